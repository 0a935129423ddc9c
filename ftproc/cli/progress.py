"""How far a long work is, on standard error: a bar on a terminal, elsewhere a line a minute."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import TextIO

PATIENCE_S = 2.0  # work shorter than this shows nothing on a terminal
LINE_S = 60.0  # between two lines where there is none
_EVERY_S = 0.1
_WIDTH = 30


class Progress:
    """Call it with (stage, steps done, steps in all), or `step` at the end of each of the `total` steps of `stage`; as
    a context manager it erases the bar at the end."""

    def __init__(
        self, stage: str = "", total: int = 0, stream: TextIO | None = None, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._stream = sys.stderr if stream is None else stream
        self._terminal = self._stream.isatty()
        self._clock = clock
        self._started = self._shown = clock()
        self._length = 0
        self._state = (stage, 0, total)
        self._ended = threading.Event()

    def step(self, *_: object) -> None:
        """One more step is done."""
        stage, done, total = self._state
        self(stage, done + 1, total)

    def __call__(self, stage: str, done: int, total: int) -> None:
        self._state = (stage, done, total)
        now = self._clock()
        if not self._terminal or now - self._started < PATIENCE_S or now - self._shown < _EVERY_S:
            return
        self._shown = now
        filled = _WIDTH * done // max(total, 1)
        line = f"{stage} [{'#' * filled}{'-' * (_WIDTH - filled)}] {done}/{total}"
        self._stream.write("\r" + line.ljust(self._length))
        self._stream.flush()
        self._length = len(line)

    def clear(self) -> None:
        """Erase the bar, so that something else can be written."""
        if self._length:
            self._stream.write("\r" + " " * self._length + "\r")
            self._stream.flush()
            self._length = 0

    def _tell(self) -> None:
        """In a thread: a line a minute, also while no step ends."""
        while not self._ended.wait(LINE_S):
            stage, done, total = self._state
            minutes = (self._clock() - self._started) / 60
            self._stream.write(f"ftproc: {stage}: {done} of {total} done in {minutes:.0f} min\n")
            self._stream.flush()

    def __enter__(self) -> Progress:
        if not self._terminal:
            threading.Thread(target=self._tell, daemon=True).start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self.clear()
