"""What a total station sees of a drone: a precise and slow instrument, an agile target."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.records import FloatArray, MeasurementLog
from ftproc.simulation.aircraft import fly
from ftproc.simulation.flights import LIGHT

DRONE = replace(
    LIGHT, speed_mps=(4, 15), turn_g=(1.05, 1.5), climb_rad=(0.05, 0.4), pull_g=(0.1, 0.4), thrust_mps2=(1, 3),
    onset_s=(0.5, 1.2), leg_s=(2, 10), height_m=(20, 80), radius_m=80, gust_mps2=0.3,
)  # fmt: skip
PLACE = np.array([200.0, 60.0, 0.0])  # m
LASTS_S = 240.0


def seen(seed: int, dt_s: float, sigma: tuple[float, ...]) -> tuple[MeasurementLog, FloatArray]:
    """A log of four minutes with noise of this 1-sigma (3,) m, rad, rad, and the true positions (n, 3) m."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, LASTS_S, dt_s)
    position = fly(DRONE, LASTS_S, rng).at(time)[0] + PLACE
    z = from_cartesian(position) + np.array(sigma) * rng.standard_normal((len(time), 3))
    z[:, 1] = wrap(z[:, 1])
    log = MeasurementLog(name="drone", time_s=time, measurement=z, row=np.arange(len(time)), rows_in_file=len(time))
    return log, position
