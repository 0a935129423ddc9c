"""Streams that take all that is written to them, or raise an error; a reader that stalls never makes the program deaf.

A raw stream may take less than it is given: standard output under PYTHONUNBUFFERED when a signal comes while its reader
stalls, or a pipe that does not block. What a buffer holds is lost, or waited for at exit, when its reader stalls.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import select
import stat
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO, TextIO, cast

GRACE_S = 1.0  # for a reader to take something, once the program is to end
_POLL_S = 0.05
_AT_ONCE = 4096  # bytes; a pipe that takes any takes so many without blocking

_ending: Callable[[], bool] | None = None


@contextlib.contextmanager
def given_up(ending: Callable[[], bool]) -> Iterator[None]:
    """Inside, a reader that takes nothing for GRACE_S after `ending` says that the program is to end gets no more: a
    write raises TimeoutError. For handlers of signals that raise nothing; others end a write at once."""
    global _ending
    before, _ending = _ending, ending
    try:
        yield
    finally:
        _ending = before


def whole(stream: BinaryIO) -> BinaryIO:
    """A stream that writes to `stream` without its buffer, and whose `write` returns when all is written."""
    if isinstance(stream, _Whole):
        return stream
    stream.flush()
    return cast(BinaryIO, _Whole(stream))


def text(stream: TextIO, lost: bool = False) -> TextIO:
    """The same of a text stream. lost: what cannot be written is lost without an error, as messages are."""
    inner = cast(BinaryIO, _Whole(stream, lost))
    return io.TextIOWrapper(inner, stream.encoding, stream.errors, write_through=True)


@contextlib.contextmanager
def opened(path: Path) -> Iterator[BinaryIO]:
    """A device or named pipe to write to; waits for the pipe's reader. Raises OSError."""
    with io.FileIO(_descriptor(path), "w") as raw:
        yield cast(BinaryIO, _Whole(raw))


def _descriptor(path: Path) -> int:
    """Opened so that neither this nor a write blocks: a signal whose handler raises nothing would not be heard."""
    began = None
    while True:
        try:
            return os.open(path, os.O_WRONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        except OSError as error:
            if error.errno != errno.ENXIO or not stat.S_ISFIFO(path.stat().st_mode):
                raise
        began = _patience(began)
        time.sleep(_POLL_S)


def _patience(began: float | None) -> float | None:
    """The time when the program was first seen to be ending while a reader stalls. Raises TimeoutError."""
    if _ending is None or not _ending():
        return None
    now = time.monotonic()
    if began is not None and now - began > GRACE_S:
        raise TimeoutError(errno.ETIMEDOUT, "its reader takes nothing")
    return now if began is None else began


class _Whole(io.RawIOBase):
    """See `whole`. After an interruption (Ctrl-C, SIGTERM) in the middle of a write nothing more is written: whatever
    closes a file on the way out would wait for the same reader."""

    def __init__(self, stream: Any, lost: bool = False) -> None:
        inner = getattr(stream, "buffer", stream)
        self._kept, self._raw = stream, getattr(inner, "raw", inner)  # kept: else the raw one is closed with it
        self._lost, self._cut = lost, False
        try:
            self._descriptor = self._raw.fileno() if os.name == "posix" else -1
        except (OSError, AttributeError):  # a stream in memory
            self._descriptor = -1

    def write(self, data: Any) -> int:
        rest = memoryview(data).cast("B")
        count = len(rest)
        try:
            while rest and not self._cut:
                rest = rest[self._some(rest) :]
        except OSError:
            if not self._lost:
                raise
        except BaseException:
            self._cut = True
            raise
        return count

    def _some(self, rest: memoryview) -> int:
        """Write some of it; how much was taken."""
        if _ending is not None:
            self._wait()
            rest = rest[:_AT_ONCE]
        taken: int | None = self._raw.write(rest)
        if taken is None:  # a stream that does not block takes nothing now
            self._wait()
        return taken or 0

    def _wait(self) -> None:
        """Until the reader takes something. Raises TimeoutError."""
        began = None
        while self._descriptor >= 0 and not select.select([], [self._descriptor], [], _POLL_S)[1]:
            began = _patience(began)

    def writable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = 0) -> int:
        return int(self._raw.seek(offset, whence))

    def truncate(self, size: int | None = None) -> int:
        return int(self._raw.truncate(size))

    def fileno(self) -> int:
        return int(self._raw.fileno())

    def isatty(self) -> bool:
        return bool(self._raw.isatty())
