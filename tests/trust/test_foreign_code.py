"""Code beside the logs is never run: the program is run among modules of every name that it imports."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

from ftproc.core import compiled
from ftproc.report.browser import printing
from tests.trust import beside
from tests.trust.beside import PROGRAM

#: Small, and in two processes.
TRAIN = ("train", "--scenario", "zuo2021", "--flights", "4")
LITTLE = ("--population", "2", "--generations", "1", "--epochs", "2", "--hidden", "3")
MODULE = (sys.executable, "-P", "-m", "ftproc")


class Hostile(NamedTuple):
    place: Path
    ran: Path
    watched: beside.Watched


@pytest.fixture(scope="module")
def hostile(tmp_path_factory: pytest.TempPathFactory) -> Hostile:
    """First a run elsewhere, which shows what is looked for."""
    watched = beside.Watched(tmp_path_factory.mktemp("watched"))
    elsewhere, place = tmp_path_factory.mktemp("elsewhere"), tmp_path_factory.mktemp("hostile")
    for folder in (elsewhere, place):
        beside.fill(folder)
    for command in (("filter", "a.csv", "b.csv", "-o", "o/", "--jobs", "2", "--report", "o/"), ("filter", "a.csv")):
        assert watched.run(elsewhere, PROGRAM, *command).returncode == 0
    looked_for = watched.seen("name")
    assert {"signal", "numpy", "multiprocessing", "ftproc", "plotly"} <= looked_for
    return Hostile(place, beside.plant(place, looked_for), watched)


@pytest.mark.parametrize(
    "command",
    [
        (PROGRAM, "filter", "a.csv", "b.csv", "-o", "o/", "--jobs", "2", "--report", "o/"),
        (PROGRAM, "filter", "a.csv", "-o", "all/", "--method", "all", "--model", "none", "--jobs", "2"),
        (PROGRAM, *TRAIN, *LITTLE, "--jobs", "2", "-o", "m.safetensors"),
        (PROGRAM, *TRAIN, *LITTLE, "--jobs", "2", "--compare-starts"),
        (PROGRAM, "score", "o/a.trajectory.csv", "--truth", "a.truth.csv", "--report", "s.html"),
        (PROGRAM, "simulate", "--scenario", "range-radar", "--duration", "10", "-o", "range/"),
        (PROGRAM, "filter", "--fuse", "range/range.toml", "-o", "best.parquet"),
        (*MODULE, "filter", "a.csv", "b.csv", "-o", "q/", "--jobs", "2"),
    ],
    ids=["filter", "all", "train", "starts", "score", "simulate", "fuse", "module"],
)
def test_nothing_beside_the_logs_is_run(hostile: Hostile, command: tuple[str, ...]) -> None:
    done = beside.run(hostile.place, *command)
    assert (done.returncode, done.stderr) == (0, done.stderr if "left out" in done.stderr else "")
    assert not hostile.ran.exists(), hostile.ran.read_text()


def test_no_library_beside_the_logs_is_loaded(hostile: Hostile) -> None:
    """In the process that is started, and in its workers."""
    for jobs in ("1", "2"):
        done = hostile.watched.run(hostile.place, PROGRAM, "filter", "a.csv", "b.csv", "-o", "w/", "--jobs", jobs)
        assert done.returncode == 0, done.stderr
    loaded = hostile.watched.seen("library")
    assert any(Path(name).parent == compiled.ROOM for name in loaded) == (compiled.WAY == "compiled")
    assert not [name for name in loaded if Path(name).is_relative_to(hostile.place)]


def test_a_module_that_python_starts_without_p(tmp_path: Path) -> None:
    """Python itself looks for what it needs to find ftproc in the current directory; we and our workers do not."""
    beside.fill(tmp_path)
    for name in ("signal", "random", "struct", "socket", "pickle", "multiprocessing", "click", "numpy", "pyarrow"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit(7)\n")
    done = beside.run(tmp_path, sys.executable, "-m", "ftproc", "filter", "a.csv", "b.csv", "-o", "p/", "--jobs", "2")
    assert (done.returncode, done.stderr) == (0, "")


def test_the_modules_would_be_run(hostile: Hostile) -> None:
    """Where Python is not told to look elsewhere."""
    ran = hostile.ran
    done = beside.run(hostile.place, sys.executable, "-c", "import click")
    assert ran.exists(), done.stderr
    ran.unlink()


def test_workers_of_an_interpreter_that_ignores_the_environment_are_refused(hostile: Hostile) -> None:
    command = ("filter", "a.csv", "b.csv", "-o", "e/", "--jobs", "2")
    done = beside.run(hostile.place, sys.executable, "-E", PROGRAM, *command)
    assert done.returncode == 1
    assert done.stderr.startswith("ftproc: python -E ignores PYTHONSAFEPATH, so worker processes would import")
    assert beside.run(hostile.place, sys.executable, "-EP", PROGRAM, *command).returncode == 0
    assert not hostile.ran.exists()


def test_numba_reads_no_settings_beside_the_logs(tmp_path: Path) -> None:
    """They would name the directory of its cache, from which it loads code."""
    pytest.importorskip("numba")
    pytest.importorskip("yaml")
    (tmp_path / ".numba_config.yaml").write_text("cache_dir: ./planted\n")
    code = "import ftproc.core.filtering.ukf\nfrom numba.core import config\nprint(config.CACHE_DIR)"
    for more, expected in (({}, ""), ({"NUMBA_CACHE_DIR": "mine"}, "mine")):
        done = beside.run(tmp_path, sys.executable, "-c", code, FTPROC_KERNELS="jit", **more)
        assert (done.stdout.strip(), done.stderr) == (expected, "")


def test_no_browser_beside_the_logs_is_run(tmp_path: Path) -> None:
    """A PATH may begin with the current directory."""
    beside.fill(tmp_path)
    for name in printing.BROWSERS:
        (tmp_path / name).write_text("#!/bin/sh\ntouch RAN\n")
        (tmp_path / name).chmod(0o755)
    for path in (".", "", str(tmp_path)):
        found = f"{path}{os.pathsep}/nowhere"
        done = beside.run(tmp_path, PROGRAM, "filter", "a.csv", "--report", "a.pdf", PATH=found)
        assert done.returncode == 2
        assert "a.pdf: a PDF is printed by Chromium" in done.stderr
    assert not (tmp_path / "RAN").exists()
