"""Clean tracks of a radar that looks every four seconds: turns are not patches, and noise that grows is noise."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ftproc.core import odds
from ftproc.core.editing import two_pass
from ftproc.core.identification import profile
from ftproc.core.model.frames import from_cartesian
from ftproc.simulation import simulate

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
        largest.append(np.linalg.norm(found.smoothed().state[:, :3] - position, axis=1).max())
        rejected.append((found.weight == 0).mean())
    return np.array(largest), np.array(rejected)


TURNS = [(60, 110), (100, 140, 180)]


def test_turns_are_not_patches(monkeypatch):
    flights = [arrival(seed, turns) for seed in (2, 3) for turns in TURNS]
    largest, rejected = edited(flights)
    assert np.median(largest) < 20
    assert largest.max() < 200
    assert rejected.max() < 0.03
    monkeypatch.setattr(profile, "ABRUPT", 1e6)
    monkeypatch.setattr(two_pass, "reassess_rejected", lambda record, decision, work: (decision, ()))
    assert edited(flights[:1])[0].mean() > 30


def test_noise_that_grows_with_nearness_is_noise():
    flights = [arrival(seed, (), height_noise_m=3.0) for seed in range(4)]
    largest, rejected = edited(flights)
    assert largest.max() < 18
    assert rejected.max() < 0.05


def take_off(seed, n=160, rotates=60):
    """A minute and more at one hertz: a run along the ground from rest at 3 m/s2, and a climb that begins within three
    seconds. Readings, positions."""
    rng, fine = np.random.default_rng(seed), 20
    time = np.arange(n * fine) / fine
    speed = np.clip(3.0 * (time - 32), 0, 75)
    climb = np.clip((time - rotates) / 3.0, 0, 1) * 0.12
    heading = rng.uniform(0, 2 * np.pi)
    along = np.stack([np.cos(heading) * np.cos(climb), np.sin(heading) * np.cos(climb), np.sin(climb)], 1)
    bearing = heading + rng.uniform(1, 2)
    position = np.cumsum(speed[:, None] * along / fine, 0)[::fine]
    position += [900 * np.cos(bearing), 900 * np.sin(bearing), 2.0]
    noise = np.array([3.0, 3e-4, 2e-4]) * rng.standard_normal((n, 3))
    return np.arange(float(n)), from_cartesian(position) + noise, position


def worst_of(flights):
    """The largest share of rejected readings, and the largest error in sigmas."""
    rejected, off = [], []
    for time, readings, position in flights:
        found = two_pass.edit(time, readings, UNKNOWN)
        rejected.append((found.weight == 0).mean())
        off.append((np.abs(found.smoothed().state[:, :3] - position) / found.smoothed().sigma[:, :3]).max())
    return max(rejected), max(off)


def test_a_take_off_is_no_patch(monkeypatch):
    flights = [take_off(seed) for seed in (0, 1, 5)]
    rejected, off = worst_of(flights)
    assert rejected < 0.01
    assert off < 5
    monkeypatch.setattr(two_pass, "reassess_rejected", lambda record, decision, work: (decision, ()))
    rejected, off = worst_of(flights[1:2])
    assert rejected > 0.04
    assert off > 7


ROCKETS = (1.0, 205), (1.0, 212), (1.0, 226), (0.5, 213), (0.5, 221)  # interval s, seed


def test_a_rocket_of_few_readings_is_no_patch(monkeypatch):
    """It burns within some of them, and does nothing in the others."""
    flights = [simulate("ballistic", seed=seed, dt_s=dt_s) for dt_s, seed in ROCKETS]
    flights = [(each.log.time_s, each.log.measurement, each.truth.position_m) for each in flights]
    largest, rejected = edited(flights)
    assert largest.max() < 30
    assert rejected.max() < 0.01
    monkeypatch.setattr(two_pass, "odds", SimpleNamespace(**{**vars(odds), "FEW_ANEW": odds.ANEW}))
    assert edited(flights)[0].min() > 300


def test_a_patch_that_begins_and_ends_with_a_jump_is_one():
    for seed in range(3):
        time, readings, _ = take_off(seed)
        readings[100:110, 2] += 6e-3
        found = two_pass.edit(time, readings, UNKNOWN)
        assert (found.weight[100:110, 2] == 0).all()
