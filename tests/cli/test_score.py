"""`ftproc score`."""

from __future__ import annotations

import csv
import io
import json

import pandas as pd
import pytest

from tests.cli.conftest import Result, on_the_earth


@pytest.fixture
def clean(run, flight):
    """`clean.parquet`, the filtered flight."""
    assert run("filter", flight, "-o", "clean.parquet", "--summary", "none").code == 0
    return flight.with_name("clean.parquet")


def test_table_with_and_without_truth(run, clean):
    alone, compared = run("score", clean), run("score", clean, "--truth", "flight.truth.csv")
    assert alone.code == compared.code == 0
    assert "average gradient R (m)" in alone.out
    assert "position RMSE" not in alone.out
    assert "position RMSE (m)" in compared.out
    assert "range outliers, precision" in compared.out


def test_json_has_the_promised_keys(run, clean):
    found = json.loads(run("score", clean, "--truth", "flight.truth.csv", "--format", "json").out)
    assert found["average_gradient"].keys() == {"range_m", "azimuth_rad", "elevation_rad"}
    for key in ("rmse_seed_m", "rmse_3d_m", "rmse_x_m", "rmse_v_mps", "max_error_m"):
        assert found[key] >= 0
    assert found["outliers"]["range"].keys() >= {"precision", "recall", "f1"}


def test_a_truth_on_the_earth_is_brought_into_the_frame_of_the_site(run, clean):
    earth = on_the_earth("flight.truth.csv", (48.0, 11.0, 500.0))
    refused = run("score", clean, "--truth", earth)
    assert refused.code == 1
    assert "no site is known; say --site" in refused.err
    found = run("score", clean, "--truth", earth, "--site", "48,11,500", "--format", "json")
    local = run("score", clean, "--truth", "flight.truth.csv", "--format", "json")
    assert json.loads(found.out)["rmse_3d_m"] == pytest.approx(json.loads(local.out)["rmse_3d_m"], rel=1e-3)


def test_exchanged_axes_are_reported(run, clean):
    truth = pd.read_csv("flight.truth.csv")
    exchanged = {"x_m": "y_m", "y_m": "x_m", "vx_mps": "vy_mps", "vy_mps": "vx_mps"}
    truth.rename(columns=exchanged).to_csv("east.csv", index=False)
    result = run("score", clean, "--truth", "east.csv")
    assert result.code == 0
    assert f"ftproc: east.csv fits {clean} far better with x and y exchanged" in result.err
    assert run("score", clean, "--truth", "flight.truth.csv").err == ""


def test_another_clock_is_reported(run, clean):
    truth = pd.read_csv("flight.truth.csv")
    truth.assign(time_s=truth.time_s + 18).to_csv("gps.csv", index=False)
    result = run("score", clean, "--truth", "gps.csv")
    assert result.code == 0
    assert "its clock is moved: it is 18 s (GPS against UTC) ahead" in result.err


def test_several_with_one_truth_or_one_each(run, clean):
    rows = {}
    for name, truths in {"one": ["flight.truth.csv"], "each": ["flight.truth.csv"] * 2}.items():
        options = [part for truth in truths for part in ("--truth", truth)]
        result = run("score", clean, "flight.truth.csv", *options, "--format", "csv")
        rows[name] = list(csv.DictReader(io.StringIO(result.out)))
    assert rows["one"] == rows["each"]
    assert [row["samples"] for row in rows["one"]] == ["61", "61"]
    assert float(rows["one"][1]["rmse_3d_m"]) == 0.0  # the truth against itself


def test_standard_input(run, clean):
    assert run("filter", "flight.csv", "-o", "clean.csv").code == 0
    text = clean.with_name("clean.csv").read_text()
    assert json.loads(run("score", "-", "--format", "json", stdin=text).out)["samples"] == 61


def test_a_bad_one_does_not_stop_the_others(run, clean):
    clean.with_name("bad.csv").write_text("time_s,x_m\n0,1\n")
    result = run("score", "none.csv", "bad.csv", clean, "--format", "json")
    assert result.code == 1
    assert json.loads(result.out)["samples"] == 61
    assert result.err.splitlines()[0] == "ftproc: none.csv: there is no such file."
    assert 'bad.csv: there is no column "y_m"' in result.err


def test_bad_truth(run, clean):
    assert run("score", clean, "--truth", "none.csv") == Result(1, "", "ftproc: none.csv: there is no such file.\n")


@pytest.mark.parametrize(
    ("args", "sentence"),
    [
        ([], "ftproc score: Missing argument 'TRAJECTORY...'. See ftproc score -h."),
        (["a", "b", "c", "--truth", "t", "--truth", "u"], "--truth is given 2 times for 3 trajectories; give it once"),
        (["-", "--truth", "-"], "Standard input (-) can be read only once."),
    ],
)
def test_wrong_usage(run, here, args, sentence):
    result = run("score", *args)
    assert (result.code, result.out) == (2, "")
    assert sentence in result.err


def test_comparison_of_all_methods(run, flight):
    assert run("filter", flight, "--method", "all", "-o", "d", "--summary", "none").code == 0
    files = sorted((flight.parent / "d").glob("*.csv"))
    result = run("score", *files, "--truth", "flight.truth.csv")
    assert (result.code, result.err) == (0, "")
    lines = result.out.splitlines()
    assert len(lines) == len(files) + 5  # a heading, three kinds of method, a note
    assert lines[1] == "from past readings"
    assert max(map(len, lines)) <= 120
    rows = list(csv.DictReader(io.StringIO(run("score", *files, "--truth", "flight.truth.csv", "--format", "csv").out)))
    assert len(rows) == len(files)  # in the order given, with the keys of a single score
    assert {"trajectory", "method", "samples", "rmse_3d_m", "outliers.range.recall"} <= rows[0].keys()


def test_limits_are_printed_and_decide_the_exit_code(run, clean, flight):
    limits = flight.with_name("limits.toml")
    limits.write_text('[[require]]\nwhat = "position horizontal"\nshare = 0.95\nbelow_m = 50\n')
    met = run("score", clean, "--truth", "flight.truth.csv", "--require", limits, "--require", "ed-142-terminal")
    assert met.code == 0
    assert "PASS  position horizontal  95 % below 50 m" in met.out
    assert "EUROCAE ED-142" in met.out
    limits.write_text('[[require]]\nwhat = "position"\nrms_below_m = 0.001\n')
    missed = run("score", clean, "--truth", "flight.truth.csv", "--require", limits)
    assert missed.code == 1
    assert "FAIL  position  rms below 0.001 m" in missed.out
    found = json.loads(run("score", clean, "--truth", "flight.truth.csv", "--require", limits, "--format", "json").out)
    assert [(each["what"], each["passed"]) for each in found["require"]] == [("position", False)]
    assert run("score", clean, "--require", limits).code == 2
    unknown = run("score", clean, "--truth", "flight.truth.csv", "--require", "ed-1")
    assert unknown.code == 2
    assert "there are ed-116" in unknown.err


def test_two_runs_are_compared(run, clean, flight):
    assert run("filter", flight, "-o", "smooth.parquet", "--smooth", "--summary", "none").code == 0
    both = run("score", clean, "smooth.parquet")
    assert both.code == 0
    assert "smooth.parquet against" in both.out
    assert "settings   smooth: False, then True" in both.out
    found = json.loads(run("score", clean, "smooth.parquet", "--format", "json").out)
    assert "difference" not in found[0]
    assert found[1]["difference"]["rows"] == 61
    assert found[1]["difference"]["settings"]["smooth"] == [False, True]
    assert "against" not in run("score", clean, clean, clean).out
