"""The unit of a range rate that nothing states: the one in which it is the rate of the log's own ranges."""

from __future__ import annotations

import math

import numpy as np

from ftproc.files.units import UNITS, Unit
from ftproc.order_statistics import median
from ftproc.records import FloatArray

BLOCKS, ROWS_EACH = 12, 6  # of the log; rows of a block, at least
NEAR = 0.04  # of one unit: km/h and ft/s, the closest ones, are 9 % apart
SPREAD = 1.86  # of a median, from the median deviation of Gaussian values: 1.4826 times the root of pi / 2
SURE = 6.0  # standard errors by which the next unit is worse


def unit_by_motion(time_s: FloatArray, range_m: FloatArray, rate: FloatArray) -> Unit | None:
    """The unit in which rates (n,), outward or inward, are those of ranges (n,), m, at times (n,) in order, s; None
    where the motion does not tell."""
    known = np.flatnonzero(np.isfinite(range_m) & np.isfinite(rate))
    if len(known) < BLOCKS * ROWS_EACH:
        return None
    blocks = [_rates(time_s[block], range_m[block], rate[block]) for block in np.array_split(known, BLOCKS)]
    by_range, stated = np.array(blocks).T
    fast = np.argsort(-np.abs(stated))[: BLOCKS // 2]
    if not stated[fast].all() or (stated == stated[0]).all():
        return None
    ratios = np.abs(by_range[fast] / stated[fast])
    ratio = median(ratios)
    if not ratio:
        return None
    units = {abs(math.log(ratio * unit.divide / unit.multiply)): unit for unit in UNITS["range_rate"].values()}
    near, next_one = sorted(units)[:2]
    error = SPREAD * median(np.abs(ratios / ratio - 1)) / math.sqrt(len(fast))
    return units[near] if near < NEAR and next_one > near + SURE * error else None


def _rates(time_s: FloatArray, range_m: FloatArray, rate: FloatArray) -> tuple[float, float]:
    """Of a block: by its ranges, from its first half to its second, and as they stand there. Medians, for outliers."""
    half = len(time_s) // 2
    elapsed = median(time_s[half:]) - median(time_s[:half])
    change = median(range_m[half:]) - median(range_m[:half])
    return change / elapsed if elapsed > 0 else 0.0, median(rate)
