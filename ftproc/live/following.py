"""A stream is followed: what comes is taken when it comes, rows leave when their lag has passed by the clock, and what
a run that was killed had done is done again first."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from typing import Any

from ftproc.errors import InputError
from ftproc.live.lines.growing import Say
from ftproc.live.sources import File, opened
from ftproc.live.state import Entry, Kind, StateFile
from ftproc.live.stop import Source, Stop
from ftproc.live.stream import Stream
from ftproc.records import Trajectory

SOON_S = 0.003  # before rows are due, what may take a while is not begun
MOMENT_S = 0.5  # at the latest between two moments
WAITING = 1 << 14  # bytes at once, with which the sender may be waiting for us: systems hold four times as much


class Following:
    """The following of one stream. delivered: rows that have gone out."""

    def __init__(self, stream: Stream, stop: Stop, say: Say, state: StateFile | None = None) -> None:
        self.stream, self.stop, self._say, self._state = stream, stop, say, state
        self.delivered, self.again = 0, 0  # rows that have gone out, and that a run before had published since
        self._ahead_s = 0.0  # of the clock, before the system's
        self._offset: tuple[int, bytes] | None = None
        self._source: Source | None = None

    @property
    def now_s(self) -> float:
        """The time of the clock, which goes on from run to run."""
        return time.monotonic() + self._ahead_s

    def rows(self) -> Iterator[Trajectory | None]:
        """What is published, as it is; None between: a moment at which all that has come is done. Raises InputError for
        a log, or a row, that is not understood, when what came before is out, and when no row came."""
        try:
            yield from self._again()
            with opened(self.stream.source) as source:
                self._source = source
                if self._offset is not None and isinstance(source, File):
                    source.offset = self._offset
                yield None
                yield from self._follow(source)
        except InputError as error:
            self.stream.fault = self.stream.fault or error
        yield from self.stream.finish(self.stop)
        yield None

    def kept(self, output: Mapping[str, Any] | None) -> dict[str, Any]:
        """What a later run must know, at such a moment."""
        offset = self._source.offset if isinstance(self._source, File) else self._offset
        stream = {name: value for name, value in self.stream.__dict__.items() if name not in Stream.kept_apart}
        return {
            "stream": stream, "output": output, "now_s": self.now_s, "place": offset, "delivered": self.delivered,
        }  # fmt: skip

    def _follow(self, source: Source) -> Iterator[Trajectory | None]:
        while self.stream.fault is None:
            busy = self.stream.due_s - self.now_s > SOON_S and self.stream.work()
            data = self._polled(source, 0.0 if busy else MOMENT_S)
            now_s = self.now_s
            if source.news:
                news, source.news = source.news, ""
                self._keep(Entry(now_s, Kind.NEWS, news.encode()))
                self.stream.begin_again(news)
            elif data is None:
                yield from self._done(Entry(now_s, Kind.TICK))
            elif not data:
                return
            else:
                self._keep(Entry(now_s, Kind.DATA, data))
                yield from self._done(Entry(now_s, Kind.DATA, data))
                if len(data) >= WAITING:  # the clock is not the sender's
                    self._ahead_s = now_s - time.monotonic()
            yield None

    def _polled(self, source: Source, most_s: float) -> bytes | None:
        """What comes before something is due by the clock, and before so long."""
        moment_s = time.monotonic() + most_s
        try:
            return self.stop.read(source, min(self.stream.due_s - self._ahead_s, moment_s))
        except OSError as error:
            raise InputError(
                f"{self.stream.source}: cannot be read any more ({error.strerror or error}); check the file."
            ) from error

    def _done(self, entry: Entry) -> Iterator[Trajectory]:
        """What is published of something that came; a tick is kept if it publishes anything. Rows that are due when
        something comes do not wait until nothing does."""
        if entry.kind == Kind.DATA:
            yield from self.stream.take(entry.data, entry.now_s, self.stop)
            entry = Entry(entry.now_s, Kind.TICK)
        if self.stream.due_s <= entry.now_s:
            self._keep(entry)
            yield from self.stream.tick(entry.now_s, self.stop)

    def _keep(self, entry: Entry) -> None:
        if self._state is not None:
            self._state.add(entry)

    def _again(self) -> Iterator[Trajectory | None]:
        """What a run before had published since it kept all that it knew, and where that was."""
        if self._state is None or self._state.known is None:
            return
        known, stream = self._state.known, self.stream
        said, stream._say = stream._say, lambda _: None
        for track in known["stream"]["tracks"].values():
            track.resume(stream.recipe.settings, stream.recipe.model)
        stream.__dict__.update(known["stream"])
        if stream._begun:
            stream.understand_again()
        self._offset, now_s = known["place"], known["now_s"]
        self.delivered = known["delivered"]
        for entry in self._state.since:
            now_s = entry.now_s
            if entry.kind == Kind.NEWS:
                stream.begin_again(entry.data.decode())
                self._offset = (0, b"")
            elif entry.kind == Kind.DELIVERED:
                continue
            else:
                yield from self._done(entry)
                if self._offset is not None and entry.data:
                    offset, end = self._offset
                    self._offset = offset + len(entry.data), (end + entry.data)[-256:]
        stream._say = said
        self._ahead_s = now_s - time.monotonic()
        self._say(f"{stream.source}: goes on after {stream.taken} rows, which an earlier run had read.")
        yield None
