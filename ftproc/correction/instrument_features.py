"""`instrument`: where the target is, for what an instrument gets wrong there on every flight. `mount`:
what a mount and its encoders do wrong beyond their setting up. `echo`: the same where the strength of the signal tells
how far a weak one is read too long.

The columns are those in which the errors are linear, so that a few flights are enough; what is not linear in them is
left to the hidden layer. Across the line of sight an error of the azimuth is cos E as large: of a circle that is off
its axis, cos E cos A. A servo is behind by a multiple of the rate of its angle, and of its acceleration.
"""

from __future__ import annotations

import numpy as np

from ftproc.core.filtering.records import FilterRun
from ftproc.correction.features import APPLIED, LOS_NAMES, WEAK_DB, Features, LineOfSight
from ftproc.records import FloatArray

USUAL_M, USUAL_MPS = 10_000.0, 300.0
FAR_M = (5_000.0, 10_000.0, 20_000.0)  # from where echoes may be weak: their power falls with the fourth power of range


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


class MountFeatures(InstrumentFeatures):
    """Those of `instrument`, and cos E times the first and the second harmonic of the azimuth, the second of the
    elevation, the log of the range and what weak echoes add, the rates of the angles across and up, their
    accelerations, and the range rate. Targets as there."""

    name = "mount"
    restarts = 3
    share = 0.99  # the error of a far range is many times that of most

    @property
    def floor(self) -> FloatArray:
        return np.array((*super().floor, *(0.3,) * 6, *(0.3,) * 4, 0.005, 0.005, 0.002, 0.002, 0.05))

    def _raw(self, run: FilterRun, start: int, stop: int) -> FloatArray:
        los = LineOfSight.of(run, start, stop)
        x, y, z = los.position_m.T
        flat = np.hypot(x, y)
        distance = np.hypot(flat, z)
        azimuth, elevation, log_range = np.arctan2(y, x), np.arctan2(z, flat), np.log(distance / USUAL_M)
        (outward, across, up), (_, across_a, up_a) = (
            np.einsum("nij,nj->in", los.axes, run.state[start:stop, k : k + 3]) for k in (3, 6)
        )
        rates = across / distance, up / distance  # of the azimuth times cos E, and of the elevation, rad/s
        tilt = np.tan(elevation)
        more = [
            *(np.cos(elevation) * wave(k * azimuth) for k in (1, 2) for wave in (np.cos, np.sin)),
            np.cos(2 * elevation),
            np.sin(2 * elevation),
            log_range,
            *(np.log1p((distance / far) ** 4) for far in FAR_M),
            *rates,
            across_a / distance - 2 * rates[0] * (outward / distance - rates[1] * tilt),
            up_a / distance - 2 * rates[1] * outward / distance - rates[0] ** 2 * tilt,
            outward / USUAL_MPS,
        ]
        return np.concatenate([super()._raw(run, start, stop), np.stack(more, axis=1)], axis=1)


class EchoFeatures(MountFeatures):
    """Those of `mount`, and of the strength of the signal, see `features.echo`. Targets as there."""

    name = "echo"
    heard = True

    @property
    def floor(self) -> FloatArray:
        return np.array((*super().floor, *(0.3,) * (1 + len(WEAK_DB))))
