"""The live editor: readings in, rows out, each as soon as its lag has passed.

What a row rests on depends on the readings before it, and up to its lag after it, alone, not on how they arrive: when
the newest part of the window is edited again, and when all of it, follows from the counts and times of rows. What
a row costs is bounded, and so is what is kept, whatever the times of the rows are.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable

import numpy as np

from ftproc.core.editing.two_pass import Known
from ftproc.core.filtering.initialization import FEWEST_READINGS
from ftproc.core.filtering.records import Model
from ftproc.core.live import beside
from ftproc.core.live.doubt import Doubt, track_of
from ftproc.core.live.pace import WINDOW_SAMPLES, Clock, pace_of, samples_between_edits
from ftproc.core.live.pieces import BLOCK, CROWD
from ftproc.core.live.rows import Published, Smoothed, Waiting, with_estimate, with_stand_ins, without_estimate
from ftproc.core.live.window import Window
from ftproc.records import FloatArray

FEWEST = 16  # samples before a track may be confirmed,
GROWTH = 1.25  # and times as many at the next attempt
OLD = 64  # samples, after which rows leave before all of the window is edited, as it seldom tells much of them
NEARLY_S = 1e-6  # by which times may be rounded
HASTE = 3.0  # times the work of a turn, where a track may be lost
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
        self.doubt, self.doubted = Doubt(), False  # and whether it is why all of the window is edited
        self.refreshed = 0  # rows that the last refresh has seen
        self.held = Waiting.nothing()  # rows that are taken when there is something to do
        self.put_off = False  # whether there may be something to do before the next row is taken
        self.pace, self.clock = pace_of(np.empty(0), lag_s), Clock()
        self.smoothed: Smoothed | None = None  # the newest part, if there is a lag

    @property
    def model(self) -> Model:
        """Noise and process noise of the track, or of the one before it; of none before the first is confirmed."""
        return self.flown if self.window is None else self.window.allowed

    def push(self, time_s: FloatArray, measurement: FloatArray) -> list[Published]:
        """Take the next rows, time_s (n,) in order, measurement (n, 3) or (n, 4) with range rates; those that leave."""
        rows = self.held.with_rows(time_s, beside.widened(measurement))
        if self._can_wait(rows):
            self.held = rows
            return self._due(float(time_s[-1]) + NEARLY_S)
        self.held = Waiting.nothing()
        return self._taken(*rows)

    def _taken(self, time_s: FloatArray, measurement: FloatArray) -> list[Published]:
        found: list[Published] = []
        low = 0
        while low < len(time_s):
            self.work()
            if self.window is None:
                high = low + 1
                found += self._due(float(time_s[low]) - NEARLY_S)
                self.waiting = self.waiting.without(self.published - self._first, WINDOW_SAMPLES[1])
                self.waiting = self.waiting.with_rows(time_s[low:high], measurement[low:high])
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
                    taken_s = float(time_s[high - 2]) if high - low > 1 else -math.inf
                    found += self._due(max(taken_s + NEARLY_S, float(time_s[high - 1]) - NEARLY_S))
                if self._is_blinded(self.window, float(time_s[low])):
                    self._begin_again()
                    continue
                self.window.append(time_s[low:high], with_stand_ins(measurement[low:high], self.absent))
                self.count, self.clock = self.count + high - low, self.clock.after(time_s[low:high])
                if self.lag_s == 0:  # what an edit finds out is known from the newest row on
                    found += self._leave(self.count - 1)
                self.put_off = True
                if self.lag_s == 0 or self._presses(self.window):
                    self.work()
            found += self._leave(self.count) if self.lag_s == 0 else self._due(float(time_s[high - 1]) + NEARLY_S)
            low = high
        return found

    def work(self) -> bool:
        """Do what was put off, now or with the next push, which comes to the same; whether anything was."""
        put_off, self.put_off = self.put_off, False
        if put_off and self.window is not None:
            self._take_turn(self.window)
        return put_off

    def tick(self, now_s: float) -> list[Published]:
        """The rows whose lag has passed at a time, of which no reading comes: they are those that leave with the next
        reading after it. What follows is the same as without: where a refresh is needed, a copy makes it."""
        self.work()
        if self.window is None or self.lag_s == 0 or not self._rows_due(self._unseen[:1], now_s):
            return self._due(now_s)
        ahead = copy.deepcopy(self)
        found = ahead.finish(now_s)
        self.published = ahead.published
        return found

    def finish(self, now_s: float = math.inf) -> list[Published]:
        """The rows that wait, up to this time, when no more come."""
        rows, self.held = self.held, Waiting.nothing()
        found = self._taken(*rows)
        self.work()
        if self.window is not None and self.lag_s > 0:
            self._refresh(self.window)
        return found + (self._due(now_s) if now_s < math.inf else self._leave(self.count))

    # -- the track's beginning --------------------------------------------------------------------------------------

    def _confirm(self) -> None:
        """Begin a track, if the readings so far agree on one."""
        self.next_edit = self.count + int(len(self.waiting.time_s) * (GROWTH - 1)) + 1
        self.pace = pace_of(self.waiting.time_s, self.lag_s)
        window = track_of(self.waiting, self.known, self.pace.sizes, self.kind)
        if window is None:
            return
        self.window, self.absent, self.confirmed_once = window, window.stand_ins, True
        self.waiting = Waiting.nothing()
        self.next_edit = self.count + samples_between_edits(self.count, window.learns)
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

    @property
    def _unseen(self) -> FloatArray:
        """The times of the rows that no refresh has seen."""
        assert self.window is not None
        return np.append(self.window.time_s[self.refreshed - self._first :], self.held.time_s)

    def _can_wait(self, rows: Waiting) -> bool:
        """Whether there is nothing to do yet with the next rows, but to let others leave."""
        window, n = self.window, len(rows.time_s)
        if window is None or self.lag_s == 0 or self.count + n >= self._next_turn(window):
            return False
        gap = rows.time_s[0] - window.time_s[-1] > self.pace.longest_s
        return not gap and self._slice_end(*rows, 0) == n

    def _before_a_pause(self, window: Window, time_s: float) -> list[Published]:
        """Where a row that no refresh has seen must leave before this time: those before it; and a refresh."""
        unseen = self._unseen[:1]
        if self.lag_s == 0 or not self._rows_due(unseen, time_s - NEARLY_S):
            return []
        found = self._due(float(unseen[0]) + self.lag_s)
        self._refresh(window)
        return found

    def _slice_end(self, time_s: FloatArray, measurement: FloatArray, low: int) -> int:
        """How far the rows can be taken at once: to the next turn, the next gap, the first reading of a component that
        was absent, or where a row must leave that no refresh has seen."""
        assert self.window is not None
        due = min(max(self._next_turn(self.window) - self.count, 1), len(time_s) - low)
        until_s = np.append(self._unseen, time_s[low])[0] + self.lag_s + NEARLY_S if self.lag_s > 0 else math.inf
        high = low + self.clock.rows_to_turn(time_s[low:], due, until_s, self.pace.longest_s)
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

    def _presses(self, window: Window) -> bool:
        """Whether rows that leave now must wait for what is found out: where a track is young, or in doubt."""
        return self.count >= self._next_turn(window) and (self.count < OLD or window.in_doubt())

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
            self.next_edit = self.count + samples_between_edits(self.count, window.learns)
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
        """A turn at the edit of all of the window."""
        self.next_work = self.count + self.pace.turn
        try:
            window.go_on(HASTE * self.pace.work if self.doubted else self.pace.work)
        except ValueError:  # a component has too few readings that agree
            window.refresh()
        if window.under_way is None:
            if self.doubted and not window.in_doubt():
                window.reacquired.append(len(window) - 1)
            self._edited(window)

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
            self.smoothed = Smoothed(self._first + window.near, window.smoothed(), labels)

    def _due(self, now_s: float) -> list[Published]:
        """The rows whose lag has passed at a time, or that are too many to wait for it."""
        kept = self.waiting.time_s if self.window is None else self.window.time_s
        due = self._rows_due(kept[self.published - self._first :], now_s)
        crowd = self.count - self.published - self.pace.sizes.most_waiting
        most = self.count if self.window is None else self.refreshed
        found = self._leave(min(self.published + max(due, crowd), most))
        if crowd > due and self.window is not None:
            self.window.left = self.published - self._first
        return found

    def _rows_due(self, time_s: FloatArray, now_s: float) -> int:
        """How many of the rows at these times their lag has passed for."""
        return int(np.searchsorted(time_s + self.lag_s, now_s, side="left"))

    def _leave(self, stop: int) -> list[Published]:
        """The rows before this one; those from before the track have no estimate."""
        begins = self.count if self.window is None else 0 if self.smoothed is None else self.smoothed.first
        found: list[Published] = []
        for end in (min(begins, stop), stop):
            if end > self.published:
                samples = slice(self.published - self._first, end - self._first)
                if end <= begins:
                    kept = self.waiting.measurement if self.window is None else self.window.came
                    found.append(without_estimate(self.published, kept[samples]))
                else:
                    assert self.window is not None
                    found.append(with_estimate(self.window, self.published, samples, self.absent, self.smoothed))
                self.published = end
        return found
