"""Times as text in a log that still grows: its first rows settle the notation, and the day that the seconds count from,
as `times` does for a complete log."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ftproc.files import leap_seconds
from ftproc.files.reading.clocks import notations, numeric, times
from ftproc.files.reading.clocks.clock import DAY_S, Clock
from ftproc.files.reading.meaning.schema import Column
from ftproc.records import FloatArray


class Stamps:
    """pattern: the notation, one of `notations.STAMPS`; "" until a time is no number."""

    def __init__(self) -> None:
        self.pattern = ""
        self._first, self._last, self._turns = 0, -np.inf, 0

    def seconds(self, cells: Sequence[str]) -> dict[str, float]:
        """Seconds since 00:00 of the first day of those cells that are moments, in file order; times of day go on over
        midnight."""
        written = [cell for cell in cells if ":" in cell]
        if not written:
            return {}
        import pyarrow as pa

        text = pa.chunked_array([pa.array(written, pa.string())])
        if not self.pattern:
            fits = notations.matching(text[:1], notations.STAMPS)
            whole = {name: found for name in fits if (found := notations.parsed(text, notations.STAMPS[name]))}
            if not whole:
                return {}
            chosen, _ = times.likeliest(whole)
            self.pattern = notations.STAMPS[next(name for name, found in whole.items() if found is chosen)]
            self._first = int(chosen.day[0])
        found = notations.parsed(text, self.pattern)
        if found is None:
            return {}
        leaps = leap_seconds.before(found.day) - leap_seconds.before(np.array(self._first)) if found.dated else 0.0
        seconds = (found.day - self._first) * DAY_S + found.second + leaps
        each = zip(written, seconds.tolist(), found.right.tolist(), strict=True)
        return {cell: self._on(second, found.has_day) for cell, second, right in each if right and np.isfinite(second)}

    def clock(self, values: FloatArray, column: Column) -> Clock:
        """The clock of times (n,): of the seconds of moments, or of numbers, as `numeric.read`."""
        return Clock(values, "", times.STAMPED) if self.pattern else numeric.read(values, column)

    def begin_again(self) -> None:
        """The same rows come once more."""
        self._last, self._turns = -np.inf, 0

    def _on(self, second: float, has_day: bool) -> float:
        if not has_day:
            second += self._turns * DAY_S
            if second < self._last - DAY_S / 2:
                self._turns, second = self._turns + 1, second + DAY_S
            self._last = second
        return second
