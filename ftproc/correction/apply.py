"""Application of a trained correction to a run, with its guards (Zuo et al. 2021 eq. 14: the output is added to the
estimate; it is never fed back into the filter)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ftproc.core.filtering.records import FilterRun
from ftproc.correction.features import APPLIED, BoolArray, LineOfSight
from ftproc.correction.model import Stage
from ftproc.correction.network import forward
from ftproc.correction.proof import own_gain
from ftproc.records import FloatArray

CHUNK = 32768  # samples at a time: bounds the memory for a long run


class Correction(NamedTuple):
    """values: (n, 6) m, m/s to be added to x y z vx vy vz. outside: share in [0, 1] of the usable samples (settled, not
    coasting) whose input lies outside the training envelope; their correction is zero. why_not: why nothing is
    corrected, where the flight itself must prove it."""

    values: FloatArray
    outside: float
    why_not: str = ""


class Output(NamedTuple):
    """values: (m, 6) output of the network in its own units, zero where not usable or outside the envelope. usable,
    outside: (m,) masks."""

    values: FloatArray
    usable: BoolArray
    outside: BoolArray


def network_output(
    run: FilterRun, stage: Stage, start: int, stop: int, smoothed: FloatArray | None = None,
    los: LineOfSight | None = None, signal_db: FloatArray | None = None,
) -> Output:  # fmt: skip
    """The network's output for samples start:stop, before gain and bound. smoothed: (n, 9) the smoother's states, by
    which the output of a feature set that must be proven is multiplied by what they prove in these samples. los: of
    these samples, if it is known. signal_db: (n,) of all samples, if the log has it."""
    found = output_of(stage, *stage.features.inputs(run, start, stop, signal_db=signal_db))
    if stage.features.proven:
        los = LineOfSight.of(run, start, stop) if los is None else los
        gain = 0.0 if smoothed is None else _own_gain(run, stage, slice(start, stop), smoothed, found, los)
        found.values[:] *= gain
    return found


def output_of(stage: Stage, raw: FloatArray, usable: BoolArray) -> Output:
    """The network's output for inputs (m, d), of which some (m,) are usable."""
    normalised = stage.inputs.forward(raw)
    inside = stage.envelope.contains(normalised)
    output = stage.targets.back(forward(stage.weights, normalised))[:, :APPLIED]
    values = np.zeros((len(raw), APPLIED))  # a feature set may have no output for velocity
    values[:, : output.shape[1]] = np.where((usable & inside)[:, None], output, 0.0)
    return Output(values, usable, usable & ~inside)


def _own_gain(
    run: FilterRun, stage: Stage, rows: slice, smoothed: FloatArray, found: Output, los: LineOfSight
) -> FloatArray:
    """(6,) what the smoother's states prove of the output for these rows."""
    later = smoothed[rows, :APPLIED] - run.state[rows, :APPLIED]
    values = np.clip(found.values, -stage.bound, stage.bound)
    return own_gain(los, values, later, run.time_s[rows], found.usable)


def bounded(los: LineOfSight, stage: Stage, output: FloatArray) -> FloatArray:
    """Output (m, 6), gain applied, as x y z vx vy vz, within the stage's bound along each line-of-sight axis.

    Zero output stays exactly zero, whatever the sigma.
    """
    values = np.zeros_like(output)
    rows = np.flatnonzero(np.any(output != 0.0, axis=1))
    if len(rows):
        los = los.rows(rows)
        along = los.from_cartesian(stage.features.to_cartesian(los, output[rows]))
        limit = stage.bound * los.sigma
        values[rows] = los.to_cartesian(np.clip(along, -limit, limit))
    return values


def correct(
    run: FilterRun, stage: Stage, smoothed: FloatArray | None = None, signal_db: FloatArray | None = None
) -> Correction:
    """The correction of a run of n samples: (n, 6), to be added to position and velocity.

    smoothed: (n, 9) the smoother's states of the same run, where there are any: what a feature set that must be proven
    is held against. Such a run is corrected as a whole, others a chunk at a time. signal_db: (n,) strength of the
    signal, if the log has it.
    """
    n = len(run.time_s)
    values = np.zeros((n, APPLIED))
    if not stage.helps:
        return Correction(values, 0.0)
    if stage.features.proven and smoothed is None:
        return Correction(values, 0.0, "there is no smoother of this run that could prove it")
    if stage.features.heard and signal_db is None:
        return Correction(values, 0.0, "the log has no strength of the signal in dB")
    outside = usable = 0
    chunk = max(n, 1) if stage.features.proven else CHUNK
    for start in range(0, n, chunk):
        stop = min(start + chunk, n)
        los = LineOfSight.of(run, start, stop)
        output = network_output(run, stage, start, stop, smoothed, los, signal_db)
        values[start:stop] = bounded(los, stage, output.values * stage.gain)
        outside += int(output.outside.sum())
        usable += int(output.usable.sum())
    unproven = stage.features.proven and not values.any()
    why_not = "the smoother of this run does not prove it" if unproven else ""
    return Correction(values, outside / usable if usable else 0.0, why_not)
