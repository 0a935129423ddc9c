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

FloatArray = NDArray[np.float64]

FEWEST = 100  # readings of a component, for the shape of their errors to show
SKEW, IN_SIGMAS = 0.1, 3.5  # least skewness of the residuals, and its standard errors, that make the fit worth while
FLAT, FINE = 0.2, 0.4  # the same of what is missing to the kurtosis of 3, where rounding makes less of the 1-sigma
LEANS = 0.15  # skewness from which it is clear on which side the errors are
LEAST_GAIN = 10.0  # in log-likelihood, over errors of either sign
LEAST_SHARE = 0.15  # of the readings
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
        scale = float(np.sqrt(np.median(smoothed.residual_variance[used, c])))
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
    skew, missing = float(np.mean(centred**3)), 3 - float(np.mean(centred**4))
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
    from scipy.optimize import minimize
    from scipy.special import expit, log_ndtr  # for logs with such errors only

    def exponential(x: FloatArray, sigma: float, error: float) -> FloatArray:
        """Log-density of normal noise plus an exponential error."""
        density: FloatArray = (
            0.5 * (sigma / error) ** 2 - x / error - math.log(error) + log_ndtr(x / sigma - sigma / error)
        )
        return density

    def natural(theta: FloatArray) -> tuple[float, float, float, float]:
        place, log_sigma, odds, log_error = (float(v) for v in theta)
        return place, math.exp(log_sigma), float(expit(odds)), math.exp(log_error)

    def cost(theta: FloatArray) -> float:
        place, sigma, share, error = natural(np.clip(theta, -6.0, 6.0))
        x = residual - place
        plain = -0.5 * (x / sigma) ** 2 - math.log(sigma) - 0.5 * math.log(2 * math.pi)
        wrong = exponential(x, sigma, error)
        if both:
            wrong = np.logaddexp(wrong, exponential(-x, sigma, error)) - math.log(2)
        return -float(np.sum(np.logaddexp(math.log1p(-share) + plain, math.log(share) + wrong)))

    starts = [np.array([0.0 if both else -0.7, math.log(0.5), 0.0, math.log(size)]) for size in (0.7, 2.0)]
    found = min(
        (minimize(cost, s, method="Nelder-Mead", options={"maxiter": 400}) for s in starts), key=lambda f: f.fun
    )
    return _Fit(natural(np.clip(found.x, -6.0, 6.0)), -float(found.fun))
