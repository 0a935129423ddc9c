"""The feature set `instrument`: where the target is, for what an instrument gets wrong there on every flight."""

from __future__ import annotations

import numpy as np

from ftproc.core.filtering.records import FilterRun
from ftproc.correction.features import APPLIED, LOS_NAMES, Features, LineOfSight
from ftproc.records import FloatArray


class InstrumentFeatures(Features):
    """Cosine and sine of the azimuth and of the elevation, the first two times the sine of the elevation, and the
    ground range in km. Targets: position error along the line of sight in m, across and up as angles in rad.

    Zero-set errors, mislevel and collimation are linear in these, and so is refraction of a low target: a network
    with direct connections learns them from a few flights and extrapolates to other directions.
    """

    name = "instrument"
    outputs = LOS_NAMES[:3]
    direct = True
    smoothed = True
    reach = 3.0

    @property
    def floor(self) -> FloatArray:
        return np.array((*(0.3,) * 6, 3.0))

    def _raw(self, run: FilterRun, start: int, stop: int) -> FloatArray:
        x, y, z = run.state[start:stop, :3].T
        flat = np.hypot(x, y)
        distance = np.hypot(flat, z)
        cos_a, sin_a, cos_e, sin_e = x / flat, y / flat, flat / distance, z / distance
        return np.stack([cos_a, sin_a, cos_e, sin_e, cos_a * sin_e, sin_a * sin_e, 1e-3 * flat], axis=1)

    def unit(self, los: LineOfSight) -> FloatArray:
        distance = np.linalg.norm(los.position_m, axis=1)
        return np.stack([np.ones_like(distance), distance, distance] * 2, axis=1)

    def targets(self, los: LineOfSight, error: FloatArray) -> FloatArray:
        return self.from_cartesian(los, error[:, :APPLIED])[:, :3]
