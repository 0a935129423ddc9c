"""Where a ballistic flight comes down after its last reading."""

from __future__ import annotations

import json
import math

import numpy as np
import pandas as pd
import pytest

from ftproc.core import impact
from ftproc.core.filtering.records import Model, Start
from ftproc.core.identification.motions.motion_models import MODELS
from ftproc.core.impact import heights
from ftproc.core.model.forces import GRAVITY
from ftproc.core.model.frames import from_cartesian
from ftproc.core.model.motion import EARTH_M
from ftproc.derived.extremes import extremes
from ftproc.derived.impact import figures
from ftproc.files.reading import trajectories
from tests.cli.conftest import run

__all__ = ["run"]

STILL = Model(np.full(3, 1e-6), np.full((1, 3), 1e-12), motion=MODELS["ballistic"])
FALL_M, SPEED_MPS = 1000.0, 100.0
SIGMA = np.array([2.0, 3.0, 4.0, 0.3, 0.2, 0.4, 1e-6, 1e-6, 1e-6])


def falling(height_m=FALL_M, vz_mps=0.0, az_mps2=-GRAVITY):
    return Start(7, np.array([500.0, 0.0, height_m, SPEED_MPS, 0.0, vz_mps, 0.0, 0.0, az_mps2]), np.diag(SIGMA**2))


def test_a_fall_without_air_ends_where_the_textbook_says():
    found = impact.predict(falling(), STILL, 0.0)
    after_s = math.sqrt(2 * FALL_M / GRAVITY)
    assert (found.kind, found.ground.what) == (impact.IMPACT, impact.STATION)
    assert found.after_s == pytest.approx(after_s, rel=2e-3)
    assert found.state[0] == pytest.approx(500.0 + SPEED_MPS * after_s, rel=2e-3)
    vertical = SIGMA[2] ** 2 + (after_s * SIGMA[5]) ** 2
    share = SPEED_MPS / (GRAVITY * after_s)
    assert found.covariance[0, 0] == pytest.approx(
        SIGMA[0] ** 2 + (after_s * SIGMA[3]) ** 2 + share**2 * vertical, rel=0.02
    )
    assert found.covariance[1, 1] == pytest.approx(SIGMA[1] ** 2 + (after_s * SIGMA[4]) ** 2, rel=0.02)
    assert found.covariance[2, 2] < 1e-3
    assert found.time_sigma_s == pytest.approx(math.sqrt(vertical) / (GRAVITY * after_s), rel=0.02)


def test_what_does_not_come_down_in_time_has_an_apogee():
    found = impact.predict(falling(vz_mps=400.0), STILL, 0.0)
    assert found.kind == impact.APOGEE
    assert found.after_s == pytest.approx(400.0 / GRAVITY, rel=0.01)
    said = figures(found, 10.0, {})
    assert said["time_s"] == pytest.approx(10.0 + found.after_s)
    assert said["sigma_height_m"] == pytest.approx(math.hypot(SIGMA[2], found.after_s * SIGMA[5]), rel=0.05)


@pytest.mark.parametrize("last", [falling(az_mps2=0.0), falling(height_m=5.0)])
def test_what_is_carried_or_not_above_the_ground_has_none(last):
    assert impact.predict(last, STILL, 0.0) is None


def test_a_flight_below_the_station_falls_to_its_lowest_height():
    found = impact.predict(falling(), STILL, -200.0)
    assert found.ground == impact.Ground(-200.0, impact.LOWEST)
    assert found.after_s == pytest.approx(math.sqrt(2 * (FALL_M + 200.0) / GRAVITY), rel=2e-3)


def test_the_ellipse_points_along_its_long_axis():
    found = impact.predict(falling(), STILL, 0.0)
    turn = np.array([[math.cos(0.5), -math.sin(0.5), 0.0], [math.sin(0.5), math.cos(0.5), 0.0], [0.0, 0.0, 1.0]])
    found = found._replace(covariance=turn @ np.diag([9.0, 1.0, 0.0]) @ turn.T)
    said = figures(found, 0.0, {})
    assert (said["sigma_major_m"], said["sigma_minor_m"]) == pytest.approx((3.0, 1.0))
    assert said["semi_major_m"] == pytest.approx(3.0 * 2.4477, rel=1e-4)
    assert said["major_axis_from_x_deg"] == pytest.approx(math.degrees(0.5))
    north = figures(found, 0.0, {"frame": "local", "settings": {"site": (48.0, 11.0, 0.0)}, "stations": True})
    assert north["major_axis_deg"] == pytest.approx(90 - math.degrees(0.5))
    assert north["lat_deg"] == pytest.approx(48.0, abs=1e-3)
    assert north["lon_deg"] == pytest.approx(11.0 + math.degrees(found.state[0] / EARTH_M / math.cos(0.838)), abs=1e-3)


def bomb(step_s=0.01):
    """Times and positions (n, 3) of a fall with drag, until the ground of a round earth."""
    p, v = np.array([2500.0, -900.0, 2200.0]), np.array([-60.0, 210.0, 0.0])
    found, centre = [p], np.array([0.0, 0.0, -EARTH_M])
    while heights(p[None])[0] > 0:
        a = GRAVITY * (centre - p) / EARTH_M - 6e-5 * math.exp(-p[2] / 9500.0) * math.sqrt(v @ v) * v
        p, v = p + step_s * v + step_s**2 / 2 * a, v + step_s * a
        found.append(p)
    return step_s * np.arange(len(found)), np.array(found)


def test_summary_score_and_report_name_the_impact_of_a_bomb(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    time_s, position = bomb()
    kept = np.arange(0, len(time_s) - 400, 5)
    noise = np.random.default_rng(3).normal(size=(len(kept), 3)) * [3.0, 2e-4, 2e-4]
    readings = from_cartesian(position[kept]) + noise
    names = ["range_m", "azimuth_rad", "elevation_rad"]
    pd.DataFrame({"time_s": time_s[kept], **dict(zip(names, readings.T, strict=True))}).to_csv("b.csv", index=False)
    truth = dict(zip(["x_m", "y_m", "z_m"], position.T, strict=True))
    pd.DataFrame({"time_s": time_s, **truth}).to_csv("truth.csv", index=False)
    result = run("filter", "b.csv", "--smooth", "--motion", "ballistic", "-o", "c.csv", "--report", "c.html")
    assert result.code == 0
    assert "impact     predicted at x " in result.out
    assert "at the height of the station" in result.out
    found = json.loads((tmp_path / "c.json").read_text())["summary"]["impact"]
    assert found["after_last_reading_s"] == pytest.approx(4.0, abs=0.1)
    score = json.loads(run("score", "c.csv", "--truth", "truth.csv", "--format", "json").out)["impact"]
    assert score["miss_m"] < 10
    assert score["miss_in_sigmas"] < 3
    assert "predicted" in run("score", "c.csv", "--truth", "truth.csv").out
    assert extremes(trajectories.read("c.csv"))[-1].what.startswith("predicted impact, distance over ground")
    assert "predicted impact" in (tmp_path / "c.html").read_text()
