"""Process noise that follows the flight: a jerk density for every few seconds, by maximum likelihood.

The smoother gives the score by every knot of the profile in one pass, so many knots cost no more than one. The
logarithm of the density is a random walk from knot to knot: where the data say little, neighbours decide.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.filtering.smoother import score_log
from ftproc.core.identification import decimation, optimizer
from ftproc.core.identification.likelihood import (
    ISOTROPIC,
    VERTICAL_PRECISION,
    jerk_bounds,
    shaped,
)
from ftproc.core.identification.scales import Scales, scales_of

FloatArray = NDArray[np.float64]

KNOT_SAMPLES = 10  # samples to a knot of the jerk profile ...
KNOT_MEMORIES = 2.0  # ... but never less than so many memories of the filter,
MAX_KNOTS = 4000  # nor more than so many knots
WALK_PRECISION = 1.0  # of the random walk of ln(jerk) from knot to knot ...
ABRUPT = 1.0  # ... whose steps beyond this are as rare as their size, not its square: flights turn and take off at once
ALLOWANCE = 1.4  # on the likeliest jerk: too little makes sigmas dishonest, a little too much costs almost nothing
LONGEST_MEMORY = 1.0  # knots: less jerk than gives the filter such a memory shows in no knot, so none has less


def fit_profile(
    log: Observations, starts: list[Start], level: Model, steps: int, scales: Scales | None = None
) -> Model:
    """A jerk density that follows the flight, knot by knot; the noise stays. `level` has a single one, or a profile
    of this same log to continue from. scales: of the log, if they are known.

    One ratio of vertical to horizontal jerk holds for the whole flight: aircraft turn harder than they pitch, and
    range and angles see the two differently.
    """
    scales = scales or scales_of(log, level.noise_variance)
    knot_s = level.knot_s
    if not math.isfinite(knot_s):
        knot_s = knot_length(scales, float(level.jerk[0, 0]))
    knots = max(math.ceil(scales.span_s / knot_s), 1)

    if log.sites is None:
        count = decimation.how_many(scales, level, knot_s)
        log, starts = decimation.merged(log, starts, count)

    def unpack(theta: FloatArray) -> Model:
        return level._replace(jerk=shaped(theta[:knots], theta[knots]), knot_s=knot_s)

    def cost(theta: FloatArray) -> tuple[float, FloatArray]:
        model = unpack(theta)
        found = score_log(log, model, starts)
        by_axis = found.jerk * model.jerk
        walk, ratio = theta[1:knots] - theta[: knots - 1], theta[knots]
        bend, slope = np.zeros(knots), walk / np.sqrt(1 + (walk / ABRUPT) ** 2)
        bend[1:] += slope
        bend[:-1] -= slope
        pull = np.append(WALK_PRECISION * bend, VERTICAL_PRECISION * ratio)
        penalty = WALK_PRECISION * _roughness(walk) + 0.5 * VERTICAL_PRECISION * ratio**2
        score = np.append(by_axis.sum(1), by_axis[:, 5].sum())
        return -found.log_likelihood + penalty, pull - score

    ratio = math.log(level.jerk[0, 5] / level.jerk[0, 0])
    theta = np.append(np.broadcast_to(np.log(level.jerk[:, 0]), knots), ratio)
    low, high = (np.append(np.full(knots, bound), side) for bound, side in jerk_bounds(scales))
    curvature = np.append(np.full(knots, 2.0), 0.7 * knots)
    return unpack(optimizer.minimise(cost, theta, curvature, low, high, steps, tolerance=0.1 * knots**0.5))


def roughness(model: Model) -> float:
    """What a jerk profile takes from the log-likelihood: it is a random walk from knot to knot."""
    return WALK_PRECISION * _roughness(np.diff(np.log(model.jerk[:, 0])))


def _roughness(walk: FloatArray) -> float:
    """Half the squares of small steps, and the sizes of large ones."""
    return ABRUPT**2 * float((np.sqrt(1 + (walk / ABRUPT) ** 2) - 1).sum())


def knot_length(scales: Scales, jerk_psd: float) -> float:
    """Seconds from knot to knot of the profile of a flight with such a typical jerk density."""
    memories, samples = KNOT_MEMORIES * scales.memory_s(jerk_psd), KNOT_SAMPLES * scales.interval_s
    return max(memories, samples, scales.span_s / MAX_KNOTS)


def median_level(model: Model) -> Model:
    """The model with the median of its jerk profile for all of the flight."""
    level = float(np.median(model.jerk[:, 0]))
    return model._replace(jerk=level * model.jerk[:1] / model.jerk[0, 0], knot_s=np.inf)


def with_allowance(log: Observations, model: Model, scales: Scales | None = None) -> Model:
    """The model with a little more jerk than is likeliest, and nowhere less than shows in a knot of its profile.
    scales: of the log, if they are known."""
    scales = scales or scales_of(log, model.noise_variance)
    knot_s = min(model.knot_s, scales.span_s)
    least = scales.jerk_psd(LONGEST_MEMORY * knot_s)
    return model._replace(jerk=np.maximum(ALLOWANCE * model.jerk, least * ISOTROPIC))
