"""Constant acceleration driven by white jerk, for any sample interval; the dynamics are linear and exact.

Per axis and interval T (Zuo et al. 2021 eq. 1, with the continuous-time noise in place of the piecewise one):

    Phi = [[1, T, T^2/2], [0, 1, T], [0, 0, 1]]
    Q   = q [[T^5/20, T^4/8, T^3/6], [T^4/8, T^3/3, T^2/2], [T^3/6, T^2/2, T]]

q is the spectral density of white jerk, m^2/s^5: it means the same at any rate, and Q(T1 + T2) composes exactly
from Q(T1) and Q(T2), so gaps and jittered times need no special case. In three dimensions q becomes a symmetric
3 x 3 tensor (an aircraft jerks across its path, hardly along it). It is held piecewise constant between knots
`knot_s` apart; each row of `jerk` is [xx, xy, xz, yy, yz, zz].
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

AXIS_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def isotropic(jerk_psd: float) -> FloatArray:
    """(1, 6) jerk tensor of the same density (m^2/s^5) along every axis, for the whole log."""
    return np.array([[jerk_psd, 0.0, 0.0, jerk_psd, 0.0, jerk_psd]])


@njit(cache=True)
def knot_index(time: float, first_time: float, knot_s: float, knots: int) -> int:
    """The piece of the jerk profile that holds at `time`."""
    index = int((time - first_time) / knot_s)
    return min(max(index, 0), knots - 1)


@njit(cache=True)
def noise_coefficients(interval: float, out: FloatArray) -> None:
    """The 3 x 3 matrix of Q per unit of jerk density; a negative interval goes back in time."""
    t = interval
    sign = 1.0 if t >= 0 else -1.0
    out[0, 0] = sign * t**5 / 20
    out[0, 1] = out[1, 0] = sign * t**4 / 8
    out[0, 2] = out[2, 0] = sign * t**3 / 6
    out[1, 1] = sign * t**3 / 3
    out[1, 2] = out[2, 1] = sign * t * t / 2
    out[2, 2] = sign * t


@njit(cache=True)
def predict(x: FloatArray, p: FloatArray, interval: float, jerk: FloatArray, c: FloatArray) -> None:
    """x <- Phi x and P <- Phi P Phi' + Q in place; c is scratch (3, 3)."""
    t = interval
    h = 0.5 * t * t
    for i in range(3):
        x[i] += t * x[i + 3] + h * x[i + 6]
        x[i + 3] += t * x[i + 6]
    # Rows first (Phi P), then columns (P Phi'): each in place from the top, which reads only untouched rows.
    for j in range(9):
        for i in range(3):
            p[i, j] += t * p[i + 3, j] + h * p[i + 6, j]
            p[i + 3, j] += t * p[i + 6, j]
    for i in range(9):
        for j in range(3):
            p[i, j] += t * p[i, j + 3] + h * p[i, j + 6]
            p[i, j + 3] += t * p[i, j + 6]
    noise_coefficients(t, c)
    for a in range(3):
        for b in range(3):
            k = 0
            for i in range(3):
                for j in range(i, 3):
                    q = c[a, b] * jerk[k]
                    p[3 * a + i, 3 * b + j] += q
                    if i != j:
                        p[3 * a + j, 3 * b + i] += q
                    k += 1


@njit(cache=True)
def adjoint(r: FloatArray, n: FloatArray, interval: float) -> None:
    """r <- Phi' r and N <- Phi' N Phi in place: the backward counterpart of `predict`."""
    t = interval
    h = 0.5 * t * t
    for i in range(3):
        r[i + 6] += t * r[i + 3] + h * r[i]
        r[i + 3] += t * r[i]
    for j in range(9):
        for i in range(3):
            n[i + 6, j] += t * n[i + 3, j] + h * n[i, j]
            n[i + 3, j] += t * n[i, j]
    for i in range(9):
        for j in range(3):
            n[i, j + 6] += t * n[i, j + 3] + h * n[i, j]
            n[i, j + 3] += t * n[i, j]
