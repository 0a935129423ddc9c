"""The feature sets by name.

`correction` is the paper's (Zuo et al. 2021, section 2.2): update minus prediction in, truth minus estimate out.
`window` has the last normalised innovations and the geometry in, and an output in units of the filter's own sigma: one
model serves any range, rate and noise. It learns the effect of wrong measurement or process noise.
`instrument` has the target's position in, and metres and radians out: the repeatable errors of one instrument. These
survive smoothing, so it serves the smoother too.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ftproc.core.filtering.records import FilterRun
from ftproc.correction.features import APPLIED, LOS_NAMES, Features, LineOfSight, innovations, lever_m
from ftproc.correction.instrument_features import EchoFeatures, InstrumentFeatures, MountFeatures
from ftproc.correction.motion_features import MotionFeatures
from ftproc.errors import UsageError
from ftproc.records import FloatArray

CARTESIAN_NAMES = ("x", "y", "z", "vx", "vy", "vz")


class CorrectionFeatures(Features):
    """The paper's: 9 components of x(k+1|k+1) - x(k+1|k) in, 9 of truth minus estimate out, all in x y z."""

    name = "correction"
    outputs = (*CARTESIAN_NAMES, "ax", "ay", "az")

    @property
    def floor(self) -> FloatArray:
        return np.full(9, 1e-6)

    def _raw(self, run: FilterRun, start: int, stop: int) -> FloatArray:
        return run.state[start:stop] - run.predicted[start:stop]

    def unit(self, los: LineOfSight) -> FloatArray:
        return np.ones((len(los.position_m), APPLIED))

    def to_cartesian(self, los: LineOfSight, output: FloatArray) -> FloatArray:
        return output[:, :APPLIED]

    def from_cartesian(self, los: LineOfSight, cartesian: FloatArray) -> FloatArray:
        return cartesian

    def targets(self, los: LineOfSight, error: FloatArray) -> FloatArray:
        return error


class WindowFeatures(Features):
    """Normalised innovations of the last 8 samples (newest first), then their sums over the 8, 16 and 32 samples before
    those, each over the root of its length; 0 where not used. The error of a filter with wrong process noise lasts as
    long as its memory, longer than single samples reach. Then log range, elevation, log sigma (radial in m, cross and
    up as angles) and log of filter sigma over innovation sigma, a measure of the gain. Targets: error along the
    line-of-sight axes over the filter's sigma."""

    name = "window"
    outputs = LOS_NAMES
    SINGLE: ClassVar[int] = 8
    SUMS: ClassVar[tuple[int, ...]] = (8, 16, 32)
    _GEOMETRY_FLOOR: ClassVar[tuple[float, ...]] = (0.25, 0.05, *(0.25,) * 6)

    @property
    def floor(self) -> FloatArray:
        return np.array((*(0.25,) * (3 * (self.SINGLE + len(self.SUMS))), *self._GEOMETRY_FLOOR))

    def _raw(self, run: FilterRun, start: int, stop: int) -> FloatArray:
        return np.concatenate(
            [innovations(run, start, stop, self.SINGLE, self.SUMS), self._geometry(run, start, stop)], axis=1
        )

    @staticmethod
    def _geometry(run: FilterRun, start: int, stop: int) -> FloatArray:
        """(m, 8) log range, elevation rad, three log sigmas, three log ratios to the innovation's sigma."""
        x, y, z = run.state[start:stop, :3].T
        flat = np.hypot(x, y)
        distance = np.hypot(flat, z)
        angular = run.los_sigma[start:stop, :3] / lever_m(run.state[start:stop, :3])  # in units of the readings
        ratio = np.log(angular / run.innovation_sigma[start:stop])
        position = np.stack([np.log(distance), np.arctan2(z, flat)], axis=1)
        return np.concatenate([position, np.log(angular), ratio], axis=1)

    def unit(self, los: LineOfSight) -> FloatArray:
        return los.sigma

    def targets(self, los: LineOfSight, error: FloatArray) -> FloatArray:
        return self.from_cartesian(los, error[:, :APPLIED])


FEATURES: dict[str, Features] = {
    features.name: features
    for features in (
        *(CorrectionFeatures(), WindowFeatures(), MotionFeatures()),
        *(InstrumentFeatures(), MountFeatures(), EchoFeatures()),
    )
}


def named(name: str) -> Features:
    """The feature set of that name. Raises UsageError for any other."""
    if name not in FEATURES:
        raise UsageError(f"there is no feature set {name!r}; choose one of {', '.join(FEATURES)}")
    return FEATURES[name]


def hears(name: str) -> bool:
    """Whether the feature set of that name, if there is one, needs the strength of the signal."""
    return name in FEATURES and FEATURES[name].heard
