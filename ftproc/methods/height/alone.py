"""Outliers of a slow channel by its own neighbours, such as heights: garbled ones are far off, for one reading or many.

A reading that lies on no line through neighbours, those before, those after, or on both sides, is one alone. Where the
channel then jumps by more than its rate and what this may change, a run ends. Runs that follow each other contradict;
others agree where the target can have come from the one to the other. The runs that agree and have most readings are
good.

Where the channel is silent for long, what was read before and after stands in: on the line between, with a 1-sigma that
grows with the time to the nearest reading, up to what is known of any target. A filter that had nothing there would
leave the target free to rise for as long.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.order_statistics import median
from ftproc.records import FloatArray

PRESSURE_M, TEMPERATURE = 80.0, 0.02  # 1-sigma of barometric heights: 10 hPa, and 5 K of 250 K as a share of the height
LEAST, FEWEST = 0.1, 3  # m, 1-sigma: no instrument is so good; and values that tell their scatter
GATE = 6.0  # sigmas beyond what the target may do
REACH = 5  # readings on each side, from which the rate is taken
RUNS_BEFORE = 30  # runs
SILENT_S, DRIFT_MPS = 30.0, 10.0  # between readings that stand in, and how fast an aircraft leaves the line, 1-sigma
_BEFORE, _AFTER = ((-2, -1), (-3, -1), (-3, -2)), ((1, 2), (1, 3), (2, 3))
_AROUND = ((-1, 1), (-2, 1), (-1, 2), (-2, 2))


class Agile(NamedTuple):
    """What a target may do: its acceleration m/s2, by which lines bend, and its rate m/s."""

    bends_mps2: float
    rate_mps: float


AIRCRAFT = Agile(1.0, 50.0)  # the height of an airliner, with 10,000 ft/min to spare


def screened(time_s: FloatArray, values: FloatArray, step: float) -> tuple[float, NDArray[np.bool_]]:
    """The noise 1-sigma of values (n,) m that are rounded to such steps, and (n,) which are no outliers."""
    scatter = _scatter(values)
    own = max(step / math.sqrt(12) if scatter < step else scatter, LEAST)
    return own, good(time_s, values, own)


def good(time_s: FloatArray, values: FloatArray, sigma: float, agile: Agile = AIRCRAFT) -> NDArray[np.bool_]:
    """(n,) which values are no outliers; False where missing. time_s (n,) never decreasing, sigma: their noise."""
    kept = np.isfinite(values)
    for each in (_alone, _alone, _spoilers, _spoilers):
        there = np.flatnonzero(kept)
        if len(there) > 2:
            kept[there[each(time_s[there], values[there], sigma, agile)]] = False
    there = np.flatnonzero(kept)
    kept[there[~_agreeing(time_s[there], values[there], sigma, agile)]] = False
    return kept


def standing_in(
    time_s: FloatArray, values: FloatArray, most: float
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Values (n,) with one in each SILENT_S that stands in where none is near; the 1-sigma (n,) by which the target may
    have left the line that they are on; and (n,) which they are. time_s (n,) never decreasing. most: 1-sigma of the
    value of any target."""
    there = np.flatnonzero(np.isfinite(values))
    if not len(there):
        return values, np.full(len(values), most), np.zeros(len(values), bool)
    known_s, k = time_s[there], np.searchsorted(time_s[there], time_s, side="right")
    before = time_s - np.r_[-np.inf, known_s][k]
    nearest = np.minimum(before, np.r_[known_s, np.inf][k] - time_s)
    off = np.minimum(DRIFT_MPS * np.maximum(nearest - SILENT_S / 2, 0.0), most)
    which = np.flatnonzero(nearest > SILENT_S)
    number = np.floor(np.where(k > 0, before, time_s)[which] / SILENT_S)
    new = (np.diff(number, prepend=np.nan) != 0) | (np.diff(k[which], prepend=-1) != 0)
    chosen = np.zeros(len(values), bool)
    chosen[which[new]] = True
    return np.where(chosen, np.interp(time_s, known_s, values[there]), values), off, chosen


def _alone(t: FloatArray, x: FloatArray, sigma: float, agile: Agile) -> NDArray[np.bool_]:
    """(n,) readings that lie on no line of their neighbours."""
    off = np.stack([_off(t, x, sigma, agile, pairs) for pairs in (_BEFORE, _AFTER, _AROUND)])
    known = np.isfinite(off)
    found: NDArray[np.bool_] = known.any(0) & (np.where(known, off, np.inf).min(0) > 1)
    return found


def _off(t: FloatArray, x: FloatArray, sigma: float, agile: Agile, pairs: tuple[tuple[int, int], ...]) -> FloatArray:
    """(n,) median distance from the lines through pairs of neighbours, in units of what is allowed; NaN of none."""
    n, found = len(t), np.full((len(pairs), len(t)), np.nan)
    for row, (i, j) in enumerate(pairs):
        k = np.arange(max(-i, 0), n - max(j, 0))
        a, b = k + i, k + j
        span = t[b] - t[a]
        share = np.divide(t[k] - t[a], span, out=np.full(len(k), 0.5), where=span > 0)
        bend = 0.5 * agile.bends_mps2 * np.abs((t[k] - t[a]) * (t[b] - t[k]))
        allowed = GATE * sigma * np.sqrt(1 + share**2 + (1 - share) ** 2) + bend
        found[row, k] = np.abs(x[k] - x[a] - share * (x[b] - x[a])) / allowed
    count, order = np.isfinite(found).sum(0), np.sort(found, 0)
    middle: FloatArray = np.take_along_axis(order, (np.maximum(count - 1, 0) // 2)[None], 0)[0]
    return middle


def _jumps(t: FloatArray, x: FloatArray, sigma: float, agile: Agile, over: int = 1) -> NDArray[np.bool_]:
    """(n - over,) whether the channel jumps between a reading and the next one, or the one `over` further."""
    step, interval = np.diff(x), np.diff(t)
    slope = np.divide(step, interval, out=np.full(len(step), np.nan), where=interval > 0)
    padded = np.pad(slope, REACH, constant_values=np.nan)
    around = np.sort(np.lib.stride_tricks.sliding_window_view(padded, 2 * REACH + 1), 1)
    middle = np.maximum(np.isfinite(around).sum(1) - 1, 0) // 2
    usual = np.nan_to_num(np.take_along_axis(around, middle[:, None], 1)[:, 0])[: len(t) - over]
    step, interval = x[over:] - x[:-over], t[over:] - t[:-over]
    single = interval / over
    bent = np.minimum(agile.bends_mps2 * REACH * single**2, agile.rate_mps * single)
    return np.asarray(np.abs(step - usual * interval) > GATE * np.sqrt(2) * sigma + bent)


def _spoilers(t: FloatArray, x: FloatArray, sigma: float, agile: Agile) -> NDArray[np.bool_]:
    """(n,) readings without which there is no jump beside them."""
    n = len(t)
    jump, over = np.flatnonzero(_jumps(t, x, sigma, agile)), _jumps(t, x, sigma, agile, 2)
    found = np.zeros(n, bool)
    found[jump[(jump > 0) & ~over[np.maximum(jump - 1, 0)]]] = True
    after = jump[(jump + 2 < n) & ~over[np.minimum(jump, n - 3)]] + 1
    found[after[~found[after - 1]]] = True
    return found


def _agreeing(t: FloatArray, x: FloatArray, sigma: float, agile: Agile) -> NDArray[np.bool_]:
    """(n,) the readings of the runs that agree and have most of them."""
    n = len(t)
    if n < 3:
        return np.ones(n, bool)
    jumps = _jumps(t, x, sigma, agile)
    edges = np.r_[0, np.flatnonzero(jumps) + 1, n]
    best, before = np.diff(edges).astype(float), np.full(len(edges) - 1, -1)
    size = best.copy()
    for run in range(1, len(size)):
        earlier = np.arange(max(run - RUNS_BEFORE, 0), run - 1)
        first, last = edges[run], edges[earlier + 1] - 1
        reach = GATE * np.sqrt(2) * sigma + agile.rate_mps * (t[first] - t[last])
        total = np.where(np.abs(x[first] - x[last]) <= reach, best[earlier], 0.0)
        if len(total) and total.max() > 0:
            before[run] = earlier[int(np.argmax(total))]
            best[run] += total.max()
    chosen, run = np.zeros(n, bool), int(np.argmax(best))
    while run >= 0:
        chosen[edges[run] : edges[run + 1]] = True
        run = int(before[run])
    return chosen


def _scatter(values: FloatArray) -> float:
    """Noise 1-sigma of single values, by their second differences."""
    seen = values[np.isfinite(values)]
    return median(np.abs(np.diff(seen, 2))) * 1.4826 / math.sqrt(6) if len(seen) > FEWEST else 0.0
