"""The correction of live rows, each with what is known by it.

No smoother has seen a live row, but the next readings come: a correction that is right makes the predictions of them
better. So the innovations prove it, by the regression of each on what the correction of the row before changes in its
prediction. It begins from what flights of the packaged family have proven.
"""

from __future__ import annotations

import numpy as np

from ftproc.core.filtering.records import FilterRun
from ftproc.correction import model_file
from ftproc.correction.apply import output_of
from ftproc.correction.features import APPLIED, BoolArray, LineOfSight, lever_m
from ftproc.correction.model import Model, Stage
from ftproc.records import FloatArray

# Chosen on 102 flights of the family and 30 others, of 60 to 90 s: without the innovations one of 26 others of the
# family becomes worse by the factor 1.9, without USUAL one of the 102 by 1.4.
PRIOR, WORTH = 0.4, 30.0  # the gain before a flight has proven any, and how much information that is worth
MEMORY = 256  # samples, after which the proof is forgotten to 1 / e
USUAL = 2.0  # times the usual sigma, of which no larger one counts: a component that coasts shows no motion
STEP = 0.3  # sigmas, by which a correction changes from row to row at most
EARLIER = 256  # samples that go into the inputs of a later one


def corrects(stage: Stage, editing: str, lag_s: float) -> bool:
    """Whether the rows of a way of editing are corrected one by one: a row that waits is smoothed, and has less of a
    lag to be taken out."""
    return stage.helps and stage.features.proven and editing == "live" and lag_s == 0


def live_model(name: Model | str | None, editing: str, lag_s: float) -> Model | None:
    """A model by its name, if it corrects such rows. Raises ModelError."""
    model = None if name is None else model_file.named(name)
    return model if model is not None and corrects(model.filter, editing, lag_s) else None


class LiveCorrection:
    """Of one track, whose rows come in any pieces. before: the last rows. seen: numbers of samples and sums of 1/sigma
    (7,), and proof: sums of the regression (2,), both fading. wanted: (6,) of the last row along its line of sight, m
    and m/s, with a gain of one; applied: (2, 3) what was added to it, in x y z."""

    def __init__(self) -> None:
        self.before: FilterRun | None = None
        self.seen, self.proof = np.zeros(1 + APPLIED), np.zeros(2)
        self.wanted, self.applied = np.zeros(APPLIED), np.zeros((2, 3))

    def of(self, new: FilterRun, stage: Stage) -> FloatArray:
        """(n, 6) m and m/s, to be added to the states of the next n rows. stage: of a feature set whose outputs are
        along the line of sight, in sigmas."""
        n, run = len(new.time_s), new if self.before is None else _joined(self.before, new)
        if n == 0:
            return np.empty((0, APPLIED))
        first = len(run.time_s) - n
        self.before = run.rows(max(len(run.time_s) - EARLIER, 0), len(run.time_s))
        fading = np.where(_goes_on(run, first), np.exp(-1 / MEMORY), 0.0)
        sigma = self._usual(new.los_sigma, fading)
        wanted = _output(run, stage, first) * sigma
        last = np.concatenate([self.wanted[None], wanted[:-1]]) * (fading > 0)[:, None]
        proof = _faded(_regression(run, first, last), fading, self.proof)
        self.proof, self.wanted = proof[-1], wanted[-1]
        gain = ((proof[:, :1] + PRIOR * WORTH) / (proof[:, 1:] + WORTH)).clip(0.0, 1.0)
        return self._in_steps(LineOfSight(new.state[:, :3], sigma), wanted * gain, fading > 0, stage.bound)

    def _usual(self, sigma: FloatArray, fading: FloatArray) -> FloatArray:
        """Sigmas (n, 6), none much larger than the usual ones; zero where they are none."""
        known = (sigma > 0) & np.isfinite(sigma)
        precise = np.divide(1.0, sigma, out=np.zeros_like(sigma), where=known)
        seen = _faded(np.column_stack([np.ones(len(sigma)), precise]), fading, self.seen)
        self.seen = seen[-1]
        usual = seen[:, :1] / np.maximum(seen[:, 1:], np.finfo(float).tiny)
        return np.where(known, np.minimum(sigma, USUAL * usual), 0.0)

    def _in_steps(self, los: LineOfSight, target: FloatArray, goes_on: BoolArray, bound: FloatArray) -> FloatArray:
        """What is applied (n, 6) in x y z, on the way to a target along the line of sight, never above so many sigmas
        (6,): these may collapse from row to row, when the noise is found anew."""
        found, sigma = np.zeros_like(target), los.sigma.reshape(-1, 2, 3)
        step, most = STEP * sigma, bound.reshape(2, 3) * sigma
        for k, wanted in enumerate(target.reshape(-1, 2, 3)):
            if not goes_on[k] or not step[k].all():
                self.applied = np.zeros((2, 3))
            elif wanted.any() or self.applied.any():
                axes = los.axes[k]
                along = self.applied @ axes.T
                self.applied = (along + (wanted - along).clip(-step[k], step[k])).clip(-most[k], most[k]) @ axes
            found[k] = self.applied.ravel()
        return found


def _output(run: FilterRun, stage: Stage, first: int) -> FloatArray:
    """(m, 6) output for the samples from the first on, in sigmas, with the stage's gain and bound. One row at a time,
    because the last bits of a product of matrices depend on how many there are."""
    raw, usable = stage.features.inputs(run, first, len(run.time_s), settling=0)
    found = [output_of(stage, raw[k : k + 1], usable[k : k + 1]).values for k in range(len(raw))]
    return np.clip(np.concatenate(found) * stage.gain, -stage.bound, stage.bound)


def _joined(before: FilterRun, new: FilterRun) -> FilterRun:
    pairs = zip(before[:-1], new[:-1], strict=True)
    return FilterRun._make([*(np.concatenate(pair) for pair in pairs), new.log_likelihood])


def _goes_on(run: FilterRun, first: int) -> BoolArray:
    """(m,) whether each sample from the first on is the next one of the same track."""
    since = run.since_start
    on = np.zeros(len(since), bool)
    on[1:] = since[1:] == since[:-1] + 1
    return on[first:]


def _regression(run: FilterRun, first: int, last: FloatArray) -> FloatArray:
    """(m, 2) of the samples from the first on: products of the innovations and of what the correction `last` (m, 6) of
    the sample before, along the line of sight, changes in the prediction, and squares of the latter; in sigmas of the
    innovations."""
    rows = slice(first, None)
    passed = np.diff(run.time_s, prepend=run.time_s[0])[rows, None]
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        moved = (last[:, :3] + passed * last[:, 3:]) / lever_m(run.predicted[rows, :3]) / run.innovation_sigma[rows]
        innovation = run.innovation[rows] / run.innovation_sigma[rows]
        counts = (run.weight[rows] > 0) & np.isfinite(moved) & np.isfinite(innovation)
        found = np.where(counts[..., None], np.stack([innovation * moved, moved**2], axis=-1), 0.0)
    return np.asarray(found.sum(axis=1))


def _faded(columns: FloatArray, fading: FloatArray, before: FloatArray) -> FloatArray:
    """(n, c) sums of columns (n, c) up to each row, which each row multiplies by its fading (n,) first."""
    sums = columns.copy()
    for k in range(len(sums)):
        sums[k] += fading[k] * before
        before = sums[k]
    return sums
