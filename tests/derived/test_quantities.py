"""Derived quantities: by hand on simple flights, in every frame, and against the truth of simulated ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pymap3d
import pytest

import ftproc
from ftproc.derived.columns import with_derived
from ftproc.derived.quantities import Derived, load_factor
from ftproc.files import arrow
from ftproc.records import Trajectory
from ftproc.settings import FilterSettings
from tests.simulated import load_factor as load_factor_of

G = 9.80665


def flown(velocity, acceleration, frame="local", site=None, position=(0.0, 0.0, 0.0), sigma=0.01):
    """One row."""
    state = np.r_[position, velocity, acceleration][None].astype(float)
    metadata = {"frame": frame, "settings": {"site": site}}
    nothing = np.full((1, 3), np.nan)
    return Trajectory(
        "one", np.arange(1), np.zeros(1), nothing, state, np.full((1, 9), sigma), nothing, np.zeros((1, 3), np.uint8),
        np.zeros(1), np.zeros((1, 6)), metadata,
    )  # fmt: skip


def values(*args, **kwargs):
    return Derived.of(flown(*args, **kwargs)).value[0]


def test_level_turn_of_60_degrees_of_bank():
    """A coordinated turn: load factor 1 / cos(bank), turn rate g tan(bank) / v."""
    v, bank = 100.0, np.radians(60)
    ground, track, climb, angle, turn, load = values([v, 0, 0], [0, G * np.tan(bank), 0])
    assert (ground, climb, angle) == (v, 0, 0)
    assert track == pytest.approx(0)
    assert load == pytest.approx(2.0)
    assert turn == pytest.approx(np.degrees(G * np.tan(bank) / v))


def test_the_load_factor_of_a_simulated_flight():
    flight = ftproc.simulate("manoeuvre", seed=3, duration_s=40.0)
    vectors = np.hstack([flight.truth.velocity_mps, flight.truth.acceleration_mps2])
    np.testing.assert_allclose(load_factor(vectors), load_factor_of(flight), rtol=1e-9)
    np.testing.assert_allclose(load_factor(np.array([[100.0, 0, 0, 30.0, 0, 0]])), 1.0)  # thrust carries nothing


def test_climb_and_free_fall():
    assert values([60.0, 0, 80.0], [0, 0, 0])[3] == pytest.approx(np.degrees(np.arctan2(80, 60)))
    assert values([100.0, 0, 0], [0, 0, -G])[5] == pytest.approx(0, abs=1e-12)
    assert values([0.0, 0, 0], [0, 0, 0], sigma=0.0)[5] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("frame", "site", "velocity", "name", "track"),
    [
        ("local", None, [0.0, 10.0, 0.0], "track_from_x_deg", 90.0),
        ("local", None, [10.0, -10.0, 0.0], "track_from_x_deg", 315.0),
        ("north-east-up", None, [0.0, 10.0, 0.0], "track_deg", 90.0),  # y is east
        ("local", (48.0, 11.0, 600.0), [10.0, 0.0, 0.0], "track_deg", 90.0),  # x is taken as east
        ("local", (48.0, 11.0, 600.0), [0.0, 10.0, 0.0], "track_deg", 0.0),
    ],
)
def test_the_name_says_where_the_track_is_counted_from(frame, site, velocity, name, track):
    columns = Derived.of(flown(velocity, [0, 0, 0], frame, site)).columns()
    assert columns[name][0] == pytest.approx(track)
    assert len(columns) == 12
    assert [name for name in columns if name.startswith("track")] == [name]


def test_with_north_a_turn_to_the_right_is_positive():
    right = [0.0, 1.0, 0.0]  # flying north, pulled to the east
    assert values([100.0, 0, 0], right, "north-east-up")[4] > 0
    assert values([0.0, 100.0, 0], [1.0, 0, 0], "local", (48.0, 11.0, 0.0))[4] > 0


def test_too_slow_for_a_direction():
    found = Derived.of(flown([0.05, 0.0, 0.0], [0, 0, 0], sigma=0.05))
    assert np.isnan(found.value[0, [1, 3, 4]]).all()
    assert np.isfinite(found.value[0, [0, 2, 5]]).all()
    rising = Derived.of(flown([0.05, 0.0, 50.0], [0, 0, 0], sigma=0.05)).value[0]
    assert np.isnan(rising[[1, 4]]).all()
    assert rising[3] == pytest.approx(90, abs=0.1)


def test_with_a_site_the_climb_rate_is_that_of_the_height():
    """A straight line in local axes 100 km away climbs, since the earth falls away below it."""
    site, step = (48.0, 11.0, 600.0), 0.5
    position, velocity = np.array([80e3, 60e3, 9000.0]), np.array([200.0, 150.0, 0.0])
    one = flown(velocity, [0, 0, 0], "local", site, position)
    places = [pymap3d.enu2geodetic(*(position + t * velocity), *site) for t in (-step, 0, step)]
    located = replace(
        one, extra=arrow.table({"lat_deg": np.array([places[1][0]]), "lon_deg": np.array([places[1][1]])})
    )
    ground, track, climb, angle, *_ = Derived.of(located).value[0]
    assert climb == pytest.approx((places[2][2] - places[0][2]) / (2 * step), abs=1e-3)
    assert climb > 3.5
    north, east, _ = pymap3d.geodetic2ned(*places[2], *places[0])
    assert track == pytest.approx(np.degrees(np.arctan2(east, north)), abs=0.02)
    assert np.hypot(ground, climb) == pytest.approx(250.0)
    assert angle == pytest.approx(np.degrees(np.arcsin(climb / 250)))


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("scenario", ["manoeuvre", "radar"])
def test_the_sigmas_hold_against_the_truth(scenario, smooth):
    flight = ftproc.simulate(scenario, seed=4, duration_s=120.0)
    settings = FilterSettings(smooth=smooth, derived=True)
    found = ftproc.filter_log(flight.log, settings)
    known = flight.truth
    exact = np.hstack([known.position_m, known.velocity_mps, known.acceleration_mps2])
    truth = replace(found, state=exact, sigma=np.zeros_like(found.sigma))
    error = Derived.of(found).value - Derived.of(truth).value
    error[:, 1] = (error[:, 1] + 180) % 360 - 180
    ratio = error / Derived.of(found).sigma
    for k in range(6):
        known = np.isfinite(ratio[:, k])
        assert known.mean() > 0.95
        assert (np.abs(ratio[known, k]) < 3).mean() > 0.97, k
        assert np.sqrt((ratio[known, k] ** 2).mean()) > 0.1, k  # and are not idle


def test_columns_are_added_when_they_are_asked_for_and_read_back(tmp_path):
    flight = ftproc.simulate("manoeuvre", seed=1, duration_s=30.0)
    assert "load_factor" not in ftproc.to_table(ftproc.filter_log(flight.log)).column_names
    found = ftproc.filter_log(flight.log, FilterSettings(derived=True))
    names = ftproc.to_table(found).column_names
    wanted = ("ground_speed_mps", "track_from_x_deg", "climb_rate_mps", "flight_path_angle_deg", "turn_rate_degps")
    assert {*wanted, *(f"sigma_{n}" for n in wanted), "load_factor", "sigma_load_factor"} <= set(names)
    from ftproc.files.reading import trajectories as reading
    from ftproc.files.writing import trajectories as writing

    writing.write(found, tmp_path / "a.parquet")
    np.testing.assert_allclose(Derived.of(reading.read(tmp_path / "a.parquet")).sigma, Derived.of(found).sigma)


def test_a_fused_flight_has_sigmas_in_every_row():
    from ftproc.fusion import flight, range_file

    found = flight.fuse(range_file.load("sample_data/range/range.toml"), FilterSettings(smooth=True, derived=True))
    derived = Derived.of(found.trajectory)
    assert derived.from_north
    assert np.isfinite(found.trajectory.path_sigma).all()
    assert "sigma_track_deg" in found.trajectory.extra.column_names


def test_a_site_makes_north_known_in_a_stretch_whose_metadata_do_not_say_it_yet():
    """As the command writes them; the track was counted from x, and right turns were negative."""
    stretch = replace(flown([0.0, 10.0, 0.0], [1.0, 0.0, 0.0]), metadata={"frame": "local"})
    found = with_derived(stretch, FilterSettings(site=(48.0, 11.0, 600.0), derived=True)).extra
    assert found.column("track_deg").to_pylist() == pytest.approx([0.0] * len(stretch))
    assert found.column("turn_rate_degps")[0].as_py() > 0
