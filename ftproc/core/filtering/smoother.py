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
* the score of the likelihood by each noise variance, 1/2 sum(u_i^2 - M_ii), and by the jerk density of each axis in
  each piece of the profile, 1/2 sum of c(T) contracted with (r r' - N). The two sums are kept apart, see `Slope`.

A forward sweep keeps what each update leaves for the way back, of `memory.BLOCK` samples at most; of a longer log it
keeps the state before each block as well, and the way back filters all blocks but the last again.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core import pacing
from ftproc.core.compiled import empty, kernel, part, variant
from ftproc.core.filtering import backward, beside, heads, ukf
from ftproc.core.filtering.filters import OFFSETS, Filter, Update, retain, retain_linearised, retain_state
from ftproc.core.filtering.forward import ESTIMATED, LEFT, Span, advance, extrapolated
from ftproc.core.filtering.memory import ColouredMemory, Memory, Scores, Slope, memory_of, scratch
from ftproc.core.filtering.records import SAMPLE, Model, Observations, Sample, Samples, Start, between
from ftproc.core.model import forces, motion
from ftproc.core.signatures import Cube

FloatArray = NDArray[np.float64]


class SmootherRun(NamedTuple):
    """What the whole record says of each sample.

    state: (n, 9), SI units. sigma: (n, 9) 1-sigma. los_sigma, path_sigma: (n, 6) as in FilterRun.
    residual: (n, 3) leave-one-out residual m, rad, rad; NaN where missing. residual_variance: (n, 3) its variance at
    full weight. nis: (n,) of the innovations used in the forward sweep. log_likelihood: of those innovations. heads:
    smoothed state and covariance at each start.
    """

    state: FloatArray
    sigma: FloatArray
    los_sigma: FloatArray
    path_sigma: FloatArray
    residual: FloatArray
    residual_variance: FloatArray
    nis: FloatArray
    log_likelihood: float
    heads: tuple[Start, ...]

    def rows(self, low: int, high: int) -> SmootherRun:
        """Of the samples [low, high) alone; likelihood and heads stay those of the whole run."""
        return SmootherRun._make([*(each[low:high] for each in self[:7]), *self[7:]])


#: What is wanted of a sweep: the likelihood; its scores too; in place of the jerk's, the residuals of each sample; the
#: state at each start too; that of each sample too; and the sigmas of `kinematics`.
LIKELIHOOD, SCORES, RESIDUALS, HEADS, STATES, PATHS = range(6)


@part
def take_in(f: Filter, sample: Sample) -> tuple[float, float]:
    """Update by a sample; NIS, NaN where nothing is used, and the log-likelihood."""
    ukf.expect_at(sample, f)
    ukf.innovate(sample, f)
    any_used = ukf.use(sample.weight, f)
    nis, gained = ukf.update(f)
    return (nis, gained) if any_used else (math.nan, 0.0)


@part
def _leaves_some(f: Filter, sample: Sample) -> bool:
    """Whether a reading is there, but is not used."""
    left = False
    for i in range(3):
        left = left or (math.isfinite(sample.measurement[i]) and not f.used[i] > 0)
    return left


@part
def _copy_state(source: Filter, target: Filter) -> None:
    for i in range(len(source.x)):
        target.x[i] = source.x[i]
        for j in range(len(source.x)):
            target.p[i, j] = source.p[i, j]


_store = heads.store  # of the sweep below; that for steps has another


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
def _carry_back(memory: Any, update: Update, sample: Sample, k: int, interval: float, place: int, wanted: int) -> None:
    """and back."""


@part
def _go_back(back: Any, f: Filter, samples: Samples, k: int, profile: motion.Profile, jerk: Cube, wanted: int) -> None:
    """Take r and N back from sample k to the one before, and add to the jerk's score if that is wanted."""
    interval, piece = samples[k].time_s - samples[k - 1].time_s, motion.knot_index(samples[k].time_s, profile)
    acts = profile.motion.acts
    if acts:
        forces.kick_back(back, f, profile.motion, k, interval)
    if wanted == SCORES:
        if acts:
            forces.orient(f, profile.motion.course[k - 1], profile.motion.course[k])
            forces.score_jerk(back, f, interval, jerk, piece)
        else:
            backward.score_jerk(back, interval, jerk, piece)
    motion.adjoint(back, interval)
    if acts:
        forces.kick_back(back, f, profile.motion, k - 1, interval)
    motion.decorrelate_back(back, interval, f.tau_s)


def _swept_through(
    span: Span, samples: Samples, profile: motion.Profile, memory: Memory, jerk: Cube, wanted: int
) -> float:
    """The sweeps over a span; the log-likelihood. Fills what is wanted; adds to the sums (m, 2, 3) of the jerk's score.
    At the end `back` holds the state of the first sample, if more than scores are wanted."""
    f, before, block, after = memory.filters[0], memory.before, memory.block, memory.after
    back, residuals = memory.back[0], memory.residuals
    likelihood, last = 0.0, len(before) - 1
    for turn in range(2 * last + 1):  # block by block to the last one, and back
        b = last - abs(turn - last)
        low = span.first + b * len(block)
        high = min(low + len(block), span.last)
        if turn <= last:
            _copy_state(f, before[b])
            _keep(memory, b)
        else:
            _copy_state(before[b], f)
            _recall(memory, b)
        for k in range(low, high):
            sample, interval = samples[k], samples[k].time_s - samples[max(k - 1, span.first)].time_s
            if k > span.first:
                advance(f, samples, k, profile)
            if len(profile.beside) > 0:
                gain = beside.take(f.x, f.p, profile.beside, k)
                likelihood += gain if turn <= last else 0.0
            nis, gained = take_in(f, sample)
            _carry(memory, f, k, interval, k - low if turn >= last else -1)
            if turn <= last:
                likelihood += gained
            if turn >= last and wanted >= SCORES:
                retain(f, block[k - low])
                if wanted == STATES or len(f.x) > OFFSETS or (wanted >= RESIDUALS and k == span.first):
                    retain_state(f, after[k - low])
                if wanted >= RESIDUALS:
                    residuals[k].nis = nis
                    if _leaves_some(f, sample):
                        retain_state(f, after[k - low])
                        retain_linearised(f, after[k - low])
        if turn < last or wanted == LIKELIHOOD:
            continue
        for k in range(high - 1, low - 1, -1):
            sample, interval = samples[k], samples[k].time_s - samples[max(k - 1, span.first)].time_s
            update = block[k - low]
            if wanted == STATES:
                _store(memory, f, samples, profile, k, low, b)
            elif wanted >= RESIDUALS and k == span.first:
                backward.estimate(back, after[k - low])
            if k == span.first:
                back.n_first[:] = back.n
            backward.absorb(back, update, after[k - low], sample, wanted >= RESIDUALS)
            if wanted >= RESIDUALS:
                for i in range(3):
                    residuals[k].residual[i] = back.residual[i]
                    residuals[k].residual_variance[i] = back.variance[i]
            if len(profile.beside) > 0:
                beside.absorb(back.r, back.n, back.pn, profile.beside, k)
            _carry_back(memory, update, sample, k, interval, k - low, wanted)
            if k > span.first:
                backward.score_markov(back, f, interval)
                if k > low:
                    backward.score_tau(back, after[k - 1 - low], f, interval)
                else:
                    backward.score_tau(back, before[b], f, interval)
                _go_back(back, f, samples, k, profile, jerk, wanted)
            else:
                backward.score_markov(back, f, math.inf)
    return likelihood


swept_through = _swept_through  # for variants with other memories

_sweep = kernel(variant(_swept_through, __name__, "_sweep"))
_sweep_coloured = kernel(variant(_swept_through, __name__, "_sweep_coloured", memory=ColouredMemory))


class _Swept(NamedTuple):
    """What sweeps leave behind: `Estimated` records of samples, where kept, and `Left` ones until the next sweep."""

    scores: Scores
    estimates: Any
    residuals: Any
    heads: tuple[Start, ...]
    beside: FloatArray


def _swept(log: Observations, model: Model, starts: list[Start], wanted: int) -> _Swept:
    paths, wanted, n = wanted == PATHS, min(wanted, STATES), len(log.time_s)
    pacing.swept(n)
    samples, profile = log.samples(model.noise_variance, scratch(SAMPLE, n)), model.profile_of(log)
    sweep = _sweep_coloured if model.coloured else _sweep
    estimates = empty(ESTIMATED, n if wanted == STATES else 0)
    residuals = scratch(LEFT, n if wanted >= RESIDUALS else 0)
    (noise, markov), tau, jerk = np.zeros((2, 2, 3)), np.zeros(3), np.zeros((len(profile.jerk), 2, 3))
    likelihood, found = 0.0, list[Start]()
    for start, stop in between(starts, n):
        memory = memory_of(stop - start.sample, model.filter(start), estimates, residuals)
        memory.back["paths"] = paths
        likelihood += sweep(Span(start.sample, stop, start.sample), samples, profile, memory, jerk, wanted)
        noise += memory.back["noise"][0]
        markov += memory.back["markov"][0]
        tau += memory.back["tau_score"][0]
        if wanted >= HEADS or (wanted == RESIDUALS and 0 < start.sample == starts[0].sample):
            back, p = memory.back[0], memory.after["p"][0]
            covariance = back["cov"] if wanted == STATES else heads.smoothed_covariance(p, back["n_first"])
            found.append(Start(start.sample, back["state"][:9].copy(), covariance[:9, :9].copy()))
    jerk = jerk[: len(model.jerk)]
    slopes = (Slope(*noise), Slope(*markov), tau, Slope(jerk[:, 0] * model.jerk, jerk[:, 1] * model.jerk))
    return _Swept(Scores(likelihood, *slopes), estimates, residuals, tuple(found), profile.beside)


def likelihood_of(log: Observations, model: Model, starts: list[Start]) -> float:
    """The log-likelihood alone, at half the cost of `score_log`."""
    return _swept(log, model, starts, LIKELIHOOD).scores.log_likelihood


def score_log(log: Observations, model: Model, starts: list[Start]) -> Scores:
    """The likelihood and its scores alone, at half the cost of `smooth_log`."""
    return _swept(log, model, starts, SCORES).scores


def residuals_beside(log: Observations, model: Model, starts: list[Start]) -> FloatArray:
    """(kinds, n, 2) leave-one-out residuals of the log's scalars, NaN where missing, and their variances."""
    return _swept(log, model, starts, RESIDUALS).beside[:, :, beside.RESIDUAL : beside.SPREAD + 1]


def smooth_log(log: Observations, model: Model, starts: list[Start], wanted: int = STATES) -> SmootherRun:
    """Smooth the whole log, on each side of a start separately; samples before the first start are extrapolated.

    wanted: HEADS leaves out states and sigmas (of no sample), which saves half of the time, RESIDUALS also all heads
    but that of a first start after the first sample; PATHS adds path_sigma, which is NaN without it.
    """
    scores, estimates, residuals, starting, _ = _swept(log, model, starts, wanted)
    if (first := starts[0].sample) > 0:
        before, residuals[:first] = extrapolated(log, model, starting[0])
        estimates[:first] = before[: len(estimates)]
    fields = {name: estimates[name] for name in ESTIMATED.names or ()}
    fields |= {name: residuals[name].copy() for name in LEFT.names or ()}
    return SmootherRun(**fields, log_likelihood=scores.log_likelihood, heads=starting)
