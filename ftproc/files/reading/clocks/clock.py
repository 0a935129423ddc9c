"""What is known of a log's clock, and clocks that restart at midnight or at the end of the GPS week."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ftproc.errors import row_named
from ftproc.records import FloatArray

HOUR_S, DAY_S, WEEK_S = 3600.0, 86400.0, 604800.0

#: Periods in s of clocks that restart at zero, and when they do.
_ROLLOVERS = {DAY_S: "midnight", WEEK_S: "the end of the GPS week"}
_SHORT = {HOUR_S: "each hour"}  # those of clocks that show no hours
_MAX_ROLLOVER_GAP_S = 600.0  # from the last time before to the first after
_ROWS_AFTER = 20  # most of these must stay below; else the fall is a glitch


class Clock(NamedTuple):
    """time_s: (n,) seconds, NaN where missing. epoch: the instant of time zero (ISO 8601, UTC) or "".

    words: how the times were understood. notes: what was done to them. doubts: what may be otherwise, with the answer.
    """

    time_s: FloatArray
    epoch: str
    words: str
    notes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()


def unrolled(time_s: FloatArray, only: float | None = None) -> tuple[FloatArray, tuple[str, ...]]:
    """(n,) times in s, in file order and NaN where missing, without the restarts of their clock; and a note on each.

    only: the one period that the clock is known to have. A single glitch, or a file whose rows are out of order, is
    left as it is.
    """
    if (time_s[1:] >= time_s[:-1]).all():
        return time_s, ()
    row = np.flatnonzero(~np.isnan(time_s))
    time = time_s[row]
    if only == DAY_S and _is_of_twelve_hours(time):
        whole = np.array(time_s)
        whole[row] = time % (DAY_S / 2) + (DAY_S / 2 if time[0] >= DAY_S / 2 else 0.0)
        return whole, (
            "the clock shows 12 hours and restarts at one o'clock, so that 12 hours are added from there on",
        )
    for period, what in (_SHORT if only in _SHORT else _ROLLOVERS).items():
        falls = _rollovers(time, period) if only in (None, period) else []
        if falls:
            turns = np.zeros(len(time))
            turns[falls] = 1.0
            whole = np.array(time_s)
            whole[row] = time + period * np.cumsum(turns)
            notes = (f"the clock restarts at {what}, {row_named(int(row[k]))}: {period:.0f} s are added" for k in falls)
            return whole, tuple(notes)
    return time_s, ()


def _is_of_twelve_hours(time: FloatArray) -> bool:
    """Whether times of day run from 12:59 to 01:00, and forward otherwise."""
    if not len(time) or time.min() < HOUR_S or time.max() >= 13 * HOUR_S:
        return False
    return bool((np.diff(time % (DAY_S / 2)) >= 0).all() and (np.diff(time) < -11 * HOUR_S).sum() == 1)


def _rollovers(time: FloatArray, period: float) -> list[int]:
    """The first sample after each restart; none if any fall by half a period is not a restart."""
    if not len(time) or time.min() < 0 or time.max() > period:
        return []
    falls = (np.flatnonzero(np.diff(time) < -period / 2) + 1).tolist()
    return falls if all(_is_rollover(time, k, period) for k in falls) else []


def _is_rollover(time: FloatArray, k: int, period: float) -> bool:
    after = time[k : k + _ROWS_AFTER]
    stays = np.count_nonzero(after < time[k - 1] - period / 2) > len(after) / 2
    return bool(stays and 0 <= time[k] + period - time[k - 1] <= _MAX_ROLLOVER_GAP_S)
