"""`--config` and `--write-config`: the station file and the command line together."""

from __future__ import annotations

import json
from pathlib import Path

import click
import numpy as np
import pandas as pd
import pytest

import ftproc
from ftproc.cli.filter import command
from ftproc.cli.filtering import recipes
from ftproc.config import reading
from ftproc.config.keys import every
from ftproc.config.recipe import Recipe
from ftproc.files.reading import logs, trajectories
from ftproc.settings import FilterSettings

TUNED = ("--noise", "3,0.0002,0.0002", "--jerk", "1")  # their estimation magnifies rounding

TOTAL_STATION = """
[site]
lat_deg = 48.0812
lon_deg = 11.2803
height_m = 612.0
[time]
column = "clock"
unit = "ms"
offset_s = -1000
[range]
column = "Dist"
unit = "km"
bias_m = 7.5
[azimuth]
column = "Hz"
unit = "gon"
from = "north"
sense = "anticlockwise"
zero_deg = 30
bias_mgon = 50
[elevation]
column = "V"
unit = "gon"
from = "zenith"
"""


@pytest.fixture
def other_conventions(flight):
    """The same flight in the conventions of another instrument, and its station file."""
    log = logs.read(flight)
    distance, azimuth, elevation = log.measurement.T
    gon = 200 / np.pi
    pd.DataFrame(
        {
            "clock": (log.time_s + 1000) * 1000,
            "Dist": (distance + 7.5) / 1000,
            "Hz": np.mod(-(azimuth - np.deg2rad(30)) * gon, 400) + 0.050,
            "V": 100 - elevation * gon,
        }
    ).to_csv("odd.csv", index=False)
    (flight.parent / "s.toml").write_text(TOTAL_STATION)
    return flight


def test_a_station_file_undoes_the_conventions_of_its_instrument(run, other_conventions):
    assert run("filter", other_conventions, *TUNED, "-o", "a.csv").code == 0
    result = run("filter", "odd.csv", "--config", "s.toml", *TUNED, "-o", "b.csv", "--summary", "none")
    assert (result.code, result.out) == (0, "")
    assert result.err.splitlines() == [
        "ftproc: readings: range bias of 7.5 m subtracted, azimuth bias of 0.785398 mrad subtracted, -1000 s added to "
        "the time, azimuth counted anticlockwise from north, reversed, azimuth zero at 30 deg from north, "
        "elevation from zenith angles",
        "ftproc: positions on the earth: x is north, y is east, z is up",
    ]
    plain, odd = trajectories.read("a.csv"), trajectories.read("b.csv")
    np.testing.assert_allclose(odd.state, plain.state, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(odd.measurement, plain.measurement, rtol=1e-8)  # canonical, not the instrument's
    np.testing.assert_allclose(odd.time_s, plain.time_s, atol=1e-9)
    assert odd.extra is not None
    assert odd.metadata["convention"].startswith("azimuth_rad clockwise from north = atan2(y, x), elevation_rad above")
    assert odd.metadata["station"]["azimuth_sense"] == "anticlockwise"
    assert odd.metadata["station"]["bias"] == pytest.approx([7.5, 0.05 * np.pi / 200, 0])
    assert "elevation from zenith angles" in odd.metadata["station"]["in_words"]


def test_in_python_too(run, other_conventions):
    assert run("filter", "odd.csv", "--config", "s.toml", "-o", "b.csv").code == 0
    found = ftproc.filter_log("odd.csv", config="s.toml")
    np.testing.assert_array_equal(found.state, trajectories.read("b.csv").state)
    assert ftproc.to_table(found).column_names[-3:] == ["lat_deg", "lon_deg", "height_m"]
    fixed = ftproc.filter_log("odd.csv", FilterSettings(method="ukf"), model="none", config="s.toml")
    assert (fixed.metadata["method"], fixed.extra) == ("ukf", None)
    read = ftproc.read_log("odd.csv", config="s.toml")
    assert read.frame == "north-east-up"
    assert ftproc.read_log("odd.csv", config="s.toml", columns={"time": "clock", "range": "Dist"}).frame == read.frame


def test_the_command_line_wins(run, other_conventions):
    (other_conventions.parent / "f.toml").write_text(
        '[filter]\nsmooth = true\ngate = 3\nediting = "forward"\nmodel = "none"\n[range]\nsigma_m = 9\nunit = "km"\n'
        '[azimuth]\ncolumn = "Hz"\nunit = "deg"\n'
    )
    args = ("odd.csv", "--config", "f.toml", "--write-config")
    assert reading.parse(run("filter", *args).out, "-")["gate"] == 3.0
    found = reading.parse(
        run("filter", *args, "--no-smooth", "--gate", "5", "--noise", "auto", "--model", "packaged",
            "--columns", "time=clock", "--units", "az=gon").out, "-")  # fmt: skip
    assert found == {
        "editing": "forward", "gate": 5.0, "columns": {"azimuth": "Hz", "time": "clock"},
        "units": {"range": "km", "azimuth": "gon"},
    }  # fmt: skip


def test_a_default_that_is_asked_for_wins_too(run, here):
    (here / "f.toml").write_text("[filter]\ngate = 3\n")
    assert "gate" not in reading.parse(run("filter", "--config", "f.toml", "--gate", "4", "--write-config").out, "-")


def test_write_config_makes_what_config_reads(run, flight):
    args = ("--site", "48,11,600", "--noise", "3,auto,0.0002", "--editing", "none", "--smooth",
            "--azimuth-from", "north", "--jerk", "2", "--units", "az=rad", "--keep-columns", "--ecef")  # fmt: skip
    text = run("filter", *args, "--write-config").out
    (flight.parent / "s.toml").write_text(text)
    assert run("filter", "--config", "s.toml", "--write-config").out == text
    assert run("filter", flight, *args, "-o", "a.csv").code == 0
    assert run("filter", flight, "--config", "s.toml", "-o", "b.csv").code == 0
    assert (flight.parent / "a.csv").read_bytes() == (flight.parent / "b.csv").read_bytes()
    settings = json.loads((flight.parent / "b.json").read_text())["settings"]
    assert settings["noise_range_m"] == pytest.approx(3.0)
    assert settings["noise_elevation_rad"] == pytest.approx(0.0002)
    assert settings["noise_azimuth_rad"] != pytest.approx(0.0002, rel=1e-3)
    assert settings["noise_specified"] is False


def test_the_command_s_defaults_are_those_of_the_settings():
    """Otherwise an empty file would differ from no file."""
    ctx = command.make_context("filter", ["x.csv"])
    keys = {key.option for _, _, key in every()}
    given = {name: value for name, value in ctx.params.items() if name in keys}
    assert Recipe.of(given) == Recipe() == recipes.recipe(ctx)


def test_every_filter_option_can_be_kept_in_a_file():
    about_the_run = {
        "output",
        "jobs",
        "scheduler",
        "summary",
        "list_methods",
        "config",
        "write_config",
        "debug",
        "report",
        "explain",
        "where",
        "target",
        "fuse",
        "write_calibration",
        "follow",
        "state",
        "coast",
        "heartbeat",
        "decisions",
        "write_decisions",
        "again",
        "redo",
        "table",
    }
    options = {p.name for p in command.params if isinstance(p, click.Option)} - about_the_run
    assert options <= {key.option for _, _, key in every()}


@pytest.mark.parametrize(
    ("args", "sentence"),
    [
        (["--config", "none.toml"], "none.toml: there is no such file. ftproc filter --write-config > none.toml makes"),
        (["--config", "bad.toml"], 'bad.toml: [filter] has no key "gaet"; did you mean "gate"? Its keys are: method, '),
        (["--method", "all", "--write-config"], "--method all cannot be kept in a station file; name one method."),
        (["--method", "ukff", "--write-config"], "there is no method 'ukff'; did you mean"),
        (["--ecef"], "--ecef needs the station: give --site LAT,LON,HEIGHT, or [site] in the --config file."),
        (["--noise", "auto,1"], '"auto,1" is not three numbers, R,A,E in m, rad, rad'),
        (["--noise", "auto,auto,0"], '"auto,auto,0": a sigma of zero means readings without error'),
    ],
)
def test_wrong_usage(run, here, args, sentence):
    (here / "bad.toml").write_text("[filter]\ngaet = 3\n")
    result = run("filter", "x.csv", *args)
    assert (result.code, result.out) == (2, "")
    assert sentence in result.err
    assert len(result.err.splitlines()) == 1
    assert [path.name for path in here.iterdir()] == ["bad.toml"]


SAMPLES = Path(__file__).parents[2] / "sample_data"


@pytest.mark.parametrize(
    ("log", "bound_m"), [("radar.csv", 60.0), ("theodolite.parquet", 1.5), ("total_station.csv", 0.15)]
)
def test_the_samples_station_files_make_their_logs_agree_with_the_truth(run, here, log, bound_m):
    stem = log.split(".")[0]
    result = run("filter", SAMPLES / log, "--config", SAMPLES / f"{stem}.toml", "-o", "a.parquet")
    assert result.code == 0, result.err
    real = next(SAMPLES.glob(f"{stem}.truth.*"))
    assert ftproc.score("a.parquet", real).as_dict()["rmse_3d_m"] < bound_m
    assert "lat_deg" in trajectories.read("a.parquet").extra.column_names


def test_a_station_file_is_never_written_over(run, flight):
    Path("station.json").write_text("[filter]\n")
    result = run("filter", flight, "--config", "station.json", "-o", "station.csv")
    assert (result.code, result.out) == (1, "")
    assert "station.json: this is the input station.json, which is never overwritten" in result.err
    assert Path("station.json").read_text() == "[filter]\n"


def test_train_reads_its_logs_as_the_station_file_says(run, here):
    small = ("--population", "4", "--generations", "1", "--epochs", "2", "--hidden", "2")
    log, real = SAMPLES / "total_station.csv", SAMPLES / "total_station.truth.csv"
    pairs = ("train", *("--log", log, "--truth", real) * 6, "-o", "m.safetensors", *small)
    result = run(*pairs, "--config", SAMPLES / "total_station.toml")
    assert result.code == 0, result.err
    assert Path("m.safetensors").exists()
    both = run("train", "--scenario", "zuo2021", "-o", "m.safetensors", "--config", "s.toml")
    assert (both.code, both.err) == (
        2, "ftproc train: --config says how to read a --log; --scenario has none. See ftproc train -h.\n"
    )  # fmt: skip
