"""The steps of the smoother's backward recursion; the formulas are in the head of `smoother`."""

from __future__ import annotations

import math
from typing import Annotated, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import part, record
from ftproc.core.filtering.filters import OFFSETS, Filter, Posterior, Update
from ftproc.core.filtering.forward import Estimated
from ftproc.core.filtering.records import Sample
from ftproc.core.model import motion
from ftproc.core.model.kinematics import path_sigma
from ftproc.core.model.measurement import line_of_sight_sigma
from ftproc.core.signatures import Layout

FloatArray = NDArray[np.float64]


class Backward(Protocol):
    """The record of the backward recursion: r, N, and what a step computes on its way.

    v, w, nu: v, W, U N of the smoother's head. state, cov: of the smoothed estimate (of the covariance only the blocks
    of position and velocity, and the diagonal; if `paths` is not zero also those of velocity with acceleration, for
    the sigmas of `kinematics`, whose gradients `path` holds). pn: P N. q: coefficients of Q. unobserved: whether
    the covariance before comes from this one, see `heads`; later: this one, whole; inverse, gain: M and C. residual,
    variance: leave-one-out. noise, markov: the two sums of the score so far, see `smoother`, of the white noise and of
    the offsets' variances; tau_score: of their correlation times. n_first: N+ of the first sample.
    """

    r: Annotated[FloatArray, 9]
    n: Annotated[FloatArray, 9, 9]
    v: Annotated[FloatArray, 3]
    w: Annotated[FloatArray, 3, 3]
    nu: Annotated[FloatArray, 3, 9]
    state: Annotated[FloatArray, 9]
    cov: Annotated[FloatArray, 9, 9]
    pn: Annotated[FloatArray, 9]
    q: Annotated[FloatArray, 3, 3]
    unobserved: float
    later: Annotated[FloatArray, 9, 9]
    inverse: Annotated[FloatArray, 9, 9]
    gain: Annotated[FloatArray, 9, 9]
    residual: Annotated[FloatArray, 3]
    variance: Annotated[FloatArray, 3]
    noise: Annotated[FloatArray, 2, 3]
    markov: Annotated[FloatArray, 2, 3]
    tau_score: Annotated[FloatArray, 3]
    n_first: Annotated[FloatArray, 9, 9]
    path: Annotated[FloatArray, 6, 6]
    paths: float


class Coloured(Backward, Protocol):
    """The same of a state that ends with the offsets of the measurements."""

    r: Annotated[FloatArray, 12]
    n: Annotated[FloatArray, 12, 12]
    nu: Annotated[FloatArray, 3, 12]
    state: Annotated[FloatArray, 12]
    cov: Annotated[FloatArray, 12, 12]
    pn: Annotated[FloatArray, 12]
    later: Annotated[FloatArray, 12, 12]
    inverse: Annotated[FloatArray, 12, 12]
    gain: Annotated[FloatArray, 12, 12]
    n_first: Annotated[FloatArray, 12, 12]


BACKWARD, COLOURED = record(Backward), record(Coloured)
Backwards = Annotated[Any, Layout(BACKWARD)]
ColouredBackwards = Annotated[Any, Layout(COLOURED)]


@part
def estimate(back: Backward, after: Posterior) -> None:
    """The smoothed state x+ + P+ r and its covariance P+ - P+ N P+."""
    x, p, r, n, pn, state, cov = after.x, after.p, back.r, back.n, back.pn, back.state, back.cov
    for i in range(9):
        p0, p1, p2, p3, p4, p5, p6, p7, p8 = (
            p[i, 0], p[i, 1], p[i, 2], p[i, 3], p[i, 4], p[i, 5], p[i, 6], p[i, 7], p[i, 8]
        )  # fmt: skip
        near = p0 * r[0] + p1 * r[1] + p2 * r[2] + p3 * r[3] + p4 * r[4]
        state[i] = x[i] + (near + p5 * r[5] + p6 * r[6] + p7 * r[7] + p8 * r[8])
        for j in range(len(x)):
            near = p0 * n[0, j] + p1 * n[1, j] + p2 * n[2, j] + p3 * n[3, j] + p4 * n[4, j]
            pn[j] = near + p5 * n[5, j] + p6 * n[6, j] + p7 * n[7, j] + p8 * n[8, j]
        for k in range(OFFSETS, len(x)):
            state[i] += p[i, k] * r[k]
            for j in range(len(x)):
                pn[j] += p[i, k] * n[k, j]
        for j in range(i // 3 * 3 if i < 6 else 3 if back.paths > 0 else i, i + 1):
            v = (pn[0] * p[j, 0] + pn[1] * p[j, 1] + pn[2] * p[j, 2]) + (pn[3] * p[j, 3] + pn[4] * p[j, 4])
            v += (pn[5] * p[j, 5] + pn[6] * p[j, 6]) + (pn[7] * p[j, 7] + pn[8] * p[j, 8])
            for k in range(OFFSETS, len(x)):
                v += pn[k] * p[j, k]
            cov[i, j] = p[i, j] - v
            cov[j, i] = cov[i, j]


@part
def keep(back: Backward, row: Estimated) -> None:
    """Keep the smoothed state of a sample and its sigmas."""
    for i in range(9):
        row.state[i] = back.state[i]
        row.sigma[i] = math.sqrt(max(back.cov[i, i], 0.0))
    line_of_sight_sigma(back.state, back.cov, row.los_sigma)
    if back.paths > 0:
        path_sigma(back.state, back.cov, back.path, row.path_sigma)
    else:
        for i in range(6):
            row.path_sigma[i] = math.nan


@part
def absorb(back: Backward, update: Update, after: Posterior, sample: Sample, residuals: bool) -> None:
    """Take r and N back over the measurement of a sample, and add to the score of the noise; leave the leave-one-out
    residuals and their variances behind, if they are wanted. after: needed where a reading is left out."""
    r, n, v, w, nu = back.r, back.n, back.v, back.w, back.nu
    y, g, u = update.y, update.g, update.u
    for i in range(3):
        u0, u1, u2, u3, u4, u5, u6, u7, u8 = (
            u[i, 0], u[i, 1], u[i, 2], u[i, 3], u[i, 4], u[i, 5], u[i, 6], u[i, 7], u[i, 8]
        )  # fmt: skip
        near = u0 * r[0] + u1 * r[1] + u2 * r[2] + u3 * r[3] + u4 * r[4]
        v[i] = y[i] - (near + u5 * r[5] + u6 * r[6] + u7 * r[7] + u8 * r[8])
        for j in range(len(r)):
            near = u0 * n[0, j] + u1 * n[1, j] + u2 * n[2, j] + u3 * n[3, j] + u4 * n[4, j]
            nu[i, j] = near + u5 * n[5, j] + u6 * n[6, j] + u7 * n[7, j] + u8 * n[8, j]
        for k in range(OFFSETS, u.shape[1]):
            v[i] -= u[i, k] * r[k]
            for j in range(len(r)):
                nu[i, j] += u[i, k] * n[k, j]
    for i in range(3):
        for j in range(i + 1):
            t = 1.0 if i == j else 0.0
            for a in range(u.shape[1]):
                t += u[i, a] * nu[j, a]
            w[i, j] = t
            w[j, i] = t
    for a in range(3):
        r[a] += g[0, a] * v[0] + g[1, a] * v[1] + g[2, a] * v[2]
    # H sees the position only, so only the rows and columns of the position change; both sides of the diagonal are
    # written from one number, because what rounding leaves of asymmetry would grow from sample to sample.
    for b in range(3):
        for a in range(3, 9):
            t = n[b, a] - nu[0, a] * g[0, b] - nu[1, a] * g[1, b] - nu[2, a] * g[2, b]
            n[b, a] = t
            n[a, b] = t
    if len(r) > OFFSETS:
        _absorb_offsets(back, update)
    for b in range(3):
        d0 = w[0, 0] * g[0, b] + w[0, 1] * g[1, b] + w[0, 2] * g[2, b] - nu[0, b]
        d1 = w[1, 0] * g[0, b] + w[1, 1] * g[1, b] + w[1, 2] * g[2, b] - nu[1, b]
        d2 = w[2, 0] * g[0, b] + w[2, 1] * g[1, b] + w[2, 2] * g[2, b] - nu[2, b]
        for a in range(b, 3):
            t = n[a, b] + g[0, a] * d0 + g[1, a] * d1 + g[2, a] * d2
            t -= nu[0, a] * g[0, b] + nu[1, a] * g[1, b] + nu[2, a] * g[2, b]
            n[a, b] = t
            n[b, a] = t
    _leave_out(back, update, after, sample, residuals)


@part
def _absorb_offsets(back: Backward, update: Update) -> None:
    """What the offsets, which H sees by a unit matrix, add to `absorb`: their rows and columns of r and N, against all
    of the state. (nu is still that of before; N's position block is yet to be changed.)"""
    r, n, v, w, nu, g, root = back.r, back.n, back.v, back.w, back.nu, update.g, update.root
    for b in range(3):
        at = OFFSETS + b
        r[at] += root[0, b] * v[0] + root[1, b] * v[1] + root[2, b] * v[2]
        for a in range(3, OFFSETS):
            t = n[at, a] - nu[0, a] * root[0, b] - nu[1, a] * root[1, b] - nu[2, a] * root[2, b]
            n[at, a] = t
            n[a, at] = t
    for b in range(3):
        at = OFFSETS + b
        for a in range(3):
            t = n[at, a]
            for i in range(3):
                t -= nu[i, a] * root[i, b] + g[i, a] * nu[i, at]
                for j in range(3):
                    t += g[i, a] * w[i, j] * root[j, b]
            n[at, a] = t
            n[a, at] = t
        for a in range(b + 1):
            t = n[at, OFFSETS + a]
            for i in range(3):
                t -= nu[i, OFFSETS + a] * root[i, b] + root[i, a] * nu[i, at]
                for j in range(3):
                    t += root[i, a] * w[i, j] * root[j, b]
            n[at, OFFSETS + a] = t
            n[OFFSETS + a, at] = t


@part
def _leave_out(back: Backward, update: Update, after: Posterior, sample: Sample, residuals: bool) -> None:
    """Residual and variance of each component without itself, and the score of the noise, from v and W, and from r and
    N before the measurement."""
    v, w, root, used, noise = back.v, back.w, update.root, update.used, sample.noise
    for i in range(3):
        if not math.isfinite(sample.measurement[i]):
            back.residual[i] = back.variance[i] = math.nan
        elif used[i] > 0:
            pull = root[0, i] * v[0] + root[1, i] * v[1] + root[2, i] * v[2]
            m = 0.0
            for j in range(3):
                m += root[j, i] * (w[j, 0] * root[0, i] + w[j, 1] * root[1, i] + w[j, 2] * root[2, i])
            back.residual[i] = pull / m
            back.variance[i] = 1 / m + noise[i] * (1 - 1 / used[i])
            half = 0.5 * noise[i] / used[i]
            back.noise[0, i] += half * pull * pull
            back.noise[1, i] += half * m
        elif residuals:  # not used: what all the rest predicts is the smoothed estimate itself
            _predict_reading(back, update, after, sample, i)


@part
def _predict_reading(back: Backward, update: Update, after: Posterior, sample: Sample, i: int) -> None:
    """The same of a component that is not used; P H' before the measurement is P+ H' + U'U H'."""
    p, h, u, column = after.p, after.h, update.u, back.pn
    u0 = u[0, 0] * h[i, 0] + u[0, 1] * h[i, 1] + u[0, 2] * h[i, 2]
    u1 = u[1, 0] * h[i, 0] + u[1, 1] * h[i, 1] + u[1, 2] * h[i, 2]
    u2 = u[2, 0] * h[i, 0] + u[2, 1] * h[i, 1] + u[2, 2] * h[i, 2]
    if len(p) > OFFSETS:
        u0, u1, u2 = u0 + u[0, OFFSETS + i], u1 + u[1, OFFSETS + i], u2 + u[2, OFFSETS + i]
    for a in range(len(p)):
        shared = p[a, 0] * h[i, 0] + p[a, 1] * h[i, 1] + p[a, 2] * h[i, 2]
        if len(p) > OFFSETS:
            shared += p[a, OFFSETS + i]
        column[a] = shared + u[0, a] * u0 + u[1, a] * u1 + u[2, a] * u2
    predicted, spread = 0.0, after.c[i, i]
    for a in range(len(p)):
        predicted += column[a] * back.r[a]
        for b in range(len(p)):
            spread -= column[a] * back.n[a, b] * column[b]
    back.residual[i] = after.e[i] - predicted
    back.variance[i] = max(spread, 0.0) + sample.noise[i] + sample.late[i] * sample.late[i]


@part
def score_jerk(back: Backward, interval: float, sums: FloatArray, piece: int) -> None:
    """Add 1/2 c(T) : r r' and 1/2 c(T) : N of each axis, whose difference is the score of its jerk density, to the sums
    (m, 2, 3) of a piece of the profile."""
    r, n, c = back.r, back.n, back.q
    motion.noise_coefficients(interval, c)
    c00, c01, c02, c11, c12, c22 = 0.5 * c[0, 0], c[0, 1], c[0, 2], 0.5 * c[1, 1], c[1, 2], 0.5 * c[2, 2]
    for i in range(3):
        p, v, a = r[i], r[3 + i], r[6 + i]
        sums[piece, 0, i] += p * (c00 * p + c01 * v + c02 * a) + v * (c11 * v + c12 * a) + c22 * a * a
        of_p = c00 * n[i, i] + c01 * n[i, 3 + i] + c02 * n[i, 6 + i]
        sums[piece, 1, i] += of_p + c11 * n[3 + i, 3 + i] + c12 * n[3 + i, 6 + i] + c22 * n[6 + i, 6 + i]


@part
def score_markov(back: Backward, f: Filter, interval: float) -> None:
    """Add to the score of the offsets' variances, by their logarithms: over an interval, or of the first state
    (infinite)."""
    for i in range(OFFSETS, len(back.r)):
        if f.tau_s[i - OFFSETS] >= motion.FOREVER_S:
            continue
        kept = math.exp(-interval / f.tau_s[i - OFFSETS])
        half = 0.5 * (1 - kept * kept) * f.markov[i - OFFSETS]
        back.markov[0, i - OFFSETS] += half * back.r[i] * back.r[i]
        back.markov[1, i - OFFSETS] += half * back.n[i, i]


@part
def score_tau(back: Backward, earlier: Any, f: Filter, interval: float) -> None:
    """Add to the score of the offsets' correlation times, by their logarithms, over the interval since an earlier
    update, which was retained with its state: r' dPhi x+ + 1/2 (r r' - N) : d(Phi P+ Phi' + Q)."""
    x, p, r, n, t = earlier.x, earlier.p, back.r, back.n, interval
    for i in range(OFFSETS, len(x)):
        kept = math.exp(-t / f.tau_s[i - OFFSETS])
        slope = kept * t / f.tau_s[i - OFFSETS]
        total = r[i] * x[i]
        for j in range(3):
            position = p[j, i] + t * p[3 + j, i] + 0.5 * t * t * p[6 + j, i]
            total += (r[i] * r[j] - n[i, j]) * position
            total += (r[i] * r[3 + j] - n[i, 3 + j]) * (p[3 + j, i] + t * p[6 + j, i])
            total += (r[i] * r[6 + j] - n[i, 6 + j]) * p[6 + j, i]
        for j in range(OFFSETS, len(x)):
            total += (r[i] * r[j] - n[i, j]) * math.exp(-t / f.tau_s[j - OFFSETS]) * p[j, i]
        lost = kept * f.markov[i - OFFSETS] * (r[i] * r[i] - n[i, i])
        back.tau_score[i - OFFSETS] += slope * (total - lost)
