"""Runs of readings that are off together, each by too little to stand out: found by the sum of their smoothations.

The smoothation u = V^-1 (z - E z) of a reading (de Jong and Penzer 1998) is its leave-one-out residual over the
variance of that. The sum of u over a run is the score of a common offset of the run's readings: what the rest of
the record cannot explain by motion adds up, while motion and noise cancel. How large such sums are by chance, for
each length of run, the log itself tells.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part
from ftproc.core.editing.screening import median
from ftproc.core.identification.stretches import runs_of
from ftproc.core.signatures import FlagMatrix, Flags, Matrix, Vector

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SHORTEST, LONGEST, MEMORIES = 2, 48, 4.0  # readings in a run, and memories of the filter: what lasts longer may be a
# manoeuvre
SURE = 5.0  # robust sigmas of the sum that make a run suspicious
SCALE_SAMPLES = 1000  # sums of a length from which their scale is taken
NEXT_LENGTH = 1.3  # times a length, of those whose scales are taken; what lies between is interpolated
FEWEST, SOME = 100, 4000  # readings, for the scale to mean anything, and intervals that tell the typical one
EDGE, SHARP = 3, 1.5  # readings at each end of a run that must be off by so many sigmas in the mean


@kernel
def suspicious(time_s: Vector, residual: Matrix, variance: Matrix, weight: Matrix, memory_s: float) -> FlagMatrix:
    """(n, 3) readings in runs that are off together.

    time_s (n,). residual, variance: (n, 3) leave-one-out, of the smoother; weight (n, 3), zero for readings not used.
    memory_s: of its filter, see `identification.scales`.
    """
    n = len(time_s)
    found, used, total, interval = np.zeros((n, 3), np.bool_), np.empty(n, np.int64), np.zeros(n + 1), np.empty(n)
    for c in range(3):
        m = 0
        for k in range(n):
            if weight[k, c] > 0 and math.isfinite(residual[k, c]):
                used[m] = k
                total[m + 1] = total[m] + residual[k, c] / variance[k, c]
                m += 1
        if m < FEWEST:
            continue
        count = 0
        for k in range(1, m, 1 + m // SOME):
            interval[count] = time_s[used[k]] - time_s[used[k - 1]]
            count += 1
        typical, longest = median(interval, count), LONGEST
        if typical > 0:
            longest = int(min(max(MEMORIES * memory_s / typical, SHORTEST), LONGEST))
        off = _scan(total[: m + 1], _scales(total[: m + 1], longest))
        for k in range(m):
            found[used[k], c] = off[k]
    return found


@part
def _scales(total: Vector, longest: int) -> Vector:
    """(longest + 1,) robust 1-sigma of the sums over runs of each length, from SCALE_SAMPLES of them or a few more."""
    m = len(total) - 1
    every = max(m // SCALE_SAMPLES, 1)
    scale, sums = np.full(longest + 1, np.inf), np.empty(m)
    length = before = SHORTEST
    while True:
        n = 0
        for begin in range(0, m + 1 - length, every):
            sums[n] = abs(total[begin + length] - total[begin])
            n += 1
        scale[length] = max(1.4826 * median(sums, n), 1e-300)
        for between in range(before + 1, length):
            share = (between - before) / (length - before)
            scale[between] = (1 - share) * scale[before] + share * scale[length]
        if length == longest:
            return scale
        before, length = length, min(max(int(NEXT_LENGTH * length), length + 1), longest)


@part
def _scan(total: Vector, scale: Vector) -> Flags:
    """(m,) readings of suspicious runs. total: (m + 1,) sums of u up to each reading; scale: by length of run."""
    m, longest = len(total) - 1, len(scale) - 1
    limit, score, end = SURE * scale, np.zeros(m), np.zeros(m, np.int64)
    for begin in range(m):
        last, suspicious = min(longest, m - begin), 0
        for length in range(SHORTEST, last + 1):  # without branches: it becomes vector instructions
            suspicious += abs(total[begin + length] - total[begin]) >= limit[length]
        for length in range(SHORTEST, last + 1 if suspicious > 0 else 0):
            size = abs(total[begin + length] - total[begin]) / scale[length]
            if size > score[begin]:
                score[begin], end[begin] = size, begin + length
    found, near, begins = np.zeros(m, np.bool_), np.zeros(m, np.bool_), np.flatnonzero(score)
    for begin in begins[np.argsort(-score[begins])]:  # the worst run first; what lies beside it may be its echo
        if not near[begin : end[begin]].any():
            found[begin : end[begin]] = True
            near[max(begin - longest, 0) : end[begin] + longest] = True
    return found


def confirmed(suspects: NDArray[np.bool_], residual: FloatArray, variance: FloatArray) -> NDArray[np.bool_]:
    """(n, 3) those suspect runs that are off at once at both ends, as no manoeuvre is.

    residual, variance: (n, 3) of the smoother that does not use the suspects.
    """
    kept = np.zeros_like(suspects)
    for c in range(3):
        for begin, end in runs_of(suspects[:, c]):
            inside = np.flatnonzero(np.isfinite(residual[begin:end, c])) + begin
            first, last = (
                residual[near, c].sum() / np.sqrt(len(near) * variance[near, c].sum())
                for near in (inside[:EDGE], inside[-EDGE:])
            )
            kept[begin:end, c] = min(abs(first), abs(last)) > SHARP and first * last > 0
    return kept & suspects
