"""Signals that end the following of a log, and the waiting for what comes, in which they are heard at once."""

from __future__ import annotations

import math
import signal
import time
from typing import Any, Protocol

GRACE_S = 2.0  # after a stop is asked for, in which rows that have been read are still used
LONGEST_S = 0.5  # of a nap


class Source(Protocol):
    """Where bytes come from. news: what happened to its content since this was emptied, or ""."""

    news: str

    def poll(self) -> bytes | None:
        """What has come; empty at the end of the input; None when there may be more later."""

    def wait(self, seconds: float) -> None:
        """Until more may have come, at most so long."""


class Stop:
    """Within its context, a signal that ends the program (Ctrl-C, SIGTERM, a closed terminal) ends the reading, and not
    what is being computed or written: that reads `asked` and `overdue` now and then, and never waits for long."""

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

    def read(self, source: Source, until_s: float = math.inf) -> bytes | None:
        """What has come, as soon as there is something; None when nothing has until this time of `time.monotonic`;
        empty at the end of the input, and when a stop is asked for."""
        self._reading = True
        try:
            while not self.asked:
                found = source.poll()
                if found is not None or source.news:
                    return found
                left_s = until_s - time.monotonic()
                if left_s <= 0:
                    return None
                source.wait(min(left_s, LONGEST_S))
        except KeyboardInterrupt:
            pass
        finally:
            self._reading = False
        return b""
