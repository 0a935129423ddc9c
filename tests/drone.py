"""What instruments see that read seldom: a total station of a drone, which is agile, and a laser ranger whose angles
have stamps of their own; an aircraft that holds, whose turns are short and far apart; one that weaves on its way to or
from the instrument; a mount that has just locked on; and a glider that circles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.records import FloatArray, MeasurementLog
from ftproc.simulation.flights.aircraft import Airframe, fly
from ftproc.simulation.flights.kinds import CRUISER, LIGHT

DRONE = replace(
    LIGHT, speed_mps=(4, 15), turn_g=(1.05, 1.5), climb_rad=(0.05, 0.4), pull_g=(0.1, 0.4), thrust_mps2=(1, 3),
    onset_s=(0.5, 1.2), leg_s=(2, 10), height_m=(20, 80), radius_m=80, gust_mps2=0.3,
)  # fmt: skip
PLACE = np.array([200.0, 60.0, 0.0])  # m
FAR = np.array([9000.0, 4000.0, 500.0])
LASTS_S = 240.0
LEG_S, TURN_S = 400.0, 60.0  # of an aircraft that holds
LOCKING_S, SWINGS = 8.0, (80.0, 60.0)  # that a mount swings when it has locked on, and by sigmas of its angles


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


def locked(seed: int, dt_s: float) -> tuple[MeasurementLog, FloatArray]:
    """A log of a hundred seconds of a light aircraft, 1 m and 0.1 mrad, whose mount has just locked on: both angles
    swing to and fro twice, and come to rest. And the true positions (n, 3) m."""
    time = np.arange(0.0, 100.0, dt_s)
    log, position = read(CRUISER, FAR, time, (1.0, 1e-4, 1e-4), seed)
    on = time < LOCKING_S
    phase = 4 * np.pi * time[on] / LOCKING_S + np.random.default_rng([seed, 2]).uniform(0, 2 * np.pi)
    swings = np.stack([np.cos(phase), np.sin(phase)], 1) * np.exp(-4 * time[on] / LOCKING_S)[:, None]
    log.measurement[on, 1:] += 1e-4 * np.array(SWINGS) * swings
    return log, position


def weaving(seed: int, dt_s: float) -> tuple[MeasurementLog, FloatArray]:
    """A log of two minutes of an aircraft that flies straight to the instrument or away from it, 3 m and 0.2 mrad, and
    weaves for a third of them, which shows in azimuth alone. And the true positions (n, 3) m."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 120.0, dt_s)
    along = 18e3 - 130 * time if seed % 2 else 2e3 + 130 * time
    width_m = rng.uniform(10, 140)
    turn_s = 4 + width_m / 10
    swings = np.clip(np.minimum(time - 40, 80 - time) / 3, 0, 1) * np.sin(2 * np.pi * time / turn_s)
    position = np.column_stack([along, 800 + width_m * swings, np.full(len(time), 900.0)])
    return _noisy(position, time, (3.0, 2e-4, 2e-4), rng), position


def holding(seed: int, dt_s: float, lasts_s: float) -> tuple[MeasurementLog, FloatArray]:
    """A log of an aircraft that holds, level and straight for some six minutes between half turns of one, as a radar
    sees it: 8 m, 0.4 and 0.6 mrad. And the true positions (n, 3) m."""
    rng = np.random.default_rng(seed)
    step_s, speed_mps, roll_in_s = 0.02, 200.0, 2.0
    time = np.arange(0.0, lasts_s, step_s)
    rate, begin_s = np.zeros(len(time)), LEG_S
    while begin_s < lasts_s - TURN_S:
        within = np.clip((time - begin_s) / roll_in_s, 0, 1) * np.clip((begin_s + TURN_S - time) / roll_in_s, 0, 1)
        rate += np.pi / (TURN_S - roll_in_s) * within
        begin_s += TURN_S + rng.uniform(0.9, 1.1) * LEG_S
    heading = rng.uniform(0, 2 * np.pi) + step_s * np.cumsum(rate)
    along = step_s * speed_mps * np.cumsum(np.stack([np.cos(heading), np.sin(heading)], 1), axis=0)
    every = round(dt_s / step_s)
    position = np.column_stack([along + np.array([5e4, -6e4]), np.full(len(time), 6e3)])[::every]
    return _noisy(position, time[::every], (8.0, 4e-4, 6e-4), rng), position


SOARING_SIGMA = (10.0, 5e-4, 5e-4)


def soaring(seed: int) -> tuple[MeasurementLog, FloatArray]:
    """A log of a glider that glides and climbs in circles of some 20 s, four times each, as a radar sees it once a
    second: 10 m and 0.5 mrad. And the true positions (n, 3) m."""
    rng = np.random.default_rng(seed)
    step_s, speed_mps, legs = 0.1, 27.0, list[FloatArray]()
    for _ in range(4):
        legs.append(np.zeros(int(rng.uniform(600, 1500))))
        circles = int(rng.uniform(600, 2400))
        legs.append(np.full(circles, rng.choice([-1, 1]) * 2 * np.pi / rng.uniform(16, 26)))
    rate = np.convolve(np.concatenate(legs), np.ones(30) / 30, "same")
    heading = rng.uniform(0, 2 * np.pi) + step_s * np.cumsum(rate)
    along = step_s * speed_mps * np.cumsum(np.stack([np.cos(heading), np.sin(heading)], 1), axis=0)
    height = 1000 + step_s * np.cumsum(np.where(np.abs(rate) > 0.1, 2.0, -1.0))
    position = np.column_stack([along + np.array([4000.0, 1500.0]), height])[::10]
    return _noisy(position, np.arange(float(len(position))), SOARING_SIGMA, rng), position


def coarse(log: MeasurementLog, step: float, share: float, seed: int) -> MeasurementLog:
    """A glider's log rounded to so many sigmas, with a share of outliers of 10 to 100."""
    rng, sigma = np.random.default_rng([seed, 1]), np.array(SOARING_SIGMA)
    z = log.measurement + (rng.random((len(log), 3)) < share) * rng.uniform(10, 100, (len(log), 3)) * sigma
    return replace(log, measurement=np.round(z / (step * sigma)) * step * sigma)


def read(
    airframe: Airframe, place: FloatArray, time: FloatArray, sigma: tuple[float, ...], seed: int
) -> tuple[MeasurementLog, FloatArray]:
    """A log of four minutes of an aircraft about a place (3,) m, at times (n,)."""
    rng = np.random.default_rng(seed)
    position = fly(airframe, LASTS_S, rng).at(time)[0] + place
    return _noisy(position, time, sigma, rng), position


def _noisy(
    position: FloatArray, time: FloatArray, sigma: tuple[float, ...], rng: np.random.Generator
) -> MeasurementLog:
    z = from_cartesian(position) + np.array(sigma) * rng.standard_normal((len(time), 3))
    z[:, 1] = wrap(z[:, 1])
    return MeasurementLog(name="drone", time_s=time, measurement=z, row=np.arange(len(time)), rows_in_file=len(time))
