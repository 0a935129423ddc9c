"""The table of verdicts: of logs with a fault, how many are reported, and how many are called consistent and are wrong.

A run is confident and wrong when its verdict is consistent while more than MOST_OFF of its rows have an axis that is
more than OFF published sigmas away from the truth.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from ftproc import pipeline
from ftproc.quality.verdict import CONSISTENT
from ftproc.records import FloatArray, Trajectory
from ftproc.settings import FilterSettings
from tests.trust import faulty_logs

OFF, MOST_OFF = 5.0, 0.01
SEEDS = 20


class Tally(NamedTuple):
    """Of a class of fault: runs (filter and smoother), those of which the summary names the fault or which
    are not called consistent, and those confident and wrong."""

    name: str
    runs: int
    detected: int
    wrong: int


def is_far(found: Trajectory, position_m: FloatArray) -> bool:
    """Whether the estimate lies far outside its sigmas. position_m: (n, 3) truth."""
    off = np.abs(found.state[:, :3] - position_m) / found.sigma[:, :3]
    return bool(np.mean((off > OFF).any(1)) > MOST_OFF)


def runs(name: str, seeds: Iterable[int]) -> Iterator[tuple[int, bool, faulty_logs.Faulty, Trajectory]]:
    """Seed, whether smoothed, log and result of the runs of a class."""
    for seed in seeds:
        faulty = faulty_logs.make(name, seed)
        for smooth in (False, True):
            yield seed, smooth, faulty, pipeline.filter_log(faulty.log, FilterSettings(smooth=smooth))


def tally(name: str, seeds: Iterable[int], told: bool = False) -> Tally:
    """The counts of a class; told: each run that is wrong is named on standard error."""
    count, detected, wrong = 0, 0, 0
    for seed, smooth, faulty, found in runs(name, seeds):
        summary = found.metadata["summary"]
        trust = summary["trust"]
        consistent, far = trust["verdict"] == CONSISTENT, is_far(found, faulty.position_m)
        named = not consistent or any(part["held"] + part["interpolated"] for part in summary["components"].values())
        count, detected, wrong = count + 1, detected + named, wrong + (consistent and far)
        if told:
            way, mark = "smooth" if smooth else "filter", "WRONG" if consistent and far else "far" if far else ""
            reasons = "; ".join(trust["reasons"])
            reasons += str({k: (p["held"], p["interpolated"]) for k, p in summary["components"].items()})
            print(f"{name} {seed} {way}: {faulty.what} -> {trust['verdict']} {mark} {reasons}", file=sys.stderr)
    return Tally(name, count, detected, wrong)


def table(seeds: int = SEEDS, names: Iterable[str] = faulty_logs.CLASSES, told: bool = False) -> list[Tally]:
    """The counts of all classes."""
    return [tally(name, range(seeds), told) for name in names]


if __name__ == "__main__":
    first, last = (int(word) for word in sys.argv[1].split("-"))
    for name in sys.argv[2:] or faulty_logs.CLASSES:
        print(*tally(name, range(first, last), told=True), sep=" | ", flush=True)
