"""Many flights full of outliers, and one that is very long: does any result go astray without saying so?"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ftproc import pipeline
from ftproc.records import FloatArray, MeasurementLog, Trajectory, Truth
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate

ASTRAY_SIGMAS, ASTRAY_S = 20.0, 2.0
OUTLIERS = "isolated=0.2:6-300,offset=2:8-30:8-200,ramp=1:10-30:20-200,burst=1:8-20:10-100,nan=0.01"


class Astray(NamedTuple):
    """Of some flights: how many could be filtered, went astray, and did so without a word."""

    flights: int
    astray: int
    unreported: int


def many(flights: int = 200) -> Astray:
    """Flights of 60 s at 10 Hz with a fifth of each component wild, patches beside."""
    astray = unreported = 0
    for seed in range(flights):
        flight = simulate("manoeuvre", seed=seed, duration_s=60.0, dt_s=0.1, outliers=OUTLIERS)
        found = pipeline.filter_log(flight.log, FilterSettings(smooth=True))
        if is_astray(found, flight.truth):
            astray += 1
            unreported += not says_something(found)
    return Astray(flights, astray, unreported)


def is_astray(found: Trajectory, truth: Truth) -> bool:
    """Whether the position is off by more than ASTRAY_SIGMAS for longer than ASTRAY_S."""
    size = np.sqrt((found.sigma[:, :3] ** 2).sum(1))
    off = np.linalg.norm(found.state[:, :3] - truth.position_m, axis=1) > ASTRAY_SIGMAS * size
    edges = np.flatnonzero(np.diff(np.r_[False, off, False].astype(int))).reshape(-1, 2)
    return any(found.time_s[b - 1] - found.time_s[a] > ASTRAY_S for a, b in edges)


def says_something(found: Trajectory) -> bool:
    """Whether the summary's verdict is another than to trust it."""
    return bool(found.metadata["summary"]["trust"]["verdict"] != "trust")


def endless(samples: int = 1_000_000) -> str:
    """One log of so many samples, from pieces of a flight flown to and fro, with outliers and gaps: `ok`, or what is
    wrong. Where sigmas are finite and above zero, so was the covariance that they come from."""
    found = pipeline.filter_log(
        _long(samples), FilterSettings(smooth=True, noise=(3.0, 2e-4, 2e-4), jerk_psd_m2ps5=10.0)
    )
    if not np.isfinite(found.state).all():
        return "states that are not finite"
    return "ok" if np.isfinite(found.sigma).all() and (found.sigma > 0).all() else "sigmas that are none"


def _long(samples: int) -> MeasurementLog:
    flight = simulate("manoeuvre", seed=1, duration_s=600.0, dt_s=0.1, outliers="isolated=0.02:8-60")
    rounds = samples // (2 * len(flight.log)) + 1
    there_and_back = np.concatenate([flight.log.measurement, flight.log.measurement[::-1]])
    measurement = np.tile(there_and_back, (rounds, 1))[:samples]
    time = 0.1 * np.arange(samples) + _gaps(samples)
    return MeasurementLog("long", time, np.ascontiguousarray(measurement), np.arange(samples))


def _gaps(samples: int) -> FloatArray:
    """Delays in s of every sample: one of 5 s every 50,000."""
    return 5.0 * (np.arange(samples) // 50_000)
