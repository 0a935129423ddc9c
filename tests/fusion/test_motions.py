"""The motion that the readings of all stations choose."""

from __future__ import annotations

import json
import math
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from ftproc.core import odds
from ftproc.core.identification.motions import motion_models
from ftproc.core.identification.motions.motion_models import MODELS, WHITE, Candidates
from ftproc.core.model.frames import from_cartesian
from ftproc.files.writing import ranges
from ftproc.fusion import logs, range_file
from ftproc.fusion.estimation import motions, whole
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate_range
from tests.derived.test_impact import bomb

SEED, DURATION_S = 1, 60.0
GAP_S = 20.0, 28.0


@pytest.fixture(scope="module")
def flight():
    return simulate_range("range-theodolites", SEED, DURATION_S)


@pytest.fixture(scope="module")
def stations(flight, tmp_path_factory):
    folder = tmp_path_factory.mktemp("three")
    ranges.write(flight, str(folder), None)
    range_ = range_file.load(str(folder / "range.toml"))
    return logs.as_seen(range_.instruments, logs.read(range_)[1])


def fused(stations, *names, smooth=True):
    return whole.fuse(stations, FilterSettings().gate, None, smooth, lambda done, most: None, Candidates(names))


def velocity_error(found, flight, zero_s):
    truth = flight.truth
    at = np.stack([np.interp(found.track.time_s + zero_s, truth.time_s, v) for v in truth.velocity_mps.T], 1)
    return float(np.sqrt(((found.track.state[:, 3:6] - at) ** 2).sum(1).mean()))


def test_the_readings_choose_how_an_aircraft_moves(stations, flight):
    seen, zero_s = stations
    plain, found = fused(seen, WHITE), fused(seen, *MODELS)
    ((motion, rows),) = found.motions
    assert motion.name == "turning-force"
    assert motion.gain > odds.SURE
    assert rows == sum(len(station.time_s) for station in seen)
    assert plain.motions[0][0] == motions.Motive(WHITE, 0.0)
    assert velocity_error(found, flight, zero_s) < 1.02 * velocity_error(plain, flight, zero_s)


@pytest.mark.parametrize("smooth", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_a_gap_of_all_stations_is_crossed_in_steps(stations, flight, smooth):
    seen, zero_s = stations
    cut = []
    for station in seen:
        kept = (station.time_s + zero_s < GAP_S[0]) | (station.time_s + zero_s > GAP_S[1])
        arrays = {name: getattr(station, name)[kept] for name in ("time_s", "measurement", "accepted")}
        cut.append(station._replace(**arrays))
    found = fused(cut, "turning-force", smooth=smooth)
    assert [len(w) for w in found.weight] == [len(station.time_s) for station in cut]
    assert np.isfinite(found.track.state).all()
    gap = np.diff(found.track.time_s).max()
    assert GAP_S[1] - GAP_S[0] - 1 < gap < GAP_S[1] - GAP_S[0] + 1


@pytest.mark.parametrize("better", [pytest.param(True, marks=pytest.mark.slow), False])
def test_a_motion_that_the_filter_does_not_follow_gives_way_to_white_jerk(stations, monkeypatch, better):
    """The smoother keeps its own."""
    real = motions.filtered

    def rated(log, model, *there):
        run = real(log, model, *there)
        return run._replace(log_likelihood=run.log_likelihood + (1e4 if model.motion.acts == better else 0.0))

    monkeypatch.setattr(motions, "filtered", rated)
    monkeypatch.setattr(motion_models, "odds", SimpleNamespace(SURE=-math.inf))
    smoothed, filtered = (fused(stations[0], WHITE, "turning-force", smooth=smooth) for smooth in (True, False))
    assert [name for (name, _, _), _ in smoothed.motions] == ["turning-force"]
    assert [name for (name, _, _), _ in filtered.motions] == ["turning-force" if better else WHITE]
    assert np.isfinite(filtered.track.state).all()


def test_states_between_are_those_of_a_constant_acceleration():
    time_s, wanted = np.array([0.0, 1.0, 4.0, 4.0, 9.0]), np.array([0.0, 0.4, 1.0, 2.0, 3.9, 4.0, 8.0, 9.0])

    def track(t):
        t, p, v, a = t[:, None], np.array([1.0, 2.0, 3.0]), np.array([30.0, -4.0, 5.0]), np.array([0.3, 0.2, -9.8])
        return np.hstack([p + t * v + t**2 / 2 * a, v + t * a, np.broadcast_to(a, (len(t), 3))])

    assert motions.between(time_s, track(time_s), wanted) == pytest.approx(track(wanted))


def test_the_motion_that_the_user_names_is_taken_and_stated(run, folder):
    result = run(
        "filter", "--fuse", "range.toml", "--motion", "ballistic", "-o", "b.csv", "--summary", "json",
        "--report", "b.html",
    )  # fmt: skip
    assert (result.code, result.err) == (0, "")
    summary, metadata = json.loads(result.out), json.loads((folder / "b.json").read_text())
    assert (summary["motion"], summary["motion_share"]) == ("ballistic", 1.0)
    assert metadata["settings"]["motion"] == "ballistic"
    assert "along_ratio" in metadata["jerk_profile"]
    assert "ballistic" in (folder / "b.html").read_text()
    again = run("filter", "--again", "b.csv", "-o", "again.csv", "--summary", "json")
    assert json.loads(again.out)["motion"] == "ballistic"


def test_two_radars_predict_where_a_bomb_comes_down(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    time_s, position = bomb()
    kept, rng, text = np.arange(0, len(time_s) - 400, 5), np.random.default_rng(1), ""
    for name, east_m in (("near", 0.0), ("far", 4000.0)):
        noise = rng.normal(size=(len(kept), 3)) * [3.0, 2e-4, 2e-4]
        readings = from_cartesian(position[kept] - [east_m, 0.0, 0.0]) + noise
        columns = dict(zip(["range_m", "azimuth_rad", "elevation_rad"], readings.T, strict=True))
        pd.DataFrame({"time_s": time_s[kept], **columns}).to_csv(f"{name}.csv", index=False)
        text += f'[station.{name}]\nlog = "{name}.csv"\neast_m = {east_m}\nnorth_m = 0.0\nup_m = 0.0\n'
    (tmp_path / "two.toml").write_text(text)
    result = run("filter", "--fuse", "two.toml", "--motion", "ballistic", "--smooth", "-o", "two.csv")
    assert (result.code, result.err) == (0, "")
    assert "impact     predicted at x " in result.out
    track, velocity = pd.read_csv("two.csv"), np.gradient(position, time_s, axis=0)[kept]
    wrong, sigma = track.filter(regex="^v[xyz]_") - velocity, track.filter(regex="^sigma_v[xyz]_")
    assert (np.abs(wrong.to_numpy()) < 3 * sigma.to_numpy()).mean() > 0.95
    assert sigma.median().max() < 0.06  # .14 with gusts as on wings
    found = json.loads((tmp_path / "two.json").read_text())["summary"]["impact"]
    assert found["ground"] == "the height of the origin"
    assert found["after_last_reading_s"] == pytest.approx(4.0, abs=0.1)
    miss = position[-1, :2] - [found["x_m"], found["y_m"]]
    assert np.sqrt(miss @ np.linalg.solve(np.array(found["covariance_xy_m2"]), miss)) < 3
