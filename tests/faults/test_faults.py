"""Faults of the machine during a run: no output is lost, none is partial, and the fault is reported."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ftproc.files.reading import logs, trajectories
from ftproc.files.writing import flights
from ftproc.simulation import simulate
from tests.faults import batches
from tests.faults.batches import PROGRAM, run


@pytest.fixture
def flight(tmp_path: Path) -> Path:
    path = tmp_path / "flight.csv"
    flights.write_log(simulate("zuo2021", seed=3).log, path)
    return path


def plain(done: subprocess.CompletedProcess[str], code: int = 1) -> str:
    """One sentence on standard error and this exit code."""
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
    return done.stderr


def test_killed_at_random_moments(tmp_path: Path) -> None:
    names = batches.fill(tmp_path, 4)
    found = batches.killed(tmp_path, names, moments=2, seed=3)
    assert len(found) == 2
    assert min(found) < len(names)


@pytest.mark.parametrize("output", ["out.csv", "out.parquet", "out.csv.gz"])
def test_a_full_disk_loses_nothing(flight: Path, tmp_path: Path, output: str) -> None:
    (tmp_path / output).write_bytes(b"earlier")
    full = batches.limited(resource.RLIMIT_FSIZE, 2000)
    args = [PROGRAM, "filter", flight.name, "-o", output]
    done = run(tmp_path, args, preexec_fn=full)
    assert f"{output}: the file is larger than the system allows; nothing was written" in plain(done)
    assert (tmp_path / output).read_bytes() == b"earlier"
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(["flight.csv", output])


@pytest.mark.parametrize("output", ["loop.csv", "loop/a.csv"])
def test_a_target_that_links_to_itself(flight: Path, tmp_path: Path, output: str) -> None:
    (tmp_path / "loop.csv").symlink_to("loop.csv")
    (tmp_path / "loop").symlink_to("loop")
    sentence = plain(run(tmp_path, [PROGRAM, "filter", flight.name, "-o", output]))
    assert "loop" in sentence
    assert "internal error" not in sentence


def test_two_processes_write_the_same_target(flight: Path, tmp_path: Path) -> None:
    args = [PROGRAM, "filter", flight.name, "-o", "out.csv"]
    both = [subprocess.Popen(args, cwd=tmp_path, stdout=subprocess.DEVNULL) for _ in range(2)]
    assert [process.wait(timeout=120) for process in both] == [0, 0]
    assert len(trajectories.read(tmp_path / "out.csv")) == len(logs.read(flight))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["flight.csv", "out.csv", "out.json"]


@pytest.mark.skipif("FTPROC_TRUST" not in os.environ, reason="depends on the machine's memory; make trust runs it")
def test_out_of_memory_is_reported(flight: Path, tmp_path: Path) -> None:
    """A limit that holds the program, but not the log."""
    long = tmp_path / "long.csv"
    with long.open("w") as stream:
        stream.write("time_s,range_m,azimuth_rad,elevation_rad\n")
        stream.writelines(f"{k / 100},{5000 + k % 7},0.5,0.3\n" for k in range(3_000_000))
    code = (
        "import resource, sys\n"
        "import ftproc\nftproc.filter_log(ftproc.read_log('flight.csv'))\n"
        "used = int(open('/proc/self/statm').read().split()[0]) * resource.getpagesize()\n"
        "resource.setrlimit(resource.RLIMIT_AS, (used + (96 << 20),) * 2)\n"
        "sys.argv[1:] = ['filter', 'long.csv', 'flight.csv', '-o', 'out', '--summary', 'none']\n"
        "from ftproc.cli.main import main\nmain()\n"
    )
    done = run(tmp_path, [sys.executable, "-c", code])
    assert done.returncode == 1, done.stderr
    assert "Traceback" not in done.stderr
    assert "long.csv: " in done.stderr
    assert "memory" in done.stderr
    assert "internal error" not in done.stderr
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "flight.trajectory.csv",
        "flight.trajectory.json",
    ]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupted(tmp_path: Path, number: signal.Signals) -> None:
    names = batches.fill(tmp_path, 30)
    with subprocess.Popen(
        batches.command(names), cwd=tmp_path, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        deadline = time.monotonic() + 60
        while not list(tmp_path.glob("out/*.csv")) and time.monotonic() < deadline:
            time.sleep(0.02)
        os.killpg(process.pid, number)
        err = process.communicate(timeout=60)[1]
    assert process.returncode == 128 + number
    assert "Traceback" not in err
    assert len(batches.whole(tmp_path)) < len(names)
    assert not list(tmp_path.glob("out/.*"))


def test_a_closed_pipe(flight: Path, tmp_path: Path) -> None:
    done = run(tmp_path, ["bash", "-c", f"{PROGRAM} filter flight.csv -o - | head -1; echo ${{PIPESTATUS[0]}} >&2"])
    assert done.stdout.startswith("row,time_s")
    assert "Traceback" not in done.stderr
    assert "Broken" not in done.stderr
