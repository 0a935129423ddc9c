"""A progress line on standard error: on a terminal only, and only for work of more than two seconds."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from types import TracebackType
from typing import TextIO

PATIENCE_S = 2.0  # work shorter than this shows nothing
_EVERY_S = 0.1
_WIDTH = 30


class Progress:
    """Call it with (stage, steps done, steps in all); as a context manager it erases the line at the end."""

    def __init__(self, stream: TextIO | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        self._stream = sys.stderr if stream is None else stream
        self._clock = clock
        self._started = self._shown = clock()
        self._length = 0

    def __call__(self, stage: str, done: int, total: int) -> None:
        now = self._clock()
        if not self._stream.isatty() or now - self._started < PATIENCE_S or now - self._shown < _EVERY_S:
            return
        self._shown = now
        filled = _WIDTH * done // max(total, 1)
        line = f"{stage} [{'#' * filled}{'-' * (_WIDTH - filled)}] {done}/{total}"
        self._stream.write("\r" + line.ljust(self._length))
        self._stream.flush()
        self._length = len(line)

    def clear(self) -> None:
        """Erase the line, so that something else can be written."""
        if self._length:
            self._stream.write("\r" + " " * self._length + "\r")
            self._stream.flush()
            self._length = 0

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.clear()
