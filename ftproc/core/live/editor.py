"""The live editor: readings in, rows out, each as soon as its lag has passed.

What a row rests on depends on the readings before it and up to its lag after it alone, not on how they arrive: when to
look again at the newest part, and when at all of the buffer, follows from counts and times of rows.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.editing import outlier_chain, two_pass
from ftproc.core.filtering.initialization import FEWEST_READINGS, shortest_gap
from ftproc.core.filtering.records import ROW, Model, empty_rows
from ftproc.core.live.window import Sizes, Window

FloatArray = NDArray[np.float64]

FEWEST = 16  # samples before a track may be confirmed
GROWTH = 1.25  # from one attempt to the next
ROUND = 128  # samples from one new look at the buffer to the next, once the track is old
LATELY, AGREE = 8, 0.6  # readings of a component, and share of them that must be good for a track to be confirmed
DOUBTED, DOUBT = 12, 0.4  # readings, and share of them: with fewer good ones the track itself is in doubt
PATIENCE_S = 1.5
TICK_S = 0.1  # between refreshes, or one sample
LONGEST_ISOLATED = 2
PATIENCE = 64  # samples that a component with few readings may take before its noise is assumed
ASSUMED_READING, ASSUMED_SIGMA = (10_000.0, 0.0, 0.0), (10.0, 1e-3, 1e-3)  # m, rad, rad


class Published(NamedTuple):
    """Rows that leave. first: number of the first, counted from zero. rows: `Row` records (n,). label: (n, 3) as
    `outlier_chain.label_runs`. known: (n,) whether there is an estimate. reacquired: (n,) whether a lost track was found
    again there."""

    first: int
    rows: Any
    label: FloatArray
    known: NDArray[np.bool_]
    reacquired: NDArray[np.bool_]


class LiveEditor:
    def __init__(self, known: two_pass.Known, lag_s: float = 0.0) -> None:
        self.known, self.lag_s = known, lag_s
        self.window: Window | None = None
        self.time_s, self.measurement = np.empty(0), np.empty((0, 3))  # before the track is confirmed
        self.absent: tuple[int, ...] = ()  # components that were never seen
        self.again: list[int] = []  # rows at which a lost track was found again, until they leave
        self.count = 0  # rows taken
        self.published = 0
        self.next_tick, self.next_edit = 0, FEWEST
        self.edits = 0
        self.was_confirmed = False
        self.next_doubt, self.next_doubt_s, self.doubted_from_s = 0, 0.0, 0.0

    def push(self, time_s: FloatArray, measurement: FloatArray) -> list[Published]:
        found: list[Published] = []
        low = 0
        while low < len(time_s):
            if self.window is None:
                high = low + 1
                found += self._due(time_s[low])
                self._take_unconfirmed(time_s[low:high], measurement[low:high])
            else:
                if np.isfinite(measurement[low, list(self.absent)]).any():
                    self._begin_again()
                    continue
                high = self._slice_end(time_s, low)
                seen = np.flatnonzero(np.isfinite(measurement[low:high, list(self.absent)]).any(1))
                high = low + int(seen[0]) if len(seen) else high
                if self.lag_s > 0:
                    found += self._due(time_s[high - 1])
                self._note_gap(float(time_s[low]))
                self.window.append(time_s[low:high], self._with_stand_ins(measurement[low:high]))
                self.count += high - low
                self._look()
            if self.lag_s == 0:
                found += self._out(self.count)
            low = high
        return found

    def finish(self) -> list[Published]:
        """The rows that wait, when no more come."""
        if self.window is not None and self.lag_s > 0:
            self._refresh()
        return self._out(self.count)

    # ------------------------------------------------------------------------------------------------------------------

    def _slice_end(self, time_s: FloatArray, low: int) -> int:
        """How many of the rows to come can be taken at once."""
        high = min(len(time_s), low + max(min(self.next_tick, self.next_edit) - self.count, 1))
        gaps = np.flatnonzero(np.diff(time_s[low:high]) > self.longest_s)
        if len(gaps):
            high = low + int(gaps[0]) + 1
        if self.lag_s > 0:
            # the first row that is not covered by the last refresh must not be due before the next
            uncovered = self.refreshed - self.first
            waiting = np.concatenate([self.window.time_s[uncovered:], time_s[low:high]])
            if len(waiting):
                overdue = np.flatnonzero(time_s[low:high] > waiting[0] + self.lag_s)
                if len(overdue):
                    if overdue[0] == 0:
                        self._refresh()
                        return self._slice_end(time_s, low)
                    high = low + int(overdue[0])
        return high

    def _note_gap(self, time_s: float) -> None:
        """After a gap that may be too long to bridge all of the buffer is looked at as soon as a track can begin."""
        if time_s - self.window.time_s[-1] > self.longest_s:
            self.next_edit = min(self.next_edit, self.count + FEWEST_READINGS + 1)

    def _begin_again(self) -> None:
        """A component is seen for the first time: what is known without it does not tell where the target is."""
        window = self.window
        low = max(min(len(window) - window.sizes.near, self.published - self.first), 0)
        self.time_s, self.measurement = window.time_s[low:].copy(), window.measurement[low:].copy()
        self.measurement[:, list(self.absent)] = np.nan
        self.window, self.absent, self.next_edit = None, (), self.count + FEWEST_READINGS

    @property
    def model(self) -> Model:
        """Noise and process noise of the track; of none before it is confirmed."""
        return Model(np.full(3, np.nan), np.empty((0, 6))) if self.window is None else self.window.allowed

    @property
    def first(self) -> int:
        """Number of the window's first row."""
        return self.count - len(self.window)

    def _take_unconfirmed(self, time_s, measurement) -> None:
        self.time_s = np.concatenate([self.time_s, time_s])
        self.measurement = np.concatenate([self.measurement, measurement])
        self.count += len(time_s)
        if self.count < self.next_edit:
            return
        window = self._confirmed()
        if window is None:
            self.next_edit = int(self.count * GROWTH) + 1
            return
        self.window, self.was_confirmed = window, True
        self.time_s, self.measurement = np.empty(0), np.empty((0, 3))
        self._later()
        self.refreshed = self.count
        self._smooth()

    def _confirmed(self) -> Window | None:
        count = np.isfinite(self.measurement).sum(0)
        few = count < FEWEST_READINGS
        if count.sum() < 2 * FEWEST_READINGS or (few & (count > 0)).any() and len(self.time_s) < PATIENCE:
            return None
        self.absent = tuple(np.flatnonzero(count == 0).tolist())
        sigma = np.where(few & np.isnan(self.known.sigma), ASSUMED_SIGMA, self.known.sigma)
        readings = self._with_stand_ins(self.measurement)
        window = Window(self.time_s, readings, self.known._replace(sigma=sigma), self._sizes(self.time_s))
        try:
            window.edit()
        except ValueError:
            return None
        self.edits += 1
        last = window.rows[-1]
        if (window.used_lately(LATELY) < AGREE).any():
            return None
        if not np.sqrt((last["sigma"][:3]**2).sum()) < 0.1 * np.linalg.norm(last["state"][:3]):
            return None
        return window

    def _with_stand_ins(self, measurement: FloatArray) -> FloatArray:
        """The readings with constants for components that were never seen; they keep the filter upright, and nothing
        that rests on them is published."""
        readings = measurement.copy()
        for c in self.absent:
            readings[:, c] = ASSUMED_READING[c]
        return readings

    def _sizes(self, time_s: FloatArray) -> Sizes:
        times = np.diff(time_s)
        interval = float(np.median(times[times > 0])) if (times > 0).any() else 1.0
        self.longest_s = shortest_gap(interval)
        self.tick = max(1, int(np.ceil(TICK_S / interval - 1e-6)))
        lag = int(self.lag_s / interval)
        buffer = int(np.clip(30.0 / interval, 300, 1500))
        near = int(np.clip(8.0 / interval, 120, 400)) + lag
        return Sizes(max(buffer, 2 * near), near)

    def _later(self) -> None:
        self.next_edit = self.count + min(ROUND, max(4, int(0.25 * self.count)))
        now_s = float(self.window.time_s[-1])
        if not self._doubtful():
            self.doubted_from_s = now_s
        self.next_doubt, self.next_doubt_s = self.count + 3, now_s + max(PATIENCE_S, 0.2 * (now_s - self.doubted_from_s))
        self.next_tick = self.count + self.tick

    def _doubtful(self) -> bool:
        return bool((self.window.used_lately(DOUBTED) < DOUBT).any())

    def _look(self) -> None:
        window = self.window
        if self.count >= self.next_edit or (
            self.count >= self.next_tick
            and self.count >= self.next_doubt
            and self.window.time_s[-1] >= self.next_doubt_s
            and self._doubtful()
        ):
            window.sizes = self._sizes(window.time_s)
            if len(window) > window.sizes.buffer:
                drop = len(window) - window.sizes.buffer
                window.forget(drop)
            self.edits += 1
            lost = self._doubtful()
            try:
                window.edit()
            except ValueError:
                window.refresh()
            if lost and not self._doubtful():
                self.again.append(self.count - 1)
            self._later()
        elif self.count >= self.next_tick:
            window.refresh()
            self.next_tick = self.count + self.tick
        else:
            return
        self.refreshed = self.count
        self._smooth()

    def _refresh(self) -> None:
        if self.refreshed < self.count:
            self.window.refresh()
            self.refreshed = self.count
            self.next_tick = self.count + self.tick
            self._smooth()

    def _smooth(self) -> None:
        if self.lag_s > 0:
            self.smoothed = self.window.smoothed()
            self.smoothed_first = self.first + self.window.near

    def _due(self, now_s: float) -> list[Published]:
        """The rows whose lag has passed at a time."""
        if self.window is None:
            k = self.published - (self.count - len(self.time_s))
            due = int(np.searchsorted(self.time_s[k:] + self.lag_s, now_s, side="left"))
            return self._out(self.published + due)
        k = self.published - self.first
        due = int(np.searchsorted(self.window.time_s[k:] + self.lag_s, now_s, side="left"))
        return self._out(min(self.published + due, self.refreshed))

    def _out(self, stop: int) -> list[Published]:
        first, n = self.published, stop - self.published
        if n <= 0:
            return []
        self.published = stop
        if self.window is None:
            start = first - (self.count - len(self.time_s))
            missing = ~np.isfinite(self.measurement[start : start + n])
            return [self._unknown(first, missing)]
        w = self.window
        low = first - self.first
        if low < 0:
            raise AssertionError("forgot rows before they left")
        rows = w.rows[low : low + n].copy()
        a = w.near
        label = outlier_chain.label_runs(np.maximum(w.weight[a:], 0), w.measurement[a:], LONGEST_ISOLATED)[low - a : low - a + n]
        if self.lag_s > 0:
            s = first - self.smoothed_first
            for name in ("state", "sigma", "los_sigma"):
                rows[name] = getattr(self.smoothed, name)[s : s + n]
        known = np.ones(n, bool)
        again = np.isin(np.arange(first, stop), self.again)
        self.again = [row for row in self.again if row >= stop]
        label[:, list(self.absent)] = 3.0
        return [Published(first, rows, label, known, again)]

    def _unknown(self, first: int, missing) -> Published:
        n = len(missing)
        rows = empty_rows(n)
        for name in ROW.names:
            rows[name] = np.nan
        rows["weight"] = 0.0
        rows["since_start"] = 0.0
        return Published(first, rows, np.where(missing, 3.0, 0.0), np.zeros(n, bool), np.zeros(n, bool))
