"""`ftproc filter --fuse` on a short simulated flight: its outputs, their honesty, the case of one station."""

from __future__ import annotations

import json
import re

import numpy as np
import pandas as pd
import pytest

from ftproc.files.writing import ranges
from ftproc.simulation import simulate_range


def test_the_outputs_are_those_of_the_contract(run, folder, simulated):
    result = run(
        "filter", "--fuse", "range.toml", "--smooth", "-o", "best.parquet", "--write-calibration", "next",
        "--report", "best.html", "--summary", "json",
    )  # fmt: skip
    assert (result.code, result.err) == (0, "")
    best = pd.read_parquet("best.parquet")
    assert (np.diff(best.time_s) > 0).all()
    assert {"x_m", "vx_mps", "ax_mps2", "sigma_x_m", "sigma_az_mps2", "nis", "stations", "lat_deg"} <= set(best)
    assert not {"range_m", "azimuth_rad", "sigma_range_m", "outlier_range", "row"} & set(best)
    assert best.stations.between(0, 3).all()
    truth = simulated.truth
    inside = best[best.time_s.between(truth.time_s[0], truth.time_s[-1])]
    at = np.stack([np.interp(inside.time_s, truth.time_s, truth.position_m[:, k]) for k in range(3)], 1)
    off = np.abs(inside[["x_m", "y_m", "z_m"]].to_numpy() - at)
    sigma = inside[["sigma_x_m", "sigma_y_m", "sigma_z_m"]].to_numpy()
    assert (off < 4 * sigma + 0.05).mean() > 0.97
    biases = pd.read_csv("best.biases.csv")
    assert list(biases) == ["station", "parameter", "estimate", "sigma", "prior_sigma", "observable"]
    assert (biases.sigma <= 1.0001 * biases.prior_sigma).all()
    for station in simulated.stations:
        edited = pd.read_parquet(f"best.edited/{station.name}.parquet")
        assert len(edited) == len(station.log)
        assert edited.time_s.to_numpy() == pytest.approx(station.log.time_s)
        assert (folder / "next" / f"{station.name}.toml").exists()
    assert (folder / "best.html").read_text().startswith("<!DOCTYPE html>")
    assert json.loads(result.out)["trust"]["verdict"] in ("consistent", "suspect")
    assert run("score", "best.parquet", "--truth", "truth.parquet").code == 0


def test_a_single_station_is_the_case_of_one(run, folder):
    text = (folder / "range.toml").read_text()
    _, radar = text.split("\n[station.")[:2]
    place = "".join(f"{line}\n" for line in radar.splitlines() if re.match("lat_deg|lon_deg|height_m", line))
    north = 'azimuth_from = "north"' in radar
    (folder / "one.toml").write_text(f"[origin]\n{place}\n[station.{radar}")
    assert run("filter", "--fuse", "one.toml", "--smooth", "-o", "one.parquet").code == 0
    own = ["--azimuth-from", "north"] if north else []
    assert run("filter", "radar.csv", "--smooth", "-o", "own.parquet", *own).code == 0
    one, alone = pd.read_parquet("one.parquet"), pd.read_parquet("own.parquet")
    alone = alone.drop_duplicates("time_s", keep="last")
    for east, name in zip("yx" if north else "xy", "xy", strict=True):
        assert one[f"{name}_m"].to_numpy() == pytest.approx(alone[f"{east}_m"].to_numpy(), rel=1e-9)
    assert one.z_m.to_numpy() == pytest.approx(alone.z_m.to_numpy(), rel=1e-9)
    for name in ("sigma_z_m", "vz_mps", "sigma_vz_mps", "nis"):
        assert one[name].to_numpy() == pytest.approx(alone[name].to_numpy(), rel=1e-9, nan_ok=True)


def test_a_range_file_is_printed_for_logs(run, folder):
    result = run("filter", "--fuse", "--write-config", "radar.csv", "theodolite2.csv")
    assert result.code == 0
    (folder / "made.toml").write_text(result.out)
    assert "[station.radar]" in result.out
    assert "[station.theodolite2]" in result.out


LOST_BY_BOTH = ("range-radars", 103, None, None)  # for 7 s both radars follow other targets, and not the same


@pytest.mark.parametrize(
    ("scenario", "seed", "duration_s", "until_s"),
    [
        ("range-radar", 5, 40.0, None),  # the first decisions must find jerk and outliers, not one after the other
        # the radar, which has most components, follows another target for 17 s
        pytest.param("range-dme", 101, None, None, marks=pytest.mark.slow),
        # the last two seconds of one azimuth are wrong
        pytest.param("range-theodolites", 102, None, None, marks=pytest.mark.slow),
        LOST_BY_BOTH,
        ("range-dme", 102, None, 60.0),  # at first only the DME sees it, then a line of sight meets its sphere twice
    ],
)
def test_hard_flights_stay_within_their_sigmas(run, tmp_path, monkeypatch, scenario, seed, duration_s, until_s):
    """One of which no reading is left for a while is not called consistent either."""
    monkeypatch.chdir(tmp_path)
    simulated = simulate_range(scenario, seed, duration_s)
    ranges.write(simulated, ".", None)
    for station in simulated.stations if until_s else ():
        log = pd.read_csv(f"{station.name}.csv")
        log[log.time_s < until_s].to_csv(f"{station.name}.csv", index=False)
    result = run("filter", "--fuse", "range.toml", "--smooth", "-o", "best.parquet", "--summary", "json")
    assert result.code == 0
    if (scenario, seed, duration_s, until_s) == LOST_BY_BOTH:
        assert json.loads(result.out)["trust"]["verdict"] != "consistent"
    best, truth = pd.read_parquet("best.parquet"), simulated.truth
    best = best[best.time_s.between(truth.time_s[0], truth.time_s[-1])]
    at = np.stack([np.interp(best.time_s, truth.time_s, truth.position_m[:, k]) for k in range(3)], 1)
    off = np.abs(best[["x_m", "y_m", "z_m"]].to_numpy() - at)
    sigma = best[["sigma_x_m", "sigma_y_m", "sigma_z_m"]].to_numpy()
    assert (off < 5 * sigma + 0.05).mean() > 0.999
