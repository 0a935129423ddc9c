"""Errors on one side in a large share of a component's readings: multipath, late echoes, a mast in the beam.

The estimate follows the mean of the readings, so the honest ones lie on the other side of it. Their place is the peak
of the residuals: normal noise, to which exponential errors of one sign add in a share of the readings, is fitted to
them by maximum likelihood, and the same with errors of either sign, which must be much less likely.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.records import Observations
from ftproc.core.filtering.smoother import SmootherRun
from ftproc.core.identification import optimizer
from ftproc.order_statistics import median

FloatArray = NDArray[np.float64]

FEWEST = 100  # readings of a component, for the shape of their errors to show
SKEW, IN_SIGMAS = 0.1, 3.5  # least skewness of the residuals, and its standard errors, that make the fit worth while
FLAT, FINE = 0.2, 0.4  # the same of what is missing to the kurtosis of 3, where rounding makes less of the 1-sigma
LEANS = 0.15  # skewness from which it is clear on which side the errors are
LEAST_GAIN = 10.0  # in log-likelihood, over errors of either sign
LEAST_SHARE = 0.15  # of the readings
LARGEST, STEPS, TOLERANCE = 6.0, 100, 1e-4  # of a parameter of the fit; of the search for it, and its last gain
CAUTION = 2.0  # times the standard error that the peak would have, if the honest readings were known


class OneSided(NamedTuple):
    """A share of a component's readings have errors of one sign. error: their mean; shift: by how much the readings as
    a whole are too large, and its 1-sigma; m, rad, rad. All are zero where the sign cannot be told."""

    component: int
    share: float
    error: float
    shift: float
    sigma: float


def find(log: Observations, smoothed: SmootherRun, rounding: FloatArray) -> list[OneSided]:
    """The components with such errors, from the residuals of the readings used. rounding: (3,) 1-sigma of it."""
    found = []
    for c in range(3):
        used = (log.weight[:, c] > 0) & (smoothed.residual_variance[:, c] > 0)
        if used.sum() < FEWEST:
            continue
        residual = smoothed.residual[used, c]
        scale = float(np.sqrt(median(smoothed.residual_variance[used, c])))
        scaled = residual / scale
        if not scaled.std() > 0:  # a component that was not measured
            continue
        skew, odd, flat = _shape(scaled)
        flat = flat and float(rounding[c]) < FINE * scale
        if not odd and not flat:
            continue
        either = _likeliest(scaled, True).gain
        fits = sorted(((side, _likeliest(side * scaled, False)) for side in (-1.0, 1.0)), key=lambda fit: fit[1].gain)
        (side, one), other = fits[1], fits[0][1].gain
        place, sigma, share, error = one.theta
        leans = skew * side > LEANS
        if leans and one.gain > max(either, other) + LEAST_GAIN and share > LEAST_SHARE:
            error_of_peak = CAUTION * sigma / math.sqrt((1 - share) * len(scaled))
            found.append(OneSided(c, share, side * error * scale, -side * place * scale, error_of_peak * scale))
        elif flat:
            found.append(OneSided(c, 0.0, 0.0, 0.0, 0.0))
    return found


def _shape(residual: FloatArray) -> tuple[float, bool, bool]:
    """The skewness of residuals (n,), whether that is no chance, and whether they are flatter than normal ones."""
    count, centred = len(residual), (residual - residual.mean()) / residual.std()
    square = centred * centred  # (a power is thirty times as slow)
    skew, missing = float(np.mean(square * centred)), 3 - float(np.mean(square * square))
    return skew, abs(skew) > SKEW + IN_SIGMAS * math.sqrt(6 / count), missing > FLAT + IN_SIGMAS * math.sqrt(24 / count)


def without(log: Observations, errors: Sequence[OneSided]) -> Observations:
    """The log with the readings moved, as a whole, to where the honest ones are."""
    measurement = log.measurement.copy()
    for one in errors:
        measurement[:, one.component] -= one.shift
    return log._replace(measurement=measurement)


class _Fit(NamedTuple):
    """Place and 1-sigma of the normal noise, share and mean of the errors that add to it; and the log-likelihood."""

    theta: tuple[float, float, float, float]
    gain: float


def _likeliest(residual: FloatArray, both: bool) -> _Fit:
    """The fit to residuals (n,) with errors above zero, or of either sign."""

    def cost(theta: FloatArray) -> optimizer.Point:
        found, slope = _log_density(residual - theta[0], theta, both)
        return optimizer.Point(-float(found.sum()), -slope.sum(1), curvature)

    curvature, bound = np.full(4, len(residual) / 4), np.full(4, LARGEST)
    tries = []
    for size in (0.7, 2.0):
        start = np.array([0.0 if both else -0.7, math.log(0.5), 0.0, math.log(size)])
        theta = optimizer.minimise(cost, start, -bound, bound, STEPS, TOLERANCE)
        tries.append((cost(theta).value, theta))
    least, (place, log_sigma, odds, log_error) = min(tries, key=lambda each: each[0])
    return _Fit((float(place), math.exp(log_sigma), 1 / (1 + math.exp(-odds)), math.exp(log_error)), -least)


def _log_density(x: FloatArray, theta: FloatArray, both: bool) -> tuple[FloatArray, FloatArray]:
    """(n,) log-density of errors x, and (4, n) its derivatives by the parameters: place, ln(1-sigma) of the noise,
    log-odds and ln(mean) of the errors that add to it."""
    sigma, error, odds = math.exp(theta[1]), math.exp(theta[3]), theta[2]
    rare, usual = -math.log1p(math.exp(-odds)), -math.log1p(math.exp(odds))
    plain = usual - 0.5 * (x / sigma) ** 2 - math.log(sigma) - 0.5 * math.log(2 * math.pi)
    sides = [_exponential(sign * x, sigma, error) for sign in ((1.0, -1.0) if both else (1.0,))]
    wrong = [rare + density - math.log(len(sides)) for density, _ in sides]
    total = np.logaddexp.reduce([plain, *wrong])
    share = np.exp(plain - total)
    slope = share * np.stack([x / sigma**2, (x / sigma) ** 2 - 1, np.full_like(x, -math.exp(rare)), 0 * x])
    for density, (_, (by_x, by_sigma, by_error)), sign in zip(wrong, sides, (1.0, -1.0), strict=False):
        share = np.exp(density - total)
        slope += share * np.stack([-sign * by_x, by_sigma, np.full_like(x, math.exp(usual)), by_error])
    return total, slope


def _exponential(x: FloatArray, sigma: float, error: float) -> tuple[FloatArray, tuple[FloatArray, ...]]:
    """(n,) log-density of normal noise plus an exponential error, and its derivatives by x, ln(sigma) and ln(error)."""
    from scipy.special import log_ndtr  # for logs with such errors only

    z = x / sigma - sigma / error
    below = log_ndtr(z)
    ratio = np.exp(-0.5 * z**2 - 0.5 * math.log(2 * math.pi) - below)
    density = 0.5 * (sigma / error) ** 2 - x / error - math.log(error) + below
    by_x = ratio / sigma - 1 / error
    by_sigma = (sigma / error) ** 2 - ratio * (x / sigma + sigma / error)
    by_error = x / error - (sigma / error) ** 2 - 1 + ratio * sigma / error
    return density, (by_x, by_sigma, by_error)
