"""Alternative hypotheses: is it the readings between two patches that are the patch?

A filter that has followed a patch calls the good readings on both sides of it bad, and the decisions stand still
there, because each supports the others. Where a short stretch of used readings lies between two rejected runs, or
between one and a gap, the decisions are made again from other initial hypotheses, over the neighbourhood alone, and
the likeliest outcome is kept.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core import odds
from ftproc.core.editing import outlier_chain, patch_likelihood
from ftproc.core.editing.patch_likelihood import SHORTEST_RUN
from ftproc.core.filtering.initialization import find_starts
from ftproc.core.filtering.records import Model, Observations, Uneven
from ftproc.core.filtering.smoother import RESIDUALS, SmootherRun, smooth_log
from ftproc.core.identification.stretches import runs_of
from ftproc.core.work import Work
from ftproc.order_statistics import typical
from ftproc.records import FloatArray, IntArray

LONGEST = 48  # used readings between two rejected runs
LENGTHS = (4, 6, 9, 13, 19, 28, 40)  # samples beside a rejected run, or at an end of the log, that may be the patch
GAP_INTERVALS = 8.0  # median intervals without a reading, which a patch may end at
AROUND = 80  # samples on each side that the comparison covers
ROUNDS = 5
HOPELESS = 400.0  # by which a longer patch must not be worse, for a shorter one to be tried: ten for each reading
MOST = 100  # comparisons in one round
STEPS = 14  # of filling a hole, or of taking out what stands out most
FITS = 2.5  # residual, in its 1-sigma, at which a reading is taken into a hole
SURE, ALMOST = 1.5, 1.3  # times the noise, or the smallest sigma in the hole: where the track is known well enough
APART = 6  # samples between readings that are taken out at once


class Neighbourhood(NamedTuple):
    """A stretch of the log and what decides in it: time_s (n,), measurement (n, 3), possible (n, 3) the readings that
    may be good at all, the model (of constant process noise), rates (3, 3) of outliers, the gate in sigmas; uneven: see
    `Observations`."""

    time_s: FloatArray
    measurement: FloatArray
    possible: NDArray[np.bool_]
    model: Model
    rates: FloatArray
    gate: float
    uneven: Uneven | None = None

    def weighted(self, weight: FloatArray) -> Observations:
        """The log with weights (n, 3)."""
        return Observations(self.time_s, self.measurement, weight, self.uneven)

    def part(self, near: slice) -> Neighbourhood:
        """The readings of a slice."""
        uneven = None if self.uneven is None else self.uneven.part(near)
        arrays = (self.time_s[near], self.measurement[near], self.possible[near])
        return self._replace(time_s=arrays[0], measurement=arrays[1], possible=arrays[2], uneven=uneven)


class AcceptedRun(NamedTuple):
    """Used readings [begin, end) of a component between rejected runs [first, begin) and [end, last), one of which may
    be a gap or an end of the log instead."""

    component: int
    first: int
    begin: int
    end: int
    last: int

    def shifted(self, samples: int) -> AcceptedRun:
        """With samples counted from a later one."""
        return AcceptedRun(self.component, *(index - samples for index in self[1:]))


class Search:
    """A search for alternatives. tried: runs that were examined; they are examined again only if they have changed.
    unexamined: those beyond the MOST of a round, and those that no work was left for."""

    def __init__(self, work: Work) -> None:
        self.tried: set[AcceptedRun] = set()
        self.unexamined: set[AcceptedRun] = set()
        self.work = work

    def take(self, run: AcceptedRun) -> bool:
        """Whether there is work left for a run."""
        (self.tried if self.work.left > 0 else self.unexamined).add(run)
        return self.work.left > 0


class Step(NamedTuple):
    """Decisions (n, 3), and the log-probability of the readings and of the decisions themselves."""

    weight: FloatArray
    likelihood: float


def try_alternatives(log: Neighbourhood, weight: FloatArray, search: Search) -> FloatArray:
    """The decisions (n, 3), replaced by others where these are likelier."""
    # Where a window ends, a patch may resemble motion, and motion a patch.
    result = weight.copy() if search.work.of_window else _at_edges(log, weight, search)
    new = [run for run in accepted_runs(log.time_s, weight, log.possible) if run not in search.tried]
    search.unexamined.update(new[MOST:])
    for run in new[:MOST]:
        if not search.take(run):
            continue
        low = max(run.first - AROUND, 0)
        near = slice(low, run.last + AROUND)
        part = log.part(near)
        try:
            steps = [*decisions(part, result[near]), *_alternatives(part, result[near], run.shifted(low))]
        except ValueError:  # a component has too few readings there
            continue
        search.work.left -= len(steps) * len(part.time_s)
        likeliest = max(steps, key=lambda step: step.likelihood)
        if likeliest.likelihood > steps[0].likelihood + odds.LIKELIER:
            result[near] = likeliest.weight
    return result


def _at_edges(log: Neighbourhood, weight: FloatArray, search: Search) -> FloatArray:
    """The decisions (n, 3), replaced where it is likelier that a rejected run, or an end of the log, is the edge of a
    patch that was followed: a ramp begins without a jump, and at an end of the log there is no other edge. Of several
    with common samples, the likeliest."""
    found = list[tuple[float, AcceptedRun, slice, FloatArray]]()
    for edge in [each for each in _edges(weight, log.possible) if each not in search.tried]:
        if not search.take(edge):
            continue
        near = slice(max(edge.first - LENGTHS[-1] - AROUND, 0), edge.last + LENGTHS[-1] + AROUND)
        try:
            steps = _beside(log.part(near), weight[near], edge.shifted(near.start))
        except ValueError:  # a component has too few readings there
            continue
        search.work.left -= sum(len(step.weight) for step in steps)
        best = max(steps, key=lambda step: step.likelihood)
        if best.likelihood > steps[0].likelihood + odds.ONE_END:
            found.append((best.likelihood - steps[0].likelihood, edge, near, best.weight))
    result, changed = weight.copy(), np.zeros(len(weight), bool)
    for _, edge, near, other in sorted(found, key=lambda each: -each[0]):
        if changed[near].any():
            search.tried.discard(edge)
        else:
            result[near], changed[near] = other, True
    return result


def _beside(part: Neighbourhood, weight: FloatArray, edge: AcceptedRun) -> list[Step]:
    """The decisions, and those with readings beside a rejected run rejected instead of it."""
    component, first, begin, end, last = edge
    steps, hopeless = [_step(part, weight)[0]], {-1: False, 1: False}
    for side, length in itertools.product((-1, 1), reversed(LENGTHS)):
        patch = slice(max(first - length, 0), first) if side < 0 else slice(last, last + length)
        other = weight.copy()
        other[begin:end, component] = part.possible[begin:end, component]
        other[patch, component] = 0.0
        if (other != weight).any() and not hopeless[side]:
            steps.append(_step(part, other)[0])
            hopeless[side] = steps[-1].likelihood < steps[0].likelihood - HOPELESS
    best = max(steps, key=lambda step: step.likelihood)
    return steps if best is steps[0] else [*steps, *decisions(part, best.weight)]


def _edges(weight: FloatArray, possible: NDArray[np.bool_]) -> list[AcceptedRun]:
    """The rejected runs of each component, and the ends of the log, which are runs of nothing."""
    found, n = list[AcceptedRun](), len(weight)
    for c in range(3):
        seen = np.flatnonzero(possible[:, c])
        if len(seen):
            runs = [(int(seen[a]), int(seen[b - 1]) + 1) for a, b in runs_of(weight[seen, c] <= 0, SHORTEST_RUN)]
            found += [AcceptedRun(c, a, a, b, b) for a, b in [(0, 0), *runs, (n, n)]]
    return found


def accepted_runs(time_s: FloatArray, weight: FloatArray, possible: NDArray[np.bool_]) -> list[AcceptedRun]:
    """Where a patch may have been followed. time_s (n,), weight, possible: (n, 3)."""
    found = []
    for c in range(3):
        seen = np.flatnonzero(possible[:, c])
        if len(seen) < 2:
            continue
        bad = runs_of(weight[seen, c] <= 0, SHORTEST_RUN)
        if not len(bad):
            continue
        interval = np.diff(time_s[seen])
        gaps = np.flatnonzero(interval > GAP_INTERVALS * typical(interval)) + 1
        walls = np.r_[0, gaps, len(seen)]
        banks = sorted({*map(tuple, bad.tolist()), *((w, w) for w in walls.tolist() if not _inside(w, bad))})
        for (low, begin), (end, high) in itertools.pairwise(banks):
            if 0 < end - begin <= LONGEST and low + end < begin + high:
                outer = int(seen[low]), int(seen[high - 1]) + 1
                found.append(AcceptedRun(c, outer[0], int(seen[begin]), int(seen[end - 1]) + 1, outer[1]))
    return found


def _inside(index: int, runs: IntArray) -> bool:
    """Whether a gap lies in one of the runs (m, 2), or at its edge."""
    return bool(((runs[:, 0] <= index) & (index <= runs[:, 1])).any())


def _alternatives(log: Neighbourhood, weight: FloatArray, run: AcceptedRun) -> Iterator[Step]:
    """Decisions from the alternative hypothesis, and from that of nothing known of the component there."""
    component, first, begin, end, last = run
    exchanged = weight.copy()
    exchanged[first:last, component] = 1.0
    exchanged[begin:end, component] = 0.0
    steps = _without_the_worst(log, exchanged * log.possible)
    yield from steps
    yield from decisions(log, max(steps, key=lambda step: step.likelihood).weight)
    yield from _filled(log, weight, component, slice(first, last))


def decisions(log: Neighbourhood, weight: FloatArray) -> list[Step]:
    """The decisions from `weight` on until they stand still, or for ROUNDS."""
    steps = []
    for _ in range(ROUNDS):
        step, smoothed = _step(log, weight)
        steps.append(step)
        noise = log.model.noise_variance
        good = outlier_chain.classify(smoothed.residual, smoothed.residual_variance, noise, log.rates.copy(), log.gate)
        decided = ((good > 0.5) & log.possible).astype(float)
        if (decided == weight).all():
            break
        weight = decided
    return steps


def _without_the_worst(log: Neighbourhood, weight: FloatArray) -> list[Step]:
    """The decisions with ever fewer readings, the worst of each surroundings first: beside an outlier, good readings
    seem bad."""
    steps = []
    for _ in range(STEPS):
        step, smoothed = _step(log, weight)
        steps.append(step)
        off = np.where(weight > 0, np.abs(smoothed.residual) / np.sqrt(smoothed.residual_variance), 0.0)
        weight = weight.copy()
        for c in range(3):
            beyond = np.flatnonzero(off[:, c] > log.gate)
            for k in beyond[np.argsort(-off[beyond, c])]:
                if off[k, c] > 0:
                    weight[k, c] = 0.0
                    off[max(k - APART, 0) : k + APART + 1, c] = 0.0
        if (weight == step.weight).all():
            break
    return steps


def _filled(log: Neighbourhood, weight: FloatArray, component: int, hole: slice) -> list[Step]:
    """The decisions when a component's readings in a hole are taken in from its edges on, where they fit the track."""
    steps = []
    weight = weight.copy()
    weight[hole, component] = 0.0
    inside = np.zeros(len(weight), bool)
    inside[hole] = log.possible[hole, component]
    noise = float(np.sqrt(log.model.noise_variance[component]))
    for _ in range(STEPS):
        step, smoothed = _step(log, weight)
        steps.append(step)
        out = np.flatnonzero(inside & (weight[:, component] <= 0))
        sigma = np.sqrt(smoothed.residual_variance[out, component])
        fits = np.abs(smoothed.residual[out, component]) < FITS * sigma
        if not fits.any():
            break
        known = sigma <= max(SURE * noise, ALMOST * sigma[fits].min())
        weight = weight.copy()
        weight[out[fits & known], component] = 1.0
    return steps


def _step(log: Neighbourhood, weight: FloatArray) -> tuple[Step, SmootherRun]:
    """How likely the decisions are, and what the readings used say of each other."""
    noise = log.model.noise_variance
    weighted = log.weighted(weight)
    starts = find_starts(weighted, noise, float(log.model.jerk[0, 0]))
    smoothed = smooth_log(weighted, log.model, starts, RESIDUALS)
    return Step(weight, smoothed.log_likelihood + rejections(log, weight, smoothed)), smoothed


def rejections(log: Neighbourhood, weight: FloatArray, smoothed: SmootherRun) -> float:
    """Log-probability of the rejected readings, and of there being such."""
    return patch_likelihood.log_probability_of_all(
        log.time_s, smoothed.residual, smoothed.residual_variance, weight, log.possible, log.model.noise_variance,
        log.rates,
    )  # fmt: skip
