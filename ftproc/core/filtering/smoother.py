"""The fixed-interval smoother, and what the same backward pass tells about outliers, noise and manoeuvres.

Rauch-Tung-Striebel estimates in Bryson-Frazier form (the dynamics are linear, so the two are equal), with the whitened
innovations of `ukf`: with v = y - U r, W = I + U N U', going backward

    r <- r + G' v            N <- N - G'(U N) - (N U')G + G' W G        over a measurement
    r <- Phi' r              N <- Phi' N Phi                            over an interval
    x^s = x+ + P+ r+         P^s = P+ - P+ N+ P+

No covariance is inverted. From the same quantities come, at no further cost (de Jong 1988, 1989; Koopman and
Shephard 1992):

* with u = L^-T v and M = L^-T W L^-1, the leave-one-out residual of each used component, u_i / M_ii with variance
  1 / M_ii (what the rest of the record predicts for it), exact to rounding;
* the score of the likelihood by each noise variance, 1/2 sum(u_i^2 - M_ii), and by each element of each piece of
  the jerk tensor, 1/2 sum of c(T) contracted with (r r' - N).

Memory stays small on long logs: a forward sweep keeps a checkpoint every BLOCK samples, and the backward sweep
filters each block again.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import empty, kernel, part, variant, zeros
from ftproc.core.filtering import backward, sites, ukf
from ftproc.core.filtering.filters import COLOURED, ColouredFilters, Filter, Filters
from ftproc.core.filtering.forward import ESTIMATED, LEFT, Estimates, Residuals, Span, advance, extrapolated
from ftproc.core.filtering.records import Model, Observations, Sample, Samples, Start, between
from ftproc.core.model import motion
from ftproc.core.signatures import Matrix

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
    heads: tuple[Start, ...]

    def rows(self, low: int, high: int) -> SmootherRun:
        """Of the samples [low, high) alone; likelihood, scores and heads stay those of the whole run."""
        return SmootherRun._make([*(each[low:high] for each in self[:6]), *self[6:]])


SCORES, RESIDUALS, STATES = 0, 1, 2  # what is kept of each sample: nothing, residuals, states too


class Memory(NamedTuple):
    """What a sweep works on: `filters.Filter` records, one for each sample of a block and one for the state before each
    block, and one `backward.Backward`; and what it fills, sample by sample of the log."""

    block: Filters
    before: Filters
    back: backward.Backwards
    estimates: Estimates
    residuals: Residuals


class ColouredMemory(NamedTuple):
    """The same of a state that ends with the offsets of the measurements."""

    block: ColouredFilters
    before: ColouredFilters
    back: backward.ColouredBackwards
    estimates: Estimates
    residuals: Residuals


def memory_of(samples: int, first: Any, estimates: Any, residuals: Any) -> Any:
    """For a span of so many samples that begins with a filter (an array of one record)."""
    coloured = first.dtype == COLOURED
    before, block = empty(first.dtype, -(-samples // BLOCK)), empty(first.dtype, min(samples, BLOCK))
    before[:1] = first
    block["wander"], block["fade_s"] = first["wander"][0], first["fade_s"][0]
    back = zeros(backward.COLOURED if coloured else backward.BACKWARD)
    return (ColouredMemory if coloured else Memory)(block, before, back, estimates, residuals)


@part
def _take_in(f: Filter, sample: Sample) -> tuple[float, float]:
    """Update by a sample; NIS, NaN where nothing is used, and the log-likelihood. All that the way back needs stays in
    the record."""
    sites.expect_at(sample, f)
    ukf.innovate(sample, f)
    any_used = ukf.use(sample.weight, f)
    nis, gained = ukf.update(f)
    return (nis, gained) if any_used else (math.nan, 0.0)


@part
def _copy_state(source: Filter, target: Filter) -> None:
    for i in range(len(source.x)):
        target.x[i] = source.x[i]
        for j in range(len(source.x)):
            target.p[i, j] = source.p[i, j]


_store = backward.store  # of the sweep below; that for steps has another


@part
def _keep(memory: Any, b: int) -> None:
    """What a variant of the sweep does where a block begins, see `biases`: it keeps its own state for the block,"""


@part
def _recall(memory: Any, b: int) -> None:
    """takes it again,"""


@part
def _carry(memory: Any, f: Filter, k: int, interval: float, place: int) -> None:
    """takes it over an interval and an update, at a place of the block (-1: of none)"""


@part
def _carry_back(memory: Any, f: Filter, k: int, interval: float, place: int, kept: int) -> None:
    """and back."""


def _swept_through(
    span: Span, samples: Samples, profile: motion.Profile, memory: Memory, jerk_score: Matrix, kept: int
) -> float:
    """Both sweeps over a span; the log-likelihood. Adds to the jerk score (m, 6); fills what is kept. At the end `back`
    holds the state of the first sample, if anything is kept."""
    block, before, back = memory.block, memory.before, memory.back[0]
    estimates, residuals = memory.estimates, memory.residuals
    f = block[0]
    _copy_state(before[0], f)
    for b in range(1, len(before)):
        for k in range(span.first + (b - 1) * BLOCK, span.first + b * BLOCK):
            if k > span.first:
                advance(f, samples, k, profile)
            _take_in(f, samples[k])
            _carry(memory, f, k, samples[k].time_s - samples[max(k - 1, span.first)].time_s, -1)
        _copy_state(f, before[b])
        _keep(memory, b)
    likelihood = 0.0
    for b in range(len(before) - 1, -1, -1):
        low = span.first + b * BLOCK
        high = min(low + BLOCK, span.last)
        _recall(memory, b)
        for k in range(low, high):
            f = block[k - low]
            _copy_state(before[b] if k == low else block[k - low - 1], f)
            if k > span.first:
                advance(f, samples, k, profile)
            nis, gained = _take_in(f, samples[k])
            _carry(memory, f, k, samples[k].time_s - samples[max(k - 1, span.first)].time_s, k - low)
            likelihood += gained
            if kept >= RESIDUALS:
                residuals[k].nis = nis
        for k in range(high - 1, low - 1, -1):
            f = block[k - low]
            if kept == STATES or (kept == RESIDUALS and k == span.first):
                backward.estimate(back, f)
            if kept == STATES:
                _store(back, f, estimates[k])
            if k == span.first:
                back.n_first[:] = back.n
            backward.absorb(back, f)
            if kept >= RESIDUALS:
                for i in range(3):
                    residuals[k].residual[i] = back.residual[i]
                    residuals[k].residual_variance[i] = back.variance[i]
            _carry_back(memory, f, k, samples[k].time_s - samples[max(k - 1, span.first)].time_s, k - low, kept)
            if k > span.first:
                interval = samples[k].time_s - samples[k - 1].time_s
                backward.score_jerk(back, interval, jerk_score[motion.knot_index(samples[k].time_s, profile)])
                backward.score_wander(back, f, interval)
                motion.adjoint(back, interval)
                motion.wander_back(back, interval, f.fade_s)
            else:
                backward.score_wander(back, f, math.inf)
    return likelihood


swept_through = _swept_through  # for variants with other memories

_sweep = kernel(variant(_swept_through, __name__, "_sweep"))
_sweep_coloured = kernel(variant(_swept_through, __name__, "_sweep_coloured", memory=ColouredMemory))


def smoothed_covariance(p: FloatArray, n: FloatArray) -> FloatArray:
    """P - P N P as L (I - L' N L) L' with P = L L' and eigenvalues kept positive whatever the rounding. (m, m).

    Of a run that has diverged, P itself.
    """
    if not (np.isfinite(p).all() and np.isfinite(n).all()):
        return p
    scale = np.sqrt(np.where(np.diag(p) > 0, np.diag(p), 1.0))
    factor = scale[:, None] * np.linalg.cholesky(p / np.outer(scale, scale) + 1e-12 * np.eye(len(p)))
    share, turn = np.linalg.eigh(np.eye(len(p)) - factor.T @ n @ factor)
    half = factor @ turn * np.sqrt(np.maximum(share, 1e-12))
    result: FloatArray = half @ half.T
    return result


class Scores(NamedTuple):
    """The likelihood of a model and its slope: noise and wander (3,) by ln(variance), jerk (m, 6) by each element."""

    log_likelihood: float
    noise: FloatArray
    wander: FloatArray
    jerk: FloatArray


class _Swept(NamedTuple):
    """What the sweeps over a log leave behind: `Estimated` and `Left` records of its samples, where they are kept."""

    scores: Scores
    estimates: Any
    residuals: Any
    heads: tuple[Start, ...]


def _swept(log: Observations, model: Model, starts: list[Start], kept: int) -> _Swept:
    n = len(log.time_s)
    samples, profile = log.samples(model.noise_variance), model.profile(log.time_s)
    sweep = _sweep_coloured if model.coloured else _sweep
    estimates, residuals = zeros(ESTIMATED, n if kept == STATES else 0), zeros(LEFT, n if kept != SCORES else 0)
    noise, wander, jerk, likelihood, heads = np.zeros(3), np.zeros(3), np.zeros_like(model.jerk), 0.0, []
    for start, stop in between(starts, n):
        memory = memory_of(stop - start.sample, model.filter(start), estimates, residuals)
        likelihood += sweep(Span(start.sample, stop, start.sample), samples, profile, memory, jerk, kept)
        noise += memory.back["noise_score"][0]
        wander += memory.back["wander_score"][0]
        if kept == STATES or (kept == RESIDUALS and start.sample > 0):
            covariance = smoothed_covariance(memory.block["p"][0], memory.back["n_first"][0])[:9, :9]
            heads.append(Start(start.sample, memory.back["state"][0, :9].copy(), covariance))
    return _Swept(Scores(likelihood, noise, wander, jerk), estimates, residuals, tuple(heads))


def score_log(log: Observations, model: Model, starts: list[Start]) -> Scores:
    """The likelihood and its scores alone, at half the cost of `smooth_log`."""
    return _swept(log, model, starts, SCORES).scores


def smooth_log(log: Observations, model: Model, starts: list[Start], residuals_only: bool = False) -> SmootherRun:
    """Smooth the whole log; the record on each side of a start separately. Samples before the first start are
    extrapolated.

    residuals_only: states and sigmas are left out (of no sample), which saves a third of the time, and most heads.
    """
    scores, estimates, residuals, heads = _swept(log, model, starts, RESIDUALS if residuals_only else STATES)
    first = starts[0].sample
    if first > 0:
        before, residuals[:first] = extrapolated(log, model, heads[0])
        estimates[:first] = before[: len(estimates)]
    fields = {name: estimates[name] for name in ESTIMATED.names or ()}
    fields |= {name: np.ascontiguousarray(residuals[name]) for name in LEFT.names or ()}
    return SmootherRun(
        **fields, log_likelihood=scores.log_likelihood, noise_score=scores.noise, jerk_score=scores.jerk, heads=heads
    )
