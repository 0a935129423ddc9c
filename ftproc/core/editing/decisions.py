"""Outlier decisions that stand still: smoother and Markov indicators by turns, with noise and jerk tuned between."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.editing import outlier_chain
from ftproc.core.filtering.initialization import begin_all
from ftproc.core.filtering.records import Model, Start
from ftproc.core.filtering.smoother import smooth_log
from ftproc.core.identification import coloured_noise, likelihood

FloatArray = NDArray[np.float64]

MAX_ROUNDS = 8
TUNING_ROUNDS = 3
READMITTED = 0.8  # probability of being good from which a rejected reading is used again, after these: else some
# swing to and fro, each time changing what the smoother says of themselves
STILL = 1e-4  # share of the readings that may still change sides when the decisions stand still
FEWEST_KEPT = 0.5  # share of what screening trusts that must survive the decisions, in each component


class Record(NamedTuple):
    """What stays the same while the decisions are made: the log, the readings that may be good at all (n, 3), what
    screening trusts (n, 3) and the noise 1-sigma (3,) that it saw, which noises are given (3,), whether the jerk is,
    and the gate in sigmas."""

    time_s: FloatArray
    measurement: FloatArray
    possible: NDArray[np.bool_]
    screened: FloatArray
    sigma: FloatArray
    known: NDArray[np.bool_]
    fix_jerk: bool
    gate: float

    @property
    def log(self) -> tuple[FloatArray, FloatArray]:
        """time_s and measurement."""
        return self.time_s, self.measurement

    def part(self, span: slice) -> Record:
        """The record of a stretch of the log."""
        return self._replace(
            time_s=self.time_s[span], measurement=self.measurement[span], possible=self.possible[span],
            screened=self.screened[span],
        )  # fmt: skip


class Decision(NamedTuple):
    """Weights (n, 3), the model and starts they were made with, the learnt outlier rates (3, 3), how many rounds it
    took, whether they stand still, and whether the noise is correlated too slowly to be told from motion."""

    weight: FloatArray
    model: Model
    starts: list[Start]
    rates: FloatArray
    rounds: int = 0
    settled: bool = False
    slow_noise: bool = False


def decide(record: Record, begun: Decision, tune_first: bool) -> Decision:
    """Tune, smooth and classify by turns until the decisions stand still."""
    time_s, measurement = record[:2]
    weight, model, starts, rates = begun.weight, begun.model, begun.starts, begun.rates.copy()
    rounds, settled = 0, False
    while rounds < MAX_ROUNDS and not settled:
        if rounds < TUNING_ROUNDS and (tune_first or rounds > 0) and not model.correlation.any():
            model = likelihood.fit_level(
                time_s, measurement, weight, starts, model, record.known, record.fix_jerk, record.sigma
            )
        smoothed = smooth_log(time_s, measurement, weight, model, starts, residuals_only=True)
        variance = smoothed.residual_variance - model.noise_variance + model.reading_variance
        good = outlier_chain.classify(smoothed.residual, variance, model.reading_variance, rates, record.gate)
        sure = np.where((weight > 0) | (rounds < TUNING_ROUNDS), 0.5, READMITTED)
        decided = _keep_most(((good > sure) & record.possible).astype(float), record.screened)
        settled = int((decided != weight).sum()) <= STILL * weight.size and (rounds > 0 or not tune_first)
        weight = decided
        rounds += 1
        starts = begin_all(time_s, measurement, weight, model.noise_variance, float(model.jerk[0, 0]))
    return Decision(weight, model, starts, rates, begun.rounds + rounds, settled)


def allow_for_colour(record: Record, decision: Decision) -> Decision:
    """The decisions made again with correlated noise, if the noise is correlated; where it is so slowly that it cannot
    be told from motion, the decision says so."""
    weight, model, starts = decision.weight, decision.model, decision.starts
    smoothed = smooth_log(*record.log, weight, model, starts, residuals_only=True)
    if not coloured_noise.is_correlated(smoothed, weight, model.noise_variance):
        return decision
    level = likelihood.median_level(model)
    model = coloured_noise.fit_coloured(*record.log, weight, starts, level, record.known, record.fix_jerk)
    if not model.correlation.any():
        return decision._replace(slow_noise=True)
    return decide(record, decision._replace(model=model), tune_first=False)


def _keep_most(decided: FloatArray, screened: FloatArray) -> FloatArray:
    """The decisions (n, 3), but for a component of which hardly anything would be left: a filter that has gone
    astray calls everything bad, and screening knows better."""
    lost = decided.sum(0) < FEWEST_KEPT * screened.sum(0)
    return np.where(lost, screened, decided)
