"""The clock, or a channel, of one station among several that jumps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ftproc.core.editing.lasting.curves import CLOCK
from ftproc.core.filtering.biases import PARAMETERS
from ftproc.core.model.frames import from_cartesian
from ftproc.files.writing import ranges
from ftproc.fusion import flight, range_file
from ftproc.fusion.estimation import jumps_beside
from ftproc.fusion.estimation.events import Seen
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate_range
from tests.trust import fused_faults


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


SIGMA = np.array([1.0, 1e-4, 1e-4])


def beside(constant):
    """Times, states, and what a station reads of them, with a constant bias and a tenth of outliers."""
    n = 600
    time_s, draw = np.arange(n) * 0.1, np.random.default_rng(1)
    position = np.stack([150 * time_s - 4000, 3000 + 0 * time_s, 1000 + 3 * time_s], 1)
    state = np.hstack([position, np.gradient(position, time_s, axis=0), 0 * position])
    read = from_cartesian(position) + SIGMA * (constant + draw.standard_normal((n, 3)))
    read[draw.random(n) < 0.1] += 200 * SIGMA
    return time_s, state, read


def likeliest(station, time_s, state):
    return max(jumps_beside.propose(station, SIGMA, time_s, state), key=lambda jump: jump.gain)


@pytest.mark.parametrize("jump_s", [0.5, -0.05])
@pytest.mark.parametrize("constant", [0.0, 30.0])
def test_a_clock_that_jumps_is_found_beside_the_track_of_others_whatever_the_constant_biases(jump_s, constant):
    time_s, state, read = beside(constant)
    read[:, 0] = np.nan
    found = likeliest(seen(time_s + jump_s * (np.arange(600) >= 233), read), time_s, state)
    assert found.channel == CLOCK
    assert found.row == pytest.approx(233, abs=0 if jump_s > 0 else 2)
    assert found.size == pytest.approx(jump_s, abs=0.01)
    assert found.gain > 100


@pytest.mark.parametrize("channel", range(3))
@pytest.mark.parametrize("constant", [0.0, 30.0])
def test_so_is_a_channel_that_jumps_in_either_direction(channel, constant):
    for size in (20.0, -8.0):
        time_s, state, read = beside(constant)
        read[233:, channel] += size * SIGMA[channel]
        found = likeliest(seen(time_s, read), time_s, state)
        assert found.channel == channel
        assert found.row == pytest.approx(233, abs=2)
        assert found.size == pytest.approx(size * SIGMA[channel], abs=SIGMA[channel])
        assert found.gain > 100


def test_a_jump_is_taken_out_of_the_readings_on_either_side_of_it_and_out_of_times_behind_it():
    station = seen(np.arange(6.0), np.full((6, 3), 3.1))
    found = jumps_beside.Jump(1, 2, 0.5, 9.0)
    later, before = (side.taken_out(station) for side in found.sides())
    np.testing.assert_allclose(later.measurement[:, 1], [3.1, 3.1, 2.6, 2.6, 2.6, 2.6])
    np.testing.assert_allclose(before.measurement[:, 1], [3.6 - 2 * np.pi] * 2 + [3.1] * 4)
    np.testing.assert_array_equal(later.measurement[:, [0, 2]], 3.1)
    (clock,) = found._replace(channel=CLOCK).sides()
    np.testing.assert_array_equal(clock.taken_out(station).time_s, [0, 1, 1.5, 2.5, 3.5, 4.5])


def test_a_station_of_few_readings_has_no_jump():
    few = 2 * jumps_beside.FEWEST - 1
    station = seen(np.arange(few) * 1.0, np.ones((few, 3)))
    assert jumps_beside.propose(station, np.ones(3), np.arange(3.0), np.ones((3, 9))) == []


def fused(flown, folder):
    """The error of the fused flight, m, and its verdict."""
    ranges.write(flown, str(folder / "range"), None)
    found = flight.fuse(range_file.load(str(folder / "range" / "range.toml")), FilterSettings(smooth=True))
    truth, trajectory = flown.truth, found.trajectory
    here = (trajectory.time_s >= truth.time_s[0]) & (trajectory.time_s <= truth.time_s[-1])
    true = np.stack([np.interp(trajectory.time_s[here], truth.time_s, axis) for axis in truth.position_m.T], 1)
    off = np.sqrt(((trajectory.state[here, :3] - true) ** 2).sum(1).mean())
    return off, trajectory.metadata["summary"]["trust"]


@pytest.mark.slow
def test_a_fused_flight_without_a_jump_of_a_clock_is_as_good_as_one_that_had_none(tmp_path):
    """The station is named with its size, and the run suspect."""
    flown, name = jumping("range-theodolites", 1, 1)
    off, trust = fused(flown, tmp_path)
    assert off < 0.3
    assert trust["verdict"] == "suspect"
    assert any(name in reason and "clock" in reason for reason in trust["reasons"])


def test_nor_does_a_slipped_encoder_that_bends_the_track_remain(tmp_path):
    """Jumps of the clocks of two stations were believed instead: 1.8 m, and no position within its sigmas."""
    flown, name = fused_faults.spoilt(simulate_range("range-theodolites", 1, 60.0), "azimuth-20", 1)
    off, trust = fused(flown, tmp_path)
    assert off < 0.3
    assert trust["verdict"] == "suspect"
    assert [reason for reason in trust["reasons"] if name in reason and "azimuth steps by -2.0" in reason]
    assert not [reason for reason in trust["reasons"] if "clock" in reason]
