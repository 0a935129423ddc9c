"""Noise and manoeuvre level from the log itself: maximum likelihood of the innovations, with exact gradients.

One pass of the smoother gives the score by every parameter at once (Koopman and Shephard 1992), so a jerk density
for every few seconds of the flight costs no more than a single one. Its logarithm is a random walk from knot to
knot: where the data say little, neighbours decide.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.initialization import begin_all
from ftproc.core.filtering.records import Model, Start
from ftproc.core.filtering.smoother import score_log
from ftproc.core.identification import decimation, optimizer

FloatArray = NDArray[np.float64]

SPANS, SPAN = 6, 400  # of samples: what stands for a long log when one noise and one jerk level are looked for
NOISE_FLOOR = np.array([1e-3, 5e-6, 5e-6])  # 1-sigma m, rad, rad: no tracker is better; below, rounding decides
NOISE_GROWTH = 3.0  # times the noise that the search begins with: more of it is a track gone astray, not noise
NOISE_SHRINKS = 4.0  # likewise, less of it is readings left out until the rest fits
NOISE_ALLOWED = np.array([1.0, 1e-4, 1e-4])  # 1-sigma m, rad, rad that are never too much: a component computed from
# another shows no noise at all to begin with
JERK_SIDES = ((1e-7, -1), (1e7, 1))  # m^2/s^5: lowest and highest
RATIO_BOUND = 6.0  # on |ln(vertical / horizontal jerk)|
KNOT_SAMPLES = 10  # samples to a knot of the jerk profile ...
KNOT_SECONDS = 4.0  # ... but never less than so many seconds,
MAX_KNOTS = 4000  # nor more than so many knots
WALK_PRECISION = 1.0  # of the random walk of ln(jerk) from knot to knot
ALLOWANCE = 1.4  # on the likeliest jerk: too little makes sigmas dishonest, a little too much costs hardly anything
CALMEST = 3e-4  # m^2/s^5 along any axis: no aircraft flies more smoothly than the air it is in. With 1e-5 for the
# smoother its errors on zuo2021-outliers are smaller by 15 %, but on cruises and overhead passes only 95 % are inside 3
# sigma, in place of 98
VERTICAL_PRECISION = 0.5  # with which ln(vertical / horizontal jerk) is drawn to zero
HORIZONTAL = np.array([1.0, 0.0, 0.0, 1.0, 0.0, 0.0])
VERTICAL = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
ISOTROPIC = (HORIZONTAL + VERTICAL)[None, :]


class Part(NamedTuple):
    """A representative part of a log: spans of it behind one another, each with a start of its own."""

    time_s: FloatArray
    measurement: FloatArray
    weight: FloatArray
    starts: list[Start]


def representative(
    time_s: FloatArray, measurement: FloatArray, weight: FloatArray, starts: list[Start], noise_variance: FloatArray
) -> Part:
    """The whole log if it is short, else SPANS spans spread evenly over it; (n,), (n, 3), (n, 3) in and out."""
    n = len(time_s)
    if n <= SPANS * SPAN:
        return Part(time_s, measurement, weight, starts)
    chosen: list[NDArray[np.int64]] = []
    begun: list[Start] = []
    for first in np.linspace(0, n - SPAN, SPANS).astype(int):
        span = np.arange(first, first + SPAN)
        try:
            inside = begin_all(time_s[span], measurement[span], weight[span], noise_variance, None)
        except ValueError:  # a component says nothing in this span
            continue
        skipped = inside[0].sample
        shift = sum(len(c) for c in chosen) - skipped
        begun += [start._replace(sample=start.sample + shift) for start in inside]
        chosen.append(span[skipped:])
    if not begun:
        return Part(time_s, measurement, weight, starts)
    rows = np.concatenate(chosen)
    return Part(time_s[rows], measurement[rows], weight[rows], begun)


def fit_level(
    time_s: FloatArray,
    measurement: FloatArray,
    weight: FloatArray,
    starts: list[Start],
    guess: Model,
    fix_noise: NDArray[np.bool_],
    fix_jerk: bool,
    expected_sigma: FloatArray | None = None,
    steps: int = 12,
) -> Model:
    """The likeliest noise variances and single jerk density with its vertical share, from `guess` on.

    fix_noise: (3,) components whose noise stays as guessed. fix_jerk: the jerk density stays. expected_sigma: (3,)
    noise that NOISE_GROWTH counts from, if not the guess.
    """
    if fix_noise.all() and fix_jerk:
        return guess
    part = representative(time_s, measurement, weight, starts, guess.noise_variance)
    log_noise = np.log(guess.noise_variance)
    expected = np.sqrt(guess.noise_variance) if expected_sigma is None else expected_sigma
    floor = 2 * np.log(np.maximum(NOISE_FLOOR, expected / NOISE_SHRINKS if expected_sigma is not None else 0.0))
    ceiling = 2 * np.log(np.maximum(NOISE_GROWTH * expected, NOISE_ALLOWED))
    log_jerk = np.array([math.log(guess.jerk[0, 0]), math.log(guess.jerk[0, 5] / guess.jerk[0, 0])])
    lowest, highest = (np.array([math.log(bound), side * RATIO_BOUND]) for bound, side in JERK_SIDES)
    lower = np.r_[np.where(fix_noise, log_noise, floor), log_jerk if fix_jerk else lowest]
    upper = np.r_[np.where(fix_noise, log_noise, ceiling), log_jerk if fix_jerk else highest]
    used = np.maximum((part.weight > 0).sum(0), 1)

    def cost(theta: FloatArray) -> tuple[float, FloatArray]:
        model = Model(np.exp(theta[:3]), shaped(theta[3:4], theta[4]))
        found = score_log(*part[:3], model, part.starts)
        by_axis = found.jerk[0] * model.jerk[0]
        pull = VERTICAL_PRECISION * theta[4]
        slope = -np.r_[found.noise, by_axis.sum(), by_axis[5] - pull]
        return -found.log_likelihood + 0.5 * pull * theta[4], slope

    theta = np.clip(np.r_[log_noise, log_jerk], lower, upper)
    curvature = np.r_[used / 2, used.mean() / 20, used.mean() / 60]
    theta = optimizer.minimise(cost, theta, curvature, lower, upper, steps, tolerance=0.05)
    return Model(np.exp(theta[:3]), shaped(theta[3:4], theta[4]))


def shaped(log_jerk: FloatArray, log_ratio: float) -> FloatArray:
    """(m, 6) jerk tensors from ln of the horizontal density (m,) and ln of vertical over horizontal."""
    tensors: FloatArray = np.exp(log_jerk)[:, None] * (HORIZONTAL + math.exp(log_ratio) * VERTICAL)
    return tensors


def fit_profile(
    time_s: FloatArray,
    measurement: FloatArray,
    weight: FloatArray,
    starts: list[Start],
    begun: Model,
    steps: int,
) -> Model:
    """A jerk density that follows the flight, knot by knot; the noise stays. `begun` has a single level, or a profile
    of this same log to go on from.

    One ratio of vertical to horizontal jerk holds for the whole flight: aircraft turn harder than they pitch, and
    range and angles see the two differently.
    """
    span = float(time_s[-1] - time_s[0])
    interval = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 1.0
    knot_s = max(KNOT_SECONDS, KNOT_SAMPLES * interval, span / MAX_KNOTS)
    knots = max(math.ceil(span / knot_s), 1)

    slant = float(np.nanmedian(measurement[:, 0]))
    merged = decimation.how_many(time_s, slant, begun, knot_s)
    if merged > 1:
        time_s, measurement, weight, starts = decimation.merge(time_s, measurement, weight, starts, merged)

    def unpack(theta: FloatArray) -> Model:
        return begun._replace(jerk=shaped(theta[:knots], theta[knots]), knot_s=knot_s)

    def cost(theta: FloatArray) -> tuple[float, FloatArray]:
        model = unpack(theta)
        found = score_log(time_s, measurement, weight, model, starts)
        by_axis = found.jerk * model.jerk
        walk, ratio = np.diff(theta[:knots]), theta[knots]
        pull = np.r_[WALK_PRECISION * (np.r_[0.0, walk] - np.r_[walk, 0.0]), VERTICAL_PRECISION * ratio]
        penalty = WALK_PRECISION * float(walk @ walk) + VERTICAL_PRECISION * ratio**2
        score = np.r_[by_axis.sum(1), by_axis[:, 5].sum()]
        return -found.log_likelihood + 0.5 * penalty, pull - score

    ratio = math.log(begun.jerk[0, 5] / begun.jerk[0, 0])
    theta = np.r_[np.broadcast_to(np.log(begun.jerk[:, 0]), knots), ratio]
    low, high = (np.r_[np.full(knots, math.log(bound)), side * RATIO_BOUND] for bound, side in JERK_SIDES)
    curvature = np.r_[np.full(knots, 2.0), 0.7 * knots]
    return unpack(optimizer.minimise(cost, theta, curvature, low, high, steps, tolerance=0.1 * knots**0.5))


def median_level(model: Model) -> Model:
    """The model with the median of its jerk profile for all of the flight."""
    level = float(np.median(model.jerk[:, 0]))
    return model._replace(jerk=level * model.jerk[:1] / model.jerk[0, 0], knot_s=np.inf)


def with_allowance(model: Model) -> Model:
    """The model with a little more jerk than is likeliest, and nowhere less than there is in the air."""
    return model._replace(jerk=np.maximum(ALLOWANCE * model.jerk, CALMEST * ISOTROPIC))
