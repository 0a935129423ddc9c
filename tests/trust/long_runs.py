"""Many flights full of outliers, and one that is very long: does any result go astray without saying so?"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ftproc import pipeline
from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.records import FloatArray, MeasurementLog, Trajectory, Truth, joined
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate

ASTRAY_SIGMAS, ASTRAY_S = 20.0, 2.0
NOISE = (3.0, 2e-4, 2e-4)  # m, rad, rad
SETTLED, MOST_DRIFT = 1000, 0.1  # samples until a start is forgotten; sigmas
MOST_COMPARED = 500_000  # samples at the end, with a run that begins there
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


def endless(samples: int) -> str:
    """One log of so many samples with manoeuvres, outliers and gaps: `ok`, or what is wrong. Where sigmas are
    finite and above zero, so was the covariance that they come from; a run that begins anew near the end must
    say the same."""
    log, settings = _long(samples), FilterSettings(smooth=True, noise=NOISE, jerk_psd_m2ps5=10.0)
    begin = samples - min(samples // 4, MOST_COMPARED)
    end: list[Trajectory] = []
    for part in pipeline.Filtering(log, settings, None).parts():
        if not np.isfinite(part.state).all():
            return "states that are not finite"
        if not (np.isfinite(part.sigma).all() and (part.sigma > 0).all()):
            return "sigmas that are none"
        if part.row[-1] >= begin:
            end.append(part)
    last = replace(log, time_s=log.time_s[begin:], measurement=log.measurement[begin:], row=log.row[begin:])
    off = drift(joined(end), pipeline.filter_log(last, settings))
    return "ok" if off < MOST_DRIFT else f"{off:.2g} sigma between a long run and one begun anew"


def drift(whole: Trajectory, anew: Trajectory) -> float:
    """By how many sigmas the states differ, once the later run has settled; but for a thousandth of them, because what
    is an outlier may hang on how many the whole log has."""
    state = whole.state[-len(anew) :]
    return float(np.quantile((np.abs(anew.state - state)[:, :6] / anew.sigma)[SETTLED:], 0.999))


def _long(samples: int) -> MeasurementLog:
    """An aircraft that climbs, dives and flies eights of 2 g across the azimuth's cut."""
    draw = np.random.default_rng(1)
    time = 0.1 * np.arange(samples) + _gaps(samples)
    turn = 0.04 * time
    place = np.stack([5000 * np.sin(turn) - 8000, 2500 * np.sin(2 * turn), 500 * np.sin(3 * turn) + 3000], axis=1)
    errors = draw.standard_normal((samples, 3))
    wild = draw.random((samples, 3)) < 0.02
    errors[wild] += draw.uniform(8, 60, wild.sum()) * draw.choice([-1, 1], wild.sum())
    measurement = from_cartesian(place) + errors * NOISE
    measurement[:, 1] = wrap(measurement[:, 1])
    return MeasurementLog("long", time, measurement, np.arange(samples))


def _gaps(samples: int) -> FloatArray:
    """Delays in s of every sample: one of 5 s every 50,000."""
    return 5.0 * (np.arange(samples) // 50_000)
