"""The ensemble Kalman filter for any system x <- f(x) + w, z = h(x) + v with white noises (Evensen 1994; in the form
of Shao et al. 2020, eqs 7 to 17 and 19).

Members are the rows of an (n, d) array. f and h are functions of all members at once; nothing is known of them but
their values. Differences of readings are taken by a function of the caller's, which may wrap angles; means of
readings are taken of such differences, so that they hold across the cut.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class Sensor(NamedTuple):
    """measure: h, (n, d) members -> (n, m) readings. subtract: a minus b of readings (..., m), angles the short way
    round; NaN where either is. noise: (m, m) covariance of v."""

    measure: Callable[[FloatArray], FloatArray]
    subtract: Callable[[FloatArray, FloatArray], FloatArray]
    noise: FloatArray


class Forecast(NamedTuple):
    """Predicted members before a reading, and what the reading says of them, in its `used` (m,) finite components.

    members (n, d), mean (d,); innovation (m,) reading minus h(mean); covariance (m, m) of the innovation, P_in, and
    its inverse; gain (d, m); rho: the normalised innovation (eq. 17).
    """

    members: FloatArray
    mean: FloatArray
    reading: FloatArray
    sensor: Sensor
    used: NDArray[np.intp]
    innovation: FloatArray
    covariance: FloatArray
    inverse: FloatArray
    gain: FloatArray
    rho: float

    @property
    def freedom(self) -> int:
        """Degrees of freedom of rho."""
        return len(self.used)


class Analysis(NamedTuple):
    """Members (n, d) after a reading, the estimate (d,), and gamma: how far the reading was used, 0 to 1."""

    members: FloatArray
    estimate: FloatArray
    gamma: float


def draw(mean: FloatArray, covariance: FloatArray, members: int, rng: Generator) -> FloatArray:
    """(members, d) from a normal distribution."""
    return mean + rng.standard_normal((members, len(mean))) @ root(covariance).T


def root(covariance: FloatArray) -> FloatArray:
    """Lower Cholesky factor; what rounding or too few members took from a covariance is made up with as little as
    works, scaled component by component because units differ."""
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    correlation = covariance / np.outer(scale, scale)
    for added in (0.0, 1e-12, 1e-9, 1e-6):
        try:
            return scale[:, None] * np.linalg.cholesky(correlation + added * np.eye(len(scale)))
        except np.linalg.LinAlgError:
            continue
    values, vectors = np.linalg.eigh(correlation)
    patched = (vectors * np.maximum(values, 1e-6)) @ vectors.T
    return scale[:, None] * np.linalg.cholesky(patched)


def spread(members: FloatArray) -> FloatArray:
    """(d, d) sample covariance."""
    deviation = members - members.mean(0)
    covariance: FloatArray = deviation.T @ deviation / (len(members) - 1)
    return covariance


def misfit(members: FloatArray, reading: FloatArray, sensor: Sensor, used: NDArray[np.intp]) -> FloatArray:
    """(n, m) reading minus h(member), of the used components."""
    return sensor.subtract(reading, sensor.measure(members))[:, used]


def forecast(members: FloatArray, reading: FloatArray, sensor: Sensor) -> Forecast | None:
    """Hold the predicted members (n, d) against a reading (m,), of which some may be NaN; None when all are."""
    used = np.flatnonzero(np.isfinite(reading))
    if not len(used):
        return None
    mean = members.mean(0)
    deviation = members - mean
    expected = sensor.measure(mean[None])
    away = sensor.subtract(sensor.measure(members), expected)[:, used]
    away -= away.mean(0)
    covariance = away.T @ away / (len(members) - 1) + sensor.noise[np.ix_(used, used)]
    inverse = np.asarray(np.linalg.inv(covariance), np.float64)
    gain = deviation.T @ away / (len(members) - 1) @ inverse
    innovation = sensor.subtract(reading, expected)[0, used]
    rho = float(innovation @ inverse @ innovation)
    return Forecast(members, mean, reading, sensor, used, innovation, covariance, inverse, gain, rho)


def corrected(known: Forecast, gamma: float, rng: Generator) -> FloatArray:
    """(n, d) members of the analysis, X + gamma K (z + v - h(X)), each with a draw of v of its own (eqs 14, 19)."""
    if gamma == 0.0:
        return known.members
    readings = np.tile(known.reading, (len(known.members), 1))
    noise = root(known.sensor.noise[np.ix_(known.used, known.used)])
    readings[:, known.used] += rng.standard_normal((len(readings), known.freedom)) @ noise.T
    off = known.sensor.subtract(readings, known.sensor.measure(known.members))[:, known.used]
    moved: FloatArray = known.members + gamma * (off @ known.gain.T)
    return moved


def enkf(known: Forecast, rng: Generator) -> Analysis:
    """The ensemble Kalman filter's update."""
    members = corrected(known, 1.0, rng)
    return Analysis(members, members.mean(0), 1.0)
