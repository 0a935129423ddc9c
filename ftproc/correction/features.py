"""What the network sees and what it is to say: from a filter run to inputs and targets, and from the output
back to a correction in x, y, z.

`correction` is the paper's (2021, section 2.2): update minus prediction in, truth minus estimate out.
`window` sees the last normalised innovations in range, azimuth and elevation and the geometry, and answers in
line-of-sight axes and in units of the filter's own sigma, so that one model serves any range, rate and noise
level. `instrument` also sees the azimuth, on which mislevel and encoder errors of one given instrument
depend.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from ftproc.core.geometry import line_of_sight_axes
from ftproc.correction import los
from ftproc.errors import UsageError
from ftproc.records import FloatArray, IntArray

WINDOW = 8  # samples of innovation history
SETTLING = 25  # samples after a (re)start that are neither learned from nor corrected
APPLIED = 6  # outputs that are applied to the trajectory: position and velocity

LOS_NAMES = ("radial", "cross", "up", "radial velocity", "cross velocity", "up velocity")
CARTESIAN_NAMES = ("x", "y", "z", "vx", "vy", "vz")

BoolArray = NDArray[np.bool_]


class FilterRecord(Protocol):
    """What is needed of a filter run of n samples (see `ftproc.core`); angles in rad.

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
    def of(cls, run: FilterRecord, start: int, stop: int) -> Place:
        return cls(run.state[start:stop, :3], run.los_sigma[start:stop])

    @cached_property
    def axes(self) -> FloatArray:
        """(n, 3, 3) line-of-sight unit vectors."""
        return line_of_sight_axes(self.position_m)


def usable(run: FilterRecord, start: int, stop: int) -> BoolArray:
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
    """A feature set: `name`, names of the outputs, and the mappings. Rows `start:stop` of a run, m of
    them."""

    name: ClassVar[str]
    outputs: ClassVar[tuple[str, ...]]

    @property
    @abstractmethod
    def floor(self) -> FloatArray:
        """(d,) smallest scale by which an input is normalised: what is constant in training must not become a
        razor-thin envelope at run time."""

    @abstractmethod
    def _raw(self, run: FilterRecord, start: int, stop: int) -> FloatArray:
        """(m, d) inputs, not finite where they cannot be formed."""

    @abstractmethod
    def unit(self, place: Place) -> FloatArray:
        """(m, 6) size of one unit of each applied output, m or m/s."""

    @abstractmethod
    def to_cartesian(self, place: Place, output: FloatArray) -> FloatArray:
        """Applied outputs (m, 6) as a correction of x y z m and vx vy vz m/s (m, 6)."""

    @abstractmethod
    def from_cartesian(self, place: Place, cartesian: FloatArray) -> FloatArray:
        """The inverse of `to_cartesian`."""

    def targets(self, place: Place, error: FloatArray) -> FloatArray:
        """Truth minus estimate (m, 9) in x y z as what the network should have said (m, outputs)."""
        return self.from_cartesian(place, error[:, :APPLIED])

    def inputs(self, run: FilterRecord, start: int = 0, stop: int | None = None) -> tuple[FloatArray, BoolArray]:
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


class CorrectionFeatures(Features):
    """The paper's: 9 components of x(k+1|k+1) - x(k+1|k) in, 9 of truth minus estimate out, all in x y z."""

    name = "correction"
    outputs = (*CARTESIAN_NAMES, "ax", "ay", "az")

    @property
    def floor(self) -> FloatArray:
        return np.full(9, 1e-6)

    def _raw(self, run: FilterRecord, start: int, stop: int) -> FloatArray:
        return run.state[start:stop] - run.predicted[start:stop]

    def unit(self, place: Place) -> FloatArray:
        return np.ones((len(place.position_m), APPLIED))

    def to_cartesian(self, place: Place, output: FloatArray) -> FloatArray:
        return output[:, :APPLIED]

    def from_cartesian(self, place: Place, cartesian: FloatArray) -> FloatArray:
        return cartesian

    def targets(self, place: Place, error: FloatArray) -> FloatArray:
        return error


class WindowFeatures(Features):
    """Innovations over sigma of the last 8 samples (newest first; 0 where not used), then log range,
    elevation, log sigma (radial in m, cross and up as angles) and log of filter sigma over innovation sigma,
    which stands for the gain. Targets: error along the line-of-sight axes over the filter's sigma."""

    name = "window"
    outputs = LOS_NAMES
    _GEOMETRY_FLOOR: ClassVar[tuple[float, ...]] = (0.25, 0.05, *(0.25,) * 6)

    @property
    def floor(self) -> FloatArray:
        return np.array((*(0.25,) * (3 * WINDOW), *self._GEOMETRY_FLOOR))

    def _raw(self, run: FilterRecord, start: int, stop: int) -> FloatArray:
        return np.concatenate([self._history(run, start, stop), self._geometry(run, start, stop)], axis=1)

    @staticmethod
    def _history(run: FilterRecord, start: int, stop: int) -> FloatArray:
        """(m, 24) innovation/sigma at lags 0..7, three components each; before the first sample zero."""
        first = max(start - (WINDOW - 1), 0)
        ratio = run.innovation[first:stop] / run.innovation_sigma[first:stop]
        ratio = np.where(run.weight[first:stop] > 0.0, ratio, 0.0)
        padded = np.concatenate([np.zeros((WINDOW - 1 - (start - first), 3)), ratio])
        return np.concatenate([padded[WINDOW - 1 - lag : len(padded) - lag] for lag in range(WINDOW)], axis=1)

    @staticmethod
    def _geometry(run: FilterRecord, start: int, stop: int) -> FloatArray:
        """(m, 8) log range, elevation rad, three log sigmas, three log ratios to the innovation's sigma."""
        x, y, z = run.state[start:stop, :3].T
        flat = np.hypot(x, y)
        distance = np.hypot(flat, z)
        # Sigma in the units of range, azimuth, elevation; overhead the lever of azimuth would vanish.
        lever = np.stack([np.ones_like(distance), np.maximum(flat, 1e-3 * distance), distance], axis=1)
        angular = run.los_sigma[start:stop, :3] / lever
        ratio = np.log(angular / run.innovation_sigma[start:stop])
        place = np.stack([np.log(distance), np.arctan2(z, flat)], axis=1)
        return np.concatenate([place, np.log(angular), ratio], axis=1)

    def unit(self, place: Place) -> FloatArray:
        return place.los_sigma

    def to_cartesian(self, place: Place, output: FloatArray) -> FloatArray:
        return los.from_los(place.axes, output * place.los_sigma)

    def from_cartesian(self, place: Place, cartesian: FloatArray) -> FloatArray:
        return los.to_los(place.axes, cartesian) / place.los_sigma


class InstrumentFeatures(WindowFeatures):
    """`window` with the cosine and sine of the azimuth: for one instrument, learned from its calibration
    flights."""

    name = "instrument"
    _GEOMETRY_FLOOR = (*WindowFeatures._GEOMETRY_FLOOR, 0.1, 0.1)

    def _raw(self, run: FilterRecord, start: int, stop: int) -> FloatArray:
        x, y = run.state[start:stop, :2].T
        flat = np.hypot(x, y)
        bearing = np.stack([x / flat, y / flat], axis=1)
        return np.concatenate([super()._raw(run, start, stop), bearing], axis=1)


FEATURES: dict[str, Features] = {f.name: f for f in (CorrectionFeatures(), WindowFeatures(), InstrumentFeatures())}


def named(name: str) -> Features:
    """The feature set of that name. Raises UsageError for any other."""
    if name not in FEATURES:
        raise UsageError(f"there is no feature set {name!r}; choose one of {', '.join(FEATURES)}")
    return FEATURES[name]
