"""Medians of interleaved repetitions, of calls and of whole processes. As a script: run a command, print what it took.

A process's peak memory is asked of a small one that starts it: a child counts what its parent held when it began.
"""

from __future__ import annotations

import os
import sys
import time


def _child(command: list[str]) -> None:
    """Print the seconds, the peak memory in kB and the exit status of a command whose output goes nowhere."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    began = time.perf_counter()
    files = [(os.POSIX_SPAWN_DUP2, nowhere, 0), (os.POSIX_SPAWN_DUP2, nowhere, 1)]
    process = os.posix_spawn(command[0], command, os.environ, file_actions=files)
    _, status, used = os.wait4(process, 0)
    print(time.perf_counter() - began, used.ru_maxrss, os.waitstatus_to_exitcode(status))


if __name__ == "__main__":
    _child(sys.argv[1:])
    sys.exit()

import subprocess  # noqa: E402
from collections.abc import Callable, Mapping, Sequence  # noqa: E402
from typing import NamedTuple  # noqa: E402

import numpy as np  # noqa: E402


class Taken(NamedTuple):
    """Medians over the repetitions; peak_mb is NaN for calls in this process."""

    seconds: float
    peak_mb: float = np.nan


def calls(named: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, Taken]:
    """Every call in turn, `rounds` times after one that does not count."""
    taken: dict[str, list[float]] = {name: [] for name in named}
    for turn in range(rounds + 1):
        for name, call in named.items():
            began = time.perf_counter()
            call()
            if turn:
                taken[name].append(time.perf_counter() - began)
    return {name: Taken(float(np.median(seconds))) for name, seconds in taken.items()}


def processes(named: Mapping[str, Sequence[str]], rounds: int) -> dict[str, Taken]:
    """The same for commands, whose first word is the path of a program."""
    taken: dict[str, list[tuple[float, float]]] = {name: [] for name in named}
    for turn in range(rounds + 1):
        for name, command in named.items():
            found = _process(command)
            if turn or rounds == 0:
                taken[name].append(found)
    return {
        name: Taken(*(float(np.median(part)) for part in zip(*found, strict=True))) for name, found in taken.items()
    }


def _process(command: Sequence[str]) -> tuple[float, float]:
    starter = [sys.executable, "-S", __file__, *command]
    # An installed package has its byte code beside it; a shell that forbids it would have ours compiled at every start.
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    done = subprocess.run(starter, check=True, stdout=subprocess.PIPE, text=True, env=environment)
    seconds, peak_kb, status = done.stdout.split()
    if status != "0":
        raise RuntimeError(f"{' '.join(command)} ended with {status}")
    return float(seconds), float(peak_kb) * 1024 / 1e6
