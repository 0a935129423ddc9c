"""Where the rows of a stream go, as they are published: standard output, a file that is seen to grow, or one that is
made at the end."""

from __future__ import annotations

import contextlib
import gzip
import os
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any, BinaryIO, Protocol

from ftproc.errors import OutputError, UsageError
from ftproc.files import layout, remote
from ftproc.files.layout import Target, sidecar
from ftproc.files.writing import atomic, outputs, tables, trajectories
from ftproc.live.outputs.parquet import GrowingParquet
from ftproc.long_records import joined
from ftproc.records import Trajectory

GROWING = (".csv", ".csv.gz", ".jsonl", ".parquet")
TAIL = 256  # bytes by which a file is known again
EVERY_S = 0.5  # at the latest rows are seen in a file, and counted in its metadata

Metadata = Callable[[], Mapping[str, Any]]


class File(Protocol):
    """A file that grows."""

    def add(self, part: Trajectory) -> None:
        """Take rows."""

    def show(self, metadata: Metadata) -> None:
        """Let all rows so far be seen."""

    def known(self) -> Mapping[str, Any]:
        """What a later run must know, after `show`, to go on from here."""


class Output:
    """Of one run. Rows go out with `add`; `pause` is called between them, now and then. Within its context; nothing
    appears before the first row. Errors as of `atomic`; BrokenPipeError."""

    def __init__(self, name: str, form: str, metadata: Metadata, known: Mapping[str, Any] | None) -> None:
        """form: csv or jsonl, of standard output. metadata: of all rows so far. known: of the run whose work is done
        again; None: there was none."""
        self.name, self._metadata, self._known = name, metadata, known
        self.kind = growing_kind(name, form)
        self._file: File | None = None
        self._open = contextlib.ExitStack()
        self._frame: Mapping[str, Any] = {}
        self._shown_s, self._new = -EVERY_S, False
        self._place: os.stat_result | None = None  # of the file, as the system knows it
        if known is not None and self.kind is not None and name != outputs.STREAM:
            _refuse_changed(name, known)

    def __enter__(self) -> Output:
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        with self._open:
            if self._file is not None and error is None:
                self._show()

    @property
    def complete(self) -> Mapping[str, Any]:
        """The metadata."""
        return {**self._frame, **self._metadata()}

    def add(self, part: Trajectory) -> None:
        """Write rows."""
        if self._file is None:
            self._frame = part.metadata
            self._file = self._made()
        with self._named():
            self._file.add(part)
        self._new = True

    def pause(self) -> None:
        """Let rows be seen that have waited for it."""
        if self._place is not None and time.monotonic() - self._shown_s >= EVERY_S:
            self._shown_s = time.monotonic()
            if not _is_at(self._place, self.name):
                raise OutputError(f"{self.name}: removed or replaced while it was written; its rows so far are lost.")
            if self._new:
                self._show()

    def line(self, text: str) -> bool:
        """Write a line that is no row; whether it is the place for that."""
        if self.name != outputs.STREAM or not isinstance(self._file, _Text):
            return False
        self._file.write(f"{text}\n".encode())
        return True

    def known(self) -> Mapping[str, Any] | None:
        """What a later run must know to go on from here; None where there is nothing yet."""
        if self._file is None:
            return self._known
        if self._new:
            self._show()
        return {**self._file.known(), "frame": dict(self._frame)}

    def _show(self) -> None:
        assert self._file is not None
        with self._named():
            self._file.show(lambda: self.complete)
        beside = described(self.name)
        if beside is not None and self.kind is not None:
            with atomic.replacing(beside, synced=False) as text:
                text.write(trajectories.to_json(self.complete, indent=2) + b"\n")
        self._shown_s, self._new = time.monotonic(), False

    @contextlib.contextmanager
    def _named(self) -> Iterator[None]:
        """Errors of the system name the file; those of standard output are named where it was opened."""
        try:
            yield
        except OSError as error:
            near = remote.local(self.name)
            if self.name == outputs.STREAM or near is None:
                raise
            raise atomic.output_error(near, error, "what was written before is whole") from error

    def _made(self) -> File:
        if self.kind is None:
            return _AtEnd(self.name)
        if self.name == outputs.STREAM:
            return _Text(self._open.enter_context(atomic.standard_output()), self.kind, None)
        stream = self._open.enter_context(atomic.growing(self.name, self._known is not None))
        near = remote.local(self.name)
        self._place = near.stat() if near is not None and near.is_file() else None
        if self.kind == ".parquet":
            return GrowingParquet(stream, self._known)
        return (_Packed if self.kind == ".csv.gz" else _Text)(stream, self.kind, self._known)


def _is_at(place: os.stat_result, name: str) -> bool:
    """Whether the file of that name is still the one that is written."""
    near = remote.local(name)
    return near is not None and near.exists() and os.path.samestat(place, near.stat())


def _refuse_changed(name: str, known: Mapping[str, Any]) -> None:
    """Raise OutputError for a file that is not as the run before has left it, up to what that knew of it."""
    near = remote.local(name)
    if near is None or (near.exists() and not near.is_file()):
        return
    found = b""
    with contextlib.suppress(FileNotFoundError), near.open("rb") as file:
        file.seek(known["size"] - len(known["tail"]))
        found = file.read(len(known["tail"]))
    if found != known["tail"]:
        raise OutputError(
            f"{name}: it was deleted, cut or replaced since the run before, which --state goes on with. Bring it back, "
            "or delete it and the state to begin again."
        )


def growing_kind(name: str, form: str) -> str | None:
    """The one of GROWING that an output is of; None for one that is made at the end. form: of standard output. Raises
    OutputError for other names."""
    if name == outputs.STREAM:
        return f".{form}"
    kind = layout.ending(name, GROWING)
    if kind is None and layout.map_kind(name) is None:
        tables.kind_of(name)
    path = remote.local(name)
    return None if path is None or (kind == ".parquet" and path.exists() and not path.is_file()) else kind


def written(name: str) -> list[outputs.Output]:
    """All files that are written for an output of this name."""
    beside = described(name)
    own = (b"{", b'"program": "ftproc"')
    return [outputs.Output(name), *([] if beside is None else [outputs.Output(beside, ours=own)])]


def described(name: str) -> Target | None:
    """The file of its metadata."""
    return sidecar(f"{name[: -len('.jsonl')]}.csv" if layout.ending(name, (".jsonl",)) else name)


class _Text:
    """CSV, or an object of JSON a line: each row is seen at once. What a run whose work is done again had written after
    it kept what it knew, is written again."""

    def __init__(self, stream: BinaryIO, kind: str, known: Mapping[str, Any] | None) -> None:
        self._stream, self._as_json = stream, kind == ".jsonl"
        self._size: int = 0 if known is None else known["size"]
        self._tail: bytes = b"" if known is None else known["tail"]
        self._with_header = self._size == 0
        if known is not None:
            stream.truncate(stream.seek(self._size))

    def add(self, part: Trajectory) -> None:
        as_json = self._as_json
        self.write(trajectories.as_json_lines(part) if as_json else trajectories.as_csv(part, self._with_header))
        self._with_header = False

    def write(self, data: bytes) -> None:
        try:
            self._stream.write(data)
        except OSError:
            with contextlib.suppress(OSError):  # half a row
                self._stream.truncate(self._size)
            raise
        self._size, self._tail = self._size + len(data), (self._tail + data)[-TAIL:]

    def show(self, metadata: Metadata) -> None:
        pass

    def known(self) -> Mapping[str, Any]:
        return {"size": self._size, "tail": self._tail}


class _Packed(_Text):
    """CSV packed by gzip: a member of the file each time that it is shown."""

    def __init__(self, stream: BinaryIO, kind: str, known: Mapping[str, Any] | None) -> None:
        super().__init__(stream, kind, known)
        self._rows = list[bytes]()

    def write(self, data: bytes) -> None:
        self._rows.append(data)

    def show(self, metadata: Metadata) -> None:
        if self._rows:
            rows, self._rows = b"".join(self._rows), []
            super().write(gzip.compress(rows, mtime=0))


class _AtEnd:
    """Files whose beginning tells what comes later: they are made at the end."""

    def __init__(self, name: str) -> None:
        self._name, self._parts = name, list[Trajectory]()

    def add(self, part: Trajectory) -> None:
        self._parts.append(part)

    def show(self, metadata: Metadata) -> None:
        trajectories.write(replace(joined(self._parts), metadata=metadata()), self._name)

    def known(self) -> Mapping[str, Any]:
        raise UsageError(f"{self._name}: --state needs a file that grows: end its name in {', '.join(GROWING)}.")
