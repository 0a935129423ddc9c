"""The adaptive Kalman filter of one component: value, rate and acceleration, with a gain that yields to outliers and
a noise that is estimated on the way (Sage and Husa 1969); the first half of the wavelet method's reconstruction."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part
from ftproc.core.model import motion
from ftproc.core.model.measurement import wrap_angle
from ftproc.core.signatures import Matrix, Vector

FloatArray = NDArray[np.float64]

FULL_AT, ZERO_AT = 3.0, 8.0  # sigmas: the gain is whole up to the first, and 0 beyond the second
FORGETTING = 0.98
NOISE_RANGE = 10.0  # times the given noise variance, up and down
MOST_REJECTED = 25  # in a row: then the filter is re-initialized at the reading
AGAIN = 100.0  # times the variances that it first had


@part
def _predict(x: FloatArray, p: FloatArray, t: float, jerk: float, q: FloatArray) -> None:
    """x <- Phi x, P <- Phi P Phi' + Q of one axis, in place; q is scratch (3, 3)."""
    h = 0.5 * t * t
    x[0] += t * x[1] + h * x[2]
    x[1] += t * x[2]
    motion.noise_coefficients(t, q)
    p00 = p[0, 0] + 2 * t * p[0, 1] + 2 * h * p[0, 2] + t * t * p[1, 1] + 2 * t * h * p[1, 2] + h * h * p[2, 2]
    p01 = p[0, 1] + t * p[0, 2] + t * p[1, 1] + (t * t + h) * p[1, 2] + h * t * p[2, 2]
    p02 = p[0, 2] + t * p[1, 2] + h * p[2, 2]
    p11 = p[1, 1] + 2 * t * p[1, 2] + t * t * p[2, 2]
    p12 = p[1, 2] + t * p[2, 2]
    p[0, 0], p[1, 1], p[2, 2] = p00 + jerk * q[0, 0], p11 + jerk * q[1, 1], p[2, 2] + jerk * q[2, 2]
    p[0, 1] = p[1, 0] = p01 + jerk * q[0, 1]
    p[0, 2] = p[2, 0] = p02 + jerk * q[0, 2]
    p[1, 2] = p[2, 1] = p12 + jerk * q[1, 2]


@part
def _update(x: FloatArray, p: FloatArray, e: float, s: float, m: float) -> None:
    """x + m K e, and the covariance that the gain m K has: P - (2 m - m^2) K S K'."""
    k0, k1, k2 = p[0, 0] / s, p[1, 0] / s, p[2, 0] / s
    x[0] += m * k0 * e
    x[1] += m * k1 * e
    x[2] += m * k2 * e
    f = (2 * m - m * m) * s
    p[0, 0] -= f * k0 * k0
    p[1, 1] -= f * k1 * k1
    p[2, 2] -= f * k2 * k2
    p[0, 1] = p[1, 0] = p[0, 1] - f * k0 * k1
    p[0, 2] = p[2, 0] = p[0, 2] - f * k0 * k2
    p[1, 2] = p[2, 1] = p[1, 2] - f * k1 * k2


@part
def gain_factor(u: float) -> float:
    """What the gain is multiplied by for an innovation of u sigmas."""
    if u <= FULL_AT:
        return 1.0
    return FULL_AT / u if u <= ZERO_AT else 0.0


class Channel(NamedTuple):
    """The model of one component: x0 (3,), p0 (3, 3) at sample `begin`; noise: variance of a reading; jerk: its
    spectral density in the component's unit, squared, per s^5; angular: an azimuth."""

    begin: int
    x0: Vector
    p0: Matrix
    noise: float
    jerk: float
    angular: bool


@kernel
def adaptive_kalman(
    time: Vector, z: Vector, model: Channel, adapt: bool
) -> tuple[Matrix, Matrix, Vector, Vector, Vector, float]:
    """Values and rates (n, 3), their variances (n, 3), innovations, their sigmas and weights (n,), and the
    log-likelihood; NaN before sample `begin`.

    z (n,) NaN where missing; adapt: False for the plain Kalman filter.
    """
    begin, x0, p0, noise, jerk, angular = model
    n = len(z)
    state, variance = np.full((n, 3), np.nan), np.full((n, 3), np.nan)
    innovation, sigma, weight = np.full(n, np.nan), np.full(n, np.nan), np.zeros(n)
    x, p, q = x0.copy(), p0.copy(), np.zeros((3, 3))
    r, updates, rejected, likelihood = noise, 0, 0, 0.0
    for k in range(begin, n):
        if k > begin:
            _predict(x, p, time[k] - time[k - 1], jerk, q)
        s = p[0, 0] + r
        sigma[k] = math.sqrt(s)
        if math.isfinite(z[k]):
            e = z[k] - x[0]
            if angular:
                e = wrap_angle(e)
            innovation[k] = e
            m = gain_factor(abs(e) / sigma[k]) if adapt else 1.0
            rejected = rejected + 1 if m == 0 else 0
            if rejected > MOST_REJECTED:
                x[0], x[1], x[2] = x[0] + e, x0[1], 0.0
                p[:] = AGAIN * p0
                e, s, m, rejected = 0.0, p[0, 0] + r, 1.0, 0
            if m == 1.0 and adapt and p[0, 0] < r:  # the prediction must not drown it
                share = (1 - FORGETTING) / (1 - FORGETTING ** (updates + 1))
                found = (1 - share) * r + share * (e * e - p[0, 0])
                updates += 1
            else:
                found = r
            likelihood -= 0.5 * (math.log(s) + e * e / s)
            _update(x, p, e, s, m)
            weight[k] = m
            r = min(max(found, noise / NOISE_RANGE), noise * NOISE_RANGE)
        for i in range(3):
            state[k, i] = x[i]
            variance[k, i] = max(p[i, i], 0.0)
    return state, variance, innovation, sigma, weight, likelihood
