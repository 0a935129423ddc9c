"""Range rates and heights of the stations of a range: used, edited, their noise and their biases estimated."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from ftproc.files.writing import ranges
from ftproc.fusion import flight, range_file
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate_range
from ftproc.simulation.ranges import SURVEILLANCE

SMOOTH = FilterSettings(smooth=True)


def fused(simulated, folder):
    ranges.write(simulated, str(folder), None)
    return flight.fuse(range_file.load(str(folder / "range.toml")), SMOOTH)


def errors(simulated, found):
    """RMS of position m and velocity m/s; and shares inside 3 sigma."""
    truth, track = simulated.truth, found.trajectory
    both = truth.position_m, truth.velocity_mps
    at = np.hstack([np.stack([np.interp(track.time_s, truth.time_s, axis) for axis in each.T], 1) for each in both])
    off = track.state[:, :6] - at
    inside = (np.abs(off) <= 3 * track.sigma[:, :6]).mean()
    return np.array([np.sqrt((part**2).sum(1).mean()) for part in (off[:, :3], off[:, 3:])]), inside


def rate_of(station):
    position, velocity = station.truth.position_m, station.truth.velocity_mps
    return (position * velocity).sum(1) / np.sqrt((position**2).sum(1))


def with_rates(simulated, sigma, seed=0, **changed):
    rng, stations = np.random.default_rng(seed), []
    for station in simulated.stations:
        rate = rate_of(station) + sigma * rng.standard_normal(len(station.log))
        stations.append(replace(station, log=replace(station.log, range_rate=changed.get("of", lambda r: r)(rate))))
    return replace(simulated, stations=tuple(stations))


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    simulated = simulate_range("range-radar", seed=3, duration_s=40.0)
    found = fused(simulated, tmp_path_factory.mktemp("plain"))
    return simulated, found, errors(simulated, found)[0]


def test_better_with_range_rates(plain, tmp_path):
    simulated, _, without = plain
    found = fused(with_rates(simulated, 0.5), tmp_path)
    ratio = errors(simulated, found)[0] / without
    assert ratio[0] < 0.8
    assert ratio[1] < 0.8
    for part in found.trajectory.metadata["summary"]["stations"].values():
        assert part["components"]["range_rate"]["noise_mps"] == pytest.approx(0.5, rel=0.15)
        assert part["components"]["range_rate"]["residual_ratio"] == pytest.approx(1.0, abs=0.1)


def test_useless_ones_change_nothing(plain, tmp_path):
    simulated, _, without = plain
    found = fused(with_rates(simulated, 100.0), tmp_path)
    assert (errors(simulated, found)[0] / without).max() < 1.01


def test_the_other_sense_is_found(plain, tmp_path):
    simulated, _, without = plain
    found = fused(with_rates(simulated, 0.5, of=np.negative), tmp_path)
    assert errors(simulated, found)[0][1] < 0.8 * without[1]
    assert "count inward" in " ".join(found.trajectory.metadata["summary"]["notes"])


def test_rates_that_hinder_are_left_out(plain, tmp_path):
    simulated, reference, _ = plain
    found = fused(with_rates(simulated, 0.5, of=lambda rate: rate + 8.0), tmp_path)
    off = np.abs(found.trajectory.state[:, :3] - reference.trajectory.state[:, :3])
    assert (off < 0.2 * reference.trajectory.sigma[:, :3]).all()
    assert "none is used" in " ".join(found.trajectory.metadata["summary"]["notes"])


@pytest.fixture(scope="module")
def surveillance(tmp_path_factory):
    simulated = simulate_range(SURVEILLANCE, seed=1, duration_s=250.0)
    return simulated, fused(simulated, tmp_path_factory.mktemp("surveillance"))


def test_heights_have_one_offset_that_the_others_tell(surveillance):
    simulated, found = surveillance
    constants = found.constants
    assert (constants.prior[:, 6] > 0).sum() == 1
    assert constants.sigma[0, 6] < 80
    assert found.trajectory.metadata["summary"]["stations"]["surveillance1"]["components"]["height"]["good"] > 20
    assert errors(simulated, found)[1] > 0.95


def test_outliers_beside_are_labelled(surveillance):
    simulated, found = surveillance
    wrong, fine = [], []
    for station in simulated.stations:
        edited = found.edited[station.name].to_pandas()
        if station.log.range_rate is not None:
            reading, label = station.log.range_rate, edited.outlier_range_rate
            far = np.abs(reading - rate_of(station)) > 8 * 0.5
            assert edited.range_rate_mps.notna().all()
        else:
            reading, label = station.log.heights.above_m, edited.outlier_height
            far = np.abs(reading - edited.height_m) > 100
            assert (label[~np.isfinite(reading)] == 3).all()
        seen = np.isfinite(reading)
        wrong += label[far & seen].tolist()
        fine += label[~far & seen].tolist()
    assert len(wrong) > 5
    assert np.isin(wrong, (1, 2)).mean() > 0.95
    assert np.isin(fine, (1, 2)).mean() < 0.01


def test_flight_levels_alone_give_a_place(tmp_path):
    """Two radars without elevations: the offset of their common transponder stays as it was known."""
    simulated = simulate_range(SURVEILLANCE, seed=2, duration_s=250.0)
    simulated = replace(simulated, stations=simulated.stations[:2])
    found = fused(simulated, tmp_path)
    (horizontal, _), inside = errors(simulated, found)
    assert inside > 0.95
    assert horizontal < 400
    assert np.median(found.trajectory.sigma[:, 2]) > 60


def two_radars(folder, seed, more_m=(0.0, 0.0)):
    """Without elevations; what is added to the heights of each, NaN for none of them. What is simulated, and fused."""
    simulated = simulate_range(SURVEILLANCE, seed=seed, duration_s=250.0)
    simulated = replace(simulated, stations=simulated.stations[:2])
    ranges.write(simulated, str(folder), None)
    for name, more in zip(("surveillance1", "surveillance2"), more_m, strict=True):
        log = pd.read_csv(folder / f"{name}.csv")
        log["flight_level"] += more / 30.48
        log.dropna(axis=1, how="all").to_csv(folder / f"{name}.csv", index=False)
    return simulated, flight.fuse(range_file.load(str(folder / "range.toml")), SMOOTH)


@pytest.mark.parametrize("seed", [0, 1, 2, 4])
def test_faults_are_sought_with_the_heights_in_mind(tmp_path, seed):
    """Each seeming step once gained a thousand in log-likelihood, as the heights did not count beside it."""
    found = two_radars(tmp_path, seed)[1].trajectory.metadata["summary"]
    assert found["trust"]["verdict"] == "consistent"
    for station in found["stations"].values():
        assert station["components"]["range"]["rejected"] < 0.1 * station["components"]["range"]["good"]


def test_where_nobody_tells_the_height_a_prior_stands_for_it(tmp_path):
    simulated, found = two_radars(tmp_path, 2, (np.nan, np.nan))
    summary, track = found.trajectory.metadata["summary"], found.trajectory
    assert "no station tells the height: it is taken for that of an aircraft, 6000 m" in " ".join(summary["notes"])
    assert summary["trust"]["verdict"] == "consistent"
    assert errors(simulated, found)[1] > 0.95
    at = [np.interp(track.time_s, simulated.truth.time_s, axis) for axis in simulated.truth.position_m[:, :2].T]
    assert np.sqrt(((track.state[:, :2] - np.stack(at, 1)) ** 2).sum(1).mean()) < 300
    assert not any("height" in name for name in found.edited["surveillance1"].column_names)


@pytest.mark.parametrize("seed", [2, 3])
def test_heights_of_one_station_may_be_others(tmp_path, seed):
    """Those of another setting of the air's pressure, 400 m off: the track is as good as without."""
    simulated, found = two_radars(tmp_path, seed, (0.0, 400.0))
    (horizontal, _), inside = errors(simulated, found)
    trust = found.trajectory.metadata["summary"]["trust"]
    assert trust["verdict"] == "suspect"
    assert re.search(r"the heights of surveillance. lie .*another setting of the air's", " ".join(trust["reasons"]))
    assert inside > 0.9
    assert horizontal < 400


@pytest.mark.parametrize(
    "channel",
    ["range", *(pytest.param(name, marks=pytest.mark.slow) for name in ("azimuth", "elevation", "rate"))],
)
def test_numbers_that_no_instrument_reads_are_outliers(plain, tmp_path, channel):
    simulated, reference, _ = plain
    simulated = with_rates(simulated, 100.0)
    first, *rest = simulated.stations
    z, rate = first.log.measurement.copy(), first.log.range_rate.copy()
    for row, number in ((40, 1e300), (41, -1e300), (90, 1e15)):
        if channel == "rate":
            rate[row] = number
        else:
            z[row, ("range", "azimuth", "elevation").index(channel)] = number
    first = replace(first, log=replace(first.log, measurement=z, range_rate=rate))
    found = fused(replace(simulated, stations=(first, *rest)), tmp_path)
    off = np.abs(found.trajectory.state[:, :3] - reference.trajectory.state[:, :3])
    assert (off < 0.5 * reference.trajectory.sigma[:, :3]).all()


def test_two_radars_without_elevations_do_not_put_a_target_below_the_ground(tmp_path):
    """A drone at 40 to 80 m, seen by two harbour radars: ranges and azimuths fit as well 60 m below."""
    t = np.arange(0, 200, 0.2)
    position = np.stack([200 + 8 * t * np.cos(t / 60), 100 + 6 * t * np.sin(t / 50 + 1), 60 + 20 * np.sin(t / 40)], 1)
    for seed in (0, 1):
        rng, text = np.random.default_rng(seed), ""
        for k, place in enumerate(([0.0, 0.0, 0.0], [800.0, -300.0, 0.0])):
            seen = np.stack([np.interp(np.arange(0.3 * k, 199), t, axis) for axis in position.T], 1) - place
            n = len(seen)
            slant = np.sqrt((seen**2).sum(1)) + rng.standard_normal(n)
            azimuth = np.arctan2(seen[:, 1], seen[:, 0]) + 2e-3 * rng.standard_normal(n)
            log = pd.DataFrame({"time_s": np.arange(0.3 * k, 199), "range_m": slant, "azimuth_rad": azimuth})
            log.to_csv(tmp_path / f"r{k}.csv", index=False)
            text += f'[station.r{k}]\nlog = "r{k}.csv"\neast_m = {place[0]}\nnorth_m = {place[1]}\nup_m = 0\n'
        (tmp_path / "range.toml").write_text(text)
        track = flight.fuse(range_file.load(str(tmp_path / "range.toml")), SMOOTH).trajectory
        off = track.state[:, 2] - np.interp(track.time_s, t, position[:, 2])
        assert np.abs(off).max() < 80
        assert (np.abs(off) <= 5 * track.sigma[:, 2]).all()
