"""From flights with truth to training, validation and test samples. Flights are kept whole, or cut into long
blocks when there are few: neighbouring samples share their error, so a split by sample would prove
nothing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ftproc.correction import los
from ftproc.correction.features import APPLIED, Features, Place, Record, usable
from ftproc.errors import InputError
from ftproc.records import FloatArray

WHOLE_FLIGHTS = 6  # with fewer, flights are cut into blocks
BLOCK_S = 30.0  # shortest block, s
APART = 8  # samples left out between two blocks of a flight, for neighbours share their error
VALIDATION_SHARE, TEST_SHARE = 1 / 3, 1 / 6


@dataclass(frozen=True)
class Flight:
    """A filter run of n samples and the truth at its times, in the station's x, y, z.

    truth_position (n, 3) m; truth_velocity (n, 3) m/s and truth_acceleration (n, 3) m/s2, differenced from
    the position when None. Rows where the truth is not known are NaN and are not used.
    """

    run: Record
    truth_position: FloatArray
    truth_velocity: FloatArray | None = None
    name: str = ""
    truth_acceleration: FloatArray | None = None

    def __post_init__(self) -> None:
        n = len(self.run.time_s)
        for array in (self.truth_position, self.truth_velocity, self.truth_acceleration):
            if array is not None and array.shape != (n, 3):
                raise ValueError(f"flight {self.name!r}: truth of shape {array.shape}, the run has {n} samples")

    @cached_property
    def error(self) -> FloatArray:
        """Truth minus estimate (n, 9): m, m/s, m/s2."""
        velocity, acceleration = self.truth_velocity, self.truth_acceleration
        velocity = _rate(self.run.time_s, self.truth_position) if velocity is None else velocity
        acceleration = _rate(self.run.time_s, velocity) if acceleration is None else acceleration
        return np.concatenate([self.truth_position, velocity, acceleration], axis=1) - self.run.state


@dataclass(frozen=True)
class Piece:
    """Samples start:stop of flight number `flight`."""

    flight: int
    start: int
    stop: int


@dataclass(frozen=True)
class Split:
    """The pieces of each kind; `by` is "flight" or "block"."""

    training: tuple[Piece, ...]
    validation: tuple[Piece, ...]
    test: tuple[Piece, ...]
    by: str


def _rate(time_s: FloatArray, values: FloatArray) -> FloatArray:
    """Derivative (n, 3) of `values` (n, 3) by central differences; samples at one instant count once."""
    instants, first, back = np.unique(time_s, return_index=True, return_inverse=True)
    if len(instants) < 2:
        return np.full_like(values, np.nan)
    slope: FloatArray = np.gradient(values[first], instants, axis=0)
    return slope[back]


def _blocks(flights: Sequence[Flight]) -> list[Piece]:
    """Blocks of at least 30 s; each but a flight's first starts late."""
    pieces = []
    for number, flight in enumerate(flights):
        time = flight.run.time_s
        if len(time) == 0:
            continue
        count = max(int((time[-1] - time[0]) // BLOCK_S), 1)
        edges = np.searchsorted(time, np.linspace(time[0], time[-1], count + 1)[1:-1])
        starts, stops = [0, *(int(e) for e in edges)], [*(int(e) for e in edges), len(time)]
        pieces += [
            Piece(number, start + (APART if start else 0), stop) for start, stop in zip(starts, stops, strict=True)
        ]
    return [piece for piece in pieces if piece.stop > piece.start]


def split(flights: Sequence[Flight], rng: np.random.Generator) -> Split:
    """Half for training, a third for validation, a sixth for the test (at least one of each), in random
    order.

    Raises InputError when there are not three pieces.
    """
    by = "flight" if len(flights) >= WHOLE_FLIGHTS else "block"
    pieces = [Piece(i, 0, len(f.run.time_s)) for i, f in enumerate(flights)] if by == "flight" else _blocks(flights)
    if len(pieces) < 3:
        raise InputError(
            f"too little to learn from: {len(flights)} flight(s) give {len(pieces)} block(s) of {BLOCK_S:g} "
            "s, and training, validation and test need one each; add flights with truth"
        )
    order = [pieces[i] for i in rng.permutation(len(pieces))]
    tests = max(math.floor(TEST_SHARE * len(order)), 1)
    held = tests + max(round(VALIDATION_SHARE * len(order)), 1)
    return Split(tuple(order[held:]), tuple(order[tests:held]), tuple(order[:tests]), by)


def table(flights: Sequence[Flight], pieces: Sequence[Piece], features: Features) -> tuple[FloatArray, FloatArray]:
    """Inputs (n, d) and targets (n, o) of all samples in `pieces` that are valid and have truth."""
    inputs, targets = [np.empty((0, features.input_size))], [np.empty((0, features.output_size))]
    for piece in pieces:
        flight, rows = flights[piece.flight], slice(piece.start, piece.stop)
        x, valid = features.inputs(flight.run, piece.start, piece.stop)
        keep = np.flatnonzero(valid)
        run = flight.run
        place = Place(run.state[rows, :3][keep], run.los_sigma[rows][keep])
        t = features.targets(place, flight.error[rows][keep])
        known = np.all(np.isfinite(t), axis=1)
        inputs.append(x[keep][known])
        targets.append(t[known])
    return np.concatenate(inputs), np.concatenate(targets)


def honesty(flights: Sequence[Flight], pieces: Sequence[Piece]) -> FloatArray:
    """(6,) by how much the filter's line-of-sight sigmas are too small in `pieces`, at least 1.

    The 68.3 % quantile of error over sigma (1 for an honest Gaussian sigma), so that a few blunders do not
    count.
    """
    ratios = [np.ones((1, APPLIED))]
    for piece in pieces:
        run = flights[piece.flight].run
        settled = usable(run, piece.start, piece.stop)
        error = flights[piece.flight].error[piece.start : piece.stop, :APPLIED][settled]
        place = Place.of(run, piece.start, piece.stop)
        sigma = place.los_sigma[settled]
        ratio = np.abs(los.to_los(place.axes[settled], error)) / sigma
        ratios.append(ratio[np.all(np.isfinite(ratio), axis=1)])
    return np.maximum(np.quantile(np.concatenate(ratios), 0.683, axis=0), 1.0)
