"""GNSS on board as a station: it calibrates the radar, and the trajectory is as good as both together."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from ftproc.core.model.earth import place_at
from ftproc.errors import InputError, UsageError
from ftproc.files.reading import positions
from ftproc.files.writing import ranges
from ftproc.fusion import flight, range_file
from ftproc.fusion import positions as seen
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate_range

ORIGIN = (48.0, 11.0, 500.0)


@pytest.fixture(scope="module")
def fused(tmp_path_factory):
    folder = tmp_path_factory.mktemp("range")
    simulated = simulate_range("range-gnss", seed=2, duration_s=120.0)
    ranges.write(simulated, str(folder), None)
    range_ = range_file.load(str(folder / "range.toml"))
    return simulated, flight.fuse(range_, FilterSettings(smooth=True))


def test_biases_of_the_radar_are_found(fused):
    simulated, found = fused
    (radar,) = simulated.stations
    off = np.abs(found.constants.estimate[0, :6] - radar.biases) / found.constants.sigma[0, :6]
    assert (off < 3.5).all()
    assert (found.constants.sigma[0, :3] < 0.5 * radar.prior[:3]).all()
    assert found.constants.sigma[0, 5] < 0.5 * radar.prior[5]
    assert (found.constants.prior[1] == 0).all()


def test_the_trajectory_is_inside_its_sigmas(fused):
    simulated, found = fused
    truth, track = simulated.truth, found.trajectory
    at = np.stack([np.interp(track.time_s, truth.time_s, axis) for axis in truth.position_m.T], 1)
    assert (np.abs(track.state[:, :3] - at) <= 3 * track.sigma[:, :3]).mean() > 0.97
    assert np.sqrt(((track.state[:, :3] - at) ** 2).sum(1).mean()) < 3.0


def test_their_noise_is_said_along_the_axes_in_metres(fused):
    """Simulated with 2, 2 and 4 m."""
    parts = fused[1].trajectory.metadata["summary"]["stations"]["gnss"]["components"]
    assert {name: part["noise_m"] for name, part in parts.items()} == pytest.approx(
        {"north": 2.0, "east": 2.0, "up": 4.0}, rel=0.2
    )


@pytest.mark.parametrize("column", ["nacp", "hdop"])
def test_a_stated_accuracy_weighs_each_position(tmp_path, column):
    """Half of the positions are ten times as noisy, and say so: that is better than not knowing which."""
    simulated = simulate_range("range-gnss", seed=5, duration_s=120.0)
    time_s, place = simulated.gnss
    bad = (time_s // 10) % 2 == 1
    noise = 30.0 * np.random.default_rng(1).standard_normal((len(place), 3)) * bad[:, None]
    point = positions.local(place, simulated.origin) + noise
    place = np.array([place_at(simulated.origin, each) for each in point])
    stated = {"nacp": np.where(bad, 8, 10), "hdop": np.where(bad, 10.0, 1.0)}[column]
    off = []
    for more in ({}, {column: stated}):
        ranges.write(simulated, str(tmp_path), None)
        table = pd.DataFrame(place, columns=["lat_deg", "lon_deg", "height_m"]).assign(time_s=time_s, **more)
        table.to_csv(tmp_path / "gnss.csv", index=False)
        found = flight.fuse(range_file.load(str(tmp_path / "range.toml")), FilterSettings(smooth=True)).trajectory
        at = np.stack([np.interp(found.time_s, simulated.truth.time_s, x) for x in simulated.truth.position_m.T], 1)
        off.append(np.sqrt(((found.state[:, :3] - at) ** 2).sum(1).mean()))
    assert off[1] < 0.9 * off[0]


def test_the_edited_positions_stand_beside(fused):
    simulated, found = fused
    edited = found.edited["gnss"].to_pandas()
    assert len(edited) == len(simulated.gnss.time_s)
    cleaned = edited[["x_m", "y_m", "z_m"]].to_numpy()
    read = positions.local(simulated.gnss.place, simulated.origin)
    far = np.sqrt(((cleaned - read) ** 2).sum(1)) > 60
    assert far.any()
    assert edited.outlier_position[far].isin([1, 2]).all()
    assert edited.outlier_position[~far].isin([1, 2]).mean() < 0.03


def test_geodetic_positions_are_those_of_the_frame():
    point = np.array([[1000.0, -20000.0, 3000.0], [-45000.0, 0.0, 12000.0]])
    place = np.array([place_at(ORIGIN, each) for each in point])
    np.testing.assert_allclose(positions.local(place, ORIGIN), point, atol=1e-3)


@pytest.mark.parametrize(
    ("head", "row", "expected"),
    [
        ("time_s,lat_deg,lon_deg,height_m", "1,48.1,11.2,700", [48.1, 11.2, 700]),
        ("Time,Latitude,Longitude,Altitude (ft)", "1,48.1,11.2,1000", [48.1, 11.2, 304.8]),
        ("utc,lat,lng,alt", "2026-01-01T00:00:01Z,48.1,11.2,700", [48.1, 11.2, 700]),
        ("time_s,x_m,y_m,z_m", "1,10,20,30", [10, 20, 30]),
        ("t,east_m,north_m,up_m", "1,10,20,30", [10, 20, 30]),
    ],
)
def test_names_and_units(tmp_path, head, row, expected):
    path = tmp_path / "p.csv"
    path.write_text(f"{head}\n{row}\n")
    found = positions.read(str(path))
    np.testing.assert_allclose(found.place, [expected])
    assert found.geodetic == (expected[0] == 48.1)
    assert found.time_s == pytest.approx([1.0])


def test_a_lever_arm_is_taken_along_the_path(tmp_path):
    t = np.arange(0.0, 20.0)
    arm = np.array([3.0, -2.0, 1.5])  # ahead, left, up
    point = np.stack([100 * t, np.zeros(20), np.full(20, 500.0)], 1) + arm
    table = pd.DataFrame(point, columns=["x_m", "y_m", "z_m"]).assign(time_s=t)
    table.to_csv(tmp_path / "p.csv", index=False)
    text = '[origin]\n[station.gps]\nkind = "position"\nlog = "p.csv"\nsigma_m = 2\nlever_arm_m = [3, 2, 1.5]\n'
    (tmp_path / "r.toml").write_text(text)
    (instrument,) = range_file.load(str(tmp_path / "r.toml")).instruments
    placed, log = seen.read(instrument, None)
    r, a, e = log.measurement.T
    back = np.stack([r * np.cos(e) * np.cos(a), r * np.cos(e) * np.sin(a), r * np.sin(e)], 1) + placed.place
    np.testing.assert_allclose(back, point - arm, atol=1e-6)
    assert placed.options["noise"][0] == 2
    assert placed.options["noise"][1] == pytest.approx(2 / np.median(r), rel=0.2)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ("lat_deg = 48.0\nlon_deg = 11.0\nheight_m = 1.0", 'kind = "position", so lat_deg has no meaning'),
        ("range_bias_sigma_m = 20", "range_bias_sigma has no meaning"),
        ("lever_arm_m = [1, 2]", "expected three numbers, such as"),
    ],
)
def test_what_a_position_has_not_is_refused(tmp_path, keys, words):
    (tmp_path / "p.csv").write_text("time_s,x_m,y_m,z_m\n1,1,1,1\n")
    (tmp_path / "r.toml").write_text(f'[origin]\n[station.gps]\nkind = "position"\nlog = "p.csv"\n{keys}\n')
    with pytest.raises(UsageError, match=words):
        range_file.load(str(tmp_path / "r.toml"))


def test_latitudes_need_an_origin(tmp_path):
    (tmp_path / "p.csv").write_text("time_s,lat_deg,lon_deg,height_m\n1,48,11,1\n")
    (tmp_path / "r.toml").write_text('[origin]\n[station.gps]\nkind = "position"\nlog = "p.csv"\n')
    (instrument,) = range_file.load(str(tmp_path / "r.toml")).instruments
    with pytest.raises(InputError, match=r"no \[origin\]"):
        seen.read(instrument, None)
