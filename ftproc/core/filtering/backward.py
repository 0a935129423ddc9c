"""The steps of the smoother's backward recursion; the formulas are in the head of `smoother`."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import part
from ftproc.core.model import motion
from ftproc.core.model.measurement import line_of_sight_sigma

FloatArray = NDArray[np.float64]


@part
def estimate(
    x: FloatArray, p: FloatArray, r: FloatArray, n: FloatArray, pn: FloatArray, smoothed: FloatArray,
    state: FloatArray, sigma: FloatArray, los: FloatArray,
) -> None:  # fmt: skip
    """x+ + P+ r and P+ - P+ N P+, its diagonal and line-of-sight sigmas."""
    for i in range(9):
        total = x[i]
        for j in range(9):
            total += p[i, j] * r[j]
            pn[i, j] = 0.0
        state[i] = total
        for k in range(9):
            for j in range(9):
                pn[i, j] += p[i, k] * n[k, j]
    for i in range(9):
        for j in range(i // 3 * 3 if i < 6 else i, i + 1):  # the blocks of position and velocity, and the diagonal
            v = p[i, j]
            for k in range(9):
                v -= pn[i, k] * p[j, k]
            smoothed[i, j] = v
            smoothed[j, i] = v
        # Rounding may eat a variance that the record has all but determined; it cannot be below that rounding.
        sigma[i] = math.sqrt(max(smoothed[i, i], 1e-14 * abs(p[i, i])))
    line_of_sight_sigma(state, smoothed, los)


@part
def absorb(
    r: FloatArray,
    n: FloatArray,
    u: FloatArray,
    m: FloatArray,
    nk: FloatArray,
    h: FloatArray,
    e: FloatArray,
    c: FloatArray,
    s_inv: FloatArray,
    gain: FloatArray,
    pxz: FloatArray,
    weight: FloatArray,
    noise: FloatArray,
    residual: FloatArray,
    variance: FloatArray,
    noise_score: FloatArray,
) -> None:
    """Take r, N back over one measurement; leave the leave-one-out residuals and their variances behind. u (3,),
    m (3, 3), nk (9, 3) are scratch."""
    for i in range(3):
        u[i] = 0.0
        for j in range(3):
            if weight[j] > 0 and math.isfinite(e[j]):
                u[i] += s_inv[i, j] * e[j]
        for a in range(9):
            u[i] -= gain[a, i] * r[a]
    for a in range(9):
        s0 = s1 = s2 = 0.0
        for b in range(9):
            s0 += n[a, b] * gain[b, 0]
            s1 += n[a, b] * gain[b, 1]
            s2 += n[a, b] * gain[b, 2]
        nk[a, 0], nk[a, 1], nk[a, 2] = s0, s1, s2
    for i in range(3):
        for j in range(i + 1):
            v = s_inv[i, j]
            for a in range(9):
                v += gain[a, i] * nk[a, j]
            m[i, j] = v
            m[j, i] = v
    for i in range(3):
        for a in range(3):
            r[a] += h[i, a] * u[i]
    # H sees the position only, so only the rows and columns of the position change; both sides of the diagonal are
    # written from one number, because what rounding leaves of asymmetry would grow from sample to sample.
    for a in range(3, 9):
        for b in range(3):
            v = n[a, b]
            for i in range(3):
                v -= nk[a, i] * h[i, b]
            n[a, b] = v
            n[b, a] = v
    for a in range(3):
        for b in range(a + 1):
            v = n[a, b]
            for i in range(3):
                v -= nk[a, i] * h[i, b] + h[i, a] * nk[b, i]
                for j in range(3):
                    v += h[i, a] * m[i, j] * h[j, b]
            n[a, b] = v
            n[b, a] = v
    for i in range(3):
        if not math.isfinite(e[i]):
            residual[i] = math.nan
            variance[i] = math.nan
        elif weight[i] > 0:
            residual[i] = u[i] / m[i, i]
            variance[i] = 1 / m[i, i] + noise[i] * (1 - 1 / weight[i])
            noise_score[i] += 0.5 * (u[i] * u[i] - m[i, i]) * noise[i] / weight[i]
        else:  # not used: what all the rest predicts is the smoothed estimate itself
            predicted, spread = 0.0, c[i]
            for a in range(9):
                predicted += pxz[a, i] * r[a]
                for b in range(9):
                    spread -= pxz[a, i] * n[a, b] * pxz[b, i]
            residual[i] = e[i] - predicted
            variance[i] = max(spread, 0.0) + noise[i]


@part
def score_jerk(r: FloatArray, n: FloatArray, interval: float, c: FloatArray, score: FloatArray) -> None:
    """Add 1/2 c(T) : (r r' - N) to the score of each element of the jerk tensor (off-diagonal ones count twice)."""
    motion.noise_coefficients(interval, c)
    k = 0
    for i in range(3):
        for j in range(i, 3):
            total = 0.0
            for a in range(3):
                for b in range(3):
                    total += c[a, b] * (r[3 * a + i] * r[3 * b + j] - n[3 * a + i, 3 * b + j])
            score[k] += 0.5 * total if i == j else total
            k += 1
