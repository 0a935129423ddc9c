"""Local positions to latitude, longitude and height."""

from __future__ import annotations

import sys

import numpy as np
import pyarrow as pa
import pytest

from ftproc import geodesy
from ftproc.errors import UsageError
from ftproc.records import Trajectory

SITE = (48.0812, 11.2803, 612.0)


def trajectory(position, frame="local", extra=None):
    n = len(position)
    state = np.full((n, 9), np.nan)
    state[:, :3] = position
    blank = np.full((n, 6), np.nan)
    flags = np.zeros((n, 3), np.uint8)
    time = np.arange(float(n))
    return Trajectory(
        "t", np.arange(n), time, blank[:, :3], state, blank, flags, time, blank, {"frame": frame}, extra
    )  # fmt: skip


def columns(found):
    return np.column_stack([found.extra[name].to_numpy() for name in geodesy.COLUMNS])


def test_the_station_and_the_point_above_it():
    found = columns(geodesy.with_geodetic(trajectory([[0, 0, 0], [0, 0, 1000.0]]), SITE))
    np.testing.assert_allclose(found, [SITE, (*SITE[:2], 1612.0)], rtol=1e-12)


@pytest.mark.parametrize("frame", ["local", "north-east-up"])
def test_axes(frame):
    east, north = ([1, 0, 0], [0, 1, 0]) if frame == "local" else ([0, 1, 0], [1, 0, 0])
    found = columns(geodesy.with_geodetic(trajectory(1000.0 * np.array([east, north]), frame), SITE))
    assert found[0, 1] > SITE[1] + 0.013
    assert found[0, 0] == pytest.approx(SITE[0], abs=1e-5)
    assert found[1, 0] > SITE[0] + 0.0089
    assert found[1, 1] == pytest.approx(SITE[1], abs=1e-12)


def test_against_the_earth_s_own_geometry():
    """Eastward along the equator: the horizon drops away, and the angle is exact."""
    a, away = 6378137.0, 100e3
    found = columns(geodesy.with_geodetic(trajectory([[away, 0, 0]]), (0.0, 0.0, 0.0)))[0]
    np.testing.assert_allclose(found, [0.0, np.rad2deg(np.arctan2(away, a)), np.hypot(a, away) - a], atol=1e-8)


def test_no_estimate_no_place_and_kept_columns_stay():
    kept = pa.table({"note": ["a", "b"]})
    found = geodesy.with_geodetic(trajectory([[np.nan] * 3, [0, 0, 0]], extra=kept), SITE)
    assert found.extra is not None
    assert found.extra.column_names == ["note", *geodesy.COLUMNS]
    assert np.isnan(columns(found)[0]).all()
    assert found.metadata["site_axes"] == "x is taken as east, y as north"


def test_a_kept_column_of_the_same_name():
    with pytest.raises(UsageError, match='the log\'s column "lat_deg" has the name of an output column'):
        geodesy.with_geodetic(trajectory([[0, 0, 0]], extra=pa.table({"lat_deg": [1.0]})), SITE)


def test_without_pymap3d(monkeypatch):
    monkeypatch.setitem(sys.modules, "pymap3d", None)
    with pytest.raises(UsageError, match=r'--site needs pymap3d, which is not installed: pip install "pymap3d>=3.0"'):
        geodesy.require_pymap3d()
