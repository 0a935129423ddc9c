"""How likely rejected readings are: each alone, as an unrelated number, or all of a run together.

The readings of a patch are often those of something that moves as smoothly as the target: another target, a reflection,
an encoder with an offset. They lie beside the track, but on a curve of their own, so that a few numbers (offset, slope
and bend) explain them all. If they counted as unrelated, a long patch would be so unlikely that
the track would rather bend through it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part
from ftproc.core.editing.screening import median
from ftproc.core.signatures import FlagMatrix, Matrix, Vector

FloatArray = NDArray[np.float64]

SHORTEST_RUN = 3  # rejected readings that make a patch
WIDE = 25.0  # half of all outliers are off by less than so many sigmas of the noise, the others by anything
OFF_CURVE = 4.0  # sigmas from the curve of its patch at which a reading is unrelated to it
MOSTLY = 0.5  # share of a patch that must be on its curve
TERMS = 3  # of a curve: offset, slope, bend
ROUNDS = 6  # of the search for the curve


@kernel
def log_probability(
    time: Vector, residual: Vector, variance: Vector, weight: Vector, sigma: float, rates: Vector
) -> float:
    """Log-probability of the rejected readings of one component (n,), and of there being such; without ln sqrt(2 pi).

    residual, variance: from what the rest of the record says. weight: zero for the rejected. sigma: of the noise.
    rates (3,): an isolated outlier comes, a patch begins, a patch goes on.
    """
    return _of_component(time, residual, variance, weight, sigma, rates)


@kernel
def log_probability_of_all(
    time: Vector, residual: Matrix, variance: Matrix, weight: Matrix, possible: FlagMatrix,
    noise_variance: Vector, rates: Matrix,
) -> float:  # fmt: skip
    """The same of all components (n, 3), with noise (3,) and rates (3, 3) of each; of readings that may be good at all
    (n, 3): what is not possible is not counted."""
    n = len(time)
    t, r, v, w = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    total = 0.0
    for c in range(3):
        m = 0
        for k in range(n):
            if possible[k, c]:
                t[m], r[m], v[m], w[m] = time[k], residual[k, c], variance[k, c], weight[k, c]
                m += 1
        total += _of_component(t[:m], r[:m], v[:m], w[:m], math.sqrt(noise_variance[c]), rates[c])
    return total


@part
def _of_component(
    time: FloatArray, residual: FloatArray, variance: FloatArray, weight: FloatArray, sigma: float, rates: FloatArray
) -> float:
    """Of one component, see `log_probability`."""
    n = len(residual)
    lone, begins, stays = math.log(rates[0]), math.log(rates[1]), math.log(rates[2])
    total, begin = 0.0, 0
    basis, fit, scratch = np.zeros((TERMS, n)), np.zeros(n), np.zeros(n)
    for k in range(n + 1):
        if k < n and weight[k] <= 0:
            continue
        length = k - begin
        apart = 0.0
        for j in range(begin, k):
            apart += _unrelated(residual[j], math.sqrt(variance[j] + (WIDE * sigma) ** 2))
        if length < SHORTEST_RUN:
            total += apart + length * lone
        else:
            together = _on_a_curve(time[begin:k], residual[begin:k], sigma, rates[0], basis, fit, scratch)
            most = max(apart, together)
            total += most + math.log(0.5 * (math.exp(apart - most) + math.exp(together - most)))
            total += begins + length * stays
        begin = k + 1
    return total


@part
def _unrelated(off: float, scale: float) -> float:
    """Log-density of an outlier (Cauchy's: a tenth is off by more than six times as much), times sqrt(2 pi)."""
    return 0.5 * math.log(2 / math.pi) - math.log(scale) - math.log1p((off / scale) ** 2)


@part
def _on_a_curve(
    time: FloatArray, residual: FloatArray, sigma: float, lone: float,
    basis: FloatArray, fit: FloatArray, scratch: FloatArray,
) -> float:  # fmt: skip
    """Log-probability of a run, most of whose readings lie on one curve beside the track: the curve's coefficients are
    integrated out (Laplace's method), and those that are off it are unrelated; -inf where there is no such curve. lone:
    rate of these. basis (TERMS, n), fit and scratch (n,) are scratch."""
    n = len(residual)
    m = _orthogonal(time, basis)
    for k in range(n):
        scratch[k] = residual[k]
    middle = median(scratch, n)
    for k in range(n):
        fit[k] = middle
    coefficient = np.zeros(TERMS)
    for trial in range(2 * ROUNDS):
        # First for the smallest sum of distances, which a few outliers do not move, then without them.
        for k in range(n):
            scratch[k] = abs(residual[k] - fit[k])
        near = max(OFF_CURVE * sigma, 2.5 * median(scratch, n))
        for k in range(n):
            off = abs(residual[k] - fit[k])
            scratch[k] = 1.0 / max(off, sigma) if trial < ROUNDS else (1.0 if off <= near else 0.0)
        if not _weighted_fit(basis, m, residual, scratch, coefficient):
            return -math.inf
        for k in range(n):
            fit[k] = 0.0
            for i in range(m):
                fit[k] += coefficient[i] * basis[i, k]
    inside, total = 0, 0.0
    for k in range(n):
        off = residual[k] - fit[k]
        if abs(off) <= OFF_CURVE * sigma:
            inside += 1
            total += math.log1p(-lone) - math.log(sigma) - 0.5 * (off / sigma) ** 2
        else:
            total += math.log(lone) + _unrelated(off, WIDE * sigma)
    if inside <= max(m, MOSTLY * n):
        return -math.inf
    for i in range(m):
        total += math.log(sigma) - 0.5 * math.log(inside) + _unrelated(coefficient[i], WIDE * sigma)
    return total


@part
def _orthogonal(time: FloatArray, basis: FloatArray) -> int:
    """Polynomials in time over the samples, orthogonal and of mean square 1, in the rows of basis; how many."""
    n = len(time)
    half = max(0.5 * (time[n - 1] - time[0]), 1e-300)
    m = 0
    for degree in range(TERMS):
        for k in range(n):
            basis[m, k] = ((time[k] - time[0]) / half - 1.0) ** degree
        for i in range(m):
            shared = 0.0
            for k in range(n):
                shared += basis[i, k] * basis[m, k] / n
            for k in range(n):
                basis[m, k] -= shared * basis[i, k]
        size = 0.0
        for k in range(n):
            size += basis[m, k] ** 2 / n
        if size > 1e-12:
            for k in range(n):
                basis[m, k] /= math.sqrt(size)
            m += 1
    return m


@part
def _weighted_fit(basis: FloatArray, m: int, value: FloatArray, weight: FloatArray, coefficient: FloatArray) -> bool:
    """Weighted least squares by m of the basis' rows; False where the weights leave too little."""
    normal = np.zeros((TERMS, TERMS + 1))
    for k in range(len(value)):
        for i in range(m):
            for j in range(m):
                normal[i, j] += weight[k] * basis[i, k] * basis[j, k]
            normal[i, TERMS] += weight[k] * basis[i, k] * value[k]
    for i in range(m):
        if not normal[i, i] > 1e-9 * normal[0, 0]:
            return False
        for j in range(i + 1, m):
            factor = normal[j, i] / normal[i, i]
            for q in range(i, TERMS + 1):
                normal[j, q] -= factor * normal[i, q]
    for i in range(m - 1, -1, -1):
        v = normal[i, TERMS]
        for j in range(i + 1, m):
            v -= normal[i, j] * coefficient[j]
        coefficient[i] = v / normal[i, i]
    return True
