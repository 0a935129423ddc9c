"""Times of a stream that cannot be right: one far ahead that no later row confirms, and a clock that was set back.

A row whose time is far ahead of all before it waits for the next row. If that is nearer to the rows before, the time
was wrong, and the row is left out: one damaged digit would make all rows after it too late. Else there was a pause.
Rows that are too late for their lag wait as well: so many in a row, whose times go on, are of a clock that was set
back, and a new track begins with them. And how a track goes on in a pause.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Iterator

import numpy as np

from ftproc.live.live import Live
from ftproc.records import FloatArray, IntArray, Trajectory

FAR_S, FAR_INTERVALS = 10.0, 20.0  # ahead of the newest row: beyond both, a time waits for the next row
SET_BACK = 20  # rows in a row that are too late, for a clock that was set back
COAST_ROWS, SHORTEST_S = 10_000, 1e-3  # rows that are coasted in a pause, and their interval
CONFIRMED_S, CONFIRMED_INTERVALS = 0.2, 3.0  # in which the next row comes, or none will

Rows = tuple[FloatArray, IntArray]


class Pause:
    """Since the newest reading of a track came, at came_s of the clock; count: rows that have been coasted since."""

    def __init__(self, came_s: float) -> None:
        self.came_s, self.count = came_s, 0

    def due_s(self, track: Live, longest_s: float) -> float:
        """When the next row of a pause is due: an interval later than one that would have come in time."""
        after_s = (self.count + 1) * max(track.interval_s, SHORTEST_S)
        if not longest_s or track.waiting or self.count >= COAST_ROWS or after_s >= longest_s + SHORTEST_S / 2:
            return math.inf
        return self.came_s + after_s + track.wait_s + track.interval_s

    def coast(self, track: Live) -> Trajectory:
        """That row."""
        self.count += 1
        return track.coast(self.count * max(track.interval_s, SHORTEST_S))


class Verdict(enum.Enum):
    """Of some rows: they are the track's next ones; their time is wrong; a new track begins with them."""

    NEXT, WRONG, NEW = range(3)


class Times:
    """Of one track. interval_s: typical, infinite while it is not known."""

    def __init__(self) -> None:
        self.newest_s, self.interval_s = -math.inf, math.inf
        self._ahead: list[Rows] = []  # the row that is far ahead
        self._back: list[Rows] = []  # rows that are too late

    @property
    def waiting(self) -> bool:
        """Whether a row far ahead waits for the next one."""
        return bool(self._ahead)

    @property
    def wait_s(self) -> float:
        """How long it waits at most."""
        return CONFIRMED_S + CONFIRMED_INTERVALS * (self.interval_s if math.isfinite(self.interval_s) else 0.0)

    @property
    def _far_s(self) -> float:
        return max(FAR_S, FAR_INTERVALS * self.interval_s) if math.isfinite(self.interval_s) else FAR_S

    def sorted(self, readings: FloatArray, numbers: IntArray, late_s: float) -> Iterator[tuple[Verdict, Rows]]:
        """What is to be done with rows (n, 5), whose first column is the time, and their numbers (n,). late_s: by which
        a row may be late."""
        time_s = readings[:, 0]
        before = np.maximum.accumulate(np.r_[self.newest_s, time_s[:-1]])
        plain = (time_s - before < self._far_s) | np.isinf(before)
        if not self._ahead and not self._back and plain.all() and (time_s > before - late_s).all():
            self.newest_s = float(max(self.newest_s, time_s.max()))
            yield Verdict.NEXT, (readings, numbers)
            return
        for k in range(len(readings)):
            yield from self._one((readings[k : k + 1], numbers[k : k + 1]), late_s)

    def rest(self) -> Iterator[tuple[Verdict, Rows]]:
        """When no more rows come, or none that a row far ahead could wait for."""
        yield from ((Verdict.NEXT, rows) for rows in self._back)
        if self._ahead:
            self.newest_s = float(self._ahead[0][0][0, 0])
            yield Verdict.NEXT, self._ahead[0]
        self._ahead, self._back = [], []

    def _one(self, row: Rows, late_s: float) -> Iterator[tuple[Verdict, Rows]]:
        time_s = float(row[0][0, 0])
        if self._ahead:
            (held,) = self._ahead
            ahead_s, self._ahead = float(held[0][0, 0]), []
            if time_s - self.newest_s < ahead_s - time_s:
                yield Verdict.WRONG, held
            else:
                self.newest_s = ahead_s
                yield Verdict.NEXT, held
        if time_s - self.newest_s >= self._far_s and math.isfinite(self.newest_s):
            self._ahead = [row]
            return
        if time_s > self.newest_s - late_s or time_s == self.newest_s:
            yield from ((Verdict.NEXT, rows) for rows in self._back)
            self._back, self.newest_s = [], max(self.newest_s, time_s)
            yield Verdict.NEXT, row
            return
        if self._back and time_s < float(self._back[-1][0][0, 0]):
            yield from ((Verdict.NEXT, rows) for rows in self._back)
            self._back = []
        self._back.append(row)
        if len(self._back) >= SET_BACK:
            rows = tuple(np.concatenate(each) for each in zip(*self._back, strict=True))
            self._back, self.newest_s = [], time_s
            yield Verdict.NEW, (rows[0], rows[1])
