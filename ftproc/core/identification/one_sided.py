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

from ftproc.core.compiled import kernel, part
from ftproc.core.filtering.records import Observations
from ftproc.core.identification import optimizer
from ftproc.core.signatures import Vector
from ftproc.order_statistics import median

FloatArray = NDArray[np.float64]

FEWEST = 100  # readings of a component, for the shape of their errors to show
SPANS, SPAN = 8, 1000  # of samples, spread over a log, that show the least skewness as clearly as all would
SKEW, IN_SIGMAS = 0.1, 3.5  # least skewness of the residuals, and its standard errors, that make the fit worth while
FLAT, FINE = 0.2, 0.4  # the same of what is missing to the kurtosis of 3, where rounding makes less of the 1-sigma
LEANS = 0.15  # skewness from which it is clear on which side the errors are
LEAST_GAIN = 10.0  # in log-likelihood, over errors of either sign
LEAST_SHARE = 0.15  # of the readings
LARGEST, STEPS, TOLERANCE = 6.0, 100, 1e-4  # of a parameter of the fit; of the search for it, and its last gain
LOG_ROOT_TWO_PI = 0.5 * math.log(2 * math.pi)
FAR_BELOW = -20.0  # sigmas
NOWHERE = (-math.inf, 0.0, 0.0, 0.0)  # the log-density of errors that there are not, and its slope
CAUTION = 2.0  # times the standard error that the peak would have, if the honest readings were known


class OneSided(NamedTuple):
    """A share of a component's readings have errors of one sign. error: their mean; shift: by how much the readings as
    a whole are too large, and its 1-sigma; m, rad, rad. All are zero where the sign cannot be told."""

    component: int
    share: float
    error: float
    shift: float
    sigma: float


def spread(samples: int) -> NDArray[np.bool_]:
    """(samples,) those whose residuals are asked for: SPANS spans of a long log."""
    asked = np.ones(samples, bool)
    if samples > SPANS * SPAN:
        asked[:] = False
        for first in np.linspace(0, samples - SPAN, SPANS).astype(int):
            asked[first : first + SPAN] = True
    return asked


def find(weight: FloatArray, residual: FloatArray, variance: FloatArray, rounding: FloatArray) -> list[OneSided]:
    """The components with such errors. weight (n, 3): zero for readings that are not used. residual, variance: (n, 3)
    leave-one-out, NaN where not known. rounding: (3,) 1-sigma of it."""
    found = []
    for c in range(3):
        used = (weight[:, c] > 0) & (variance[:, c] > 0)
        if used.sum() < FEWEST:
            continue
        scale = math.sqrt(median(variance[used, c]))
        scaled = residual[used, c] / scale
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
        slope = np.empty(4)
        return optimizer.Point(-_log_likelihood(residual, theta, both, slope), -slope, curvature)

    curvature, bound = np.full(4, len(residual) / 4), np.full(4, LARGEST)
    tries = []
    for size in (0.7, 2.0):
        start = np.array([0.0 if both else -0.7, math.log(0.5), 0.0, math.log(size)])
        theta = optimizer.minimise(cost, start, -bound, bound, STEPS, TOLERANCE)
        tries.append((cost(theta).value, theta))
    least, (place, log_sigma, odds, log_error) = min(tries, key=lambda each: each[0])
    return _Fit((float(place), math.exp(log_sigma), 1 / (1 + math.exp(-odds)), math.exp(log_error)), -least)


@kernel
def _log_likelihood(residual: Vector, theta: Vector, both: bool, slope: Vector) -> float:
    """Of residuals (n,); fills its slope (4,) by the parameters theta (4,): place, ln(1-sigma) of the noise, log-odds
    and ln(mean) of the errors that add to it. both: these are of either sign."""
    sigma, error = math.exp(theta[1]), math.exp(theta[3])
    rare, usual = -math.log1p(math.exp(-theta[2])), -math.log1p(math.exp(theta[2]))
    of_side, peak = rare - math.log(2.0 if both else 1.0), usual - math.log(sigma) - LOG_ROOT_TWO_PI
    slope[:] = 0.0
    likelihood = 0.0
    for k in range(len(residual)):
        x = residual[k] - theta[0]
        plain = peak - 0.5 * (x / sigma) ** 2
        above, above_x, above_sigma, above_error = _exponential(x, sigma, error)
        below, below_x, below_sigma, below_error = _exponential(-x, sigma, error) if both else NOWHERE
        above, below = above + of_side, below + of_side
        top = max(plain, above, below)
        total = top + math.log(math.exp(plain - top) + math.exp(above - top) + math.exp(below - top))
        likelihood += total
        right, over, under = math.exp(plain - total), math.exp(above - total), math.exp(below - total)
        slope[0] += right * x / sigma**2 - over * above_x + under * below_x
        slope[1] += right * ((x / sigma) ** 2 - 1) + over * above_sigma + under * below_sigma
        slope[2] += (over + under) * math.exp(usual) - right * math.exp(rare)
        slope[3] += over * above_error + under * below_error
    return likelihood


@part
def _exponential(x: float, sigma: float, error: float) -> tuple[float, float, float, float]:
    """Log-density of normal noise plus an exponential error, and its derivatives by x, ln(sigma) and ln(error)."""
    z = x / sigma - sigma / error
    below = _log_share_below(z)
    ratio = math.exp(-0.5 * z * z - LOG_ROOT_TWO_PI - below)
    density = 0.5 * (sigma / error) ** 2 - x / error - math.log(error) + below
    by_sigma = (sigma / error) ** 2 - ratio * (x / sigma + sigma / error)
    by_error = x / error - (sigma / error) ** 2 - 1 + ratio * sigma / error
    return density, ratio / sigma - 1 / error, by_sigma, by_error


@part
def _log_share_below(z: float) -> float:
    """ln of the share of normal noise that lies below z sigmas; far below, where that share is no number any more, by
    its asymptotic series."""
    if z > FAR_BELOW:
        return math.log(0.5 * math.erfc(-z * math.sqrt(0.5)))
    s = 1 / (z * z)
    series = 1 - s * (1 - s * (3 - s * (15 - s * (105 - s * 945))))
    return -0.5 * z * z - math.log(-z) - LOG_ROOT_TWO_PI + math.log(series)
