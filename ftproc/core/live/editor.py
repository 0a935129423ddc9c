"""The live editor: readings in, rows out, each as soon as its lag has passed.

What a row rests on depends on the readings before it, and up to its lag after it, alone, not on how they arrive: when
the newest part of the window is edited again, and when all of it, follows from the counts and times of rows. What
a row costs is bounded, and so is what is kept, whatever the times of the rows are.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterator

import numpy as np

from ftproc.core.editing.two_pass import Known
from ftproc.core.filtering.initialization import FEWEST_READINGS
from ftproc.core.filtering.records import Model
from ftproc.core.filtering.smoother import SmootherRun
from ftproc.core.live import beside
from ftproc.core.live.doubt import Doubt, is_track
from ftproc.core.live.pace import WINDOW_SAMPLES, Clock, pace_of
from ftproc.core.live.pieces import BLOCK, CROWD
from ftproc.core.live.rows import (
    LATELY,
    Published,
    Waiting,
    widened,
    with_stand_ins,
    without_estimate,
    without_what_is_lost,
)
from ftproc.core.live.window import Window
from ftproc.records import FloatArray

FEWEST = 16  # samples before a track may be confirmed,
GROWTH = 1.25  # and times as many at the next attempt
PATIENCE = 64  # samples after which the noise of a component with few readings is assumed
ASSUMED_SIGMA = (10.0, 1e-3, 1e-3)  # m, rad, rad: of what was seldom seen
YOUNG, SOONEST, ROUND = 0.25, 4, 128  # all of the window is edited when it has grown by this share, but not
# sooner and not later than after so many samples, or while the track is in doubt
STALE = 4  # times what a window keeps, after which an edit of all of it that is still under way is given up


class LiveEditor:
    """Edits and filters readings as they come. absent: components that were never seen."""

    def __init__(self, known: Known, lag_s: float = 0.0, window: Callable[..., Window] = Window) -> None:
        """lag_s: seconds that a row waits for later readings. window: the kind of window that edits."""
        self.known, self.lag_s, self.kind = known, lag_s, window
        self.window: Window | None = None
        self.flown = Model(np.full(3, np.nan), np.empty((0, 3)))
        self.confirmed_once = False
        self.waiting = Waiting.nothing()
        self.absent: tuple[int, ...] = ()
        self.count = self.published = 0  # rows taken, and rows that have left
        self.next_edit, self.next_refresh, self.next_work = FEWEST, 0, 0
        self.doubt, self.doubted = Doubt(), False  # and whether it is why all of the window is edited,
        self.urgent = False  # at once
        self.refreshed = 0  # rows that the last refresh has seen
        self.pace, self.clock = pace_of(np.empty(0), lag_s), Clock()
        # The newest part, from this row on, with its labels, if there is a lag.
        self.smoothed: tuple[int, SmootherRun, FloatArray] | None = None

    @property
    def model(self) -> Model:
        """Noise and process noise of the track, or of the one before it; of none before the first is confirmed."""
        return self.flown if self.window is None else self.window.allowed

    def push(self, time_s: FloatArray, measurement: FloatArray) -> list[Published]:
        """Take the next rows, time_s (n,) in order, measurement (n, 3) or (n, 4) with range rates; those that leave."""
        measurement = beside.widened(measurement)
        found: list[Published] = []
        low = 0
        while low < len(time_s):
            if self.window is None:
                high = low + 1
                found += self._due(float(time_s[low]))
                self.waiting = self.waiting.without(self.published - self._first, WINDOW_SAMPLES[1])
                self.waiting = self.waiting.with_row(time_s[low:high], measurement[low:high])
                self.count, self.clock = self.count + high - low, self.clock.after(time_s[low:high])
                if self.count >= self.next_edit and not self.clock.stands:
                    self._confirm()
            else:
                if np.isfinite(measurement[low, list(self.absent)]).any():
                    self._begin_again()
                    continue
                found += self._before_a_pause(self.window, float(time_s[low]))
                high = self._slice_end(time_s, measurement, low)
                if self.lag_s > 0:
                    found += self._due(float(time_s[high - 1]))
                if self._is_blinded(self.window, float(time_s[low])):
                    self._begin_again()
                    continue
                self.window.append(time_s[low:high], with_stand_ins(measurement[low:high], self.absent))
                self.count, self.clock = self.count + high - low, self.clock.after(time_s[low:high])
                if self.lag_s == 0:  # what an edit finds out is known from the newest row on
                    found += self._leave(self.count - 1)
                self._take_turn(self.window)
            if self.lag_s == 0:
                found += self._leave(self.count)
            low = high
        return found

    def tick(self, now_s: float) -> list[Published]:
        """The rows whose lag has passed at a time, of which no reading comes: they are those that leave with the next
        reading after it. What follows is the same as without: where a refresh is needed, a copy makes it."""
        kept = self.waiting.time_s if self.window is None else self.window.time_s
        unseen = kept[self.refreshed - self._first :]
        if self.window is None or self.lag_s == 0 or not len(unseen) or now_s <= unseen[0] + self.lag_s:
            return self._due(now_s)
        ahead = copy.deepcopy(self)
        assert ahead.window is not None
        ahead._refresh(ahead.window)
        found = ahead._due(now_s)
        self.published = ahead.published
        return found

    def finish(self) -> list[Published]:
        """The rows that wait, when no more come."""
        if self.window is not None and self.lag_s > 0:
            self._refresh(self.window)
        return self._leave(self.count)

    # -- the track's beginning --------------------------------------------------------------------------------------

    def _confirm(self) -> None:
        """Begin a track, if the readings so far agree on one."""
        self.next_edit = self.count + int(len(self.waiting.time_s) * (GROWTH - 1)) + 1
        self.pace = pace_of(self.waiting.time_s, self.lag_s)
        seen = np.isfinite(self.waiting.measurement[:, : beside.RATE]).sum(0)
        few = seen < FEWEST_READINGS
        if seen.sum() < 2 * FEWEST_READINGS or ((few & (seen > 0)).any() and len(self.waiting.time_s) < PATIENCE):
            return
        self.absent = tuple(np.flatnonzero(seen == 0).tolist())
        sigma = np.where(few & np.isnan(self.known.sigma), ASSUMED_SIGMA, self.known.sigma)
        readings, known = with_stand_ins(self.waiting.measurement, self.absent), self.known._replace(sigma=sigma)
        window = self.kind(self.waiting.time_s, readings, known, self.pace.sizes, self.absent)
        try:
            window.edit()
        except ValueError:  # a component has too few readings that agree
            return
        if not is_track(window):
            return
        self.window, self.confirmed_once = window, True
        self.waiting = Waiting.nothing()
        self.next_edit = self.count + self._samples_between_edits(window)
        self._edited(window)

    def _begin_again(self) -> None:
        """Nothing tells where the target is by now: a component is seen for the first time, or a gap was long."""
        assert self.window is not None
        window, self.flown = self.window, self.window.allowed
        low = max(min(len(window) - window.sizes.near, self.published - self._first), 0)
        self.waiting = Waiting(window.time_s[low:].copy(), window.came[low:])
        self.waiting.measurement[:, list(self.absent)] = np.nan
        self.window, self.absent, self.next_edit = None, (), self.count + FEWEST_READINGS

    # -- when to edit -----------------------------------------------------------------------------------------------

    @property
    def _first(self) -> int:
        """Number of the first row that is kept."""
        return self.count - len(self.waiting.time_s if self.window is None else self.window)

    def _before_a_pause(self, window: Window, time_s: float) -> list[Published]:
        """Where a row that no refresh has seen must leave before this time: those before it; and a refresh."""
        unseen = window.time_s[self.refreshed - self._first :]
        if self.lag_s == 0 or not len(unseen) or time_s <= unseen[0] + self.lag_s:
            return []
        found = self._due(float(unseen[0]) + self.lag_s)
        self._refresh(window)
        return found

    def _slice_end(self, time_s: FloatArray, measurement: FloatArray, low: int) -> int:
        """How far the rows can be taken at once: to the next turn, the next gap, the first reading of a component that
        was absent, or where a row must leave that no refresh has seen."""
        assert self.window is not None
        due = min(max(self._next_turn(self.window) - self.count, 1), len(time_s) - low)
        high = low + self.clock.rows_to_turn(time_s[low:], due)
        if self.lag_s > 0:
            unseen = np.concatenate([self.window.time_s[self.refreshed - self._first :], time_s[low:high]])
            high = low + int(np.searchsorted(time_s[low:high], unseen[0] + self.lag_s, side="right"))
        gaps = np.flatnonzero(np.diff(time_s[low:high]) > self.pace.longest_s)
        high = low + int(gaps[0]) + 1 if len(gaps) else high
        seen = np.flatnonzero(np.isfinite(measurement[low:high, list(self.absent)]).any(1))
        return low + int(seen[0]) if len(seen) else high

    def _is_blinded(self, window: Window, time_s: float) -> bool:
        """Whether a gap ends here that is too long to bridge; after any, all of the window is edited soon."""
        gap = time_s - window.time_s[-1] > self.pace.longest_s
        self.next_edit = min(self.next_edit, self.count + FEWEST_READINGS + 1) if gap else self.next_edit
        return bool(gap) and window.expect_gap(time_s)

    def _next_turn(self, window: Window) -> int:
        """How many rows there are when there is something to do again."""
        return min(self.next_refresh, self.next_edit if window.under_way is None else self.next_work)

    def _take_turn(self, window: Window) -> None:
        if len(window) > STALE * (self.pace.sizes.window + BLOCK):
            window.under_way = None
        if self.clock.stands:
            if self.clock.rows % CROWD == 0:
                self._refresh(window)
            return
        if self.count < self._next_turn(window):
            return
        in_doubt = window.in_doubt()
        if window.under_way is not None and self.doubted != in_doubt:
            window.under_way = None  # what it began with is not so
        doubted = in_doubt and self.count >= self.next_refresh and self.doubt.is_due(window, self.count)
        if window.under_way is None and (doubted or self.count >= self.next_edit):
            self.doubted, self.next_work = in_doubt, self.count
            self.urgent = in_doubt and self.doubt.is_urgent(window)
            self.next_edit = self.count + self._samples_between_edits(window)
            self.pace = pace_of(window.time_s, self.lag_s)
            window.sizes = self.pace.sizes
            window.trim()
            window.begin()
            if window.under_way is None:
                self._edited(window)
        if window.under_way is not None and self.count >= self.next_work:
            self._go_on(window)
        if self.count >= self.next_refresh:
            self._refresh(window)

    def _go_on(self, window: Window) -> None:
        """A turn at the edit of all of the window, or the whole of it."""
        self.next_work = self.count + self.pace.turn
        try:
            window.go_on(math.inf if self.urgent else self.pace.work)
        except ValueError:  # a component has too few readings that agree
            window.refresh()
        if window.under_way is None:
            if self.doubted and not window.in_doubt():
                window.reacquired.append(len(window) - 1)
            self._edited(window)

    def _samples_between_edits(self, window: Window) -> int:
        return int(np.clip(YOUNG * self.count, SOONEST, ROUND)) if window.learns else BLOCK

    def _edited(self, window: Window) -> None:
        self.doubt = self.doubt.after_edit(window, self.count)
        self._seen(window)

    def _refresh(self, window: Window) -> None:
        if self.refreshed < self.count:
            window.refresh()
            self._seen(window)

    def _seen(self, window: Window) -> None:
        every = window.refresh_every * self.pace.refresh if window.learns else BLOCK
        self.refreshed, self.next_refresh = self.count, self.count + every
        if self.lag_s > 0:
            _, labels = window.shown(window.near, len(window))
            self.smoothed = self._first + window.near, window.smoothed(), labels

    # -- what leaves ------------------------------------------------------------------------------------------------

    def _due(self, now_s: float) -> list[Published]:
        """The rows whose lag has passed at a time, or that are too many to wait for it."""
        kept = self.waiting.time_s if self.window is None else self.window.time_s
        due = int(np.searchsorted(kept[self.published - self._first :] + self.lag_s, now_s, side="left"))
        crowd = self.count - self.published - self.pace.sizes.most_waiting
        most = self.count if self.window is None else self.refreshed
        found = self._leave(min(self.published + max(due, crowd), most))
        if crowd > due and self.window is not None:
            self.window.left = self.published - self._first
        return found

    def _leave(self, stop: int) -> list[Published]:
        """The rows before this one; those from before the track have no estimate."""
        begins = self.count if self.window is None else 0 if self.smoothed is None else self.smoothed[0]
        return [*self._without_estimate(min(begins, stop)), *self._with_estimate(stop)]

    def _without_estimate(self, stop: int) -> Iterator[Published]:
        low, n = self.published - self._first, stop - self.published
        if n > 0:
            kept = self.waiting.measurement if self.window is None else self.window.came
            yield without_estimate(self.published, kept[low : low + n])
            self.published = stop

    def _with_estimate(self, stop: int) -> Iterator[Published]:
        first, n = self.published, stop - self.published
        if n <= 0:
            return
        assert self.window is not None
        window, low = self.window, first - self._first
        before = min(LATELY - 1, low)
        rows, label = window.shown(low - before, low + n)
        rows, label = widened(rows, before), label[before:]
        if self.smoothed is not None:
            begin, smoothed, labels = self.smoothed
            label = labels[first - begin : stop - begin].copy()
            for name in ("state", "sigma", "los_sigma", "path_sigma"):
                rows[name] = getattr(smoothed, name)[first - begin : stop - begin]
        label[:, list(self.absent)] = 3.0
        again = np.isin(np.arange(low, low + n), window.reacquired)
        yield Published(first, rows, label, without_what_is_lost(rows), again, self.absent)
        self.published = stop
