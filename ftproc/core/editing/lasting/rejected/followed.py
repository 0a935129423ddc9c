"""Patches beside a rejected run that the track has followed, up to their other edge: what is rejected is the end of the
patch, and the first good readings behind it, or the same where it begins."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator

import numpy as np

from ftproc.core.editing.decisions import Decision, Record
from ftproc.core.editing.lasting.rejected.joining import SHORTEST, Run
from ftproc.core.editing.reassessment import log_probability_as_it_is
from ftproc.core.filtering.records import Model
from ftproc.core.filtering.smoother import RESIDUALS, smooth_log
from ftproc.core.identification.profile import starts_of
from ftproc.order_statistics import median
from ftproc.records import FloatArray

BEYOND, INTO = (6, 9, 14, 20, 30, 40), (0, 1, 2, 4)  # samples of such a patch beside a run, and in it
SURELY_OFF = 6.0  # sigmas of the noise, by which half of its readings are off: of true ones 6.8 to 17, of others, where
# the noise is uneven and correlated, up to 5.8


def followed(part: Record, decision: Decision, run: Run, offset: int, model: Model) -> Iterator[FloatArray]:
    """Decisions (n, 3) in which a patch lies before a run, or behind it, which the track has followed: some readings of
    the run are the patch's, the others are good. Its edges are the likeliest by a model that has not followed it. They
    are not made again: in the gap that a patch leaves any track may go through its readings."""
    c, first, last = run.component, int(run.samples[0]) - offset, int(run.samples[-1]) + 1 - offset
    good, here = decision.weight.copy(), run.around(offset)
    good[first:last, c] = part.possible[first:last, c]

    def without(edges: tuple[int, int]) -> FloatArray:
        other = good.copy()
        other[slice(*edges), c] = 0.0
        return part.with_accepted(other)

    @functools.cache
    def likely(edges: tuple[int, int]) -> float:
        return _likely(part, decision, model, without(edges))

    inside = {*(each for each in INTO if each < last - first), last - first}
    beside = list(itertools.product(BEYOND, inside))
    for tried, lowest, highest in (
        ([(first - length, first + into) for length, into in beside], (here.start, first - 1), (first, last)),
        ([(last - into, last + length) for length, into in beside], (first, last), (last + 1, here.stop)),
    ):

        def fits(edges: tuple[int, int], lowest: tuple[int, int] = lowest, highest: tuple[int, int] = highest) -> bool:
            return lowest[0] <= edges[0] <= lowest[1] and highest[0] <= edges[1] <= highest[1]

        best, step = max(filter(fits, tried), key=likely, default=None), SHORTEST
        while best is not None and step:
            a, b = best
            near = filter(fits, [(a - step, b), (a + step, b), (a, b - step), (a, b + step)])
            other = max(near, key=likely, default=best)
            best, step = (other, step) if likely(other) > likely(best) else (best, step // 2)
        if best is None or not np.isfinite(likely(best)):
            continue
        if _are_off(part, decision, model, without(best), c, slice(*best)):
            yield without(best)


def _likely(part: Record, decision: Decision, model: Model, weight: FloatArray) -> float:
    """Log-probability of decisions (n, 3) by a model; none where a component has too few readings."""
    try:
        return log_probability_as_it_is(part, decision._replace(weight=weight, model=model))
    except ValueError:
        return -np.inf


def _are_off(part: Record, decision: Decision, model: Model, weight: FloatArray, c: int, patch: slice) -> bool:
    """Whether most readings of a patch are off the track by decisions (n, 3) without them."""
    log = part.weighted(weight)
    off = smooth_log(log, model, starts_of(log, decision.model), RESIDUALS).residual[patch, c][part.possible[patch, c]]
    return len(off) > 0 and median(np.abs(off)) > SURELY_OFF * np.sqrt(model.noise_variance[c])


def with_weight(part: Record, decision: Decision, weight: FloatArray) -> Decision:
    """The decision with other weights (n, 3)."""
    return decision._replace(weight=weight, starts=starts_of(part.weighted(weight), decision.model))
