"""Outlier decisions that stand still: the smoother and the hidden Markov chain alternate, with noise and jerk tuned in
between."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.components import any_of, totals
from ftproc.core.editing import outlier_chain
from ftproc.core.filtering.initialization import find_starts
from ftproc.core.filtering.records import Model, Observations, Start, Uneven
from ftproc.core.filtering.smoother import RESIDUALS, smooth_log
from ftproc.core.identification import coloured_noise, uneven_noise
from ftproc.core.identification.likelihood import Fixed, fit_level, representative
from ftproc.core.identification.nearby import samples_around, smoothed_near
from ftproc.core.identification.profile import median_level
from ftproc.core.identification.stretches import widened
from ftproc.core.work import Work
from ftproc.records import FloatArray

MAX_ROUNDS = 8
TUNING_ROUNDS = 3
STILL = 1e-4  # share of the readings that may still change sides when the decisions stand still
IMPRECISE = (0.3, 0.03, 0.003)  # shares of the variance of late time stamps by which they may move the components
# apart: the rates at which these change are not known better, and do not stay the same
TAILS, RARE = 0.5, 0.005  # share of what lies outside the gate that lies just outside, and of all readings, to be tails
MOST_IN_TAILS = 0.05  # share of all readings: of more, nobody knows whether they are tails or outliers
NORMALLY, FALLING = 3.0, 1.0  # times as many as a normal distribution has there, and as farther out
GATE_STEP, WIDEST_GATE = 1.1, 2.5  # by which a gate is widened, and times itself at most
ROUNDED = 0.5  # of a component's noise that rounding makes
FEW_CHANGED, ALIKE = 0.25, 1e-9  # share of a log around what has changed, to smooth only that; of what is the same
FEWEST_KEPT = 0.5  # share of what screening trusts that must survive the decisions, in each component


class Record(NamedTuple):
    """What stays the same while decisions are made: the log, the readings that may be good at all (n, 3), what
    screening trusts (n, 3) and the noise 1-sigma (3,) that it saw, what the user has fixed, the gate in sigmas, the
    1-sigma (3,) that rounding alone makes, what work is left for alternatives, and how the noise of single readings
    differs, if it does; surely: if it grows only where neighbours differ more, too. white: whether the noise is taken
    for white and even. accepted: (n, 3), by hand. whole: no spans stand for a long log."""

    time_s: FloatArray
    measurement: FloatArray
    possible: NDArray[np.bool_]
    screened: FloatArray
    sigma: FloatArray
    fixed: Fixed
    gate: float
    rounding: FloatArray
    work: Work
    uneven: Uneven | None = None
    white: bool = False
    accepted: NDArray[np.bool_] | None = None
    surely: Uneven | None = None
    whole: bool = False

    def with_accepted(self, weight: FloatArray) -> FloatArray:
        """Weights (n, 3) with the readings used that are good by hand."""
        return weight if self.accepted is None else np.where(self.accepted, 1.0, weight)

    def weighted(self, weight: FloatArray) -> Observations:
        """The log with weights (n, 3)."""
        return Observations(self.time_s, self.measurement, weight, self.uneven)

    def part(self, span: slice) -> Record:
        """The record of a stretch of the log."""
        return self._replace(
            time_s=self.time_s[span], measurement=self.measurement[span], possible=self.possible[span],
            screened=self.screened[span], uneven=None if self.uneven is None else self.uneven.part(span),
            accepted=None if self.accepted is None else self.accepted[span],
        )  # fmt: skip


class Residuals(NamedTuple):
    """What the readings used say of each other: leave-one-out residuals (n, 3) m, rad, rad, and their variances."""

    residual: FloatArray
    variance: FloatArray


class Decision(NamedTuple):
    """Weights (n, 3), the model and starts they were made with, the estimated outlier rates (3, 3), how many rounds it
    took, whether they stand still, for how many runs no work was left to try alternatives, the 1-sigma of the
    time stamps, s, the log-probability of their being as late as they are, whether the noise drifts, a model with
    correlated noise that explains the log as well or better, but is not followed, that with the slowest noise of the
    one that is followed, and the residuals by which `decide` made them."""

    weight: FloatArray
    model: Model
    starts: list[Start]
    rates: FloatArray
    rounds: int = 0
    settled: bool = False
    unexamined: int = 0
    stamp_s: float = 0.0
    stamps: float = 0.0
    drifts: bool = False
    alternative: coloured_noise.Coloured | None = None
    slowest: Model | None = None
    residuals: Residuals | None = None


def decide(record: Record, initial: Decision, tune_first: bool) -> Decision:
    """Tune, smooth and classify in turn until the decisions stand still.

    Some readings would alternate for ever, each time changing what the smoother says of themselves: once the model
    stands still, it is the mean of the rounds that decides on them.
    """
    weight, model, starts, rates = initial.weight, initial.model, initial.starts, initial.rates.copy()
    rounds, settled, mean, last = 0, False, np.zeros_like(weight), None
    while rounds < MAX_ROUNDS and not settled:
        log = record.weighted(weight)
        if rounds < TUNING_ROUNDS and (tune_first or rounds > 0) and not model.coloured:
            model = fit_level(log, starts, model, record.fixed, record.sigma, record.rounding, record.whole)
        last = _smoothed(log, model, starts, last)
        good = outlier_chain.classify(*last.residuals, model.reading_variance, rates, record.gate)
        mean += (good - mean) / max(rounds - TUNING_ROUNDS + 1, 1)
        decided = record.with_accepted(_keep_most(np.where(record.possible, mean > 0.5, 0.0), record.screened))
        settled = int((decided != weight).sum()) <= STILL * weight.size and (rounds > 0 or not tune_first)
        weight = decided
        rounds += 1
        starts = find_starts(record.weighted(weight), model.noise_variance, float(model.jerk[0, 0]))
    return initial._replace(
        weight=weight, model=model, starts=starts, rates=rates, rounds=initial.rounds + rounds, settled=settled,
        residuals=None if last is None else last.residuals,
    )  # fmt: skip


class _Smoothed(NamedTuple):
    """A log as it was smoothed, with which model and starts, and the residuals."""

    log: Observations
    model: Model
    starts: list[Start]
    residuals: Residuals


def _smoothed(log: Observations, model: Model, starts: list[Start], before: _Smoothed | None) -> _Smoothed:
    """The log smoothed; where it was smoothed before with the same model, only around the readings that have changed
    sides since then."""
    if before is not None and _alike(model, starts, before):
        changed = any_of(log.weight != before.log.weight)
        if not changed.any():
            return before._replace(log=log, starts=starts)
        around = samples_around(log, median_level(model))
        reached = widened(changed, around // 2)
        if widened(reached, around).mean() < FEW_CHANGED:
            samples, smoothed = smoothed_near(log, model, reached, around)
            inside = reached[samples]
            residual, variance = (each.copy() for each in before.residuals)
            residual[samples[inside]] = smoothed.residual[inside]
            variance[samples[inside]] = smoothed.residual_variance[inside]
            return _Smoothed(log, model, starts, Residuals(residual, variance))
    smoothed = smooth_log(log, model, starts, RESIDUALS)
    return _Smoothed(log, model, starts, Residuals(smoothed.residual, smoothed.residual_variance))


def _alike(model: Model, starts: list[Start], before: _Smoothed) -> bool:
    """Whether model and starts are those with which the log was smoothed before, but for rounding."""
    if [start.sample for start in starts] != [start.sample for start in before.starts]:
        return False
    one, other = (
        np.concatenate([m.noise_variance, m.jerk.ravel(), m.markov_variance, m.tau_s]) for m in (model, before.model)
    )
    same = model.knot_s == before.model.knot_s and len(one) == len(other)
    return same and bool((np.abs(one - other) <= ALIKE * other).all())


class LateStamps(NamedTuple):
    """Time stamps that are late now and then. sigma_s: 1-sigma, s. late: (n, 3) what that adds to the readings, m, rad,
    rad. variance: (3,) of the noise beside it."""

    sigma_s: float
    late: FloatArray
    variance: FloatArray


def late_stamps(record: Record, decision: Decision) -> LateStamps | None:
    """Whether time stamps are late now and then, by the residuals that the decisions leave."""
    log, model, starts = record.weighted(decision.weight), decision.model, decision.starts
    part, inside = representative(log, starts, model.noise_variance, float(model.jerk[0, 0]))
    variance, stamp_variance = uneven_noise.stamp_variance(part, smooth_log(part, model, inside), model)
    if stamp_variance == 0.0:
        return None
    late = math.sqrt(stamp_variance) * uneven_noise.rates(smooth_log(log, model, starts).state)
    variance = np.where(record.fixed.noise, model.noise_variance, np.maximum(variance, record.rounding**2))
    return LateStamps(math.sqrt(stamp_variance), late, variance)


def allow_for_late_stamps(
    record: Record, decision: Decision, stamps: LateStamps, imprecise: float
) -> tuple[Record, Decision]:
    """The record with noise that grows with the rates of the readings, and the decisions made again. imprecise: see
    IMPRECISE."""
    uneven = _with_late(record, stamps.late, stamps.variance, imprecise)
    record = record._replace(sigma=np.sqrt(stamps.variance), uneven=uneven)
    model = median_level(decision.model)._replace(noise_variance=stamps.variance)
    return record, decide(record, decision._replace(model=model, stamp_s=stamps.sigma_s), tune_first=True)


def allow_for_very_late_stamps(
    record: Record, decision: Decision, imprecise: float, even: Record
) -> tuple[Record, Decision]:
    """The record with a variance for each time stamp, and the decisions made again: a few may be so late that all
    readings of their samples, and then those around them, resemble outliers. even: the record as it was before late
    stamps were allowed for."""
    log = record.weighted(decision.weight)
    smoothed = smooth_log(log, decision.model, decision.starts)
    stamps = uneven_noise.each_stamp(log, smoothed, decision.model, decision.stamp_s**2)
    late = np.sqrt(stamps.variance)[:, None] * uneven_noise.rates(smoothed.state)
    uneven = _with_late(even, late, decision.model.noise_variance, imprecise)
    record = even._replace(sigma=record.sigma, uneven=uneven)
    return record, decide(record, decision._replace(stamps=stamps.log_probability), tune_first=True)


def _with_late(record: Record, late: FloatArray, variance: FloatArray, imprecise: float) -> Uneven:
    """How the noise differs where late stamps add late (n, 3) to the readings, beside noise of variance (3,)."""
    times = 1.0 if record.uneven is None else record.uneven.times
    return Uneven(times + imprecise * late**2 / variance, late)


def _residuals(record: Record, decision: Decision) -> Residuals:
    """Those by which the decisions were made, if they stand still."""
    if decision.settled and decision.residuals is not None:
        return decision.residuals
    return _smoothed(record.weighted(decision.weight), decision.model, decision.starts, None).residuals


def allow_for_tails(record: Record, decision: Decision) -> tuple[Record, Decision]:
    """The record with a wider gate, and the decisions made again, if most of what is rejected lies just outside it:
    then the noise has tails, and it is they that are rejected."""
    residual, variance = _residuals(record, decision)
    off = np.abs(residual) / np.sqrt(variance)
    off, gate = np.where(record.possible, off, 0.0), record.gate
    while gate < WIDEST_GATE * record.gate and _has_tails(off, gate, int(record.possible.sum())):
        gate *= GATE_STEP
    if gate == record.gate:
        return record, decision
    record = record._replace(gate=gate)
    return record, decide(record, decision, tune_first=True)


def _has_tails(off: FloatArray, gate: float, count: int) -> bool:
    """Whether most residuals (n, 3), in sigmas, that lie outside a gate are alone and not twice as far, ever fewer with
    the distance, and these are too many, among so many readings, for a normal distribution."""
    outside = np.pad(off > gate, ((1, 1), (0, 0)))
    alone = outside[1:-1] & ~outside[:-2] & ~outside[2:]
    near, far = (
        int((alone & (off > low * gate) & (off < math.sqrt(2) * low * gate)).sum()) for low in (1, math.sqrt(2))
    )
    normal = NORMALLY * count * math.erfc(gate / math.sqrt(2))
    few = int(outside.sum()) <= MOST_IN_TAILS * count
    return few and near > FALLING * far and near + far > max(TAILS * int(outside.sum()), RARE * count, normal)


def allow_for_drift(record: Record, decision: Decision, rejected: bool = False) -> tuple[Record, Decision]:
    """The record with noise that drifts, and the decisions made again, if it does. rejected: by what was, too."""
    if _repeats(record, decision):
        return record, decision
    log = record.weighted(record.possible.astype(float) if rejected else decision.weight)
    if (drifting := uneven_noise.drift(log, *(residuals := _residuals(record, decision)))) is None:
        return record, decision
    drifted, known = uneven_noise.drifted, record.surely if decision.drifts else record.uneven
    surely = drifted(known, uneven_noise.drift(log, *residuals, by_neighbours=True))
    record = record._replace(uneven=drifted(record.uneven, drifting), surely=surely)
    return record, decide(record, decision._replace(model=median_level(decision.model), drifts=True), tune_first=True)


def _repeats(record: Record, decision: Decision) -> bool:
    """Whether readings repeat because they are rounded. Their errors last as long as they do, and are as large as the
    target is slow, but that is known."""
    rounded = record.rounding > ROUNDED * np.sqrt(decision.model.noise_variance)
    return record.uneven is not None and bool(rounded.any())


def allow_for_colour(record: Record, decision: Decision) -> Decision:
    """The decisions made again with correlated noise, if the noise is correlated; where such a model is only a little
    better than that of white noise, or cannot be separated from motion, it is an alternative."""
    if _repeats(record, decision):
        return decision
    log, starts = record.weighted(decision.weight), decision.starts
    smoothed = smooth_log(log, decision.model, starts, RESIDUALS)
    if not coloured_noise.may_be(log, smoothed, decision.model):
        return decision
    found = coloured_noise.fit_coloured(log, starts, median_level(decision.model), record.fixed)
    if found.likelier and found.separable:
        coloured = decision._replace(model=found.fastest, slowest=found.slowest)
        again = decide(record, coloured, tune_first=False)
        return again if again.settled else coloured
    return decision._replace(alternative=found) if found.possible else decision


def _keep_most(decided: FloatArray, screened: FloatArray) -> FloatArray:
    """The decisions (n, 3), but for a component that loses almost all: a diverged filter calls everything bad."""
    lost = totals(decided) < FEWEST_KEPT * totals(screened)
    return np.where(lost, screened, decided)
