"""Inputs and targets of the network: from a filter run to inputs and targets, and from the output back to a correction
in x, y, z. The feature sets themselves are in `feature_sets`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.records import FilterRun
from ftproc.core.model.frames import line_of_sight_axes
from ftproc.records import FloatArray, IntArray

#: Samples after (re-)initialization that are not learned from, nor corrected where the filter begins at a smoothed
#: state: its error is another there, and the correction makes it 1.06 times larger (radar, 1 Hz).
SETTLING = 25
#: Where an echo may begin to be weak: receivers detect from about 13 dB above their noise on.
WEAK_DB = (10.0, 20.0, 30.0)
APPLIED = 6  # outputs that are applied to the trajectory: position and velocity
LOS_NAMES = ("radial", "cross", "up", "radial velocity", "cross velocity", "up velocity")

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True)
class LineOfSight:
    """The line-of-sight axes (radial, cross, up) of n samples, along which instrument errors are simple.

    position_m: (n, 3) as estimated. sigma: (n, 6) 1-sigma of position m and velocity m/s along the axes.
    """

    position_m: FloatArray
    sigma: FloatArray

    @classmethod
    def of(cls, run: FilterRun, start: int, stop: int) -> LineOfSight:
        """Of the samples start:stop of a run."""
        return cls(run.state[start:stop, :3], run.los_sigma[start:stop])

    def rows(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> LineOfSight:
        """Of the samples of a mask, or of these numbers."""
        found = LineOfSight(self.position_m[rows], self.sigma[rows])
        if "axes" in self.__dict__:
            found.__dict__["axes"] = self.axes[rows]
        return found

    @cached_property
    def axes(self) -> FloatArray:
        """(n, 3, 3) unit vectors, one per row."""
        return line_of_sight_axes(self.position_m)

    def from_cartesian(self, cartesian: FloatArray) -> FloatArray:
        """Position and velocity (n, 6) in x, y, z as components along the axes."""
        pairs = cartesian.reshape(len(cartesian), 2, 3)
        along: FloatArray = (pairs @ self.axes.transpose(0, 2, 1)).reshape(len(cartesian), 6)
        return along

    def to_cartesian(self, along: FloatArray) -> FloatArray:
        """The inverse of `from_cartesian`."""
        pairs = along.reshape(len(along), 2, 3)
        cartesian: FloatArray = (pairs @ self.axes).reshape(len(along), 6)
        return cartesian


def lever_m(position_m: FloatArray) -> FloatArray:
    """(n, 3) metres along the radial, cross and up axes per m of range and rad of azimuth and elevation, at positions
    (n, 3). That of azimuth does not vanish overhead."""
    x, y, z = position_m.T
    ground = np.hypot(x, y)
    distance = np.hypot(ground, z)
    return np.stack([np.ones_like(distance), np.maximum(ground, 1e-3 * distance), distance], axis=1)


def usable(run: FilterRun, start: int, stop: int, settling: int = SETTLING) -> BoolArray:
    """(m,) true where the filter has had so many samples to settle, is not coasting (some component was used) and has
    finite sigmas."""
    sigma = run.los_sigma[start:stop]
    fit: BoolArray = (
        (run.since_start[start:stop] >= settling)
        & np.any(run.weight[start:stop] > 0.0, axis=1)
        & np.all(np.isfinite(sigma) & (sigma > 0.0), axis=1)
        & np.all(np.isfinite(run.state[start:stop]), axis=1)
    )
    return fit


def innovations(run: FilterRun, start: int, stop: int, single: int, sums: Sequence[int]) -> FloatArray:
    """(m, 3 (single + sums)) innovations over their sigmas of so many last samples, newest first, then their sums over
    as many samples before those as `sums` says (powers of two), each over the root of its length; zero where not used,
    and before the last (re-)initialization."""
    first = max(start - 2 * sums[-1], 0)
    ratio = run.innovation[first:stop] / run.innovation_sigma[first:stop]
    ratio = np.where(run.weight[first:stop] > 0.0, ratio, 0.0)
    since = run.since_start[first:stop, None]
    columns = [_earlier(ratio, lag, since) for lag in range(single)]
    total, width = ratio, 1
    while width <= sums[-1]:  # total: over the last `width` samples, any cut of the run gives the same sums
        before = _earlier(total, width, since)
        if width in sums:
            columns.append(before / np.sqrt(width))
        total, width = total + before, 2 * width
    return np.concatenate(columns, axis=1)[start - first :]


def _earlier(values: FloatArray, lag: int, since: IntArray) -> FloatArray:
    """(n, 3) the values `lag` samples earlier; 0 where `since` (n, 1), samples since the initialization, is less."""
    moved = np.zeros_like(values)
    moved[lag:] = values[: max(len(values) - lag, 0)]
    return np.where(since >= lag, moved, 0.0)


def echo(signal_db: FloatArray) -> FloatArray:
    """(m, 4) of the strength of the signal: itself, and what a weak one adds below each of WEAK_DB."""
    tenth = signal_db / 10
    return np.stack([tenth, *(np.log1p(10 ** (weak / 10 - tenth)) for weak in WEAK_DB)], axis=1)


class Features(ABC):
    """A feature set: its name, the names of its outputs (the first six, or fewer, are applied), and the mappings, over
    the m samples `start:stop` of a filter run or of one with the smoother's states.

    direct: the network has direct connections. smoothed: valid for smoothed runs too, because it needs no innovations.
    reach: radius of the region where it holds, in units of that covered by the training inputs. proven: applied only
    where the smoother of the same flight proves it. hidden: usual units of the hidden layer.
    most: samples of a flight that are learned from; None: all. restarts: fits from other first weights, of which the
    best on validation data is kept. share: of the errors learned from that bounds a correction at twice its largest.
    heard: the strength of the signal is among the inputs.
    """

    name: ClassVar[str]
    outputs: ClassVar[tuple[str, ...]]
    direct: ClassVar[bool] = False
    smoothed: ClassVar[bool] = False
    reach: ClassVar[float] = 1.0
    proven: ClassVar[bool] = False
    hidden: ClassVar[int] = 12
    most: ClassVar[int | None] = None
    restarts: ClassVar[int] = 1
    share: ClassVar[float] = 0.683
    heard: ClassVar[bool] = False

    @property
    @abstractmethod
    def floor(self) -> FloatArray:
        """(d,) smallest normalisation scale of each input: an input that was constant in training must not make the
        envelope infinitely thin."""

    @abstractmethod
    def _raw(self, run: FilterRun, start: int, stop: int) -> FloatArray:
        """(m, d) inputs, not finite where they cannot be formed."""

    @abstractmethod
    def unit(self, los: LineOfSight) -> FloatArray:
        """(m, 6) size of one unit of each applied output, m or m/s."""

    @abstractmethod
    def targets(self, los: LineOfSight, error: FloatArray) -> FloatArray:
        """Desired outputs (m, outputs) for truth minus estimate (m, 9) in x y z."""

    def to_cartesian(self, los: LineOfSight, output: FloatArray) -> FloatArray:
        """Applied outputs (m, 6) as a correction of x y z m and vx vy vz m/s (m, 6)."""
        return los.to_cartesian(output * self.unit(los))

    def from_cartesian(self, los: LineOfSight, cartesian: FloatArray) -> FloatArray:
        """The inverse of `to_cartesian`."""
        return los.from_cartesian(cartesian) / self.unit(los)

    def inputs(
        self, run: FilterRun, start: int, stop: int, settling: int = SETTLING, signal_db: FloatArray | None = None
    ) -> tuple[FloatArray, BoolArray]:
        """Inputs (m, d), zero where not valid, and the mask (m,) of valid samples. signal_db: (n,) of the whole run."""
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            raw = self._raw(run, start, stop)
            if self.heard:
                strength = np.full(stop - start, np.nan) if signal_db is None else signal_db[start:stop]
                raw = np.concatenate([raw, echo(strength)], axis=1)
        valid = usable(run, start, stop, settling) & np.all(np.isfinite(raw), axis=1)
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
