"""The lines of a log that still grows: standard input, or a file, which may be replaced or overwritten."""

from __future__ import annotations

import contextlib
import io
import math
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from ftproc.errors import InputError
from ftproc.files import remote
from ftproc.files.reading.formats import content, packing

MOST = 1 << 18  # bytes that are read at once, and of a line
LINES = 4096  # that are taken at once, of those that are there
NAP_S = 0.05  # between looks at a file that has not grown
GRACE_S = 2.0  # after a stop is asked for, in which rows that have been read are still used
_KNOWN_AGAIN = 256  # bytes before the place where reading goes on, by which the file is known to be the same

Say = Callable[[str], None]


class Stop:
    """Within its context, a signal that ends the program (Ctrl-C, SIGTERM, a closed terminal) ends the reading, and not
    what is being computed or written: that looks at `asked` and `overdue` now and then, and never waits for long."""

    def __init__(self) -> None:
        self.asked = self._reading = False
        self._since_s = math.inf
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Stop:
        for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGXCPU"):
            number = getattr(signal, name, None)
            if number is None or (name == "SIGHUP" and signal.getsignal(number) == signal.SIG_IGN):  # as nohup wants
                continue
            self._before[number] = signal.signal(number, self._ask)
        return self

    def __exit__(self, *error: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _ask(self, number: int, frame: object) -> None:
        if not self.asked:
            self.asked, self._since_s = True, time.monotonic()
        if self._reading:
            raise KeyboardInterrupt

    @property
    def overdue(self) -> bool:
        """Whether it was asked for so long ago that nothing more is begun."""
        return time.monotonic() - self._since_s > GRACE_S

    def read(self, look: Callable[[], bytes | None]) -> bytes:
        """What a look finds, as soon as it is not None; empty when a stop is asked for."""
        self._reading = True
        try:
            while not self.asked:
                found = look()
                if found is not None:
                    return found
                time.sleep(NAP_S)
        except KeyboardInterrupt:
            pass
        finally:
            self._reading = False
        return b""


class Block(NamedTuple):
    """Complete lines, without their ends, and the number of the first one in its file, from 1."""

    first: int
    texts: list[str]


def blocks(source: str, stop: Stop, say: Say) -> Iterator[Block]:
    """The lines of a file, which has no end, or of `-`, in the order in which they come. A file that was replaced or
    overwritten goes on at the beginning of its new content, and a line that it left incomplete is dropped. say: takes
    a sentence for the user. Raises InputError for what cannot be read, or is no text."""
    rest, number = bytearray(), 0
    with _opened(source) as log:
        while data := _looked(source, stop, log):
            if log.news:
                cut = " The last line of the old content was not complete, and is left out." if rest.strip() else ""
                say(f"{source}: {log.news}, and is read on from the beginning of its new content.{cut}")
                rest, number, log.news = bytearray(), 0, ""
            if not number and not rest:
                _refuse_other_kinds(source, data)
            end, *begun = data.split(b"\n")
            rest += end  # without looking through what came before: a line may come byte by byte
            whole = [bytes(rest), *begun[:-1]] if begun else []
            rest = bytearray(begun[-1]) if begun else rest
            if len(rest) > MOST:
                raise InputError(
                    f"{source}: line {number + len(whole) + 1} has no end within {MOST >> 10} KiB, which is no row of "
                    "a log. Write text whose lines end in LF."
                )
            for low in range(0, len(whole), LINES):
                if stop.overdue:
                    return
                yield Block(number + low + 1, [_text(line) for line in whole[low : low + LINES]])
            number += len(whole)
    if rest.strip() and source == "-" and not stop.asked:
        yield Block(number + 1, [_text(rest)])


def _text(line: bytes | bytearray) -> str:
    return line.decode("utf-8", "replace").strip("\r\ufeff")


class _Log(Protocol):
    news: str  # what happened to the content since this was emptied, or ""

    def look(self) -> bytes | None:
        """What has come; empty at the end of the input; None when there may be more later."""


def _looked(source: str, stop: Stop, log: _Log) -> bytes:
    try:
        return stop.read(log.look)
    except OSError as error:
        raise InputError(f"{source}: cannot be read any more ({error.strerror or error}); check the file.") from error


@contextlib.contextmanager
def _opened(source: str) -> Iterator[_Log]:
    if source == "-":
        yield _Input()
        return
    path = remote.local(source)
    if path is None:
        raise InputError(f"{source}: --follow reads a file of this machine, or - for standard input; name one of them.")
    with contextlib.closing(_File(source, path)) as file:
        yield file


class _Input:
    """Standard input."""

    news = ""

    def look(self) -> bytes:
        if sys.stdin is None:
            raise InputError("-: standard input is closed; pipe a log into it, or name a file.")
        stream = sys.stdin.buffer
        return stream.read1(MOST) if isinstance(stream, io.BufferedReader) else stream.read(MOST)


class _File:
    """A file under a name, which may come to name another one. Each look also reads the end of what is known: where it
    stands no more, the file was overwritten, whatever its length."""

    def __init__(self, source: str, path: Path) -> None:
        self.news = ""
        self._path = path
        try:
            self._begin()
        except OSError:
            content.read(source, path, limit=1)  # whose messages say why it cannot be read
            raise

    def _begin(self) -> None:
        stream = io.FileIO(self._path, opener=_without_waiting)
        self.close()
        self._stream, self._place, self._end = stream, 0, b""

    def close(self) -> None:
        if hasattr(self, "_stream"):
            self._stream.close()

    def look(self) -> bytes | None:
        replaced = self._is_replaced()
        if self._stream.seekable():
            self._stream.seek(self._place - len(self._end))
        data = self._stream.read(MOST) or b""
        if not data.startswith(self._end):
            self._place, self._end, self.news = 0, b"", "became shorter or was overwritten"
            return None
        if new := data[len(self._end) :]:
            if self._stream.seekable():
                self._place, self._end = self._place + len(new), data[-_KNOWN_AGAIN:]
            return new
        if replaced:
            with contextlib.suppress(FileNotFoundError):
                self._begin()
                self.news = "was replaced by another file"
        return None

    def _is_replaced(self) -> bool:
        """Asked before reading, so that what the old file still got is read first."""
        try:
            return not os.path.samestat(self._path.stat(), os.fstat(self._stream.fileno()))
        except FileNotFoundError:  # moved away, and nothing is there yet
            return False


def _without_waiting(name: str, flags: int) -> int:
    """A descriptor, also of a named pipe into which nobody writes yet: neither this nor a read waits for a writer, so
    that signals are heard."""
    return os.open(name, flags | getattr(os, "O_NONBLOCK", 0))


def _refuse_other_kinds(source: str, data: bytes) -> None:
    """Raise InputError for a file that does not begin as a text in columns does."""
    packed = packing.ending(source, data[:8])
    if packed is not None:
        raise InputError(
            f"{source}: this is packed ({packing.KINDS[packed][1]}), and --follow reads plain text. Filter it without "
            "--follow, or unpack it into a pipe and follow -."
        )
    if b"\0" in data[:64] or data.lstrip().startswith(b"{"):
        raise InputError(
            f"{source}: --follow reads text in columns (UTF-8), such as CSV, and this is something else. Filter it "
            "without --follow when it is complete."
        )
