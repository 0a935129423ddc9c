"""Noise and manoeuvre level from the log itself: maximum likelihood of the innovations, with exact gradients.

One pass of the smoother gives the score by every parameter at once (Koopman and Shephard 1992), so a jerk density
for every few seconds of the flight costs no more than a single one. Its logarithm is a random walk from knot to
knot: where the data say little, neighbours decide.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ftproc.core import ascent
from ftproc.core.forward import Model, Start
from ftproc.core.smoother import smooth_log

FloatArray = NDArray[np.float64]

NOISE_FLOOR = np.array([1e-3, 1e-7, 1e-7])  # 1-sigma m, rad, rad: below it, rounding of the readings decides
NOISE_CEILING = np.array([1e5, 1.0, 1.0])
JERK_BOUNDS = (1e-7, 1e7)  # m^2/s^5
KNOT_SAMPLES = 20  # samples to a knot of the jerk profile ...
KNOT_SECONDS = 8.0  # ... but never less than so many seconds,
MAX_KNOTS = 400  # nor more than so many knots
WALK_PRECISION = 0.5  # of the random walk of ln(jerk) from knot to knot


def fit_level(
    time_s: FloatArray,
    measurement: FloatArray,
    weight: FloatArray,
    starts: list[Start],
    guess: Model,
    fix_noise: NDArray[np.bool_],
    fix_jerk: bool,
    steps: int = 12,
) -> Model:
    """The likeliest noise variances and single jerk density, from the model `guess` on.

    fix_noise: (3,) components whose noise stays as guessed. fix_jerk: the jerk density stays.
    """
    if fix_noise.all() and fix_jerk:
        return guess
    floor, ceiling = 2 * np.log(NOISE_FLOOR), 2 * np.log(NOISE_CEILING)
    log_noise, log_jerk = np.log(guess.noise_variance), math.log(guess.jerk[0, 0])
    lower = np.r_[np.where(fix_noise, log_noise, floor), log_jerk if fix_jerk else math.log(JERK_BOUNDS[0])]
    upper = np.r_[np.where(fix_noise, log_noise, ceiling), log_jerk if fix_jerk else math.log(JERK_BOUNDS[1])]
    used = np.maximum((weight > 0).sum(0), 1)

    def cost(theta: FloatArray) -> tuple[float, FloatArray]:
        model = Model(np.exp(theta[:3]), math.exp(theta[3]) * ISOTROPIC)
        run = smooth_log(time_s, measurement, weight, model, starts)
        score = float(run.jerk_score[0] @ ISOTROPIC[0]) * math.exp(theta[3])
        return -run.log_likelihood, -np.r_[run.noise_score, score]

    theta = np.clip(np.r_[log_noise, log_jerk], lower, upper)
    curvature = np.r_[used / 2, used.mean() / 20]
    theta = ascent.minimise(cost, theta, curvature, lower, upper, steps, tolerance=0.05)
    return Model(np.exp(theta[:3]), math.exp(theta[3]) * ISOTROPIC)


ISOTROPIC = np.array([[1.0, 0.0, 0.0, 1.0, 0.0, 1.0]])


def fit_profile(
    time_s: FloatArray,
    measurement: FloatArray,
    weight: FloatArray,
    starts: list[Start],
    level: Model,
    steps: int = 15,
) -> Model:
    """A jerk density that follows the flight, knot by knot, from the single level on; the noise stays."""
    span = time_s[-1] - time_s[0]
    interval = np.median(np.diff(time_s)) if len(time_s) > 1 else 1.0
    knot_s = max(KNOT_SECONDS, KNOT_SAMPLES * float(interval), float(span) / MAX_KNOTS)
    knots = max(math.ceil(span / knot_s), 1)
    if knots == 1:
        return level

    def cost(theta: FloatArray) -> tuple[float, FloatArray]:
        run = smooth_log(time_s, measurement, weight, unpack(theta), starts)
        score = (run.jerk_score @ ISOTROPIC[0]) * np.exp(theta)
        walk = np.diff(theta)
        pull = WALK_PRECISION * (np.r_[0.0, walk] - np.r_[walk, 0.0])
        return -run.log_likelihood + 0.5 * WALK_PRECISION * float(walk @ walk), -score + pull

    def unpack(theta: FloatArray) -> Model:
        return level._replace(jerk=np.exp(theta)[:, None] * ISOTROPIC, knot_s=knot_s)

    low, high = math.log(JERK_BOUNDS[0]), math.log(JERK_BOUNDS[1])
    theta = np.full(knots, math.log(level.jerk[0, 0]))
    theta = ascent.minimise(
        cost, theta, np.full(knots, 2.0), np.full(knots, low), np.full(knots, high), steps, tolerance=0.05 * knots**0.5
    )
    return unpack(theta)
