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
    JERK_SIDES,
    RATIO_BOUND,
    VERTICAL_PRECISION,
    shaped,
)

FloatArray = NDArray[np.float64]

KNOT_SAMPLES = 10  # samples to a knot of the jerk profile ...
KNOT_SECONDS = 4.0  # ... but never less than so many seconds,
MAX_KNOTS = 4000  # nor more than so many knots
WALK_PRECISION = 1.0  # of the random walk of ln(jerk) from knot to knot
ALLOWANCE = 1.4  # on the likeliest jerk: too little makes sigmas dishonest, a little too much costs almost nothing
CALMEST = 3e-4  # m^2/s^5 along any axis: no aircraft flies more smoothly than the air it is in. With 1e-5 for the
# smoother its errors on zuo2021-outliers are smaller by 15 %, but on cruises and overhead passes only 95 % are inside 3
# sigma, in place of 98


def fit_profile(log: Observations, starts: list[Start], level: Model, steps: int) -> Model:
    """A jerk density that follows the flight, knot by knot; the noise stays. `level` has a single one, or a profile
    of this same log to continue from.

    One ratio of vertical to horizontal jerk holds for the whole flight: aircraft turn harder than they pitch, and
    range and angles see the two differently.
    """
    span = float(log.time_s[-1] - log.time_s[0])
    interval = float(np.median(np.diff(log.time_s))) if len(log.time_s) > 1 else 1.0
    knot_s = max(KNOT_SECONDS, KNOT_SAMPLES * interval, span / MAX_KNOTS)
    knots = max(math.ceil(span / knot_s), 1)

    slant = float(np.nanmedian(log.measurement[:, 0]))
    merged = decimation.how_many(log.time_s, slant, level, knot_s)
    if merged > 1:
        log, starts = decimation.merge(log, starts, merged)

    def unpack(theta: FloatArray) -> Model:
        return level._replace(jerk=shaped(theta[:knots], theta[knots]), knot_s=knot_s)

    def cost(theta: FloatArray) -> tuple[float, FloatArray]:
        model = unpack(theta)
        found = score_log(log, model, starts)
        by_axis = found.jerk * model.jerk
        walk, ratio = np.diff(theta[:knots]), theta[knots]
        pull = np.r_[WALK_PRECISION * (np.r_[0.0, walk] - np.r_[walk, 0.0]), VERTICAL_PRECISION * ratio]
        penalty = WALK_PRECISION * float(walk @ walk) + VERTICAL_PRECISION * ratio**2
        score = np.r_[by_axis.sum(1), by_axis[:, 5].sum()]
        return -found.log_likelihood + 0.5 * penalty, pull - score

    ratio = math.log(level.jerk[0, 5] / level.jerk[0, 0])
    theta = np.r_[np.broadcast_to(np.log(level.jerk[:, 0]), knots), ratio]
    low, high = (np.r_[np.full(knots, math.log(bound)), side * RATIO_BOUND] for bound, side in JERK_SIDES)
    curvature = np.r_[np.full(knots, 2.0), 0.7 * knots]
    return unpack(optimizer.minimise(cost, theta, curvature, low, high, steps, tolerance=0.1 * knots**0.5))


def median_level(model: Model) -> Model:
    """The model with the median of its jerk profile for all of the flight."""
    level = float(np.median(model.jerk[:, 0]))
    return model._replace(jerk=level * model.jerk[:1] / model.jerk[0, 0], knot_s=np.inf)


def with_allowance(model: Model) -> Model:
    """The model with a little more jerk than is likeliest, and nowhere less than CALMEST."""
    return model._replace(jerk=np.maximum(ALLOWANCE * model.jerk, CALMEST * ISOTROPIC))
