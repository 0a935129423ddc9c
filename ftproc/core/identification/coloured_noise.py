"""Noise that is correlated from sample to sample, which a white-noise likelihood takes for motion.

For first-order (Gauss-Markov) noise of variance sigma^2 and correlation rho between neighbours, a filter that is
slow against the noise sees white noise of variance R = sigma^2 (1 + rho) / (1 - rho): its long-run average is the
same. With R in place of sigma^2 the estimate keeps its gain and its sigmas stay honest. sigma^2 and rho are found by
a fixed point: with r the smoothed residual and a = H P^s H' its loss to the fit,

    sigma^2 = mean(r_k^2 + a_k),    rho sigma^2 = mean(r_k r_{k+1} + sqrt(a_k a_{k+1}))

and the jerk density by the likelihood of every m-th sample, thinned until neighbours know nothing of each other.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.filtering.smoother import SmootherRun, smooth_log
from ftproc.core.identification.likelihood import Fixed, fit_level

FloatArray = NDArray[np.float64]

LEAST = 0.15  # correlation of neighbours that is worth modelling ...
LEAST_IN_SIGMAS = 5.0  # ... if so many of its own standard errors away from zero
MOST = 0.98
FEWEST_INDEPENDENT = 30  # readings of each component that the correlation must leave worth of
GROWTH = 60.0  # times the variance that white noise would have
INDEPENDENT = 0.1  # correlation left between the samples that remain after thinning
FEWEST = 60  # samples that must remain
FEWEST_PAIRS = 200  # neighbours, for their correlation to be asked for
ITERATIONS = 8
BLOCKS = 9  # stretches of a log whose correlations are compared


def moments(smoothed: SmootherRun, weight: FloatArray, noise_variance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(3,) variance of the readings' noise and (3,) its correlation between neighbouring samples.

    noise_variance: (3,) R that the smoother was given.
    """
    variance, correlation = noise_variance.copy(), np.zeros(3)
    for c, (square, product) in enumerate(_products(smoothed, weight, noise_variance)):
        if len(product) >= FEWEST_PAIRS:
            variance[c] = square.mean()
            correlation[c] = product.mean() / variance[c]
    return variance, correlation


def is_correlated(smoothed: SmootherRun, weight: FloatArray, noise_variance: FloatArray) -> bool:
    """Whether some component's noise is correlated beyond doubt.

    By the median of the correlations of BLOCKS stretches of the log: a patch that the smoother has followed looks like
    correlated noise, but only where it is."""
    for square, product in _products(smoothed, weight, noise_variance):
        if len(product) < FEWEST_PAIRS:
            continue
        typical = np.median(
            [
                pairs.mean() / alone.mean()
                for pairs, alone in zip(np.array_split(product, BLOCKS), np.array_split(square, BLOCKS), strict=True)
            ]
        )
        if typical > max(LEAST, LEAST_IN_SIGMAS / math.sqrt(len(square))):
            return True
    return False


def _products(
    smoothed: SmootherRun, weight: FloatArray, noise_variance: FloatArray
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Of each component, what estimates sigma^2 at each reading used, and rho sigma^2 at each pair of neighbours."""
    used = weight > 0
    share = noise_variance / smoothed.residual_variance  # of the reading in its own smoothed residual
    residual = smoothed.residual * share
    lost = noise_variance * np.maximum(1 - share, 0.0)
    for c in range(3):
        both = used[1:, c] & used[:-1, c]
        r, a = residual[:, c], lost[:, c]
        square = (r * r + a)[used[:, c]]
        yield square, (r[1:] * r[:-1] + np.sqrt(a[1:] * a[:-1]))[both]


def fit_coloured(log: Observations, starts: list[Start], white: Model, fixed: Fixed) -> Model:
    """A model with correlated noise, from one that took it for white; that one if none is believable."""
    given = white.noise_variance
    model, variance = white, white.noise_variance
    run = smooth_log(log, white, starts, residuals_only=True)
    correlation = np.maximum(moments(run, log.weight, given)[1], 0.0)
    for _ in range(2):
        model = _fit_thinned(log, starts, model._replace(noise_variance=variance), correlation, fixed)
        for _ in range(ITERATIONS):
            model = model._replace(
                noise_variance=variance * (1 + correlation) / (1 - correlation), correlation=correlation
            )
            run = smooth_log(log, model, starts, residuals_only=True)
            if not math.isfinite(run.log_likelihood):  # the filter diverged among so few readings
                return white
            variance, correlation = moments(run, log.weight, model.noise_variance)
            variance = np.where(fixed.noise, given, variance)
            correlation = np.clip(correlation, 0.0, MOST)
    # Slow motion and slow noise look alike; where the search ends among the slowest, it has mistaken one for the other.
    independent = (log.weight > 0).sum(0) * (1 - correlation) / (1 + correlation)
    believable = (independent > FEWEST_INDEPENDENT) & (variance < GROWTH * given)
    return model if believable.all() else white


def _fit_thinned(log: Observations, starts: list[Start], model: Model, correlation: FloatArray, fixed: Fixed) -> Model:
    """Noise and jerk by the likelihood of every m-th sample, which is nearly white."""
    highest = float(np.clip(correlation.max(), INDEPENDENT, MOST))
    every = min(math.ceil(math.log(INDEPENDENT) / math.log(highest)), max(len(log.time_s) // FEWEST, 1))
    thinned = np.zeros_like(log.weight)
    thinned[::every] = log.weight[::every]
    guess = model._replace(correlation=np.zeros(3))
    return fit_level(log._replace(weight=thinned), starts, guess, fixed)
