"""The command line as a user meets it: `run` in this process, `shell` in a new one; and logs to work on."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner

from ftproc.cli.main import cli
from ftproc.core.model.earth import place_at

BIN = Path(sys.prefix) / "bin"


@dataclass(frozen=True)
class Result:
    code: int
    out: str
    err: str


@pytest.fixture
def run() -> Callable[..., Result]:
    """run("filter", "log.csv") -> exit code, stdout and stderr."""

    def invoke(*args: object, stdin: str | None = None) -> Result:
        result = CliRunner().invoke(cli, [str(a) for a in args], input=stdin)
        return Result(result.exit_code, result.stdout, result.stderr)

    return invoke


@pytest.fixture
def shell(tmp_path: Path) -> Callable[..., Result]:
    """shell("ftproc filter log.csv") in the temporary directory, with this environment's programs first."""

    def execute(command: str, cwd: Path = tmp_path, **environment: str) -> Result:
        path = f"{BIN}{os.pathsep}{os.environ['PATH']}"
        done = subprocess.run(
            ["bash", "-o", "pipefail", "-c", command],
            cwd=cwd, env={**os.environ, "PATH": path, **environment}, capture_output=True, text=True, timeout=600,
        )  # fmt: skip
        return Result(done.returncode, done.stdout, done.stderr)

    return execute


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The temporary directory, as the current one."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def flight(here: Path, run: Callable[..., Result]) -> Path:
    """`flight.csv` (61 rows, outliers) and `flight.truth.csv` in the current directory."""
    made = run("simulate", "--scenario", "zuo2021-outliers", "-o", "flight.csv", "--truth", "flight.truth.csv")
    assert made == Result(0, "", "")
    return here / "flight.csv"


def on_the_earth(truth: str, site: tuple[float, float, float]) -> str:
    """The file of a truth written again as latitude, longitude and height, x being east at the site."""
    frame = pd.read_csv(truth)
    places = [place_at(site, row) for row in frame[["x_m", "y_m", "z_m"]].to_numpy()]
    table = pd.DataFrame(places, columns=["lat_deg", "lon_deg", "height_m"]).assign(time_s=frame.time_s)
    table.to_csv(f"earth-{truth}", index=False)
    return f"earth-{truth}"
