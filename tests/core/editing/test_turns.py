"""Clean tracks of a radar that looks every four seconds: turns are not patches, and noise that grows is noise."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing import two_pass
from ftproc.core.model.frames import from_cartesian

pytestmark = pytest.mark.compiled

UNKNOWN = two_pass.Known(np.full(3, np.nan), None, 4.0)
INTERVAL_S, SCANS, FINE = 4.0, 260, 40
TURN_RATE, SCANS_OF_A_TURN = np.deg2rad(3.0), 8


def arrival(seed, turns, height_noise_m=None):
    """Readings of an arrival, from far to a kilometre, that turns left and right in turn at these scans, and the
    positions. height_noise_m: of the height that the elevation is computed from; None for an elevation of 0.1 mrad."""
    rng = np.random.default_rng(seed)
    time = INTERVAL_S * np.arange(SCANS)
    rate = np.zeros(SCANS)
    for k, turn in enumerate(turns):
        rate[turn : turn + SCANS_OF_A_TURN] = TURN_RATE * (-1) ** k
    heading = np.pi + np.cumsum(np.repeat(rate, FINE)) * INTERVAL_S / FINE
    speed = np.linspace(150.0, 70.0, SCANS * FINE)[:, None]
    ground = np.cumsum(speed * INTERVAL_S / FINE * np.stack([np.cos(heading), np.sin(heading)], 1), 0)[::FINE]
    ground += np.array([1000.0, 600.0]) - ground[-1]
    position = np.column_stack([ground, np.linspace(3000.0, 60.0, SCANS)])
    readings = from_cartesian(position)
    sigma = np.tile([2.4, 1.2e-4, 1e-4], (SCANS, 1))
    if height_noise_m is not None:
        sigma[:, 2] = height_noise_m / readings[:, 0]
    return time, readings + sigma * rng.standard_normal((SCANS, 3)), position


def edited(flights):
    """The largest error of each flight in metres, and the share of all its readings that is rejected."""
    largest, rejected = [], []
    for time, readings, position in flights:
        found = two_pass.edit(time, readings, UNKNOWN)
        largest.append(np.linalg.norm(found.smoothed.state[:, :3] - position, axis=1).max())
        rejected.append((found.weight == 0).mean())
    return np.array(largest), np.array(rejected)


TURNS = [(60, 110), (100, 140, 180)]


def test_turns_are_not_patches(monkeypatch):
    flights = [arrival(seed, turns) for seed in range(2) for turns in TURNS]
    largest, rejected = edited(flights)
    assert np.median(largest) < 20
    assert largest.max() < 200
    assert rejected.max() < 0.03
    monkeypatch.setattr(two_pass, "may_be_turns", lambda decision, jumps_only: np.zeros(jumps_only.shape, bool))
    assert np.median(edited(flights[:2])[0]) > 50


def test_noise_that_grows_with_nearness_is_noise():
    flights = [arrival(seed, (), height_noise_m=3.0) for seed in range(4)]
    largest, rejected = edited(flights)
    assert largest.max() < 18
    assert rejected.max() < 0.05


def test_turns_are_looked_for_where_they_may_be(monkeypatch):
    flights = [arrival(0, TURNS[0])]
    monkeypatch.setattr(two_pass, "few", lambda doubtful: True)
    assert edited(flights)[0][0] < 20
    monkeypatch.setattr(two_pass, "with_turns", lambda record, decision, weight, doubtful: decision)
    assert edited(flights)[0][0] > 50
