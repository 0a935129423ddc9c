"""The steps of the smoother's backward recursion; the formulas are in the head of `smoother`."""

from __future__ import annotations

import math
from typing import Annotated, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import part, record
from ftproc.core.filtering.forward import Estimated
from ftproc.core.filtering.ukf import Filter
from ftproc.core.model import motion
from ftproc.core.model.measurement import line_of_sight_sigma
from ftproc.core.signatures import Layout

FloatArray = NDArray[np.float64]


class Backward(Protocol):
    """The record of the backward recursion: r, N, and what a step computes on its way.

    u, m, nk: u, M, N K of the smoother's head. state, cov: of the smoothed estimate (of the covariance only the blocks
    of position and velocity, and the diagonal). pn: P N. q: coefficients of Q. residual, variance: leave-one-out.
    noise_score: its sum so far. n_first: N+ of the first sample.
    """

    r: Annotated[FloatArray, 9]
    n: Annotated[FloatArray, 9, 9]
    u: Annotated[FloatArray, 3]
    m: Annotated[FloatArray, 3, 3]
    nk: Annotated[FloatArray, 9, 3]
    state: Annotated[FloatArray, 9]
    cov: Annotated[FloatArray, 9, 9]
    pn: Annotated[FloatArray, 9, 9]
    q: Annotated[FloatArray, 3, 3]
    residual: Annotated[FloatArray, 3]
    variance: Annotated[FloatArray, 3]
    noise_score: Annotated[FloatArray, 3]
    n_first: Annotated[FloatArray, 9, 9]


BACKWARD = record(Backward)
Backwards = Annotated[Any, Layout(BACKWARD)]


@part
def estimate(back: Backward, f: Filter) -> None:
    """The smoothed state x+ + P+ r and its covariance P+ - P+ N P+."""
    x, p, r, n, pn, state, cov = f.x, f.p, back.r, back.n, back.pn, back.state, back.cov
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
        for j in range(i // 3 * 3 if i < 6 else i, i + 1):
            v = p[i, j]
            for k in range(9):
                v -= pn[i, k] * p[j, k]
            cov[i, j] = v
            cov[j, i] = v


@part
def store(back: Backward, f: Filter, row: Estimated) -> None:
    """Keep the smoothed state of a sample and its sigmas."""
    for i in range(9):
        row.state[i] = back.state[i]
        # Rounding may eat a variance that the record has all but determined; it cannot be below that rounding.
        row.sigma[i] = math.sqrt(max(back.cov[i, i], 1e-14 * abs(f.p[i, i])))
    line_of_sight_sigma(back.state, back.cov, row.los_sigma)


@part
def absorb(back: Backward, f: Filter) -> None:
    """Take r and N back over the measurement of a sample; leave the leave-one-out residuals and their variances behind,
    and add to the score of the noise."""
    r, n, u, m, nk = back.r, back.n, back.u, back.m, back.nk
    h, e, used, s_inv, gain = f.h, f.e, f.used, f.s_inv, f.gain
    for i in range(3):
        u[i] = 0.0
        for j in range(3):
            if used[j] > 0:
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
            back.residual[i] = back.variance[i] = math.nan
        elif used[i] > 0:
            back.residual[i] = u[i] / m[i, i]
            back.variance[i] = 1 / m[i, i] + f.noise[i] * (1 - 1 / used[i])
            back.noise_score[i] += 0.5 * (u[i] * u[i] - m[i, i]) * f.noise[i] / used[i]
        else:  # not used: what all the rest predicts is the smoothed estimate itself
            predicted, spread = 0.0, f.c[i, i]
            for j in range(9):
                predicted += f.pxz[j, i] * r[j]
                for k in range(9):
                    spread -= f.pxz[j, i] * n[j, k] * f.pxz[k, i]
            back.residual[i] = e[i] - predicted
            back.variance[i] = max(spread, 0.0) + f.noise[i]


@part
def score_jerk(back: Backward, interval: float, score: FloatArray) -> None:
    """Add 1/2 c(T) : (r r' - N) to the score of each element of the jerk tensor (off-diagonal ones count twice)."""
    r, n, c = back.r, back.n, back.q
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
