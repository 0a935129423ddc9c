"""Flights along given paths, measured from the station with the same noise."""

from __future__ import annotations

from functools import cache

import numpy as np

from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.pipeline import filter_log
from ftproc.records import MeasurementLog
from ftproc.settings import FilterSettings

SIGMA = np.array([3.0, 2e-4, 2e-4])
TIME = 0.1 * np.arange(600)
UNCONFIRMED = 30  # samples at most before a track that is edited as it comes is confirmed

PATHS = {
    "radial": lambda t: np.stack([-9000 + 100 * t, 0 * t, 500 + 0 * t], 1),
    "swinging across the cut": lambda t: np.stack([-9000 + 100 * t, 3 * np.sin(t), 500 + 0 * t], 1),
    "orbit": lambda t: np.stack([3000 * np.cos(t / 15), 3000 * np.sin(t / 15), 800 + 0 * t], 1),
    "helix": lambda t: np.stack([8000 + 1500 * np.cos(t / 20), 8000 + 1500 * np.sin(t / 20), 800 + 2 * t], 1),
    "receding": lambda t: np.stack([3000 + 100 * t, 3000 + 50 * t, 500 + 0 * t], 1),
    "overhead": lambda t: np.stack([-3000 + 100 * t, 30 + 0 * t, 2000 + 0 * t], 1),
    "through the zenith": lambda t: np.stack([-3000 + 100 * t, 0 * t, 2000 + 0 * t], 1),
}


def measured(position, time=TIME, seed=0):
    """The log of a flight along (n, 3) positions."""
    z = from_cartesian(position) + SIGMA * np.random.default_rng(seed).standard_normal((len(time), 3))
    z[:, 1] = wrap(z[:, 1])
    return MeasurementLog("flight.csv", time, z, np.arange(len(time)), rows_in_file=len(time))


def turned(position, angle):
    c, s = np.cos(angle), np.sin(angle)
    return position @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


def rms(trajectory, position, rows=slice(None)):
    """Of the samples with an estimate: all, but for those before a track that is edited as it comes is confirmed."""
    first = begins(trajectory)
    assert np.isfinite(trajectory.state[first:]).all()
    error = np.sum((trajectory.state[:, :3] - position) ** 2, 1)[rows]
    return np.sqrt(np.mean(error[np.isfinite(error)]))


def begins(trajectory):
    """The first sample with an estimate."""
    first = trajectory.metadata["summary"]["rows_without_estimate"]
    assert first <= (UNCONFIRMED if trajectory.metadata["settings"]["editing"] in ("live", "forward") else 0)
    return first


def held(trajectory, position):
    """Share of samples whose position lies within 3 published sigmas along every axis."""
    return (np.abs(trajectory.state[:, :3] - position) < 3 * trajectory.sigma[:, :3]).all(1).mean()


def run(log, **settings):
    return filter_log(log, FilterSettings(**settings))


@cache
def flown(path, seed=0, **settings):
    """The run of a flight along a path of PATHS; run once, however many ask for it."""
    return run(measured(PATHS[path](TIME), seed=seed), **settings)
