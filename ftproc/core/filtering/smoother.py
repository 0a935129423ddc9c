"""The fixed-interval smoother, and what the same backward pass tells about outliers, noise and manoeuvres.

Rauch-Tung-Striebel estimates in Bryson-Frazier form (the dynamics are linear, so the two are equal): with
u = S^-1 e - K' r, M = S^-1 + K' N K, going backward

    r <- r + H' u            N <- N - H'(K'N) - (NK)H + H' M H          over a measurement
    r <- Phi' r              N <- Phi' N Phi                            over an interval
    x^s = x+ + P+ r+         P^s = P+ - P+ N+ P+

No covariance is inverted. From the same quantities come, at no further cost (de Jong 1988, 1989; Koopman and
Shephard 1992):

* the leave-one-out residual of each used component, u_i / M_ii with variance 1 / M_ii (what the rest of the record
  predicts for it), exact to rounding;
* the score of the likelihood by each noise variance, 1/2 sum(u_i^2 - M_ii), and by each element of each piece of
  the jerk tensor, 1/2 sum of c(T) contracted with (r r' - N).

Memory stays small on long logs: a forward sweep keeps a checkpoint every BLOCK samples, and the backward sweep
filters each block again.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel
from ftproc.core.filtering import backward, ukf
from ftproc.core.filtering.forward import extrapolate_back
from ftproc.core.filtering.records import Model, Start
from ftproc.core.model import motion
from ftproc.core.model.measurement import innovate

FloatArray = NDArray[np.float64]

BLOCK = 1024


class SmootherRun(NamedTuple):
    """What the whole record says of each sample.

    state: (n, 9), SI units. sigma: (n, 9) 1-sigma. los_sigma: (n, 6) as in FilterRun.
    residual: (n, 3) leave-one-out residual m, rad, rad; NaN where missing. residual_variance: (n, 3) its variance at
    full weight. nis: (n,) of the innovations used in the forward sweep. log_likelihood: of those innovations.
    noise_score: (3,) d log-likelihood / d ln(variance). jerk_score: (m, 6) d log-likelihood / d jerk element.
    heads: smoothed state and covariance at each start.
    """

    state: FloatArray
    sigma: FloatArray
    los_sigma: FloatArray
    residual: FloatArray
    residual_variance: FloatArray
    nis: FloatArray
    log_likelihood: float
    noise_score: FloatArray
    jerk_score: FloatArray
    heads: list[Start]

    def rows(self, low: int, high: int) -> SmootherRun:
        """Of the samples [low, high) alone; likelihood, scores and heads stay those of the whole run."""
        return SmootherRun._make([*(each[low:high] for each in self[:6]), *self[6:]])


@kernel
def _sweep(
    first: int,
    last: int,
    time: FloatArray,
    z: FloatArray,
    weight: FloatArray,
    noise: FloatArray,
    jerk: FloatArray,
    knot_s: float,
    start_x: FloatArray,
    start_p: FloatArray,
    state: FloatArray,
    sigma: FloatArray,
    los_sigma: FloatArray,
    residual: FloatArray,
    variance: FloatArray,
    nis_out: FloatArray,
    noise_score: FloatArray,
    jerk_score: FloatArray,
    head: FloatArray,
    scores_only: bool,
    residuals_only: bool,
) -> float:
    """Both sweeps over samples [first, last); returns the log-likelihood. With `scores_only` the arrays of the samples
    need only one row, which is scratch. Leaves P+ and N+ of sample
    `first` in `head` (2, 9, 9)."""
    factor, b, c, s = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    q, z_hat, used = np.zeros((3, 3)), np.zeros(3), np.zeros(3)
    blocks = (last - first + BLOCK - 1) // BLOCK
    size = min(last - first, BLOCK)
    saved_x, saved_p = np.empty((blocks, 9)), np.empty((blocks, 9, 9))
    xs, ps = np.empty((size, 9)), np.empty((size, 9, 9))
    hs, es, cs = np.empty((size, 3, 3)), np.empty((size, 3)), np.empty((size, 3))
    s_invs, gains, pxzs = np.empty((size, 3, 3)), np.empty((size, 9, 3)), np.empty((size, 9, 3))
    r, n, smoothed = np.zeros(9), np.zeros((9, 9)), np.zeros((9, 9))
    u, m, nk, pn = np.zeros(3), np.zeros((3, 3)), np.zeros((9, 3)), np.zeros((9, 9))  # scratch
    x, p = motion.own(start_x, start_p)
    likelihood = 0.0
    for round_ in range(2 * blocks):
        forward_only = round_ < blocks
        block = round_ if forward_only else 2 * blocks - 1 - round_
        low = first + block * BLOCK
        high = min(low + BLOCK, last)
        if forward_only:
            saved_x[block] = x
            saved_p[block] = p
            if block == blocks - 1:
                continue  # its filtering is done on the way back
        else:
            motion.hand_over(saved_x[block], saved_p[block], x, p)
        for k in range(low, high):
            j = k - low
            if k > first:
                piece = motion.knot_index(time[k], time[0], knot_s, jerk.shape[0])
                motion.predict(x, p, time[k] - time[k - 1], jerk[piece], q)
            h, e = hs[j], es[j]
            ukf.linearise(x, p, factor, b, z_hat, h, c)
            innovate(z[k], z_hat, e)
            any_used = False
            for i in range(3):
                used[i] = weight[k, i] if math.isfinite(e[i]) else 0.0
                any_used = any_used or used[i] > 0
                cs[j, i] = c[i, i]
            ukf.cross_covariance(p, h, pxzs[j])
            if any_used:
                nis, gained = ukf.update(x, p, pxzs[j], c, h, e, noise, used, s, s_invs[j], gains[j])
                if not forward_only:
                    nis_out[0 if scores_only else k] = nis
                    likelihood += gained
            else:
                s_invs[j] = 0.0
                gains[j] = 0.0
            xs[j] = x
            ps[j] = p
        if forward_only:
            continue
        for k in range(high - 1, low - 1, -1):
            j = k - low
            if k == first:
                head[0] = ps[j]
                head[1] = n
            row = 0 if scores_only else k
            if not scores_only and (not residuals_only or k == first):
                backward.estimate(xs[j], ps[j], r, n, pn, smoothed, state[k], sigma[k], los_sigma[k])
            backward.absorb(
                r, n, u, m, nk, hs[j], es[j], cs[j], s_invs[j], gains[j], pxzs[j], weight[k], noise,
                residual[row], variance[row], noise_score,
            )  # fmt: skip
            if k > first:
                interval = time[k] - time[k - 1]
                piece = motion.knot_index(time[k], time[0], knot_s, jerk.shape[0])
                backward.score_jerk(r, n, interval, q, jerk_score[piece])
                motion.adjoint(r, n, interval)
    return likelihood


def smoothed_covariance(p: FloatArray, n: FloatArray) -> FloatArray:
    """P - P N P as L (I - L' N L) L' with P = L L' and eigenvalues kept positive whatever the rounding. (9, 9).

    Of a run that has diverged, P itself.
    """
    if not (np.isfinite(p).all() and np.isfinite(n).all()):
        return p
    scale = np.sqrt(np.diag(p))
    factor = scale[:, None] * np.linalg.cholesky(p / np.outer(scale, scale) + 1e-12 * np.eye(9))
    share, turn = np.linalg.eigh(np.eye(9) - factor.T @ n @ factor)
    half = factor @ turn * np.sqrt(np.maximum(share, 1e-12))
    result: FloatArray = half @ half.T
    return result


class Scores(NamedTuple):
    """The likelihood of a model and its slope: noise (3,) by ln(variance), jerk (m, 6) by each element."""

    log_likelihood: float
    noise: FloatArray
    jerk: FloatArray


def score_log(
    time_s: FloatArray, measurement: FloatArray, weight: FloatArray, model: Model, starts: list[Start]
) -> Scores:
    """The likelihood and its scores alone, at half the cost of `smooth_log`; arguments as there."""
    scratch = (np.empty((1, 9)), np.empty((1, 9)), np.empty((1, 6)), np.empty((1, 3)), np.empty((1, 3)), np.empty(1))
    noise, jerk, ends = np.zeros(3), np.zeros_like(model.jerk), np.empty((2, 9, 9))
    likelihood = 0.0
    for start, stop in zip(starts, [s.sample for s in starts[1:]] + [len(time_s)], strict=True):
        likelihood += _sweep(
            start.sample, stop, time_s, measurement, weight, model.noise_variance, model.jerk, model.knot_s,
            start.state, start.covariance, *scratch, noise, jerk, ends, True, True,
        )  # fmt: skip
    return Scores(likelihood, noise, jerk)


def smooth_log(
    time_s: FloatArray,
    measurement: FloatArray,
    weight: FloatArray,
    model: Model,
    starts: list[Start],
    residuals_only: bool = False,
) -> SmootherRun:
    """Smooth the whole log; the record on each side of a start is smoothed by itself.

    time_s (n,), measurement (n, 3), weight (n, 3) in [0, 1]. Samples before the first start are extrapolated.
    residuals_only: states and sigmas are left undefined, for who needs only what the record says of its readings.
    """
    n = len(time_s)
    state, sigma, los_sigma = np.empty((n, 9)), np.empty((n, 9)), np.empty((n, 6))
    residual, variance, nis = np.empty((n, 3)), np.empty((n, 3)), np.full(n, np.nan)
    noise_score, jerk_score = np.zeros(3), np.zeros_like(model.jerk)
    likelihood = 0.0
    heads: list[Start] = []
    for start, stop in zip(starts, [s.sample for s in starts[1:]] + [n], strict=True):
        ends = np.empty((2, 9, 9))
        likelihood += _sweep(
            start.sample, stop, time_s, measurement, weight, model.noise_variance, model.jerk, model.knot_s,
            start.state, start.covariance, state, sigma, los_sigma, residual, variance, nis, noise_score, jerk_score,
            ends, False, residuals_only,
        )  # fmt: skip
        heads.append(Start(start.sample, state[start.sample].copy(), smoothed_covariance(*ends)))
    head = heads[0]
    extrapolate_back(
        head.sample, time_s, measurement, model.noise_variance, model.jerk, model.knot_s, head.state.copy(),
        head.covariance.copy(), state, sigma, los_sigma, residual, variance,
    )  # fmt: skip
    return SmootherRun(state, sigma, los_sigma, residual, variance, nis, likelihood, noise_score, jerk_score, heads)
