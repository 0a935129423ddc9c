"""Application of a trained correction to a run, with its guards (Zuo et al. 2021 eq. 14: the output is added to the
estimate; it is never fed back into the filter)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ftproc.core.filtering.records import FilterRun
from ftproc.correction.features import APPLIED, BoolArray, LineOfSight
from ftproc.correction.model import Stage
from ftproc.correction.network import forward
from ftproc.records import FloatArray

CHUNK = 32768  # samples at a time: bounds the memory for a long run


class Correction(NamedTuple):
    """values: (n, 6) m, m/s to be added to x y z vx vy vz. outside: share in [0, 1] of the usable samples (settled, not
    coasting) whose input lies outside the training envelope; their correction is zero."""

    values: FloatArray
    outside: float


class Output(NamedTuple):
    """values: (m, 6) output of the network in its own units, zero where not usable or outside the envelope. usable,
    outside: (m,) masks."""

    values: FloatArray
    usable: BoolArray
    outside: BoolArray


def network_output(run: FilterRun, stage: Stage, start: int, stop: int) -> Output:
    """The network's output for samples start:stop, before gain and bound."""
    raw, usable = stage.features.inputs(run, start, stop)
    normalised = stage.inputs.forward(raw)
    inside = stage.envelope.contains(normalised)
    output = stage.targets.back(forward(stage.weights, normalised))[:, :APPLIED]
    values = np.zeros((len(raw), APPLIED))  # a feature set may have no output for velocity
    values[:, : output.shape[1]] = np.where((usable & inside)[:, None], output, 0.0)
    return Output(values, usable, usable & ~inside)


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


def correct(run: FilterRun, stage: Stage) -> Correction:
    """The correction of a run of n samples: (n, 6), to be added to position and velocity."""
    n = len(run.time_s)
    values = np.zeros((n, APPLIED))
    if not stage.helps:
        return Correction(values, 0.0)
    outside = usable = 0
    for start in range(0, n, CHUNK):
        stop = min(start + CHUNK, n)
        output = network_output(run, stage, start, stop)
        values[start:stop] = bounded(LineOfSight.of(run, start, stop), stage, output.values * stage.gain)
        outside += int(output.outside.sum())
        usable += int(output.usable.sum())
    return Correction(values, outside / usable if usable else 0.0)
