"""`ftproc filter`: what it does with one log and with several."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from ftproc.core.live.recursive import PATCH_S, PATCH_SAMPLES
from ftproc.files.reading import trajectories
from ftproc.methods import registry
from tests.cli.conftest import Result


def untimed(text):
    return re.sub(r"(?m)^  time .*$", "", text)


def read(name):
    return trajectories.read(str(name))


def test_just_works(run, flight):
    result = run("filter", flight)
    assert (result.code, result.err) == (0, "")
    assert result.out.startswith(f"{flight}: 61 rows")
    assert re.search(r"\n  time +\d+\.\d\d s\n  -> flight\.trajectory\.csv\n$", result.out)
    assert len(read("flight.trajectory.csv")) == 61


def test_summary_goes_where_the_trajectory_does_not(run, flight):
    text = flight.read_text()
    to_file = run("filter", "-", "-o", "a.csv", stdin=text)
    assert to_file.out.startswith("<stdin>: 61 rows")
    to_stdout = run("filter", "-", "-o", "-", stdin=text)
    assert to_stdout.out == (flight.parent / "a.csv").read_text()
    assert to_stdout.err.startswith("<stdin>: 61 rows")
    again = run("filter", "-", stdin=text)  # in a pipe, out of a pipe
    assert again.out == to_stdout.out
    assert untimed(again.err) == untimed(to_stdout.err)
    assert run("filter", "-", "--summary", "none", stdin=text) == Result(0, to_stdout.out, "")


def test_json_summary(run, flight):
    one = json.loads(run("filter", flight, "-o", "a.parquet", "--summary", "json").out)
    assert (one["log"], one["output"], one["rows"]) == (str(flight), "a.parquet", 61)
    shutil.copy(flight, "second.csv")
    result = run("filter", flight, "none.csv", "second.csv", "-o", "d", "--summary", "json")
    assert result.code == 1
    several = json.loads(result.out)
    assert [each["log"] for each in several] == [str(flight), "none.csv", "second.csv"]
    assert several[1] == {"log": "none.csv", "error": "none.csv: there is no such file."}


def test_every_option_reaches_the_filter(run, flight):
    options = {
        "--method": "ga-bpnn-ukf", "--model": "none", "--editing": "forward", "--noise": "3,0.0002,0.0003",
        "--jerk": "2.5", "--gate": "5", "--max-patch": "7", "--weight-form": "gain", "--site": "48,11,600",
    }  # fmt: skip
    flat = [part for pair in options.items() for part in pair]
    result = run("filter", flight, "--smooth", *flat, "-o", "a.parquet")
    assert result.code == 0, result.err
    metadata = json.loads(pq.read_schema("a.parquet").metadata[b"ftproc"])
    settings = metadata["settings"]
    assert metadata["method"] == "ga-bpnn-ukf"
    assert metadata["model_sha256"] is None
    assert settings["editing"] == "forward"
    assert settings["smooth"] is True
    assert settings["noise_range_m"] == pytest.approx(3.0)
    assert settings["noise_azimuth_rad"] == pytest.approx(0.0002)
    assert settings["noise_elevation_rad"] == pytest.approx(0.0003)
    assert settings["jerk_psd_m2ps5"] == pytest.approx(2.5)
    assert (settings["gate"], settings["max_patch_s"], settings["gain_form"]) == (5.0, 7.0, True)
    assert settings["site"] == [48.0, 11.0, 600.0]


@pytest.mark.parametrize("jobs", [1, 2])
def test_random_methods_take_particles_and_a_seed(run, shell, flight, jobs):
    """Their warnings are on stderr, log by log, from workers too."""
    shutil.copy(flight, "second.csv")
    options = "--method renpf --particles 40 --seed 3 --summary none"
    result = shell(f"ftproc filter flight.csv second.csv {options} --jobs {jobs} -o d")
    warned = "renpf: 40 particles are few for 9 states; 90 or more are trustworthy"
    expected = {f"ftproc: {name}: {warned}" for name in ("flight.csv", "second.csv")}
    assert (result.code, result.out, set(result.err.splitlines())) == (0, "", expected)
    settings = read("d/flight.trajectory.csv").metadata["settings"]
    assert (settings["particles"], settings["seed"]) == (40, 3)
    run("filter", flight, "-o", "plain.csv")
    assert "particles" not in read("plain.csv").metadata["settings"]


def test_auto_is_the_default(run, flight):
    assert run("filter", flight, "-o", "a.csv").code == 0
    assert run("filter", flight, "-o", "b.csv", "--noise", "auto", "--jerk", "AUTO").code == 0
    assert (flight.parent / "a.csv").read_bytes() == (flight.parent / "b.csv").read_bytes()


def test_reading_options(run, flight):
    table = pd.read_csv(flight)
    table["note"] = "x"
    table["RNG"] = table.pop("range_m") / 1000
    table.to_csv("odd.csv", index=False)
    tuned = ("--noise", "3,0.0002,0.0002", "--jerk", "1")  # their estimation magnifies the rounding of kilometres
    assert run("filter", flight, *tuned, "-o", "a.csv").code == 0
    args = ("--columns", "range=RNG", "--units", "range=km", "--azimuth-from", "north", "--keep-columns")
    assert run("filter", "odd.csv", *tuned, *args, "-o", "b.csv").code == 0
    plain, odd = read("a.csv"), read("b.csv")
    np.testing.assert_allclose(odd.state, plain.state, rtol=1e-6, atol=1e-6)
    assert odd.metadata["frame"] == "north-east-up"
    assert odd.extra is not None
    assert odd.extra.column_names == ["note"]


@pytest.mark.parametrize(
    ("args", "text", "axes"),
    [
        ([], "x is taken as east, y as north (unless the azimuth's name says north)", (0, 1)),
        (["--azimuth-from", "north"], "x is north, y is east", (1, 0)),
    ],
)
def test_site(run, flight, args, text, axes):
    result = run("filter", flight, "--site", "-33.9,18.4,100", *args, "-o", "a.parquet", "--summary", "none")
    assert result == Result(0, "", f"ftproc: positions on the earth: {text}, z is up\n")
    table = pq.read_table("a.parquet").to_pandas()
    assert list(table.columns[-3:]) == ["lat_deg", "lon_deg", "height_m"]
    east, north = (table[["x_m", "y_m"]].to_numpy()[:, axis] for axis in axes)
    np.testing.assert_allclose(table["lat_deg"] + 33.9, north / 110_900, rtol=0.02)
    np.testing.assert_allclose(table["lon_deg"] - 18.4, east / (111_320 * np.cos(np.deg2rad(33.9))), rtol=0.02)


def test_list_methods(run):
    result = run("filter", "--list-methods")
    assert (result.code, result.err) == (0, "")
    assert all(name in result.out for name in registry.METHODS)


def test_all_methods(run, flight):
    """What is left out is said once in each run, also in a process that has said so before."""
    for directory in ("before", "d"):
        result = run("filter", flight, "--method", "all", "-o", directory)
        assert result.code == 0
        (left_out,) = result.err.splitlines()
        assert left_out.startswith(
            "ftproc: left out: bpnn-ekf needs a model trained for it: ftproc train --method bpnn-ekf "
        )
    found = {read(path).metadata["method"] for path in (flight.parent / "d").glob("*.csv")}
    assert found == set(registry.METHODS) - {"bpnn-ekf"}
    assert (flight.parent / "d" / "flight.ekf.trajectory.csv").exists()


def test_all_methods_that_apply(run, flight, monkeypatch):
    """Without PyWavelets, with the smoother, and with a model for one of them: each gets what suits it."""
    monkeypatch.setattr(registry, "find_spec", lambda name: None)
    train = ("--epochs", "3", "--flights", "3")
    assert run("train", "--method", "bpnn-ekf", "--scenario", "radar", *train, "-o", "m.safetensors").code == 0
    result = run("filter", flight, "--method", "all", "--smooth", "--model", "m.safetensors", "-o", "d")
    assert result.code == 0
    smoothers = {m.name for m in registry.METHODS.values() if m.smooths}
    assert {read(path).metadata["method"] for path in (flight.parent / "d").glob("*.csv")} == smoothers
    assert 'ftproc: left out: wavelet-akf needs PyWavelets, which is not installed: pip install "PyWa' in result.err
    assert "ftproc: left out: gate has no smoother; leave --smooth out." in result.err
    assert len(result.err.splitlines()) == len(registry.METHODS) - len(smoothers)
    used = {read(path).metadata["model_sha256"] for path in (flight.parent / "d").glob("*bpnn*.csv")}
    assert len(used) == 2


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["--method", "gate", "--smooth"], "gate has no smoother; leave --smooth out."),
        (["--method", "bpnn-ekf"], "bpnn-ekf needs a model trained for it: ftproc train --method bpnn-ekf --scenario"),
    ],
)
def test_a_method_that_cannot_be_run_so(run, flight, args, message):
    result = run("filter", flight, *args, "-o", "a.csv")
    assert (result.code, result.out) == (2, "")
    assert result.err.startswith(f"ftproc: {message}")
    assert not flight.with_name("a.csv").exists()


def test_a_bad_log_does_not_stop_the_others(run, flight):
    (flight.parent / "bad.csv").write_text("time_s,range_m,azimuth_rad,elevation_rad\n0,1,wrong,0\n")
    result = run("filter", "none.csv", "bad.csv", flight, "-o", "d")
    assert result.code == 1
    assert [path.name for path in sorted((flight.parent / "d").iterdir())] == [
        "flight.trajectory.csv",
        "flight.trajectory.json",
    ]
    first, second = result.err.splitlines()
    assert first == "ftproc: none.csv: there is no such file."
    assert second.startswith('ftproc: bad.csv: row 0 (the first data row is 0), column "azimuth_rad"')


def test_debug_shows_where_a_log_failed(run, here):
    assert "Traceback" not in run("filter", "none.csv").err
    result = run("filter", "none.csv", "--debug")
    assert result.code == 1
    assert "Traceback" in result.err
    assert result.err.splitlines()[-1] == "ftproc: none.csv: there is no such file."


@pytest.mark.parametrize(
    ("args", "sentence"),
    [
        (["flight.csv", "--method", "ekff"], "there is no method 'ekff'; did you mean 'ekf'?"),
        (["flight.csv", "--noise", "1,2"], '"1,2" is not three numbers, R,A,E in m, rad, rad'),
        (["flight.csv", "--noise", "0,1,1"], "a sigma of zero means readings without error"),
        (["flight.csv", "--jerk", "-1"], '"-1" is not a number above zero.'),
        (["flight.csv", "--gate", "inf"], '"inf" is not a number above zero.'),
        (["flight.csv", "--max-patch", "long"], '"long" is not a number above zero.'),
        (["flight.csv", "--site", "48,11"], '"48,11" is not three numbers, LAT,LON,HEIGHT'),
        (["flight.csv", "--site", "98,11,0"], "a latitude lies in -90..90"),
        (["flight.csv", "--units", "range=ly"], '--units: "ly" is not a unit of range'),
        (["flight.csv", "--columns", "range"], '--columns: "range" is not QUANTITY=NAME'),
        (["flight.csv", "--editing", "backward"], "Invalid value for '--editing'"),
    ],
)
def test_wrong_usage(run, flight, args, sentence):
    result = run("filter", *args)
    assert (result.code, result.out) == (2, "")
    assert sentence in result.err
    assert len(result.err.splitlines()) == 1
    assert len(list(flight.parent.iterdir())) == 2


def test_a_model_that_is_none(run, flight):
    result = run("filter", flight, "--model", "flight.csv")
    assert (result.code, result.out) == (1, "")
    assert result.err == "ftproc: flight.csv: not a correction model; `ftproc train` writes one\n"
    assert run("filter", flight, "--model", "there").err.startswith("ftproc: there: there is no such file")


def test_wrong_usage_that_only_the_log_shows(run, flight):
    table = pd.read_csv(flight)
    table["x_m"] = 0.0
    table.to_csv("kept.csv", index=False)
    result = run("filter", "kept.csv", "--keep-columns")
    assert result.code == 2
    assert 'the log\'s column "x_m" has the name of an output column' in result.err


def test_jobs_and_scheduler_exclude_each_other(run):
    result = run("filter", "a.csv", "b.csv", "--jobs", 2, "--scheduler", "tcp://127.0.0.1:1")
    assert (result.code, result.out) == (2, "")
    assert result.err == (
        "ftproc: --jobs is for processes on this machine, --scheduler for a cluster; give one of the two.\n"
    )


@pytest.mark.parametrize(
    ("args", "sentence"),
    [
        (["--weight-form", "gain"], "--weight-form does nothing with ga-bpnn-ukf here: it is for ga-bpnn-ukf with"),
        (["--max-patch", "3"], "--max-patch does nothing with ga-bpnn-ukf here: it is for ga-bpnn-ukf with --editing"),
        (["--max-patch", "3", "--method", "enkf"], "--max-patch does nothing with enkf here"),
        (["--particles", "50"], "--particles does nothing with ga-bpnn-ukf here: it is for the methods enkf, enpf"),
        (["--seed", "1", "--method", "ukf"], "--seed does nothing with ukf here"),
        (["--editing", "forward", "--method", "huber-ukf"], "--editing does nothing with huber-ukf here"),
        (["--model", "m.safetensors", "--method", "ukf"], "--model does nothing with ukf here: a network corrects"),
        (["--method", "all", "--weight-form", "gain", "-o", "out/"], "--weight-form does nothing with these methods"),
    ],
)  # fmt: skip
def test_options_that_do_nothing_are_refused(run, args, sentence):
    done = run("filter", "flight.csv", *args)
    assert done.code == 2
    assert sentence in done.err
    assert done.err.rstrip().endswith("Leave it out.")
    assert len(done.err.splitlines()) == 1


@pytest.mark.parametrize(
    "args",
    [
        ["--model", "none", "--method", "ukf"],
        ["--editing", "forward", "--max-patch", "3", "--weight-form", "gain"],
        ["--config", "s.toml"],
    ],
)
def test_options_that_ask_for_nothing_and_those_of_a_station_file_are_not(run, flight, args):
    Path("s.toml").write_text("[filter]\nmax_patch_s = 3\nparticles = 50\n")
    assert run("filter", flight, *args, "-o", "x.csv").code == 0


def test_parameters_of_a_method(run, here):
    """Set on the command line and in a station file, of which the former wins; explained by --list-methods NAME."""
    assert run("simulate", "--scenario", "zuo2021-outliers", "-o", "a.csv").code == 0
    shown = run("filter", "--list-methods", "ls-window-kf")
    assert (shown.code, shown.err) == (0, "")
    assert shown.out.startswith("ls-window-kf: outliers repaired by a line, Kalman filter (Zhang and Zhang")
    assert "  F_range_m " in shown.out
    (here / "s.toml").write_text('[filter]\nmethod = "ls-window-kf"\nset = "window=8,longest=9"\n')
    used = run(
        "filter",
        "a.csv",
        "--config",
        "s.toml",
        "--set",
        "window=6",
        "--set",
        "F_range_m=30,Q_range_m2=9",
        "-o",
        "t.csv",
    )
    assert used.code == 0, used.err
    kept = json.loads((here / "t.json").read_text())["settings"]["parameters"]
    assert kept == {"window": 6.0, "longest": 9.0, "F_range_m": 30.0, "Q_range_m2": 9.0}
    for wrong, sentence in (
        ("windw=3", 'did you mean "window"?'),
        ("window", "expected NAME=VALUE"),
        ("window=0", "a whole"),
    ):
        refused = run("filter", "a.csv", "--method", "gate", "--set", wrong, "-o", "u.csv")
        assert (refused.code, refused.out) == (2, "")
        assert sentence in refused.err
    assert not (here / "u.csv").exists()


def test_the_help_tells_the_longest_patch_that_the_gate_expects(run):
    shown = " ".join(run("filter", "-h").out.split())
    assert f"[default: {PATCH_S:g} s or {PATCH_SAMPLES} samples, the longer of the two]" in shown
