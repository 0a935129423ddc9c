"""What flight-test engineers read off a state: ground speed, track, climb rate, flight path angle, turn rate and load
factor; for kernels their gradients, by which the covariance of the state gives their sigmas (to first order).

With v = (vx, vy, vz), s the ground speed, t the direction of flight, and f = a + (0, 0, g) the specific force:

    ground speed s         track atan2(vy, vx)        turn rate (vx ay - vy ax) / s^2
    climb rate vz          flight path angle atan2(vz, s)        load factor |f - (f t) t| / g

The load factor is what the wings carry across the direction of flight. A target slower than SLOWEST has no direction,
and the whole specific force is taken. z is the vertical.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part
from ftproc.core.signatures import Cube, Matrix

FloatArray = NDArray[np.float64]

GRAVITY = 9.80665  # m/s2, standard
SLOWEST = 1.0  # m/s
LEAST = 1e-9  # of a speed, m/s, or of a force, by which is divided


@part
def gradients(x: FloatArray, g: FloatArray) -> None:
    """Fill g (6, 6): a row for each quantity in the order above (ground speed, track, climb rate, flight path angle,
    turn rate, load factor), a column for each of vx, vy, vz, ax, ay, az; SI units and rad."""
    vx, vy, vz, ax, ay, az = x[3], x[4], x[5], x[6], x[7], x[8] + GRAVITY
    s2 = max(vx * vx + vy * vy, LEAST * LEAST)
    v2 = s2 + vz * vz
    s, per_s2, per_v2 = math.sqrt(s2), 1 / s2, 1 / v2
    per_s = s * per_s2
    g[0, 0], g[0, 1], g[0, 2] = vx * per_s, vy * per_s, 0.0
    g[1, 0], g[1, 1], g[1, 2] = -vy * per_s2, vx * per_s2, 0.0
    g[2, 0], g[2, 1], g[2, 2] = 0.0, 0.0, 1.0
    g[3, 0], g[3, 1], g[3, 2] = -vz * per_v2 * g[0, 0], -vz * per_v2 * g[0, 1], s * per_v2
    turn = 2 * (vx * ay - vy * ax) * per_s2
    g[4, 0], g[4, 1], g[4, 2] = (ay - turn * vx) * per_s2, -(ax + turn * vy) * per_s2, 0.0
    g[4, 3], g[4, 4], g[4, 5] = g[1, 0], g[1, 1], 0.0
    along = (ax * vx + ay * vy + az * vz) * per_v2 if v2 > SLOWEST * SLOWEST else 0.0  # f t / v
    nx, ny, nz = ax - along * vx, ay - along * vy, az - along * vz
    per_n = 1 / (GRAVITY * max(math.sqrt(nx * nx + ny * ny + nz * nz), LEAST))
    g[5, 3], g[5, 4], g[5, 5] = nx * per_n, ny * per_n, nz * per_n
    g[5, 0], g[5, 1], g[5, 2] = -along * g[5, 3], -along * g[5, 4], -along * g[5, 5]


@part
def path_sigma(x: FloatArray, p: FloatArray, g: FloatArray, out: FloatArray) -> None:
    """1-sigma (6,) of the quantities at a state, from its covariance. g: memory for the gradients."""
    gradients(x, g)
    for i in range(2):
        out[i] = _sigma(p, g, i, 2)
    for i in range(2, 4):
        out[i] = _sigma(p, g, i, 3)
    for i in range(4, 6):
        out[i] = _sigma(p, g, i, 6)


@part
def _sigma(p: FloatArray, g: FloatArray, i: int, n: int) -> float:
    """The square root of g' P g with the first n of velocity and acceleration."""
    variance = 0.0
    for a in range(n):
        total = 0.5 * g[i, a] * p[3 + a, 3 + a]
        for b in range(a):
            total += g[i, b] * p[3 + a, 3 + b]
        variance += g[i, a] * total
    return math.sqrt(max(2 * variance, 0.0))


def widened(state: FloatArray, sigma: FloatArray, before: FloatArray, after: FloatArray) -> FloatArray:
    """1-sigma (n, 6) of the quantities at states (n, 9), where independent errors have widened the sigmas (n, 9) of the
    state; SI units and rad."""
    wider = np.array(sigma, order="C")
    _widen(np.ascontiguousarray(state), np.ascontiguousarray(after**2 - before**2), wider)
    return wider


def sigma_of(state: FloatArray, covariance: FloatArray) -> FloatArray:
    """1-sigma (n, 6) of the quantities at states (n, 9) with covariances (n, 9, 9); SI units and rad."""
    found = np.empty((len(state), 6))
    _sigma_of(np.ascontiguousarray(state), np.ascontiguousarray(covariance), found)
    return found


@kernel
def _sigma_of(state: Matrix, covariance: Cube, sigma: Matrix) -> None:
    g = np.zeros((6, 6))
    for k in range(len(state)):
        path_sigma(state[k], covariance[k], g, sigma[k])


@kernel
def _widen(state: Matrix, added: Matrix, sigma: Matrix) -> None:
    g = np.zeros((6, 6))
    for k in range(len(state)):
        gradients(state[k], g)
        for i in range(6):
            variance = sigma[k, i] * sigma[k, i]
            for a in range(3 if i < 4 else 6):
                variance += g[i, a] * g[i, a] * added[k, 3 + a]
            sigma[k, i] = math.sqrt(variance)
