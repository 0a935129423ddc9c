"""A batch from the command line: which logs it takes, what it leaves of an earlier run, its table, lines and counts."""

from __future__ import annotations

import csv
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import ftproc
from ftproc.batch import plan
from ftproc.files.reading import trajectories as reading
from ftproc.files.writing import flights, trajectories
from ftproc.simulation import simulate

NAMES = ["0.csv", "1.parquet", "2.csv"]
BATCH = ("filter", *NAMES, "-o", "out", "--summary", "line")


@pytest.fixture
def logs(here):
    """Three short logs in the current directory."""
    for number, name in enumerate(NAMES):
        flights.write_log(simulate("zuo2021-outliers", seed=number).log, name)
    return here


def touched(directory: Path) -> dict[str, int]:
    """When each output was made; all of them are older than anything that is made from now on."""
    return {path.name: path.stat().st_mtime_ns for path in directory.glob("out/*trajectory.*")}


def made(directory: Path, before: dict[str, int]) -> list[str]:
    return sorted(name[0] for name, when in touched(directory).items() if before.get(name) != when and ".j" not in name)


def test_finished_logs_are_left(run, logs):
    first = run(*BATCH)
    assert (first.code, first.err) == (0, "")
    before = touched(logs)
    again = run(*BATCH)
    assert made(logs, before) == []
    assert again.out.count(", finished before, ") == 3
    assert again.out.endswith("; 3 finished before (--redo filters them again)\n")
    assert again.out.replace(", finished before", "").startswith(first.out.rstrip("\n"))
    run(*BATCH, "--redo")
    assert made(logs, before) == ["0", "1", "2"]


def test_one_log_is_always_filtered(run, logs):
    for _ in range(2):
        assert "  time " in run("filter", "0.csv", "-o", "out/").out


@pytest.mark.parametrize(
    ("change", "again"),
    [
        (lambda: shutil.copy("2.csv", "0.csv"), ["0"]),
        (lambda: os.utime("0.csv"), []),
        (lambda: Path("out/1.trajectory.parquet").unlink(), ["1"]),
        (lambda: Path("out/1.trajectory.parquet").write_bytes(b"PAR1 broken PAR1"), ["1"]),
        (lambda: Path("out/2.trajectory.csv").unlink(), ["2"]),
        (lambda: Path("out/2.trajectory.json").unlink(), ["2"]),
        (lambda: Path("out/2.trajectory.json").write_text('{"program": "ftproc"'), ["2"]),
    ],
)
def test_what_is_not_the_same_is_filtered(run, logs, change, again):
    run(*BATCH)
    change()
    before = touched(logs)
    assert run(*BATCH).code == 0
    assert made(logs, before) == again


@pytest.mark.parametrize("more", [("--smooth",), ("--gate", "3"), ("--model", "none"), ("--azimuth-from", "north")])
def test_other_settings_filter_all(run, logs, more):
    run(*BATCH)
    before = touched(logs)
    run(*BATCH, *more)
    assert made(logs, before) == ["0", "1", "2"]


def test_another_version_or_model_filters_all(run, logs, monkeypatch):
    from ftproc.correction import model_file

    model_file.save(model_file.named("packaged"), "mine.safetensors")
    run(*BATCH)
    before = touched(logs)
    run(*BATCH, "--model", "mine.safetensors")
    assert made(logs, before) == []  # the same model under another name
    monkeypatch.setattr("ftproc.__version__", "9.9")
    run(*BATCH)
    assert made(logs, before) == ["0", "1", "2"]


def test_other_decisions_by_hand_filter_all(run, logs):
    """Whatever their file is called; and decisions to be written are those of all logs."""
    header, line = "station,component,from_row,to_row,use", "0,range,3,5,"
    decided = (*BATCH, "--decisions")
    Path("a.csv").write_text(f"{header}\n{line}bad\n")
    run(*decided, "a.csv")
    before = touched(logs)
    Path("a.csv").rename("b.csv")
    assert run(*decided, "b.csv").code == 0
    assert made(logs, before) == []
    run(*decided, "b.csv", "--write-decisions", "taken.csv")
    assert made(logs, before) == ["0", "1", "2"]
    assert {row["station"] for row in csv.DictReader(Path("taken.csv").read_text().splitlines())} == {"0", "1", "2"}
    before = touched(logs)
    Path("b.csv").write_text(f"{header}\n{line}good\n")
    run(*decided, "b.csv")
    assert made(logs, before) == ["0", "1", "2"]


def test_a_page_that_is_not_there_is_made(run, logs):
    run(*BATCH)
    before = touched(logs)
    run(*BATCH, "--report", "pages/")
    assert made(logs, before) == ["0", "1", "2"]
    before = touched(logs)
    Path("pages/1.report.html").unlink()
    run(*BATCH, "--report", "pages/")
    assert made(logs, before) == ["1"]
    assert Path("pages/index.html").read_text().count(">trajectory</a>") == 3


def test_a_kill_between_a_table_and_its_metadata_leaves_nothing_that_looks_finished(logs, monkeypatch):
    """Metadata of the new settings beside the older table would."""
    trajectory, rename = ftproc.filter_log("0.csv"), Path.replace

    def write(recipe: str, off_m: float) -> None:
        told = {**trajectory.metadata, "recipe_sha256": recipe}
        trajectories.write(replace(trajectory, state=trajectory.state + off_m, metadata=told), "out.csv")

    def last(temporary: Path, target: Path) -> None:
        rename(temporary, target)
        raise KeyboardInterrupt

    write("older", 0.0)
    monkeypatch.setattr(Path, "replace", last)
    with pytest.raises(KeyboardInterrupt):
        write("newer", 1.0)
    found = reading.read("out.csv")
    assert found.metadata["recipe_sha256"] == "older"
    np.testing.assert_array_equal(found.state, trajectory.state + 1.0)


def test_a_batch_that_was_killed_goes_on(logs):
    """Only the logs in flight are filtered twice."""
    names = [f"long{number}.csv" for number in range(8)]
    for number, name in enumerate(names):
        flights.write_log(simulate("manoeuvre", duration_s=60.0, seed=number).log, name)
    command = [sys.executable, "-P", "-m", "ftproc", "filter", *names, "-o", "out/", "--jobs", "2", "--summary", "line"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, start_new_session=True) as process:
        deadline = time.monotonic() + 120
        while len(list(Path("out").glob("*.trajectory.csv"))) < 2 and time.monotonic() < deadline:
            time.sleep(0.01)
        os.killpg(process.pid, signal.SIGKILL)
    there = len(list(Path("out").glob("*.trajectory.csv")))
    assert 2 <= there < 8
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert int(re.findall(r"; (\d+) finished before", done.stdout)[0]) == there


def test_the_table(run, logs):
    Path("broken.csv").write_text("time_s,range_m\n0,wrong\n")
    command = ("filter", *NAMES, "broken.csv", "-o", "out", "--summary", "line", "--report", "pages/", "--table")
    result = run(*command, "night.csv")
    assert result.code == 1
    assert re.fullmatch(r"4 logs: .*, 1 failed", result.out.splitlines()[-1])
    rows = list(csv.DictReader(Path("night.csv").read_text().splitlines()))
    assert [row["log"] for row in rows] == [*NAMES, "broken.csv"]
    assert rows[3]["verdict"] == "failed"
    assert 'column "range_m"' in rows[3]["error"]
    assert rows[3]["output"] == rows[3]["report"] == rows[3]["rows"] == ""
    assert (rows[0]["rows"], rows[0]["duration_s"]) == ("61", "60.0")
    assert rows[1]["output"] == "out/1.trajectory.parquet"
    assert rows[1]["report"] == "pages/1.report.html"
    assert float(rows[0]["outliers_range_percent"]) > 5
    assert run(*command, "night.json").code == 1
    listed = json.loads(Path("night.json").read_text())
    assert [each["verdict"] for each in listed] == [row["verdict"] for row in rows]
    assert listed[0]["noise_azimuth_rad"] == pytest.approx(float(rows[0]["noise_azimuth_rad"]))
    assert listed[3]["reasons"] == []
    assert run(*command, "night.html").code == 1
    page = Path("night.html").read_text()
    assert '<a href="./pages/0.report.html">0.csv</a>' in page
    assert page.index(">failed</span>") < page.index(">0.csv</a>")  # the worst first


@pytest.mark.parametrize(
    ("name", "code", "sentence"),
    [
        ("night.txt", 2, "--table night.txt: end the name in .csv, .json, .html."),
        ("0.csv", 1, "0.csv: this is the input 0.csv, which is never overwritten. Give another name with --table."),
        ("none/night.csv", 1, "there is no directory none"),
    ],
)
def test_a_table_that_cannot_be_written(run, logs, name, code, sentence):
    result = run(*BATCH, "--table", name)
    assert (result.code, result.out) == (code, "")
    assert sentence in result.err


def test_names_do_not_run_in_a_spreadsheet(run, logs):
    shutil.copy("0.csv", "=1+1.csv")
    run("filter", "=1+1.csv", "0.csv", "-o", "out", "--table", "night.csv")
    assert Path("night.csv").read_text().splitlines()[1].startswith("'=1+1.csv,")


def test_a_pattern_leaves_truths_and_trajectories_out(run, logs):
    for name in ("0.truth.csv", "0.trajectory.csv"):
        shutil.copy("0.csv", name)
    result = run("filter", "*.csv", "1.parquet", "-o", "out", "--summary", "line")
    assert result.code == 0
    assert result.err == "ftproc: left out: 2 truths and trajectories, such as 0.trajectory.csv\n"
    assert [line.split(":")[0] for line in result.out.splitlines()] == ["0.csv", "2.csv", "1.parquet", "3 logs"]


def test_a_log_that_may_not_be_read_stops_no_other(run, logs, monkeypatch):
    allowed, opened = os.access, Path.open

    def open_allowed(path, *how, **more):
        if path.name == NAMES[1]:
            raise PermissionError
        return opened(path, *how, **more)

    monkeypatch.setattr(os, "access", lambda path, mode: str(path) != NAMES[1] and allowed(path, mode))
    monkeypatch.setattr(Path, "open", open_allowed)
    found = run(*BATCH)
    assert found.code == 1
    assert found.err == "ftproc: 1.parquet: no permission to read it.\n"
    assert made(logs, {}) == ["0", "2"]


def test_which_names_are_logs(here):
    for name in ("a.csv", "a.truth.csv", "b[1].csv"):
        (here / name).touch()
    assert plan.chosen(["a.truth.csv"]) == (["a.truth.csv"], [])
    assert plan.chosen(["a.truth.csv", "b.trajectory.csv"]) == (["a.truth.csv", "b.trajectory.csv"], [])
    assert plan.chosen(["b[1].csv"]) == (["b[1].csv"], [])
    assert plan.chosen(["?.csv", "none*.csv"]) == (["a.csv", "none*.csv"], [])
    assert plan.chosen(["s3://bucket/*.csv"]) == (["s3://bucket/*.csv"], [])


def test_outputs_named_after_their_logs(run, logs):
    result = run("filter", *NAMES, "-o", "clean/*.best.parquet", "--summary", "line")
    assert result.code == 0
    assert sorted(path.name for path in Path("clean").iterdir()) == [f"{number}.best.parquet" for number in range(3)]


def test_a_station_file_for_each_log_that_has_one(run, logs):
    Path("in").mkdir()
    shutil.copy("0.csv", "in/0.csv")
    Path("in/0.toml").write_text("[filter]\nsmooth = true\n")
    result = run("filter", "in/0.csv", "2.csv", "-o", "out", "--config", "*.toml", "--summary", "json")
    assert result.code == 0, result.err
    found = {name: json.loads(Path(f"out/{name}.trajectory.json").read_text())["settings"]["smooth"] for name in "02"}
    assert found == {"0": True, "2": False}


def test_logs_that_measure_other_things_stand_beside_the_rest(run, here):
    """A radar without elevation has outliers of its heights in place of those, one with range rates has those too."""
    for scenario in ("surveillance-2d", "radar-doppler", "radar"):
        flights.write_log(simulate(scenario, seed=1, duration_s=200.0).log, f"{scenario}.csv")
    result = run("filter", "*.csv", "-o", "out", "--report", "rep", "--table", "t.json", "--summary", "line")
    assert result.code == 0, result.err
    lines = {line.partition(".csv")[0]: line for line in result.out.splitlines()}
    counts = {name: lines[name].partition(" rows, ")[2].partition(" %")[0].count(".") for name in list(lines)[:3]}
    assert counts == {"surveillance-2d": 3, "radar-doppler": 4, "radar": 3}
    rows = {row["log"][:-4]: row for row in json.loads(Path("t.json").read_text())}
    height, doppler, plain = (rows[name] for name in ("surveillance-2d", "radar-doppler", "radar"))
    assert height["outliers_elevation_percent"] is None
    assert height["noise_height_m"] == pytest.approx(2.2, abs=0.1)
    assert doppler["noise_range_rate_mps"] == pytest.approx(0.5, rel=0.2)
    assert plain["outliers_height_percent"] is plain["noise_range_rate_mps"] is None
    text = Path("rep/index.html").read_text()
    assert "<th>range rate outliers, %</th><th>height outliers, %</th><th>method</th></tr>" in text
