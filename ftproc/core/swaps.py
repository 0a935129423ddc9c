"""The opposite decision, tried: is it the readings between two patches that are the patch?

A filter that has followed a patch calls the good readings on both sides of it bad, and the decisions stand still
there, because each supports the others. Where a short stretch of used readings lies between two rejected runs, or
between one and a gap, the decisions are made again from the opposite on, over the neighbourhood alone, and the
likelier outcome is kept.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core import indicators
from ftproc.core.forward import Model
from ftproc.core.runs import runs_of
from ftproc.core.smoother import SmootherRun, smooth_log
from ftproc.core.start import begin_all

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SHORTEST_RUN = 3  # rejected readings on each side
LONGEST = 48  # used readings between them
GAP_INTERVALS = 8.0  # median intervals without a reading, which a patch may end at
AROUND = 80  # samples on each side that the comparison looks at
ROUNDS = 5
MARGIN = 5.0  # by which the log-probability of the opposite must be better
MOST = 100  # comparisons in one look


class Neighbourhood(NamedTuple):
    """A stretch of the log and what decides in it: time_s (n,), measurement (n, 3), possible (n, 3) the readings that
    may be good at all, the model (of a single jerk level), rates (3, 3) of outliers, the gate in sigmas."""

    time_s: FloatArray
    measurement: FloatArray
    possible: NDArray[np.bool_]
    model: Model
    rates: FloatArray
    gate: float

    def part(self, near: slice) -> Neighbourhood:
        return self._replace(time_s=self.time_s[near], measurement=self.measurement[near], possible=self.possible[near])


class Island(NamedTuple):
    """Used readings [begin, end) of a component between rejected runs [first, begin) and [end, last), one of which may
    be a gap or an end of the log instead."""

    component: int
    first: int
    begin: int
    end: int
    last: int


def try_opposites(log: Neighbourhood, weight: FloatArray) -> FloatArray:
    """The decisions (n, 3), with better ones in their place where the opposite is likelier."""
    result = weight.copy()
    for component, first, begin, end, last in islands(log.time_s, weight, log.possible)[:MOST]:
        low = max(first - AROUND, 0)
        near = slice(low, last + AROUND)
        opposite = result[near].copy()
        opposite[first - low : last - low, component] = 1.0
        opposite[begin - low : end - low, component] = 0.0
        part = log.part(near)
        try:
            steps = [*_decisions(part, result[near]), *_decisions(part, opposite * part.possible)]
        except ValueError:  # a component says too little hereabouts
            continue
        decided, likeliest = max(steps, key=lambda step: step[1])
        if likeliest > steps[0][1] + MARGIN:
            result[near] = decided
    return result


def islands(time_s: FloatArray, weight: FloatArray, possible: NDArray[np.bool_]) -> list[Island]:
    """Where a patch may have been followed. time_s (n,), weight, possible: (n, 3)."""
    found = []
    for c in range(3):
        seen = np.flatnonzero(possible[:, c])
        if len(seen) < 2:
            continue
        bad = runs_of(weight[seen, c] <= 0)
        bad = bad[bad[:, 1] - bad[:, 0] >= SHORTEST_RUN]
        interval = np.diff(time_s[seen])
        gaps = np.flatnonzero(interval > GAP_INTERVALS * np.median(interval)) + 1
        walls = np.r_[0, gaps, len(seen)]
        banks = sorted({*map(tuple, bad.tolist()), *((w, w) for w in walls.tolist() if not _inside(w, bad))})
        for (low, begin), (end, high) in itertools.pairwise(banks):
            if 0 < end - begin <= LONGEST and low + end < begin + high:
                outer = int(seen[low]), int(seen[high - 1]) + 1
                found.append(Island(c, outer[0], int(seen[begin]), int(seen[end - 1]) + 1, outer[1]))
    return found


def _inside(place: int, runs: IntArray) -> bool:
    """Whether a gap lies in one of the runs (m, 2), or at its edge."""
    return bool(((runs[:, 0] <= place) & (place <= runs[:, 1])).any())


def _decisions(log: Neighbourhood, weight: FloatArray) -> list[tuple[FloatArray, float]]:
    """The decisions from `weight` on until they stand still, each with the log-probability of the readings and of the
    decisions themselves."""
    steps = []
    noise = log.model.noise_variance
    for _ in range(ROUNDS):
        starts = begin_all(log.time_s, log.measurement, weight, noise, float(log.model.jerk[0, 0]))
        smoothed = smooth_log(log.time_s, log.measurement, weight, log.model, starts, residuals_only=True)
        steps.append((weight, smoothed.log_likelihood + _rejections(log, weight, smoothed)))
        good = indicators.classify(smoothed.residual, smoothed.residual_variance, noise, log.rates.copy(), log.gate)
        decided = ((good > 0.5) & log.possible).astype(float)
        if (decided == weight).all():
            break
        weight = decided
    return steps


def _rejections(log: Neighbourhood, weight: FloatArray, smoothed: SmootherRun) -> float:
    """Log-probability of the rejected readings, and of there being such."""
    total = 0.0
    for c in range(3):
        seen = np.flatnonzero(log.possible[:, c])
        bad = weight[seen, c] <= 0
        residual, variance = smoothed.residual[seen[bad], c], smoothed.residual_variance[seen[bad], c]
        wide = variance + indicators.WIDE**2 * log.model.noise_variance[c]
        total -= 0.5 * float((np.log(wide) + residual**2 / wide).sum())
        isolated, begins, stays = np.log(log.rates[c])
        begin, end = runs_of(bad).T
        length = end - begin
        lone = length < SHORTEST_RUN
        total += float(np.where(lone, length * isolated, begins + length * stays).sum())
    return total
