"""Compilation in advance, and the line that announces it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from numba import config, njit

from ftproc.core import compiled

BIN = Path(sys.prefix) / "bin"


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


def test_a_cold_start_is_announced_and_a_warm_one_is_not(tmp_path):
    """After `python -m ftproc.cli.warm` no way of filtering compiles anything."""

    def execute(*command: str) -> str:
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "NUMBA_DISABLE_JIT": "0"}
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
        return done.stderr

    ftproc = str(BIN / "ftproc")
    execute(ftproc, "simulate", "--scenario", "manoeuvre", "--duration", "30", "-o", "a.csv")
    execute(ftproc, "simulate", "--scenario", "radar", "-o", "b.parquet")
    text = execute(sys.executable, "-m", "ftproc.cli.warm")
    assert text.splitlines()[0] == compiled.COMPILING
    assert text.splitlines()[-1].startswith("the kernels are ready")
    for options in (["--smooth"], ["--editing", "forward"], ["--method", "all"]):
        assert compiled.COMPILING not in execute(ftproc, "filter", "a.csv", "b.parquet", "-o", "out", *options)


def test_nowhere_to_keep_the_kernels_is_a_plain_sentence(tmp_path):
    """A copy of the package with files where the directories of the cache would be."""
    source = Path(compiled.__file__).parents[1]
    shutil.copytree(source, tmp_path / "ftproc", ignore=shutil.ignore_patterns("__pycache__"))
    for room in [p for p in (tmp_path / "ftproc" / "core").rglob("*") if p.is_dir()]:
        (room / "__pycache__").write_text("")
    (tmp_path / "file").write_text("")
    nowhere = str(tmp_path / "file" / "deeper")
    environment = {
        **os.environ, "PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1",
        "NUMBA_DISABLE_JIT": "0", "HOME": nowhere, "XDG_CACHE_HOME": nowhere, "NUMBA_CACHE_DIR": nowhere,
    }  # fmt: skip
    command = [sys.executable, "-c", "from ftproc.cli.main import main; main()", "filter", "-"]
    log = "time_s,range_m,azimuth_rad,elevation_rad\n0,1,0,0\n1,2,0,0\n"
    done = subprocess.run(command, input=log, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 1
    assert "Set NUMBA_CACHE_DIR to a directory that can be written to." in done.stderr
    assert "Traceback" not in done.stderr
