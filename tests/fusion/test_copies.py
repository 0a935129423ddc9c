"""A station of a fused flight that repeats its readings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ftproc.files.writing import ranges
from ftproc.fusion import flight, range_file
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate_range

HELD, SETTINGS = 4, FilterSettings(smooth=True)


@pytest.fixture(scope="module")
def spoilt(tmp_path_factory):
    """A flight whose first theodolite holds each reading for four rows, fused; and its truth."""
    flown = simulate_range("range-theodolites", 0, 60.0)
    first = flown.stations[0]
    held = first.log.measurement[HELD * (np.arange(len(first.log.time_s)) // HELD)]
    stations = (replace(first, log=replace(first.log, measurement=held)), *flown.stations[1:])
    folder = str(tmp_path_factory.mktemp("held"))
    ranges.write(replace(flown, stations=stations), folder, None)
    return flight.fuse(range_file.load(f"{folder}/range.toml"), SETTINGS).trajectory, flown.truth


def test_a_station_that_holds_its_readings_contradicts_nobody(spoilt):
    found, _ = spoilt
    summary = found.metadata["summary"]
    said = [*summary["trust"]["reasons"], *summary["notes"]]
    assert not [each for each in said if "contradicts" in each or "rejected" in each]
    assert any("theodolite1: azimuth repeats the reading before in " in each for each in said)


def test_what_was_held_is_missing_and_the_rest_is_used(spoilt):
    found, _ = spoilt
    part = found.metadata["summary"]["stations"]["theodolite1"]["components"]["azimuth"]
    rows = found.metadata["summary"]["stations"]["theodolite1"]["rows"]
    assert part["held"] == part["missing"] == pytest.approx(rows * (1 - 1 / HELD), abs=3)
    assert part["good"] > 0.8 * rows / HELD


def test_its_track_is_within_its_sigmas(spoilt):
    found, truth = spoilt
    inside = (found.time_s >= truth.time_s[0]) & (found.time_s <= truth.time_s[-1])
    position = np.stack([np.interp(found.time_s[inside], truth.time_s, axis) for axis in truth.position_m.T], 1)
    error = np.abs(found.state[inside, :3] - position) / found.sigma[inside, :3]
    assert (error < 3).all(1).mean() > 0.95
