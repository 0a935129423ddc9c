"""From flights with truth to training, validation and test samples. Flights are kept whole, or cut into long blocks
when there are few: errors of neighbouring samples are correlated, so a split by sample would prove nothing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ftproc.core.filtering.records import FilterRun
from ftproc.correction.features import APPLIED, Features, LineOfSight, usable
from ftproc.errors import InputError
from ftproc.records import FloatArray

WHOLE_FLIGHTS = 6  # with fewer, flights are cut into blocks
BLOCK_S = 30.0  # shortest block, s
APART = 8  # samples left out between two blocks of a flight, for neighbours share their error
VALIDATION_SHARE, TEST_SHARE = 1 / 3, 1 / 6
MOST_VALIDATION, MOST_TEST = 60, 30  # pieces: more prove no more
MOST_SAMPLES = 40_000  # for back-propagation
BOUND_SIGMA = 2.0  # bound on a correction where sigmas are consistent


@dataclass(frozen=True)
class Flight:
    """A run of n samples, of the filter or with the smoother's states, and the truth at its times in the station's
    x, y, z.

    truth_position: (n, 3) m. truth_velocity: (n, 3) m/s, differenced from the position when None. Rows without truth
    are NaN and are not used. smoothed: (n, 9) the smoother's states, by which a filter's correction can be proven.
    signal_db: (n,) strength of the signal, if the log has it.
    """

    run: FilterRun
    truth_position: FloatArray
    truth_velocity: FloatArray | None = None
    smoothed: FloatArray | None = None
    signal_db: FloatArray | None = None

    @cached_property
    def error(self) -> FloatArray:
        """Truth minus estimate (n, 9): m, m/s, m/s2."""
        velocity = self.truth_velocity
        velocity = _rate(self.run.time_s, self.truth_position) if velocity is None else velocity
        acceleration = _rate(self.run.time_s, velocity)
        return np.concatenate([self.truth_position, velocity, acceleration], axis=1) - self.run.state


class Piece(NamedTuple):
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

    @property
    def count(self) -> int:
        return len(self.training) + len(self.validation) + len(self.test)


class Samples(NamedTuple):
    """Inputs (n, d) and targets (n, o) of the network."""

    inputs: FloatArray
    targets: FloatArray

    def rows(self, rows: slice) -> Samples:
        return Samples(self.inputs[rows], self.targets[rows])

    def and_(self, others: Samples) -> Samples:
        return Samples.of([self, others])

    @classmethod
    def of(cls, tables: Sequence[Samples]) -> Samples:
        """All of several tables."""
        return cls(*(np.concatenate(each) for each in zip(*tables, strict=True)))

    def thinned(self, most: int, rng: np.random.Generator) -> Samples:
        """At most so many of the samples, in their order."""
        if len(self.inputs) <= most:
            return self
        rows = np.sort(rng.choice(len(self.inputs), most, replace=False))
        return Samples(self.inputs[rows], self.targets[rows])


def _rate(time_s: FloatArray, values: FloatArray) -> FloatArray:
    """Derivative (n, 3) of `values` (n, 3) by central differences; samples at one instant count once."""
    instants, first, back = np.unique(time_s, return_index=True, return_inverse=True)
    if len(instants) < 2:
        return np.full_like(values, np.nan)
    slope: FloatArray = np.gradient(values[first], instants, axis=0)
    return slope[back]


def _blocks(flights: Sequence[Flight]) -> list[Piece]:
    """Blocks of at least 30 s; each but a flight's first starts APART samples late."""
    pieces = []
    for number, flight in enumerate(flights):
        time = flight.run.time_s
        if len(time) == 0:
            continue
        count = max(int((time[-1] - time[0]) // BLOCK_S), 1)
        inner = np.searchsorted(time, np.linspace(time[0], time[-1], count + 1)[1:-1])
        edges = [0, *inner.tolist(), len(time)]
        pieces += [Piece(number, start + (APART if start else 0), stop) for start, stop in pairwise(edges)]
    return [piece for piece in pieces if piece.stop > piece.start]


def split(flights: Sequence[Flight], rng: np.random.Generator) -> Split:
    """A third for validation, a sixth for the test (at least one of each, and no more than needed), in random order;
    the others for training.

    Raises InputError when there are fewer than three pieces.
    """
    by = "flight" if len(flights) >= WHOLE_FLIGHTS else "block"
    pieces = [Piece(i, 0, len(f.run.time_s)) for i, f in enumerate(flights)] if by == "flight" else _blocks(flights)
    if len(pieces) < 3:
        raise InputError(
            f"too little to learn from: {len(flights)} flight(s) give {len(pieces)} block(s) of {BLOCK_S:g} "
            "s, and training, validation and test need one each; add flights with truth"
        )
    order = [pieces[i] for i in rng.permutation(len(pieces))]
    tests = min(max(math.floor(TEST_SHARE * len(order)), 1), MOST_TEST)
    held = tests + min(max(round(VALIDATION_SHARE * len(order)), 1), MOST_VALIDATION)
    return Split(tuple(order[held:]), tuple(order[tests:held]), tuple(order[:tests]), by)


def samples(
    flights: Sequence[Flight], pieces: Sequence[Piece], features: Features, among: int | None = None
) -> Samples:
    """The samples in `pieces` that are valid and have truth, not normalised; of each piece at most so many as the
    feature set wants, or more where there are few pieces, at even distances, so that long flights count no more than
    others. among: the number of pieces, if there are others."""
    most = None if features.most is None else max(features.most, MOST_SAMPLES // max(among or len(pieces), 1))
    inputs, targets = [np.empty((0, features.input_size))], [np.empty((0, features.output_size))]
    for number, start, stop in pieces:
        flight = flights[number]
        x, valid = features.inputs(flight.run, start, stop, signal_db=flight.signal_db)
        t = features.targets(LineOfSight.of(flight.run, start, stop).rows(valid), flight.error[start:stop][valid])
        known = np.all(np.isfinite(t), axis=1)
        every = 1 if most is None else max(-(-int(known.sum()) // most), 1)
        inputs.append(x[valid][known][::every])
        targets.append(t[known][::every])
    return Samples(np.concatenate(inputs), np.concatenate(targets))


def overconfidence(flights: Sequence[Flight], pieces: Sequence[Piece], share: float) -> FloatArray:
    """(6,) by what factor the filter's line-of-sight sigmas are too small in `pieces`, at least 1.

    The quantile of error over sigma that holds this share of samples: with 68.3 % (1 for a consistent Gaussian sigma)
    a few outliers do not count.
    """
    ratios = [np.ones((1, APPLIED))]
    for number, start, stop in pieces:
        flight = flights[number]
        settled = usable(flight.run, start, stop)
        los = LineOfSight.of(flight.run, start, stop).rows(settled)
        ratio = np.abs(los.from_cartesian(flight.error[start:stop, :APPLIED][settled])) / los.sigma
        ratios.append(ratio[np.all(np.isfinite(ratio), axis=1)])
    return np.maximum(np.quantile(np.concatenate(ratios), share, axis=0), 1.0)
