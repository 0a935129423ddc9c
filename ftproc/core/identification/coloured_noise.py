"""Noise that is correlated from sample to sample, which a white-noise likelihood takes for motion.

Each component's noise is white noise of variance r plus a first-order Gauss-Markov offset of variance w and correlation
time tau, which is part of the state (`filters.Coloured`). r, w, tau and the jerk density are found together by maximum
likelihood: motion is smooth and common to the three components, such an offset is neither. The scores by r, w and the
jerk are exact; those by tau are differences.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ftproc.core import odds
from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.filtering.smoother import SmootherRun, likelihood_of, score_log
from ftproc.core.identification import optimizer
from ftproc.core.identification.likelihood import Fixed, fit_level, jerk_bounds, of_level, representative, shaped
from ftproc.core.identification.profile import fit_profile
from ftproc.core.identification.scales import Scales, scales_of
from ftproc.order_statistics import median
from ftproc.records import FloatArray

LEAST = 0.1  # correlation of neighbours from which the noise may not be white ...
LEAST_IN_SIGMAS = 3.0  # ... if so many of its own standard errors away from zero
FEWEST_PAIRS = 30  # neighbours, for their correlation to be asked for
BLOCKS = 9  # stretches of a log whose correlations are compared
SHORT_MEMORY = (
    4.0  # intervals: a filter with a shorter one follows noise that is correlated, so its residuals show none
)
FIRST_TAUS = (1.5, 6.0, 25.0)  # intervals: correlation times with which the search begins,
FIRST_SHARES = (1.0, 1e-3)  # and shares of the jerk that white noise leads to
FIRST_STEPS, STEPS, PROFILE_STEPS = 5, 15, 3
SHORTEST_TAU, LONGEST_TAU = 0.3, 0.5  # intervals, and spans of the log
LARGEST = 1e4  # times the variance that white noise would have
NEGLIGIBLE = 0.02  # share of a component's variance, and correlation of neighbours
INDEPENDENT = 20.0  # correlation times that a log must last for noise and motion to be separated


class Coloured(NamedTuple):
    """The likeliest model with correlated noise, and those whose noise is correlated over as short, and over as long a
    time, as the log allows. likelier: the first is likelier than that of white noise by odds.SURE for each component;
    possible: by that once. separable: the log lasts long enough to tell such noise, if it is fast, from motion."""

    model: Model
    fastest: Model
    slowest: Model
    likelier: bool
    possible: bool
    separable: bool


def may_be(log: Observations, smoothed: SmootherRun, model: Model) -> bool:
    """Whether correlated noise is worth asking for, of a smoother run with a model of white noise.

    By the median of the correlations of BLOCKS stretches of the log: a patch that the smoother has followed resembles
    correlated noise, but only where it is. And where the filter's memory is so short that it would follow such noise.
    """
    scales = scales_of(log, model.noise_variance)
    if scales.memory_samples(median(model.jerk[:, 0])) < SHORT_MEMORY:
        return True
    used = log.weight > 0
    share = model.noise_variance / smoothed.residual_variance  # of the reading in its own smoothed residual
    residual = smoothed.residual * share
    lost = model.noise_variance * np.maximum(1 - share, 0.0)
    for c in range(3):
        both = used[1:, c] & used[:-1, c]
        if both.sum() < FEWEST_PAIRS:
            continue
        r, a = residual[:, c], lost[:, c]
        square, product = (r * r + a)[used[:, c]], (r[1:] * r[:-1] + np.sqrt(a[1:] * a[:-1]))[both]
        blocks = zip(np.array_split(product, BLOCKS), np.array_split(square, BLOCKS), strict=True)
        typical = median(np.array([pairs.mean() / alone.mean() for pairs, alone in blocks]))
        if typical > max(LEAST, LEAST_IN_SIGMAS / math.sqrt(len(square))):
            return True
    return False


def fit_coloured(log: Observations, starts: list[Start], white: Model, fixed: Fixed) -> Coloured:
    """The likeliest model with correlated noise and constant process noise, from one that took it for white."""
    part, starts = representative(log, starts, white.noise_variance, float(white.jerk[0, 0]))
    scales = scales_of(part, white.noise_variance)
    search = _Search(part, starts, white, fixed, scales)
    tries = [search.run(search.first(tau, share), FIRST_STEPS) for tau in FIRST_TAUS for share in FIRST_SHARES]
    theta = search.run(min(tries, key=lambda theta: search.cost(theta).value), STEPS)
    found = [search.model(theta), *(search.model(search.along(theta, factor)) for factor in (0.5, 2.0))]
    model = found[0]
    neighbours = np.exp(-scales.interval_s / model.tau_s) * model.markov_variance / model.reading_variance
    correlated = neighbours > NEGLIGIBLE
    model, fastest, slowest = (
        each._replace(markov_variance=np.where(correlated, each.markov_variance, 0.0)) for each in found
    )
    level = fit_profile(part, starts, fit_level(part, starts, white, fixed), PROFILE_STEPS)
    gain = likelihood_of(part, fit_profile(part, starts, model, PROFILE_STEPS), starts)
    gain -= likelihood_of(part, level, starts)
    return Coloured(
        model,
        fastest,
        slowest,
        likelier=bool(correlated.any()) and gain > odds.SURE * int(correlated.sum()),
        possible=bool(correlated.any()) and gain > odds.SURE,
        separable=float(fastest.tau_s[correlated].max(initial=0.0)) < scales.span_s / INDEPENDENT,
    )


class _Search:
    """The likelihood of a log as a function of ln r, ln w, ln tau (3 each), ln(jerk) and ln(vertical / horizontal)."""

    def __init__(self, log: Observations, starts: list[Start], white: Model, fixed: Fixed, scales: Scales) -> None:
        self.log, self.starts, self.white, self.scales = log, starts, white, scales
        given = np.log(white.noise_variance)
        low, high = jerk_bounds(scales)
        level = np.array([math.log(white.jerk[0, 0]), math.log(white.jerk[0, 2] / white.jerk[0, 0])])
        if fixed.jerk:
            low = high = level
        taus = np.log(np.array([SHORTEST_TAU * scales.interval_s, LONGEST_TAU * scales.span_s]))
        fewest = np.where(fixed.noise, 0.0, math.log(NEGLIGIBLE / LARGEST))
        most = np.where(fixed.noise, 0.0, math.log(LARGEST))
        none = np.where(fixed.noise, math.log(NEGLIGIBLE) - 1.0, 0.0)  # noise that is specified is white
        self.lower = np.r_[given + fewest, given + fewest + none, np.full(3, taus[0]), low]
        self.upper = np.r_[given + np.minimum(most, 1.0), given + most + none, np.full(3, max(taus)), high]
        self.of_taus = np.full(3, 0.05 * float((log.weight > 0).sum(0).mean()))  # curvature

    def first(self, tau: float, share: float) -> FloatArray:
        """Where a search begins: with half of the noise correlated over `tau` intervals, and so much of the jerk."""
        given, jerk = np.log(0.5 * self.white.noise_variance), self.white.jerk[0]
        motion = [math.log(share * jerk[0]), math.log(jerk[2] / jerk[0])]
        theta = np.r_[given, given, np.full(3, math.log(tau * self.scales.interval_s)), motion]
        return np.asarray(np.clip(theta, self.lower, self.upper), np.float64)

    def model(self, theta: FloatArray) -> Model:
        """The model of some parameters."""
        white, markov, tau = np.exp(theta[:9]).reshape(3, 3)
        return Model(white, shaped(theta[9:10], theta[10]), markov_variance=markov, tau_s=tau)

    def cost(self, theta: FloatArray) -> optimizer.Point:
        """Minus the log-likelihood."""
        found = score_log(self.log, self.model(theta), self.starts)
        level, variances = of_level(found, theta[10]), (found.noise, found.markov)
        slope = np.r_[*(-each.score for each in variances), -found.tau, level.gradient]
        curvature = np.r_[*(each.curvature for each in variances), self.of_taus, level.curvature]
        return optimizer.Point(level.value, slope, curvature)

    def along(self, theta: FloatArray, factor: float) -> FloatArray:
        """The parameters with offsets as much slower and larger, or faster and smaller, as the log does not refute.
        Over a few samples an offset of twice the variance and twice the correlation time is the same, and what is
        slower than that, motion."""
        for c in range(3):
            least = likelihood_of(self.log, self.model(theta), self.starts) - odds.REFUTED
            while True:
                other = theta.copy()
                other[[3 + c, 6 + c]] += math.log(factor)
                inside = (other >= self.lower).all() and (other <= self.upper).all()
                if not inside or likelihood_of(self.log, self.model(other), self.starts) < least:
                    break
                theta = other
        return theta

    def run(self, theta: FloatArray, steps: int) -> FloatArray:
        """The likeliest parameters, after so many steps at most."""
        return optimizer.minimise(self.cost, theta, self.lower, self.upper, steps, tolerance=0.05)
