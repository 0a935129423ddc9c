"""Many flights full of outliers, and one that is very long: does any result diverge and pass for consistent?"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ftproc import pipeline
from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.long_records import joined
from ftproc.quality.verdict import CONSISTENT
from ftproc.records import FloatArray, MeasurementLog, Trajectory, Truth
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate

DIVERGED_SIGMAS, DIVERGED_S = 20.0, 2.0
NOISE = (3.0, 2e-4, 2e-4)  # m, rad, rad
FORGOTTEN, MOST_DRIFT = 1000, 0.1  # samples until a start is forgotten; sigmas
MOST_COMPARED = 500_000  # samples at the end, with a run that starts there
OUTLIERS = "isolated=0.2:6-300,offset=2:8-30:8-200,ramp=1:10-30:20-200,burst=1:8-20:10-100,nan=0.01"


class Divergences(NamedTuple):
    """Of some flights: how many were filtered, how many diverged, and how many of these were called consistent."""

    flights: int
    diverged: int
    unreported: int


def many(flights: int = 200) -> Divergences:
    """Flights of 60 s at 10 Hz with a fifth of each component isolated outliers, and patches."""
    diverged = unreported = 0
    for seed in range(flights):
        flight = simulate("manoeuvre", seed=seed, duration_s=60.0, dt_s=0.1, outliers=OUTLIERS)
        found = pipeline.filter_log(flight.log, FilterSettings(smooth=True))
        if is_diverged(found, flight.truth):
            diverged += 1
            unreported += not is_reported(found)
    return Divergences(flights, diverged, unreported)


def is_diverged(found: Trajectory, truth: Truth) -> bool:
    """Whether the position is off by more than DIVERGED_SIGMAS for longer than DIVERGED_S."""
    size = np.sqrt((found.sigma[:, :3] ** 2).sum(1))
    off = np.linalg.norm(found.state[:, :3] - truth.position_m, axis=1) > DIVERGED_SIGMAS * size
    edges = np.flatnonzero(np.diff(np.r_[False, off, False].astype(int))).reshape(-1, 2)
    return any(found.time_s[b - 1] - found.time_s[a] > DIVERGED_S for a, b in edges)


def is_reported(found: Trajectory) -> bool:
    """Whether the verdict is suspect or unreliable."""
    return bool(found.metadata["summary"]["trust"]["verdict"] != CONSISTENT)


def endless(samples: int) -> str:
    """One log of so many samples with manoeuvres, outliers and gaps: `ok`, or what is wrong. Finite sigmas above zero
    need such a covariance; a run that starts near the end must give the same."""
    log, settings = _long(samples), FilterSettings(smooth=True, noise=NOISE, jerk_psd_m2ps5=10.0)
    start = samples - min(samples // 4, MOST_COMPARED)
    end: list[Trajectory] = []
    for part in pipeline.Filtering(log, settings, None).parts():
        if not np.isfinite(part.state).all():
            return "states that are not finite"
        if not (np.isfinite(part.sigma).all() and (part.sigma > 0).all()):
            return "sigmas that are not positive and finite"
        if part.row[-1] >= start:
            end.append(part)
    last = replace(log, time_s=log.time_s[start:], measurement=log.measurement[start:], row=log.row[start:])
    off = drift(joined(end), pipeline.filter_log(last, settings))
    return "ok" if off < MOST_DRIFT else f"{off:.2g} sigma between a long run and a late start"


def drift(whole: Trajectory, late: Trajectory) -> float:
    """By how many sigmas the states differ once the late start is forgotten, but for a thousandth of them: a decision
    on an outlier may depend on how many the whole log has."""
    state = whole.state[-len(late) :]
    return float(np.quantile((np.abs(late.state - state)[:, :6] / late.sigma[:, :6])[FORGOTTEN:], 0.999))


def _long(samples: int) -> MeasurementLog:
    """An aircraft that climbs, dives and flies eights of 2 g across the azimuth's cut."""
    draw = np.random.default_rng(1)
    time = 0.1 * np.arange(samples) + _gaps(samples)
    turn = 0.04 * time
    place = np.stack([5000 * np.sin(turn) - 8000, 2500 * np.sin(2 * turn), 500 * np.sin(3 * turn) + 3000], axis=1)
    errors = draw.standard_normal((samples, 3))
    outlier = draw.random((samples, 3)) < 0.02
    errors[outlier] += draw.uniform(8, 60, outlier.sum()) * draw.choice([-1, 1], outlier.sum())
    measurement = from_cartesian(place) + errors * NOISE
    measurement[:, 1] = wrap(measurement[:, 1])
    return MeasurementLog("long", time, measurement, np.arange(samples))


def _gaps(samples: int) -> FloatArray:
    """Delays in s of every sample: one of 5 s every 50,000."""
    return 5.0 * (np.arange(samples) // 50_000)
