"""Noise and process noise from the log itself: maximum likelihood of the innovations, with exact gradients.

One pass of the smoother gives the score by every parameter at once (Koopman and Shephard 1992). Here the process noise
has one level for the whole log; `profile` lets it follow the flight.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core import odds
from ftproc.core.filtering.initialization import find_starts
from ftproc.core.filtering.memory import Scores
from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.filtering.smoother import likelihood_of, score_log
from ftproc.core.identification import decimation, optimizer
from ftproc.core.identification.scales import EXACT, Scales, scales_of
from ftproc.core.identification.stretches import stretches_of
from ftproc.core.model.motion import isotropic
from ftproc.order_statistics import median
from ftproc.records import FloatArray

LEVEL_STEPS, JERK_STEPS = 12, 4  # of the search for one level of noise and jerk, and of the jerk alone
SPANS, SPAN = 6, 400  # of samples: what stands for a long log when one noise and one process noise are estimated
ASSUMED = 0.03  # of the others' noise, in metres, that is assumed of a component that shows none: nothing moves exactly
NOISE_GROWTH = 3.0  # times the noise that the search begins with: more of it is a diverged track, not noise
NOISE_SHRINKS = 4.0  # less of it comes of readings left out until the rest fits
NOISE_ALLOWED = 1e-4  # 1-sigma, in ranges or rad, that is never too much: a component computed from another shows no
# noise at all to begin with
MEMORIES = (0.1, 3.0)  # intervals and spans of the log: the shortest and the longest memory of a filter
FIRST_MEMORIES = (
    0.1,
    0.3,
    0.8,
    2.0,
    5.0,
    12.0,
    30.0,
)  # intervals, of which the likeliest is where the search for the jerk begins
LONGER = 2.5  # times, from memory to memory, up to as many mean intervals: in bunches the typical one is far too short
UNFORESEEN = 8.0  # times the noise, of a prediction: with more, a reading says nothing of its own noise
NOISE_STEP, NOISE_STEPS = 2.0, 6  # by which the noise is raised, and how often
RATIO_BOUND = 6.0  # on |ln(vertical / horizontal jerk)|
VERTICAL_PRECISION = 0.5  # with which ln(vertical / horizontal jerk) is drawn to zero


class Fixed(NamedTuple):
    """What the user has specified: the noise of each component (3,), and the jerk density."""

    noise: NDArray[np.bool_]
    jerk: bool


def is_long(time_s: FloatArray) -> bool:
    """Whether spans stand for a log with these times (n,) s."""
    return len(time_s) > SPANS * SPAN


def representative(
    log: Observations, starts: list[Start], noise_variance: FloatArray, jerk_psd: float
) -> tuple[Observations, list[Start]]:
    """The whole log if it is short, else SPANS spans spread evenly over it, each with its own start."""
    n = len(log.time_s)
    if not is_long(log.time_s):
        return log, starts
    spans = [slice(first, first + SPAN) for first in np.linspace(0, n - SPAN, SPANS).astype(int).tolist()]
    found = stretches_of(log, spans, noise_variance, jerk_psd)
    return (log, starts) if found is None else found[1:]


def first_jerk(log: Observations, noise_variance: FloatArray, shortest: float = 0.0) -> float:
    """The jerk density, m^2/s^5, with which a search begins: the likeliest of a few. shortest: intervals that the
    filter is to remember at least."""
    scales = scales_of(log, noise_variance)

    def likelihood(jerk_psd: float) -> float:
        starts = find_starts(log, noise_variance, jerk_psd)
        part, starts = representative(log, starts, noise_variance, jerk_psd)
        found = likelihood_of(part, Model(noise_variance, isotropic(jerk_psd)), starts)
        return found if math.isfinite(found) else -math.inf

    memories = [memory for memory in FIRST_MEMORIES if memory >= shortest]
    while memories[-1] * LONGER <= FIRST_MEMORIES[-1] * _bunched(log, scales) < math.inf:
        memories.append(LONGER * memories[-1])
    return max((scales.jerk_psd(memory * scales.interval_s) for memory in memories), key=likelihood)


def _bunched(log: Observations, scales: Scales) -> float:
    """The mean interval of a log, in typical ones: far more than one where readings come in bunches, as of an
    instrument whose angles have stamps milliseconds after those of its ranges."""
    return scales.span_s / max(len(log.time_s) - 1, 1) / scales.interval_s


def without_noise(log: Observations, sigma: FloatArray) -> tuple[NDArray[np.bool_], FloatArray]:
    """(3,) which components show no noise at all, because they were not measured, and (3,) 1-sigma m, rad, rad: those
    given, and what is assumed for these."""
    scales = scales_of(log, sigma**2)
    unit = np.array([1.0, scales.range_m, scales.range_m])
    return scales.exact, np.where(scales.exact, ASSUMED * scales.typical_noise_m, scales.noise_m) / unit


def fit_level(
    log: Observations,
    starts: list[Start],
    guess: Model,
    fixed: Fixed,
    expected_sigma: FloatArray | None = None,
    least_sigma: FloatArray | float = 0.0,
    whole: bool = False,
) -> Model:
    """The likeliest noise variances and single jerk density with its vertical share, starting from `guess`.

    whole: no spans stand for a long log. fixed: what stays as guessed. expected_sigma: (3,) noise that NOISE_GROWTH
    counts from, if not the guess. least_sigma: (3,) that it cannot be below.
    """
    if fixed.noise.all() and fixed.jerk:
        return guess
    part = log
    if not whole:
        part, starts = representative(log, starts, guess.noise_variance, float(guess.jerk[0, 0]))
    scales = scales_of(log, guess.noise_variance)
    log_noise = np.log(guess.noise_variance)
    expected = np.sqrt(guess.noise_variance) if expected_sigma is None else expected_sigma
    smallest = EXACT * scales.typical_noise_m / np.array([1.0, scales.range_m, scales.range_m])
    smallest = np.maximum(smallest, least_sigma)
    floor = 2 * np.log(np.maximum(smallest, expected / NOISE_SHRINKS if expected_sigma is not None else 0.0))
    allowed = NOISE_ALLOWED * np.array([scales.range_m, 1.0, 1.0])
    ceiling = 2 * np.log(np.maximum(NOISE_GROWTH * expected, allowed))
    log_jerk = np.array([math.log(guess.jerk[0, 0]), math.log(guess.jerk[0, 2] / guess.jerk[0, 0])])
    lowest, highest = jerk_bounds(scales)
    lower = np.r_[np.where(fixed.noise, log_noise, floor), log_jerk if fixed.jerk else lowest]
    upper = np.r_[np.where(fixed.noise, log_noise, ceiling), log_jerk if fixed.jerk else highest]

    def cost(theta: FloatArray) -> optimizer.Point:
        found = score_log(part, Model(np.exp(theta[:3]), shaped(theta[3:4], theta[4])), starts)
        level = of_level(found, theta[4])
        slope, curvature = np.r_[-found.noise.score, level.gradient], np.r_[found.noise.curvature, level.curvature]
        return optimizer.Point(level.value, slope, curvature)

    theta = np.clip(np.r_[log_noise, log_jerk], lower, upper)
    theta = optimizer.minimise(cost, theta, lower, upper, LEVEL_STEPS, tolerance=0.05)
    return Model(np.exp(theta[:3]), shaped(theta[3:4], theta[4]))


def most_noise(log: Observations, model: Model, starts: list[Start], predicted_sigma: FloatArray) -> Model | None:
    """The model with as much noise of each component as the log does not exclude, where motion and noise are poorly
    distinguished; None where they are well, by the 1-sigma (n, 3) of the innovations."""
    used = log.weight > 0
    foreseen = [median(predicted_sigma[used[:, c], c]) if used[:, c].any() else 0.0 for c in range(3)]
    doubtful = np.flatnonzero(np.array(foreseen) > UNFORESEEN * np.sqrt(model.noise_variance))
    if not doubtful.size:
        return None
    least, most = likelihood_of(log, model, starts) - odds.POSSIBLE, model.noise_variance.copy()
    for _ in range(NOISE_STEPS):
        before = most.copy()
        for c in doubtful:
            more = most.copy()
            more[c] *= NOISE_STEP**2
            if likelihood_of(log, model._replace(noise_variance=more), starts) >= least:
                most = more
        if (most == before).all():
            break
    return model._replace(noise_variance=most)


def jerk_bounds(scales: Scales) -> tuple[FloatArray, FloatArray]:
    """The lowest and the highest ln(jerk density) and ln(vertical / horizontal), (2,) each."""
    shortest, longest = MEMORIES[0] * scales.interval_s, MEMORIES[1] * scales.span_s
    low, high = math.log(scales.jerk_psd(longest)), math.log(scales.jerk_psd(shortest))
    return np.array([low, -RATIO_BOUND]), np.array([high, RATIO_BOUND])


def shaped(log_jerk: FloatArray, log_ratio: float) -> FloatArray:
    """(m, 3) jerk densities from ln of the horizontal one (m,) and ln of vertical over horizontal."""
    densities: FloatArray = np.exp(log_jerk)[:, None] * np.array([1.0, 1.0, math.exp(log_ratio)])
    return densities


def of_level(found: Scores, log_ratio: float) -> optimizer.Point:
    """Minus the log-likelihood, with what is known beforehand of the ratio, by ln(jerk) of a single level and by
    ln(vertical / horizontal)."""
    score, curvature, pull = found.jerk.score[0], found.jerk.curvature[0], VERTICAL_PRECISION * log_ratio
    return optimizer.Point(
        -found.log_likelihood + 0.5 * pull * log_ratio,
        np.array([-score.sum(), pull - score[2]]),
        np.array([curvature.sum(), curvature[2] + VERTICAL_PRECISION]),
    )


def fit_jerk(log: Observations, starts: list[Start], model: Model) -> Model:
    """The likeliest constant process noise with its vertical share, from the model's; the noise stays."""
    scales = scales_of(log, model.noise_variance)
    lower, upper = jerk_bounds(scales)
    if log.sites is None:
        log, starts = decimation.merged(log, starts, decimation.how_many(scales, model, math.inf))

    def cost(theta: FloatArray) -> optimizer.Point:
        return of_level(score_log(log, model._replace(jerk=shaped(theta[:1], theta[1])), starts), theta[1])

    jerk = np.median(model.jerk, 0)
    theta = np.clip(np.array([math.log(jerk[0]), math.log(jerk[2] / jerk[0])]), lower, upper)
    theta = optimizer.minimise(cost, theta, lower, upper, JERK_STEPS, tolerance=0.1)
    return model._replace(jerk=shaped(theta[:1], theta[1]), knot_s=math.inf)
