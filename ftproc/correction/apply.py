"""Apply a trained correction to a run, with the guards that keep it harmless (Zuo et al. 2021 eq. 14:
the output is added to the estimate; it is never fed back into the filter)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ftproc.correction import los
from ftproc.correction.features import APPLIED, BoolArray, Place, Record
from ftproc.correction.model import Stage
from ftproc.correction.network import forward
from ftproc.records import FloatArray

CHUNK = 32768  # samples at a time, so that a long run needs little memory


class Correction(NamedTuple):
    """values: (n, 6) m, m/s to be added to x y z vx vy vz. outside: share in [0, 1] of the samples the
    network could speak about (settled, not coasting) whose input lies outside what training covered; these
    get zero."""

    values: FloatArray
    outside: float


class Answer(NamedTuple):
    """output: (m, 6) what the network says in its own units, zero where guarded. usable, outside: (m,)
    masks."""

    output: FloatArray
    usable: BoolArray
    outside: BoolArray


def answer(run: Record, stage: Stage, start: int, stop: int) -> Answer:
    """The network on samples start:stop, before gain and bound; zero while coasting, settling or outside."""
    raw, usable = stage.features.inputs(run, start, stop)
    normalised = stage.inputs.forward(raw)
    inside = stage.envelope.contains(normalised)
    said = stage.targets.back(forward(stage.weights, normalised))[:, :APPLIED]
    output = np.zeros((len(raw), APPLIED))  # a feature set may have nothing to say about velocity
    output[:, : said.shape[1]] = np.where((usable & inside)[:, None], said, 0.0)
    return Answer(output, usable, usable & ~inside)


def bounded(place: Place, stage: Stage, output: FloatArray) -> FloatArray:
    """Output (m, 6), gain applied, as x y z vx vy vz (m, 6), within so many sigmas along each line-of-sight
    axis.

    Zero output stays exactly zero, whatever the sigma.
    """
    values = np.zeros_like(output)
    rows = np.flatnonzero(np.any(output != 0.0, axis=1))
    if len(rows):
        here = Place(place.position_m[rows], place.los_sigma[rows])
        along = los.to_los(here.axes, stage.features.to_cartesian(here, output[rows]))
        limit = stage.bound_sigma * here.los_sigma
        values[rows] = los.from_los(here.axes, np.clip(along, -limit, limit))
    return values


def correct(run: Record, stage: Stage) -> Correction:
    """The correction of a run of n samples: (n, 6), to be added to position and velocity."""
    n = len(run.time_s)
    values = np.zeros((n, APPLIED))
    if not stage.helps:
        return Correction(values, 0.0)  # held-out flights have said that it brings nothing
    outside = usable = 0
    for start in range(0, n, CHUNK):
        stop = min(start + CHUNK, n)
        said = answer(run, stage, start, stop)
        values[start:stop] = bounded(Place.of(run, start, stop), stage, said.output * stage.gain)
        outside += int(said.outside.sum())
        usable += int(said.usable.sum())
    return Correction(values, outside / usable if usable else 0.0)
