"""What is measured beside range, azimuth and elevation: scalars of a sample, taken one by one before its readings.

A scalar knows a point c, by which it is one of two kinds, with d = |x - c| and u = (x - c) / d:

    RATE       h = u . v, the range rate of a station at c; gradient (v - h u) / d by position, u by velocity
    DISTANCE   h = d; gradient u by position. About the centre of the earth it is a height, less the earth's radius

What the bend of h adds where position and velocity are poorly known is the mean tr(C P_xv), half of tr(C P_xx), and to
the variance tr(C P_xx C P_vv), half of tr(C P_xx C P_xx), with C = (I - u u') / d. The update and its way back are
those of `ukf` and `smoother` for a single component whose H sees the velocity too.

The scalars of a log are an array (kinds, n, WIDTH), which the sweeps fill: value m/s or m, and variance, weight (of a
mean, of how many; below zero it is yet to be decided by the innovation), innovation and its variance (after a way back
the leave-one-out residual and its), then what an update leaves for the way back; the kind and the point; and the
derivatives of the value by what is unknown of its station: the clock, and what `biases` has beside the six of readings.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import part
from ftproc.core.signatures import Cube

FloatArray = NDArray[np.float64]

VALUE, VARIANCE, WEIGHT, RESIDUAL, SPREAD, Y, G, U = 0, 1, 2, 3, 4, 5, 6, 12
ROOT, KIND, POINT, UNKNOWN = U + 12, U + 13, U + 14, U + 17
UNKNOWNS = 3  # clock offset, offset, scale
WIDTH = UNKNOWN + UNKNOWNS
RATE, DISTANCE = 0.0, 1.0
OPEN, GATE = -1.0, 4.0  # the weight of a scalar that is not decided, and the sigmas up to which it is good then
LEAST_LEFT = 1e-6  # of a reading's information: what biases leave of it at least
NEAREST_M = 1e-3  # of the point: nearer, nothing has a direction


@part
def _gradient(x: FloatArray, row: FloatArray) -> tuple[float, float]:
    """h(x) and the distance; its gradient by position and velocity in the row, and u in place of U's first."""
    px, py, pz = x[0] - row[POINT], x[1] - row[POINT + 1], x[2] - row[POINT + 2]
    far = max(math.sqrt(px * px + py * py + pz * pz), NEAREST_M)
    row[U], row[U + 1], row[U + 2] = px / far, py / far, pz / far
    if row[KIND] == DISTANCE:
        for i in range(3):
            row[G + i], row[G + 3 + i] = row[U + i], 0.0
        return far, far
    rate = (px * x[3] + py * x[4] + pz * x[5]) / far
    for i in range(3):
        row[G + 3 + i] = row[U + i]
        row[G + i] = (x[3 + i] - rate * row[U + i]) / far
    return float(rate), far


@part
def _across(p: FloatArray, row: FloatArray, far: float, i: int, j: int, first: int, column: int) -> float:
    """An element of (I - u u') P / d, of the block of P that begins there."""
    total = p[first + i, column + j]
    for k in range(3):
        total -= row[U + i] * row[U + k] * p[first + k, column + j]
    return float(total / far)


@part
def _bend(p: FloatArray, row: FloatArray, far: float) -> tuple[float, float]:
    """Mean and variance of what the bend of h adds."""
    other, share = (3, 1.0) if row[KIND] == RATE else (0, 0.5)
    mean, variance = 0.0, 0.0
    for i in range(3):
        mean += share * _across(p, row, far, i, i, 0, other)
        for j in range(3):
            variance += share * _across(p, row, far, i, j, 0, 0) * _across(p, row, far, j, i, other, other)
    return mean, max(variance, 0.0)


@part
def take(x: FloatArray, p: FloatArray, scalars: Cube, k: int) -> float:
    """Update a state and its covariance by the scalars of sample k; the log-likelihood of their innovations."""
    gained = 0.0
    for kind in range(len(scalars)):
        gained += _take(x, p, scalars[kind, k])
    return gained


@part
def _take(x: FloatArray, p: FloatArray, row: FloatArray) -> float:
    row[RESIDUAL] = row[SPREAD] = math.nan
    if not math.isfinite(row[VALUE]):
        return 0.0
    expected, far = _gradient(x, row)
    mean, spread = _bend(p, row, far)
    for i in range(len(x)):
        shared = 0.0
        for j in range(6):
            shared += p[i, j] * row[G + j]
        row[U + i] = shared
    for j in range(6):
        spread += row[G + j] * row[U + j]
    spread += row[VARIANCE] / row[WEIGHT] if row[WEIGHT] > 0 else row[VARIANCE]
    e = row[VALUE] - expected - mean
    if row[WEIGHT] < 0:
        row[WEIGHT] = 1.0 if e * e <= GATE * GATE * spread else 0.0
    row[RESIDUAL], row[SPREAD], row[Y], row[ROOT] = e, spread, e, 1.0
    if not row[WEIGHT] > 0:
        return 0.0
    root = 1 / math.sqrt(spread)
    row[Y], row[ROOT] = e * root, root
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
def absorb(r: FloatArray, n: FloatArray, nu: FloatArray, scalars: Cube, k: int) -> None:
    """Take r and N back over the scalars of sample k, and leave their leave-one-out residuals and the variances of
    those. nu: memory for U N."""
    for kind in range(len(scalars) - 1, -1, -1):
        _absorb(r, n, nu, scalars[kind, k])


@part
def _absorb(r: FloatArray, n: FloatArray, nu: FloatArray, row: FloatArray) -> None:
    size = len(r)
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


@part
def carry(s: FloatArray, row: FloatArray, columns: FloatArray, white: FloatArray) -> None:
    """Take S (9, m) of `biases` over a scalar, and leave its C (m,). columns: (UNKNOWNS, m) those on which it
    depends."""
    if not (math.isfinite(row[VALUE]) and row[WEIGHT] > 0):
        return
    for c in range(s.shape[1]):
        total = 0.0
        for j in range(UNKNOWNS):
            total += row[UNKNOWN + j] * columns[j, c]
        white[c] = row[ROOT] * total
        for j in range(6):
            white[c] += row[G + j] * s[j, c]
    for i in range(9):
        for c in range(s.shape[1]):
            s[i, c] -= row[U + i] * white[c]


@part
def count(row: FloatArray, white: FloatArray, score: FloatArray, info: FloatArray) -> None:
    """Add to the score (m,) and the information (m, m) of the biases what a scalar says."""
    if not (math.isfinite(row[VALUE]) and row[WEIGHT] > 0):
        return
    for c in range(len(score)):
        score[c] += white[c] * row[Y]
        for e in range(c + 1):
            info[c, e] += white[c] * white[e]


@part
def carry_back(a: FloatArray, row: FloatArray, columns: FloatArray, white: FloatArray, smoothed: FloatArray) -> None:
    """Take l (9, m) of `biases` back over a scalar, and let its leave-one-out residual allow for them. smoothed: (9, m)
    S of the smoothed sample."""
    if not math.isfinite(row[VALUE]):
        return
    m, lost = a.shape[1], 0.0
    if not row[WEIGHT] > 0:
        for c in range(m):
            share = 0.0
            for j in range(UNKNOWNS):
                share += row[UNKNOWN + j] * columns[j, c]
            for j in range(6):
                share += row[G + j] * smoothed[j, c]
            lost += share * share
        row[SPREAD] += lost
        return
    for j in range(9):
        for c in range(m):
            white[c] -= row[U + j] * a[j, c]
    for c in range(m):
        lost += row[ROOT] * row[ROOT] * white[c] * white[c]
    known = 1 / row[SPREAD]
    rest = max(known - lost, LEAST_LEFT * known)
    row[RESIDUAL] *= known / rest
    row[SPREAD] = 1 / rest
    for j in range(6):
        for c in range(m):
            a[j, c] += row[G + j] * white[c]
