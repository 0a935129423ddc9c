"""What the network sees and what it is to say: from a run to inputs and targets, and from the output back to a
correction in x, y, z. The feature sets themselves are in `feature_sets`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from ftproc.core.model.frames import line_of_sight_axes
from ftproc.correction import los
from ftproc.records import FloatArray, IntArray

SETTLING = 25  # samples after a (re)start that are neither learned from nor corrected
APPLIED = 6  # outputs that are applied to the trajectory: position and velocity

BoolArray = NDArray[np.bool_]


class Record(Protocol):
    """What is needed of a run of n samples, of the filter (see `core.filtering.records`) or smoothed; angles in rad.

    time_s (n,); state (n, 9) updated and predicted (n, 9) one-step predicted x y z m, v m/s, a m/s2;
    innovation (n, 3), NaN where missing; innovation_sigma (n, 3) sqrt(S_ii); weight (n, 3) in [0, 1], 0 where
    rejected or missing; los_sigma (n, 6) 1-sigma m, m/s along the line-of-sight axes; since_start (n,)
    samples since the last (re)start.
    """

    @property
    def time_s(self) -> FloatArray: ...
    @property
    def state(self) -> FloatArray: ...
    @property
    def predicted(self) -> FloatArray: ...
    @property
    def innovation(self) -> FloatArray: ...
    @property
    def innovation_sigma(self) -> FloatArray: ...
    @property
    def weight(self) -> FloatArray: ...
    @property
    def los_sigma(self) -> FloatArray: ...
    @property
    def since_start(self) -> IntArray: ...


@dataclass(frozen=True)
class Place:
    """Where some samples are: position_m (n, 3) as estimated, los_sigma (n, 6) m, m/s."""

    position_m: FloatArray
    los_sigma: FloatArray

    @classmethod
    def of(cls, run: Record, start: int, stop: int) -> Place:
        return cls(run.state[start:stop, :3], run.los_sigma[start:stop])

    @cached_property
    def axes(self) -> FloatArray:
        """(n, 3, 3) line-of-sight unit vectors."""
        return line_of_sight_axes(self.position_m)


def usable(run: Record, start: int, stop: int) -> BoolArray:
    """(m,) true where the filter has settled, is not coasting (some component was used) and has a finite
    sigma."""
    sigma = run.los_sigma[start:stop]
    fit: BoolArray = (
        (run.since_start[start:stop] >= SETTLING)
        & np.any(run.weight[start:stop] > 0.0, axis=1)
        & np.all(np.isfinite(sigma) & (sigma > 0.0), axis=1)
        & np.all(np.isfinite(run.state[start:stop]), axis=1)
    )
    return fit


class Features(ABC):
    """A feature set: `name`, names of the outputs (the first six, or fewer, are applied), and the mappings. Rows
    `start:stop` of a run, m of them. direct: the network has direct connections. smoothed: works on smoothed runs
    as well, for it needs no innovations. reach: how many times farther than the training inputs it holds."""

    name: ClassVar[str]
    outputs: ClassVar[tuple[str, ...]]
    direct: ClassVar[bool] = False
    smoothed: ClassVar[bool] = False
    reach: ClassVar[float] = 1.0

    @property
    @abstractmethod
    def floor(self) -> FloatArray:
        """(d,) smallest scale by which an input is normalised: what is constant in training must not become a
        razor-thin envelope at run time."""

    @abstractmethod
    def _raw(self, run: Record, start: int, stop: int) -> FloatArray:
        """(m, d) inputs, not finite where they cannot be formed."""

    @abstractmethod
    def unit(self, place: Place) -> FloatArray:
        """(m, 6) size of one unit of each applied output, m or m/s."""

    @abstractmethod
    def targets(self, place: Place, error: FloatArray) -> FloatArray:
        """Truth minus estimate (m, 9) in x y z as what the network should have said (m, outputs)."""

    def to_cartesian(self, place: Place, output: FloatArray) -> FloatArray:
        """Applied outputs (m, 6) as a correction of x y z m and vx vy vz m/s (m, 6)."""
        return los.from_los(place.axes, output * self.unit(place))

    def from_cartesian(self, place: Place, cartesian: FloatArray) -> FloatArray:
        """The inverse of `to_cartesian`."""
        return los.to_los(place.axes, cartesian) / self.unit(place)

    def inputs(self, run: Record, start: int = 0, stop: int | None = None) -> tuple[FloatArray, BoolArray]:
        """Inputs (m, d), zero where not valid, and the mask (m,) of valid samples."""
        stop = len(run.time_s) if stop is None else stop
        with np.errstate(invalid="ignore", divide="ignore"):
            raw = self._raw(run, start, stop)
        valid = usable(run, start, stop) & np.all(np.isfinite(raw), axis=1)
        raw[~valid] = 0.0
        return raw, valid

    @property
    def input_size(self) -> int:
        return len(self.floor)

    @property
    def output_size(self) -> int:
        return len(self.outputs)

    @property
    def applied(self) -> tuple[str, ...]:
        """Names of the outputs that are applied."""
        return self.outputs[:APPLIED]
