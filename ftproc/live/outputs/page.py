"""A page that follows a stream: the report of its newest rows, written again every few seconds by a process of its own,
so that no row waits for it; whole each time, and it loads itself again."""

from __future__ import annotations

import multiprocessing
import signal
import time
from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import replace
from typing import Any

from ftproc import report
from ftproc.long_records import joined
from ftproc.records import Trajectory

EVERY_S = 3.0  # between pages
ROWS = 20_000  # newest ones that are shown
_HEAD = '<meta charset="utf-8">'


class Page:
    """The page of one run."""

    def __init__(self, name: str, metadata: Callable[[], Mapping[str, Any]]) -> None:
        """Raises UsageError when what pages need is not installed."""
        report.check(name)
        self._name, self._metadata = name, metadata
        self._parts, self._count, self._new = deque[Trajectory](), 0, False
        self._pool = self._started()
        self._under_way: Future[None] | None = None
        self._written_s = time.monotonic()

    def add(self, part: Trajectory) -> None:
        """Show these rows, too."""
        self._parts.append(replace(part, extra=None))
        self._count, self._new = self._count + len(part), True
        while self._count - len(self._parts[0]) >= ROWS:
            self._count -= len(self._parts.popleft())

    def pause(self) -> None:
        """Write it if it is time, without waiting for it."""
        busy = self._under_way is not None and not self._under_way.done()
        if self._new and not busy and time.monotonic() - self._written_s >= EVERY_S:
            self._write(EVERY_S)

    def finish(self) -> None:
        """Write it for the last time. Raises OutputError."""
        if self._under_way is not None and self._under_way.exception() is not None:
            self._pool = self._started()
        if self._parts:
            self._write(None)
            assert self._under_way is not None
            self._under_way.result()
        self._pool.shutdown()

    def _write(self, again_s: float | None) -> None:
        rows = joined(list(self._parts))
        self._parts = deque([rows])
        self._new, self._written_s = False, time.monotonic()
        try:
            self._under_way = self._pool.submit(_write, replace(rows, metadata=self._metadata()), self._name, again_s)
        except RuntimeError:  # its process was killed
            self._pool = self._started()

    def _started(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), _deaf)


def _deaf() -> None:
    """Signals for the program are heard by the process that follows."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)


def _write(rows: Trajectory, name: str, again_s: float | None) -> None:
    """The page of some rows, which loads itself again after so many seconds."""
    from ftproc.report.browser import printing
    from ftproc.report.page import page

    text = page(rows)
    if again_s is not None:
        text = text.replace(_HEAD, f'{_HEAD}<meta http-equiv="refresh" content="{again_s:g}">', 1)
    printing.write(text, name)
