"""How much of the readings is kept, and how often they are edited, by their interval; and the clock, which must go
on for that. So work and memory are bounded by rows, whatever their times are."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ftproc.core.filtering.initialization import shortest_gap
from ftproc.core.live.pieces import BLOCK, CROWD, Sizes
from ftproc.order_statistics import median
from ftproc.records import FloatArray

REFRESH_S = 0.1  # between refreshes of the newest part, or one sample
WORK_S, WORK_PER_S = 0.02, 160_000  # between turns at an edit of all of the window, or one sample; and how much of it
# there is for each second that the readings last: so many samples that are filtered
WINDOW_S, WINDOW_SAMPLES = 30.0, (300, 1500)  # of the window: the longer of the two, up to so many samples
NEAR_S, NEAR_SAMPLES = 8.0, (120, 400)  # of its newest part, beside the lag
SHORTEST_S, SELDOM = 1e-4, 64  # interval of any instrument; shorter ones count where no others come once in so many
TICK_S, STANDING = 1e-3, 4  # of the clock, and rows in a tick, after which it stands still
YOUNG, SOONEST, ROUND = 0.25, 4, 128  # all of the window is edited when it has grown by this share, but not
# sooner and not later than after so many samples, or while the track is in doubt
MOST_IN_LAG = 100_000  # samples, that the window is made for


class Pace(NamedTuple):
    """sizes: of what is kept. longest_s: between samples; more is a gap. refresh, turn: samples from one to the next.
    work: of a turn, see WORK_PER_S."""

    sizes: Sizes
    longest_s: float
    refresh: int
    turn: int
    work: float


def pace_of(time_s: FloatArray, lag_s: float) -> Pace:
    """By the typical interval of readings at these times (n,)."""
    times = np.diff(time_s)
    times = times[times > 0]
    usual = times[times >= SHORTEST_S]
    interval_s = 1.0 if not len(times) else median(usual) if SELDOM * len(usual) >= len(times) else SHORTEST_S
    refresh, turn = (max(1, math.ceil(each_s / interval_s - 1e-6)) for each_s in (REFRESH_S, WORK_S))
    near = int(np.clip(NEAR_S / interval_s, *NEAR_SAMPLES)) + min(int(lag_s / interval_s), MOST_IN_LAG)
    sizes = Sizes(max(int(np.clip(WINDOW_S / interval_s, *WINDOW_SAMPLES)), 2 * near), near, lag_s)
    work = WORK_PER_S * interval_s * turn
    return Pace(sizes, shortest_gap(interval_s), refresh, turn, work)


def samples_between_edits(count: int, learns: bool) -> int:
    """Of all of the window, after so many samples. learns: whether there is more to find out than what is rejected."""
    return int(np.clip(YOUNG * count, SOONEST, ROUND)) if learns else BLOCK


class Clock(NamedTuple):
    """The newest tick, and how many rows have come in it."""

    tick: float = -math.inf
    rows: int = 0

    @property
    def stands(self) -> bool:
        """Whether so many rows have come in a tick that nothing is edited before the next one."""
        return self.rows > STANDING

    def after(self, time_s: FloatArray) -> Clock:
        """When more rows have come, with times (n,)."""
        tick = time_s[-1] // TICK_S
        same = len(time_s) - int(np.searchsorted(time_s // TICK_S, tick))
        return Clock(float(tick), same + (self.rows if same == len(time_s) and tick == self.tick else 0))

    def rows_to_turn(self, time_s: FloatArray, rows: int, until_s: float, longest_s: float) -> int:
        """How many of the next rows, with times (n,), are taken before a turn that is due after so many: one more
        than come in the same tick, or as many as make up a CROWD, where the clock stands still then. None after a time,
        and none after a longer interval than this."""
        then = self.after(time_s[:rows])
        if then.stands and then.rows % CROWD != 0:
            goes_on = int(np.searchsorted(time_s // TICK_S, then.tick, side="right")) + 1
            rows = min(rows + CROWD - then.rows % CROWD, goes_on, len(time_s))
        rows = int(np.searchsorted(time_s[:rows], until_s, side="right"))
        gaps = np.flatnonzero(np.diff(time_s[:rows]) > longest_s)
        return int(gaps[0]) + 1 if len(gaps) else rows
