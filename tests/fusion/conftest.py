"""A short flight that several stations have seen, written once."""

from __future__ import annotations

import shutil

import pytest

from ftproc.files.writing import ranges
from ftproc.simulation import simulate_range
from tests.cli.conftest import run

__all__ = ["run"]

SEED, DURATION_S = 2, 40.0


@pytest.fixture(scope="session")
def simulated():
    return simulate_range("range-radar", SEED, DURATION_S)


@pytest.fixture(scope="session")
def written(simulated, tmp_path_factory):
    folder = tmp_path_factory.mktemp("range")
    ranges.write(simulated, str(folder), str(folder / "truth.parquet"))
    return folder


@pytest.fixture
def folder(written, tmp_path, monkeypatch):
    """A copy that a test may change; the current directory."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(written, tmp_path, dirs_exist_ok=True)
    return tmp_path
