"""Local positions to latitude, longitude and height."""

from __future__ import annotations

import sys

import numpy as np
import pyarrow as pa
import pytest

from ftproc.core.model.frames import to_cartesian
from ftproc.errors import InputError, UsageError
from ftproc.files.reading import logs
from ftproc.files.writing import geodesy
from ftproc.records import Trajectory
from ftproc.settings import FilterSettings
from tests.files.conftest import Make

SITE = (48.0812, 11.2803, 612.0)


def trajectory(position, frame="local", extra=None):
    n = len(position)
    state = np.full((n, 9), np.nan)
    state[:, : np.shape(position)[1]] = position
    blank = np.full((n, 6), np.nan)
    flags = np.zeros((n, 3), np.uint8)
    time = np.arange(float(n))
    return Trajectory(
        "t", np.arange(n), time, blank[:, :3], state, np.full((n, 9), np.nan), blank[:, :3], flags, time, blank,
        {"frame": frame}, extra
    )  # fmt: skip


def columns(found):
    return np.column_stack([found.extra[name].to_numpy() for name in geodesy.COLUMNS])


def test_the_station_and_the_point_above_it():
    found = columns(geodesy.located(trajectory([[0, 0, 0], [0, 0, 1000.0]]), FilterSettings(site=SITE)))
    np.testing.assert_allclose(found, [SITE, (*SITE[:2], 1612.0)], rtol=1e-12)


@pytest.mark.parametrize("frame", ["local", "north-east-up"])
def test_axes(frame):
    east, north = ([1, 0, 0], [0, 1, 0]) if frame == "local" else ([0, 1, 0], [1, 0, 0])
    found = columns(geodesy.located(trajectory(1000.0 * np.array([east, north]), frame), FilterSettings(site=SITE)))
    assert found[0, 1] > SITE[1] + 0.013
    assert found[0, 0] == pytest.approx(SITE[0], abs=1e-5)
    assert found[1, 0] > SITE[0] + 0.0089
    assert found[1, 1] == pytest.approx(SITE[1], abs=1e-12)


def test_against_the_earth_s_own_geometry():
    """Eastward along the equator: the horizon drops away, and the angle is exact."""
    a, away = 6378137.0, 100e3
    found = columns(geodesy.located(trajectory([[away, 0, 0]]), FilterSettings(site=(0.0, 0.0, 0.0))))[0]
    np.testing.assert_allclose(found, [0.0, np.rad2deg(np.arctan2(away, a)), np.hypot(a, away) - a], atol=1e-8)


def test_no_estimate_no_place_and_kept_columns_stay():
    kept = pa.table({"note": ["a", "b"]})
    found = geodesy.located(trajectory([[np.nan] * 3, [0, 0, 0]], extra=kept), FilterSettings(site=SITE))
    assert found.extra is not None
    assert found.extra.column_names == ["note", *geodesy.COLUMNS]
    assert np.isnan(columns(found)[0]).all()
    assert found.metadata["site_axes"] == "x is taken as east, y as north"


def test_a_kept_column_of_the_same_name():
    with pytest.raises(UsageError, match='the log\'s column "lat_deg" has the name of an output column'):
        geodesy.located(trajectory([[0, 0, 0]], extra=pa.table({"lat_deg": [1.0]})), FilterSettings(site=SITE))


def test_without_pymap3d(monkeypatch):
    monkeypatch.setitem(sys.modules, "pymap3d", None)
    with pytest.raises(UsageError, match=r'--site needs pymap3d, which is not installed: pip install "pymap3d>=3.0.1"'):
        geodesy.require_pymap3d()


def test_against_pymap3d_to_a_millimetre_at_every_distance():
    """Through spherical range, azimuth and elevation, which pymap3d turns by a way of its own."""
    import pymap3d

    rng = np.random.default_rng(5)
    azimuth, elevation, distance = rng.uniform(0, 360, 50), rng.uniform(-1, 89, 50), 10 ** rng.uniform(1, 5.7, 50)
    position = to_cartesian(np.column_stack([distance, np.deg2rad(azimuth), np.deg2rad(elevation)]))
    moving = np.column_stack([position, rng.normal(0, 300, (50, 3))])
    settings = FilterSettings(site=SITE, ecef=True)
    located = geodesy.located(trajectory(moving, "north-east-up"), settings)
    place = columns(located)
    expected = np.column_stack(pymap3d.aer2geodetic(azimuth, elevation, distance, *SITE))
    on_ground = np.array([111e3, 111e3, 1.0])
    np.testing.assert_array_less(np.abs(place - expected) * on_ground, 1e-3)
    ecef = np.column_stack([located.extra[name].to_numpy() for name in geodesy.ECEF])
    np.testing.assert_allclose(
        ecef[:, :3], np.column_stack(pymap3d.aer2ecef(azimuth, elevation, distance, *SITE)), atol=1e-3
    )
    later = np.column_stack([moving[:, :3] + moving[:, 3:], moving[:, 3:]])
    then = geodesy.located(trajectory(later, "north-east-up"), settings)
    step = np.column_stack([then.extra[name].to_numpy() for name in geodesy.ECEF[:3]]) - ecef[:, :3]
    np.testing.assert_allclose(step, ecef[:, 3:], atol=1e-6)


def test_earth_s_curvature():
    """A level line of sight of 100 km ends 785 m above the ellipsoid: R^2 / 2r."""
    found = columns(geodesy.located(trajectory([[0.0, 100e3, 0.0]]), FilterSettings(site=(0.0, 0.0, 0.0))))[0]
    assert found[2] == pytest.approx(100e3**2 / (2 * 6_335_439), rel=1e-3)  # the meridian's radius at the equator


def test_without_a_site_nothing_is_added_and_ecef_is_refused():
    plain = trajectory([[0, 0, 0]])
    assert geodesy.located(plain, FilterSettings()) is plain
    with pytest.raises(UsageError, match=r"--ecef needs the station: give --site LAT,LON,HEIGHT, or \[site\]"):
        geodesy.located(plain, FilterSettings(ecef=True))


@pytest.mark.parametrize(
    ("name", "axis"), [("Az", ""), ("Bearing", "north"), ("True Azimuth", "north"), ("azimuth_rad", "x")]
)
def test_the_axis_of_an_unknown_azimuth_is_asked_about(make: Make, name: str, axis: str) -> None:
    settings = FilterSettings(site=(48.0, 11.0, 600.0))
    rows = "".join(f"{k},{4000 + 30 * k},{0.3 + 0.002 * k},0.1\n" for k in range(30))
    path = make(f"time_s,range_m,{name},el_rad\n{rows}")
    log = logs.read(path, units=None if axis == "x" else "azimuth=rad")
    assert log.station.azimuth_from == (axis or "x")
    if axis:
        geodesy.check_axes(log, settings)
        return
    with pytest.raises(InputError, match="Say --azimuth-from north if clockwise from north, or --azimuth-from x"):
        geodesy.check_axes(log, settings)
    geodesy.check_axes(log, FilterSettings())
    geodesy.check_axes(logs.read(path, units="azimuth=rad", azimuth_from="x"), settings)
