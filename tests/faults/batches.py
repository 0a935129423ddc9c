"""A batch of flights as a user runs it, to be disturbed from outside, and checks of its outputs."""

from __future__ import annotations

import os
import random
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from ftproc.files.reading import logs, trajectories
from ftproc.files.writing.flights import write_log
from ftproc.simulation import simulate

PROGRAM = str(Path(sys.prefix) / "bin" / "ftproc")
FLIGHTS = 6


def fill(directory: Path, flights: int = FLIGHTS) -> list[str]:
    """Logs of 30 s at 10 Hz; their names."""
    names = [f"{number}.csv" for number in range(flights)]
    for number, name in enumerate(names):
        write_log(simulate("manoeuvre", duration_s=30.0, seed=number).log, directory / name)
    return names


def command(names: list[str], *more: str) -> list[str]:
    """Filter them to `out`."""
    return [PROGRAM, "filter", *names, "-o", "out/", "--summary", "none", *more]


def run(directory: Path, args: list[str], **options: Any) -> subprocess.CompletedProcess[str]:
    """To its end."""
    return subprocess.run(args, cwd=directory, capture_output=True, text=True, timeout=300, **options)


def whole(directory: Path) -> list[str]:
    """The trajectories in `out`. AssertionError unless each is whole and has its sidecar."""
    found = sorted(directory.glob("out/*.csv"))
    for path in found:
        read = trajectories.read(path)
        assert len(read) == len(logs.read(directory / f"{path.name.partition('.')[0]}.csv")), f"{path} is not whole"
        assert read.metadata, f"{path} has no sidecar"
    return [path.name for path in found]


@cache
def duration_s(directory: Path) -> float:
    """Duration of the undisturbed batch."""
    started = time.monotonic()
    assert run(directory, command([path.name for path in sorted(directory.glob("?.csv"))])).returncode == 0
    return time.monotonic() - started


def killed(directory: Path, names: list[str], moments: int, seed: int = 0) -> list[int]:
    """SIGKILL at so many random moments; every fifth time the batch is then run to its end. The number of outputs after
    each kill. AssertionError when one is not whole, or the second run does not give the same bytes."""
    draw, found = random.Random(seed), []
    lasts = duration_s(directory)
    expected = {path.name: path.read_bytes() for path in directory.glob("out/*")}
    for moment in range(moments):
        for path in directory.glob("out/*"):
            path.unlink()
        more = ("--jobs", "2") if moment % 2 else ()
        process = subprocess.Popen(
            command(names, *more), cwd=directory, stderr=subprocess.DEVNULL, start_new_session=True
        )
        time.sleep(draw.uniform(0.1, 1.0) * lasts)
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        found.append(len(whole(directory)))
        if moment % 5 == 0:
            assert run(directory, command(names)).returncode == 0
            assert len(whole(directory)) == len(names)
            assert {p.name: p.read_bytes() for p in directory.glob("out/*")} == expected
    return found


def limited(kind: int, most: int) -> Callable[[], None]:
    """For `preexec_fn`: a limit of the system, RLIMIT_FSIZE or RLIMIT_AS, in bytes."""

    def limit() -> None:
        resource.setrlimit(kind, (most, most))

    return limit
