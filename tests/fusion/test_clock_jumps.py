"""The clock of one station among several that jumps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ftproc.core.filtering.biases import PARAMETERS
from ftproc.core.model.frames import from_cartesian
from ftproc.files.writing import ranges
from ftproc.fusion import flight, range_file
from ftproc.fusion.estimation import clock_jumps
from ftproc.fusion.estimation.events import Seen
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate_range


def seen(time_s, measurement):
    """A station at the origin without biases."""
    unknown, by_hand = np.full(3, np.nan), np.zeros(measurement.shape, bool)
    return Seen("it", time_s, measurement, np.zeros(3), np.eye(3), np.zeros(PARAMETERS), unknown, by_hand)


def jumping(scenario, seed, k):
    """A flight whose k-th station has a clock that jumps, and the name of that station."""
    flown = simulate_range(scenario, seed, 60.0)
    station = flown.stations[k]
    time_s = station.log.time_s + 0.5 * (np.arange(len(station.log.time_s)) >= 0.4 * len(station.log.time_s))
    spoilt = replace(station, log=replace(station.log, time_s=np.round(time_s, 6)))
    return replace(flown, stations=tuple(spoilt if s is station else s for s in flown.stations)), station.name


@pytest.mark.parametrize("jump_s", [0.5, -0.05])
@pytest.mark.parametrize("constant", [0.0, 3e-3])
def test_a_jump_is_found_beside_the_track_of_others_whatever_the_constant_biases(jump_s, constant):
    n, row = 600, 233
    time_s, draw = np.arange(n) * 0.1, np.random.default_rng(1)
    position = np.stack([150 * time_s - 4000, 3000 + 0 * time_s, 1000 + 3 * time_s], 1)
    state = np.hstack([position, np.gradient(position, time_s, axis=0), 0 * position])
    read = from_cartesian(position) + constant + 1e-4 * draw.standard_normal((n, 3))
    read[draw.random(n) < 0.1] += 0.02
    read[:, 0] = np.nan
    station = seen(time_s + jump_s * (np.arange(n) >= row), read)
    found = clock_jumps.propose(station, np.array([1.0, 1e-4, 1e-4]), time_s, state)
    assert found is not None
    assert found.row == pytest.approx(row, abs=0 if jump_s > 0 else 2)
    assert found.size_s == pytest.approx(jump_s, abs=0.01)
    assert found.gain > 100


def test_a_station_of_few_readings_has_no_jump():
    few = 2 * clock_jumps.FEWEST - 1
    station = seen(np.arange(few) * 1.0, np.ones((few, 3)))
    assert clock_jumps.propose(station, np.ones(3), np.arange(3.0), np.ones((3, 9))) is None


def test_a_fused_flight_without_a_jump_of_a_clock_is_as_good_as_one_that_had_none(tmp_path):
    """The station is named with its size, and the run suspect."""
    flown, name = jumping("range-theodolites", 1, 1)
    ranges.write(flown, str(tmp_path / "range"), None)
    found = flight.fuse(range_file.load(str(tmp_path / "range" / "range.toml")), FilterSettings(smooth=True))
    truth, trajectory = flown.truth, found.trajectory
    here = (trajectory.time_s >= truth.time_s[0]) & (trajectory.time_s <= truth.time_s[-1])
    true = np.stack([np.interp(trajectory.time_s[here], truth.time_s, axis) for axis in truth.position_m.T], 1)
    off = np.sqrt(((trajectory.state[here, :3] - true) ** 2).sum(1).mean())
    assert off < 0.3
    trust = trajectory.metadata["summary"]["trust"]
    assert trust["verdict"] == "suspect"
    assert any(name in reason and "clock" in reason for reason in trust["reasons"])
