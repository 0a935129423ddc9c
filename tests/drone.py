"""What instruments see that read seldom: a total station of a drone, which is agile, and a laser ranger whose angles
have stamps of their own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.records import FloatArray, MeasurementLog
from ftproc.simulation.aircraft import Airframe, fly
from ftproc.simulation.flights import CRUISER, LIGHT

DRONE = replace(
    LIGHT, speed_mps=(4, 15), turn_g=(1.05, 1.5), climb_rad=(0.05, 0.4), pull_g=(0.1, 0.4), thrust_mps2=(1, 3),
    onset_s=(0.5, 1.2), leg_s=(2, 10), height_m=(20, 80), radius_m=80, gust_mps2=0.3,
)  # fmt: skip
PLACE = np.array([200.0, 60.0, 0.0])  # m
FAR = np.array([9000.0, 4000.0, 500.0])
LASTS_S = 240.0


def seen(seed: int, dt_s: float, sigma: tuple[float, ...]) -> tuple[MeasurementLog, FloatArray]:
    """A log of four minutes with noise of this 1-sigma (3,) m, rad, rad, and the true positions (n, 3) m."""
    return read(DRONE, PLACE, np.arange(0.0, LASTS_S, dt_s), sigma, seed)


def apart(seed: int, dt_s: float, late_s: float) -> tuple[MeasurementLog, FloatArray]:
    """The same of a light aircraft whose angles are read so long after its ranges, in rows of their own, as laser
    rangers and some total stations do; 1 m and 0.1 mrad."""
    time = (np.arange(0.0, LASTS_S, dt_s)[:, None] + [0.0, late_s]).ravel()
    log, position = read(CRUISER, FAR, time, (1.0, 1e-4, 1e-4), seed)
    log.measurement[0::2, 1:] = np.nan
    log.measurement[1::2, 0] = np.nan
    return log, position


def read(
    airframe: Airframe, place: FloatArray, time: FloatArray, sigma: tuple[float, ...], seed: int
) -> tuple[MeasurementLog, FloatArray]:
    """A log of four minutes of an aircraft about a place (3,) m, at times (n,)."""
    rng = np.random.default_rng(seed)
    position = fly(airframe, LASTS_S, rng).at(time)[0] + place
    z = from_cartesian(position) + np.array(sigma) * rng.standard_normal((len(time), 3))
    z[:, 1] = wrap(z[:, 1])
    log = MeasurementLog(name="drone", time_s=time, measurement=z, row=np.arange(len(time)), rows_in_file=len(time))
    return log, position
