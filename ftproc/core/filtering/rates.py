"""Range rates, the one further number that a radar measures: one scalar measurement of a sample, before its readings.

h = u . v with u = x / R, whose gradient by position is (v - h u) / R, and by velocity u. What the bend of h adds where
position and velocity are vague is the mean tr(C P_xv), and to the variance tr(C P_xx C P_vv), with C = (I - u u') / R.
The update and its way back are those of `ukf` and `smoother` for a single component whose H sees the velocity too.

A log's rates are the rows (n, WIDTH) of an array, which the sweeps fill: value m/s and variance, weight (of a mean, of
how many), innovation and its variance (after a way back the leave-one-out residual and its), then what an update leaves
for the way back.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import part

FloatArray = NDArray[np.float64]

VALUE, VARIANCE, WEIGHT, RESIDUAL, SPREAD, Y, G, U = 0, 1, 2, 3, 4, 5, 6, 12
WIDTH = U + 12
NEAREST_M = 1e-3  # of the station: nearer, the rate has no direction


@part
def _gradient(x: FloatArray, row: FloatArray) -> float:
    """h(x), and its gradient by position and velocity in the row."""
    slant = max(math.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]), NEAREST_M)
    rate = (x[0] * x[3] + x[1] * x[4] + x[2] * x[5]) / slant
    for i in range(3):
        row[G + 3 + i] = x[i] / slant
        row[G + i] = (x[3 + i] - rate * x[i] / slant) / slant
    return float(rate)


@part
def _across(p: FloatArray, row: FloatArray, slant: float, i: int, j: int, at: int) -> float:
    """An element of (I - u u') P / R, of the block of P whose columns begin there; its rows are those of the position
    (at < 0: of the velocity)."""
    first, column = (3, -at) if at < 0 else (0, at)
    total = p[first + i, column + j]
    for k in range(3):
        total -= row[G + 3 + i] * row[G + 3 + k] * p[first + k, column + j]
    return float(total / slant)


@part
def _bend(x: FloatArray, p: FloatArray, row: FloatArray) -> tuple[float, float]:
    """Mean and variance of what the bend of h adds."""
    slant = max(math.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]), NEAREST_M)
    mean, variance = 0.0, 0.0
    for i in range(3):
        mean += _across(p, row, slant, i, i, 3)
        for j in range(3):
            variance += _across(p, row, slant, i, j, 0) * _across(p, row, slant, j, i, -3)
    return mean, max(variance, 0.0)


@part
def take(x: FloatArray, p: FloatArray, rows: FloatArray, k: int) -> float:
    """Update a state and its covariance by the rate of sample k; the log-likelihood of its innovation."""
    row = rows[k]
    row[RESIDUAL] = row[SPREAD] = math.nan
    if not math.isfinite(row[VALUE]):
        return 0.0
    rate = _gradient(x, row)
    mean, spread = _bend(x, p, row)
    for i in range(len(x)):
        shared = 0.0
        for j in range(6):
            shared += p[i, j] * row[G + j]
        row[U + i] = shared
    for j in range(6):
        spread += row[G + j] * row[U + j]
    spread += row[VARIANCE] / row[WEIGHT] if row[WEIGHT] > 0 else row[VARIANCE]
    e = row[VALUE] - rate - mean
    row[RESIDUAL], row[SPREAD], row[Y] = e, spread, e
    if not row[WEIGHT] > 0:
        return 0.0
    root = 1 / math.sqrt(spread)
    row[Y] = e * root
    for j in range(6):
        row[G + j] *= root
    for i in range(len(x)):
        row[U + i] *= root
        x[i] += row[U + i] * row[Y]
    for i in range(len(x)):
        for j in range(len(x)):
            p[i, j] -= row[U + i] * row[U + j]
    return float(-0.5 * (math.log(spread) + row[Y] * row[Y]))


@part
def absorb(r: FloatArray, n: FloatArray, nu: FloatArray, rows: FloatArray, k: int) -> None:
    """Take r and N back over the rate of sample k, and leave its leave-one-out residual and the variance of that. nu:
    memory for U N."""
    row, size = rows[k], len(r)
    if not math.isfinite(row[VALUE]):
        return
    v, w = row[Y], 1.0
    for j in range(size):
        v -= row[U + j] * r[j]
        nu[j] = 0.0
        for i in range(size):
            nu[j] += row[U + i] * n[i, j]
    for j in range(size):
        w += nu[j] * row[U + j]
    if not row[WEIGHT] > 0:  # what all the rest predicts
        row[RESIDUAL], row[SPREAD] = v, max(row[SPREAD] - (w - 1.0), row[VARIANCE])
        return
    row[RESIDUAL], row[SPREAD] = v * math.sqrt(row[SPREAD]) / w, row[SPREAD] / w
    for i in range(6):
        r[i] += row[G + i] * v
    for i in range(size):
        for j in range(i + 1):
            a, b = row[G + i] if i < 6 else 0.0, row[G + j] if j < 6 else 0.0
            t = n[i, j] - a * nu[j] - nu[i] * b + a * w * b
            n[i, j] = t
            n[j, i] = t
