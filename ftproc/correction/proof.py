"""The proof that a flight gives of its own correction: the smoother of the same run, which knows what came later.

What is left between filter and truth after smoothing does not depend on anything the filter knew, if the noise is what
it is taken for; so the correction that brings the filter nearer to the smoother brings it nearer to the truth. It is
applied only as far as that is distinguished from chance.
"""

from __future__ import annotations

import numpy as np

from ftproc.correction.features import APPLIED, BoolArray, LineOfSight
from ftproc.records import FloatArray

FARTHEST = 5.0  # sigmas: a filter that was lost for a while proves nothing
INTERVALS = 12  # that a flight is cut into
SURE = 1.0  # standard deviations, of the sum over these, that a decrease of squared error must have
FEWEST = 60  # samples that prove anything


def own_gain(
    los: LineOfSight, output: FloatArray, later: FloatArray, time_s: FloatArray, counts: BoolArray
) -> FloatArray:
    """(6,) in [0, 1] by which a flight's own smoother multiplies each output.

    output: (n, 6) bounded correction along the line-of-sight axes, in sigmas. later: (n, 6) smoother minus filter in
    x y z, m and m/s. time_s: (n,). counts: (n,) the samples that count.
    """
    counts = counts & np.isfinite(later).all(axis=1)
    gain = np.zeros(APPLIED)
    if int(counts.sum()) < FEWEST:
        return gain
    los, output, time_s = los.rows(counts), output[counts], time_s[counts]
    wanted = (los.from_cartesian(later[counts]) / los.sigma).clip(-FARTHEST, FARTHEST)
    interval = _intervals(time_s)
    power = np.sum(output**2, axis=0)
    best = np.divide(np.sum(output * wanted, axis=0), power, out=gain.copy(), where=power > 0.0).clip(0.0, 1.0)
    decrease = wanted**2 - (wanted - best * output) ** 2
    # In sigmas and in metres: the mean square in sigmas can fall while that in metres rises.
    proven = _sure(decrease, interval) & _sure(decrease * los.sigma**2, interval)
    return np.where(proven, best, 0.0)


def _intervals(time_s: FloatArray) -> FloatArray:
    """(n, INTERVALS) one where a sample is in the interval."""
    span = max(float(time_s[-1] - time_s[0]), 1e-9)
    number = np.minimum((time_s - time_s[0]) * (INTERVALS / span), INTERVALS - 1).astype(int)
    return np.asarray(np.eye(INTERVALS)[number])


def _sure(decrease: FloatArray, interval: FloatArray) -> BoolArray:
    """(6,) whether a decrease (n, 6) holds over the intervals of the flight."""
    sums = interval.T @ decrease
    sure: BoolArray = sums.sum(axis=0) > SURE * np.sqrt(INTERVALS) * sums.std(axis=0, ddof=1)
    return sure
