"""Compilation in advance, and the line that announces it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from numba import config, njit

from ftproc.core import compiled


@pytest.mark.skipif(bool(config.DISABLE_JIT), reason="nothing is compiled")
def test_only_ftproc_s_kernels_are_announced_and_once():
    lines: list[str] = []

    def double(x):
        return 2 * x

    def triple(x):
        return 3 * x

    foreign, own, other = njit(double), njit(triple), njit(lambda x: x)
    own.py_func.__module__ = "ftproc.core.example"
    with compiled.announced(lines.append):
        foreign(1.0)
        assert lines == []
        own(1.0)
        own(1)
        own(1.0)
    other(1.0)
    assert lines == [compiled.COMPILING]


@pytest.fixture
def copy(tmp_path: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    """copy("-m", "ftproc", ...) runs Python with a copy of the package, which has a cache of its own.

    The kernels of `outlier_chain.py`, which every log needs, are missing in it.
    """
    source = Path(compiled.__file__).parents[1]
    missing = shutil.ignore_patterns("*.pyc", "outlier_chain.*.nbi")
    shutil.copytree(source, tmp_path / "ftproc", ignore=missing)  # with the times, by which numba knows the files
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    environment |= {"PYTHONPATH": str(tmp_path), "NUMBA_DISABLE_JIT": "0", "PYTHONDONTWRITEBYTECODE": "1"}

    def execute(*args: str, **more: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, *args], cwd=tmp_path, env=environment | more, capture_output=True, text=True
        )

    return execute


def test_a_cold_start_is_announced_and_a_warm_one_is_not(copy, flight):
    cold, warm = (copy("-m", "ftproc", "filter", "flight.csv") for _ in range(2))
    assert (cold.returncode, cold.stderr) == (0, f"ftproc: {compiled.COMPILING}\n")
    assert (warm.returncode, warm.stderr) == (0, "")


def test_warming_is_announced(copy):
    lines = copy("-m", "ftproc.cli.warm").stderr.splitlines()
    assert lines[0] == compiled.COMPILING
    assert lines[-1].startswith("the kernels are ready")


WAYS = (["--smooth"], ["--editing", "forward"], ["--method", "all"])
SCRIPT = f"""
import sys
from click.testing import CliRunner
from numba.core.dispatcher import Dispatcher
from ftproc.cli.main import cli
from ftproc.cli.warm import warm

def variants():
    modules = [module for name, module in list(sys.modules.items()) if name.startswith("ftproc.")]
    kernels = [d for module in modules for d in vars(module).values() if isinstance(d, Dispatcher)]
    return {{(d.py_func.__module__, d.py_func.__name__, signature) for d in kernels for signature in d.signatures}}

warm()
warmed = variants()
assert len(warmed) > 20
for options in {WAYS}:
    done = CliRunner().invoke(cli, ["filter", "a.csv", "b.parquet", "-o", "out", *options])
    assert done.exit_code == 0, done.stderr
    print(*options, sorted(variants() - warmed))
"""


def test_no_way_of_filtering_needs_more_than_is_warmed(run, here):
    """In a process of its own, as kernels of earlier tests would count as warmed."""
    assert run("simulate", "--scenario", "manoeuvre", "--duration", "20", "-o", "a.csv").code == 0
    assert run("simulate", "--scenario", "radar", "--duration", "20", "-o", "b.parquet").code == 0
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "0"}
    done = subprocess.run([sys.executable, "-c", SCRIPT], cwd=here, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == [f"{' '.join(way)} []" for way in WAYS]


def test_nowhere_to_keep_the_kernels_is_a_plain_sentence(copy, tmp_path):
    """Files stand where the directories of the cache would be."""
    for room in [p for p in (tmp_path / "ftproc" / "core").rglob("*") if p.is_dir() and p.name != "__pycache__"]:
        shutil.rmtree(room / "__pycache__", ignore_errors=True)
        (room / "__pycache__").write_text("")
    (tmp_path / "file").write_text("")
    (tmp_path / "log.csv").write_text("time_s,range_m,azimuth_rad,elevation_rad\n0,1,0,0\n1,2,0,0\n")
    nowhere = str(tmp_path / "file" / "deeper")
    done = copy("-m", "ftproc", "filter", "log.csv", HOME=nowhere, XDG_CACHE_HOME=nowhere, NUMBA_CACHE_DIR=nowhere)
    assert done.returncode == 1
    assert "Set NUMBA_CACHE_DIR to a directory that can be written to." in done.stderr
    assert "Traceback" not in done.stderr
