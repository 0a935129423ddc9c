"""The batch pipeline of the Makefile, in a copy of the project and with the environment that runs the tests."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.files.reading import logs, truth
from tests.cli.conftest import Result

PROJECT = Path(__file__).parents[2]


def outside_make() -> dict[str, str]:
    """The environment without what a make that runs the tests says to the makes that it starts."""
    return {name: value for name, value in os.environ.items() if not name.startswith("MAKE") and name != "MFLAGS"}


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    shutil.copytree(PROJECT / "ftproc", tmp_path / "ftproc", ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("Makefile", "pyproject.toml", "hatch_build.py"):
        shutil.copy2(PROJECT / name, tmp_path / name)
    return tmp_path


@pytest.fixture
def make(copy: Path) -> Callable[..., Result]:
    """make("run", "OUT=there"): the environment counts as installed, whatever else is to be done is done."""

    def execute(*args: str, venv: str = sys.prefix) -> Result:
        installed = ["-o", f"{venv}/.installed"] if venv == sys.prefix else []
        command = ["make", f"VENV={venv}", *installed, *args]
        done = subprocess.run(command, cwd=copy, env=outside_make(), capture_output=True, text=True, timeout=300)
        return Result(done.returncode, done.stdout, done.stderr)

    return execute


@pytest.fixture
def flights(copy: Path, run: Callable[..., Result]) -> Path:
    """a.csv, b.csv.gz and c.parquet, the first and the last with truth."""
    (copy / "flights").mkdir()
    for seed, name in enumerate(("a.csv", "b.csv.gz", "c.parquet")):
        args = ["simulate", "--scenario", "zuo2021-outliers", "--seed", str(seed), "-o", copy / "flights" / name]
        if seed != 1:
            kind = "csv" if seed == 0 else "parquet"
            args += ["--truth", copy / "flights" / f"{name[0]}.truth.{kind}"]
        assert run(*args).code == 0
    return copy / "flights"


LOGS = "LOGS=flights/*.csv flights/*.csv.gz flights/*.parquet"


def done(result: Result) -> list[str]:
    """Which logs were filtered, by the first line of their summaries."""
    return sorted(line.split(":")[0] for line in result.out.splitlines() if " rows, " in line)


def test_all_logs_then_the_score_table(make, flights, copy):
    result = make("run", LOGS, "-j2")
    assert result.code == 0, result.err
    assert result.err == ""
    assert done(result) == ["flights/a.csv", "flights/b.csv.gz", "flights/c.parquet"]
    assert sorted(path.name for path in (copy / "out").glob("*.parquet")) == [
        f"{name}.trajectory.parquet" for name in "abc"
    ]
    (table,) = (part for part in result.out.split("\n\n") if "position RMSE (m)" in part)
    assert table.split()[:2] == ["a", "c"]  # only these have truth


def test_a_failed_log_fails_the_target_but_stops_no_other(make, flights, copy):
    """What is there is scored, but not an older trajectory of a log that fails now."""
    shutil.copy(flights / "c.parquet", flights / "d.parquet")
    shutil.copy(flights / "c.truth.parquet", flights / "d.truth.parquet")
    (copy / "out").mkdir()
    (copy / "out" / "d.trajectory.parquet").write_bytes(b"older")
    os.utime(copy / "out" / "d.trajectory.parquet", (0, 0))
    (flights / "a.csv").write_text("time_s,range_m\n0,wrong\n")
    (flights / "d.parquet").write_bytes(b"broken")
    result = make("run", LOGS)
    assert result.code == 2
    assert 'ftproc: flights/a.csv: row 0 (the first data row is 0), column "range_m"' in result.err
    assert (copy / "out" / "d.trajectory.parquet").read_bytes() == b"older"
    assert sorted(path.name for path in (copy / "out").glob("[!.]*")) == [
        "b.trajectory.parquet", "c.trajectory.parquet", "d.trajectory.parquet",
    ]  # fmt: skip
    assert re.search(r"^4 logs: .*, 2 failed$", result.out, re.MULTILINE)
    assert result.out.split("\n\n")[-1].split()[:2] == ["c", "method"]


@pytest.fixture
def plan(make, copy) -> Callable[..., list[str]]:
    """plan("LOGS=...") -> the commands of `make run`, each given to a program that only writes an empty output."""
    program = copy / "venv" / "bin" / "ftproc"
    program.parent.mkdir(parents=True)
    program.write_text(
        "#!/bin/sh\n"
        'echo "ftproc $*"\n'
        'if [ "$1" = filter ]; then for log; do\n'
        'case "$log" in flights/*) name=${log##*/}; : > "${3%/*}/${name%%.*}.trajectory.parquet";; esac; done; fi\n'
    )
    program.chmod(0o755)
    (program.parents[1] / ".installed").touch()

    def execute(*args: str) -> list[str]:
        result = make("run", "-o", "venv/.installed", *args, venv="venv")
        assert result.code == 0, result.err
        return sorted(line for line in result.out.splitlines() if line)

    return execute


def filtered(*names: str, out: str = "out", jobs: int = 1, flags: str = "") -> str:
    """All logs in one process, each with the station file beside it, if there is one."""
    how = f"-o {out}/*.trajectory.parquet --config *.toml --jobs {jobs} --redo"
    return " ".join(["ftproc filter", how, *filter(None, [flags]), *(f"flights/{name}" for name in names)])


def scored(out: str = "out") -> str:
    truths = {"a": "a.truth.csv", "c": "c.truth.parquet"}
    return "ftproc score " + " ".join(f"{out}/{k}.trajectory.parquet --truth flights/{v}" for k, v in truths.items())


ALL = ("a.csv", "b.csv.gz", "c.parquet")


def test_only_what_changed_runs_again(plan, flights):
    assert plan(LOGS) == [filtered(*ALL), scored()]
    assert plan(LOGS) == [scored()]
    later = time.time() + 5
    os.utime(flights / "b.csv.gz", (later, later))
    assert plan(LOGS) == [filtered("b.csv.gz"), scored()]


@pytest.mark.parametrize(("option", "jobs"), [("-j3", 3), ("-j1", 1), ("-j", os.cpu_count())])
def test_as_many_at_a_time_as_make_is_told(plan, flights, option, jobs):
    assert plan(LOGS, option) == [filtered(*ALL, jobs=jobs), scored()]


def test_a_change_of_the_program_makes_all_results_old(plan, flights, copy):
    assert plan(LOGS) == [filtered(*ALL), scored()]
    later = time.time() + 5
    os.utime(copy / "ftproc" / "settings.py", (later, later))
    assert plan(LOGS) == [filtered(*ALL), scored()]


def test_other_flags_make_all_results_old(plan, flights):
    for flags in ("--model none", "--model none --smooth"):
        assert plan(LOGS, "OUT=clean", f"FLAGS={flags}") == [filtered(*ALL, out="clean", flags=flags), scored("clean")]
    assert plan(LOGS, "OUT=clean", "FLAGS=--model none --smooth") == [scored("clean")]


def test_logs_without_truth(plan, flights):
    nothing = "There is no trajectory with a truth beside its log to score."
    assert plan("LOGS=flights/b.csv.gz") == [nothing, filtered("b.csv.gz")]


def test_a_station_file_beside_a_log_makes_its_result_old(plan, flights):
    only = "LOGS=flights/b.csv.gz"
    plan(only)
    assert filtered("b.csv.gz") not in plan(only)
    (flights / "b.toml").touch()
    later = time.time() + 5
    os.utime(flights / "b.toml", (later, later))
    assert filtered("b.csv.gz") in plan(only)


def test_trajectories_and_truths_are_no_logs(plan, flights):
    assert plan(LOGS, "OUT=flights") == [filtered(*ALL, out="flights"), scored("flights")]
    assert plan(LOGS, "OUT=flights") == [scored("flights")]


@pytest.mark.parametrize(
    ("named", "sentence"),
    [
        ("flights/*.txt", "LOGS: there is no file flights/*.txt"),
        ("flights/a.csv flights/none.csv", "LOGS: there is no file flights/none.csv"),
        ("Makefile", "LOGS: Makefile is not a .csv, .csv.gz or .parquet file"),
        ("flights/a.csv flights/a.parquet", "LOGS: flights/a.csv flights/a.parquet would all become out/a.trajectory"),
        ("flights/a.truth.csv", 'LOGS: there is no log among "flights/a.truth.csv"'),
    ],
)
def test_wrong_logs(make, flights, copy, named, sentence):
    shutil.copy(flights / "c.parquet", flights / "a.parquet")
    result = make("run", f"LOGS={named}")
    assert result.code == 2
    assert sentence in result.err
    assert not (copy / "out").exists()


def test_help_lists_every_target(make):
    result = make()
    assert result == make("help")
    for target in ("run", "test", "samples", "model", "readme", "bench", "reproduce", "clean", "install", "wheel"):
        assert f"\nmake {target} " in result.out


@pytest.mark.parametrize(
    ("lacking", "sentence"),
    [("version_info", "ftproc needs Python 3.11 or newer"), ("ensurepip", "cannot make virtual environments: install")],
)
def test_a_machine_without_the_right_python(make, copy, lacking, sentence):
    python = copy / "python-without"
    python.write_text(f'#!/bin/sh\ncase "$*" in *{lacking}*) exit 1;; esac\nexit 0\n')
    python.chmod(0o755)
    result = make("install", f"PYTHON={python}", venv="new")
    assert result.code == 2
    assert sentence in result.err
    assert not (copy / "new").exists()


def test_what_takes_long_is_said_before_it_is_done(copy):
    """So that nobody takes it for a program that hangs."""
    python = copy / "slow-python"
    python.write_text("#!/bin/sh\ncase \"$*\" in *'-m venv'*) touch begun; sleep 60;; esac\nexit 0\n")
    python.chmod(0o755)
    command = ["make", "VENV=new", f"PYTHON={python}", "install"]
    with subprocess.Popen(
        command, cwd=copy, env=outside_make(), stdout=subprocess.PIPE, text=True, start_new_session=True
    ) as making:
        assert making.stdout is not None
        try:
            assert making.stdout.readline() == "making new\n"
            assert making.poll() is None
        finally:
            os.killpg(making.pid, signal.SIGKILL)


def test_test_does_all_that_ci_needs(make):
    plan = make("-n", "-o", f"{sys.prefix}/.installed-dev", "test").out
    positions = [plan.index(step) for step in ("ruff check", "ruff format --check", "mypy", "pytest")]
    assert positions == sorted(positions)


def test_clean(make, copy):
    (copy / "out").mkdir()
    (copy / "ftproc" / "__pycache__").mkdir()
    (copy / "tests").mkdir()
    assert make("clean", f"installed={copy}/none").code == 0
    assert not (copy / "out").exists()
    assert not (copy / "ftproc" / "__pycache__").exists()


def test_samples_are_made_anew(make, copy):
    assert make("samples").code == 0
    checked_in, made = ({path.name for path in (r / "sample_data").rglob("*.*")} for r in (PROJECT, copy))
    by_hand = (name for name in checked_in if name.endswith((".toml", ".png")) and name != "range.toml")
    assert made == checked_in - set(by_hand)
    for name in (
        "zuo2021-outliers.csv",
        "theodolite.parquet",
        "radar.csv",
        "calibration/circle.parquet",
    ):  # other processors round differently
        made, kept = (logs.read(root / "sample_data" / name) for root in (copy, PROJECT))
        assert len(made) == len(kept)
        assert abs(made.measurement[0] - kept.measurement[0]).max() < 1e-6
    head = (PROJECT / "sample_data" / "total_station.csv").read_text().splitlines()[:5]
    assert (copy / "sample_data" / "total_station.csv").read_text().splitlines()[:5] == head


def test_samples_are_what_they_say():
    samples = PROJECT / "sample_data"
    assert sum(path.stat().st_size for path in samples.rglob("*")) < 2_000_000
    circle, flown = (samples / "calibration" / f"circle{kind}.parquet" for kind in ("", ".truth"))
    off = logs.read(circle).measurement - from_cartesian(truth.read(flown).position_m)
    assert 2e-4 < np.median(np.abs(wrap(off[:, 1]))) < 3e-3
    assert 1e-4 < np.median(np.abs(off[:, 2])) < 1e-3
    for name in ("zuo2021-outliers.csv", "theodolite.parquet", "radar.csv"):
        stem = name.split(".")[0]
        real = truth.read(next(samples.glob(f"{stem}.truth.*")))
        assert real.outlier is not None
        assert real.outlier.any()
    assert (samples / "radar.csv").read_text().startswith("time_s,range_km,azimuth_deg,elevation_deg\n")
    theodolite = pq.read_table(samples / "theodolite.parquet").to_pandas()
    assert theodolite["range_m"].isna().any()
    assert theodolite["time_s"].diff().median() == pytest.approx(0.05)
    assert theodolite["time_s"].diff().max() > 1.0
