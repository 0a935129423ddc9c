"""Process noise that follows the flight: a jerk density for every few seconds, by maximum likelihood.

The smoother gives the score by every knot of the profile in one pass, so many knots cost no more than one. The
logarithm of the density is a random walk from knot to knot: where the data say little, neighbours decide.
"""

from __future__ import annotations

import math

import numpy as np

from ftproc.core.filtering.initialization import find_starts
from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.filtering.smoother import score_log
from ftproc.core.identification import decimation, optimizer
from ftproc.core.identification.likelihood import VERTICAL_PRECISION, jerk_bounds
from ftproc.core.identification.scales import Scales, scales_of
from ftproc.order_statistics import median
from ftproc.records import FloatArray, IntArray

KNOT_SAMPLES = 10  # samples to a knot of the jerk profile ...
KNOT_MEMORIES = 2.0  # ... but never less than so many memories of the filter,
MAX_KNOTS = 4000  # nor more than so many knots
WALK_PRECISION = 0.7  # of the random walk of ln(jerk) from knot to knot ...
ABRUPT = 1.0  # ... whose steps beyond this are as rare as their size, not its square: flights turn and take off at once
ALLOWANCE = 1.4  # on the likeliest jerk: too little makes sigmas dishonest, a little too much costs almost nothing
LONGEST_MEMORY = 2.0  # knots: less jerk than gives the filter such a memory shows in no knot, so none has less


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
    jerk = np.broadcast_to(level.jerk, (knots, 3))
    return climbed(log, starts, level._replace(jerk=jerk, knot_s=knot_s), steps, scales)[0]


def climbed(log: Observations, starts: list[Start], model: Model, steps: int, scales: Scales) -> tuple[Model, float]:
    """The likeliest profile with the knots and the motion of this model, from it on, and the log-likelihood with what
    is known beforehand of profiles. Ratios of the densities along other axes to the second's hold for the whole
    flight."""
    knots, free = len(model.jerk), [0, 2] if model.motion.acts else [2]

    def unpack(theta: FloatArray) -> Model:
        times = dict(zip(free, theta[knots:].tolist(), strict=True))
        shape = np.array([math.exp(times.get(axis, 0.0)) for axis in range(3)])
        return model._replace(jerk=np.exp(theta[:knots])[:, None] * shape)

    costs = list[float]()

    def cost(theta: FloatArray) -> optimizer.Point:
        found = score_log(log, unpack(theta), starts)
        walk, ratio = np.diff(theta[:knots]), theta[knots:]
        firm = WALK_PRECISION / np.sqrt(1 + (walk / ABRUPT) ** 2)  # with which a step is drawn to zero
        score, curvature, pull = found.jerk.score, found.jerk.curvature, VERTICAL_PRECISION * ratio
        costs.append(WALK_PRECISION * _roughness(walk) + 0.5 * float((pull * ratio).sum()) - found.log_likelihood)
        return optimizer.Point(
            costs[-1],
            np.append(_by_knot(-firm * walk, firm * walk) - score.sum(1), [*pull - score[:, free].sum(0)]),
            np.append(_by_knot(firm, firm) + curvature.sum(1), [*VERTICAL_PRECISION + curvature[:, free].sum(0)]),
            np.append(-firm, np.zeros(len(free))),
        )

    theta = np.append(np.log(model.jerk[:, 1]), np.log(model.jerk[0, free] / model.jerk[0, 1]))
    low, high = (np.append(np.full(knots, bound), np.full(len(free), side)) for bound, side in jerk_bounds(scales))
    theta = optimizer.minimise(cost, theta, low, high, steps, tolerance=0.1 * knots**0.5)
    return unpack(theta), -float(np.min(costs, where=np.isfinite(costs), initial=np.inf))


def _by_knot(before: FloatArray, after: FloatArray) -> FloatArray:
    """(m,) what the steps between m knots (m - 1,) add up to at each: of the step after it, and of that before it."""
    return np.append(before, 0.0) + np.insert(after, 0, 0.0)


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


def pieces(time_s: FloatArray, model: Model) -> IntArray:
    """(n,) the row of the jerk profile that holds at each time of the log of which it is."""
    if not math.isfinite(model.knot_s):
        return np.zeros(len(time_s), np.int64)
    found: IntArray = np.clip(((time_s - time_s[0]) / model.knot_s).astype(np.int64), 0, len(model.jerk) - 1)
    return found


def median_level(model: Model) -> Model:
    """The model with the median of its jerk profile for all of the flight."""
    level = median(model.jerk[:, 0])
    return model._replace(jerk=level * model.jerk[:1] / model.jerk[0, 0], knot_s=np.inf)


def starts_of(log: Observations, model: Model, at_median: Model | None = None) -> list[Start]:
    """Where a track starts over a log, by the process noise of its model, and by the typical one if that is another."""
    profile = model.jerk[pieces(log.time_s, model), 0] if len(model.jerk) > 1 else None
    typical = at_median or median_level(model)
    return find_starts(log, typical.noise_variance, float(typical.jerk[0, 0]), profile)


def from_knot(model: Model, time_s: FloatArray, span: slice) -> tuple[slice, Model]:
    """A stretch of a log with these times (n,), from the knot of the jerk profile on before which it begins, and the
    model for it, whose profile ends with it."""
    if not math.isfinite(model.knot_s):
        return span, model
    first, last = (int((time_s[span][end] - time_s[0]) / model.knot_s) for end in (0, -1))
    first = min(first, len(model.jerk) - 1)
    start = int(np.searchsorted(time_s, time_s[0] + first * model.knot_s))
    return slice(min(start, span.start), span.stop), model._replace(jerk=model.jerk[first : last + 1])


def of_part(model: Model, time_s: FloatArray) -> Model:
    """The model for a part of the log of which it is, with these times (m,) since that began: each knot of the part has
    the density that holds in its middle."""
    if not math.isfinite(model.knot_s):
        return model
    knots = max(math.ceil((time_s[-1] - time_s[0]) / model.knot_s), 1)
    middle = (time_s[0] + (np.arange(knots) + 0.5) * model.knot_s) / model.knot_s
    return model._replace(jerk=model.jerk[np.clip(middle.astype(np.int64), 0, len(model.jerk) - 1)])


def with_allowance(log: Observations, model: Model, scales: Scales | None = None) -> Model:
    """The model with a little more jerk than is likeliest, and nowhere less than shows in a knot of its profile.
    scales: of the log, if they are known."""
    scales = scales or scales_of(log, model.noise_variance)
    knot_s = min(model.knot_s, scales.span_s)
    least = scales.jerk_psd(LONGEST_MEMORY * knot_s)
    return model._replace(jerk=np.maximum(ALLOWANCE * model.jerk, least))
