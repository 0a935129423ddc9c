"""The table of verdicts: of logs with a fault, how many are reported, and how many are called consistent and are wrong.

A run is confident and wrong when its verdict is consistent while more than MOST_OFF of its rows have an axis that is
more than OFF published sigmas away from the truth. `python -m tests.trust.verdicts 0-5 held` tells the runs of some
seeds and classes one by one.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from ftproc import pipeline
from ftproc.quality.verdict import CONSISTENT
from ftproc.records import FloatArray, Trajectory
from ftproc.settings import FilterSettings
from tests.trust import faulty_logs

OFF, MOST_OFF = 5.0, 0.01
SEEDS = 20
LEAST_CONSISTENT = 0.9  # of the logs without a fault
#: Share of the runs of a class that may be confident and wrong; of those not named MOST_WRONG.
BOUNDS = {"clock jump": 0.05, "held": 0.02, "resampled": 0.02, "one-sided errors": 0.05}
MOST_WRONG = 0.01


class Tally(NamedTuple):
    """Of a class of fault: runs (filter and smoother), those of which the summary names the fault or which are not
    called consistent, and those confident and wrong."""

    name: str
    runs: int
    reported: int
    wrong: int


class Judged(NamedTuple):
    """A run and what is said of it. reported: it is not called consistent, or readings that were not measured are
    named. far: the truth lies far outside the sigmas."""

    seed: int
    smooth: bool
    what: str
    trust: dict[str, Any]
    reported: bool
    far: bool

    @property
    def wrong(self) -> bool:
        return self.far and self.trust["verdict"] == CONSISTENT


def is_far(found: Trajectory, position_m: FloatArray) -> bool:
    """Whether the estimate lies far outside its sigmas. position_m: (n, 3) truth."""
    off = np.abs(found.state[:, :3] - position_m) / found.sigma[:, :3]
    return bool(np.mean((off > OFF).any(1)) > MOST_OFF)


def runs(name: str, seeds: Iterable[int]) -> Iterator[Judged]:
    """The runs of a class."""
    for seed in seeds:
        faulty = faulty_logs.make(name, seed)
        for smooth in (False, True):
            found = pipeline.filter_log(faulty.log, FilterSettings(smooth=smooth))
            summary = found.metadata["summary"]
            copied = sum(part["held"] + part["interpolated"] for part in summary["components"].values())
            reported = bool(copied) or summary["trust"]["verdict"] != CONSISTENT
            yield Judged(seed, smooth, faulty.what, summary["trust"], reported, is_far(found, faulty.position_m))


def tally(name: str, judged: Iterable[Judged]) -> Tally:
    """The counts of a class."""
    each = list(judged)
    return Tally(name, len(each), sum(run.reported for run in each), sum(run.wrong for run in each))


def table(seeds: int = SEEDS, names: Iterable[str] = faulty_logs.CLASSES) -> list[Tally]:
    """The counts of all classes."""
    return [tally(name, runs(name, range(seeds))) for name in names]


def rows(judged: Iterable[Tally]) -> Iterator[tuple[str, str]]:
    """What and count of the table of `make trust`."""
    for each in judged:
        if each.name in faulty_logs.SOUND:
            yield f"{each.name} logs: runs, called consistent", f"{each.runs}, {each.runs - each.reported}"
        else:
            counts = f"{each.runs}, {each.reported}, {each.wrong}"
            yield f"logs with {each.name}: runs, reported, confident and wrong", counts


def too_many(judged: Iterable[Tally]) -> list[str]:
    """The classes beyond their bounds."""
    found = []
    for each in judged:
        if each.wrong > BOUNDS.get(each.name, MOST_WRONG) * each.runs:
            found.append(f"{each.name}: {each.wrong} of {each.runs} runs are confident and wrong")
        if each.name in faulty_logs.SOUND and each.runs - each.reported < LEAST_CONSISTENT * each.runs:
            found.append(f"{each.name}: {each.reported} of {each.runs} runs without a fault are not called consistent")
    return found


def main(first: int, last: int, names: Iterable[str]) -> None:
    """Print the runs one by one on standard error, and the counts."""
    for name in names:
        judged = []
        for run in runs(name, range(first, last)):
            judged.append(run)
            way, mark = "smooth" if run.smooth else "filter", "WRONG" if run.wrong else "far" if run.far else ""
            verdict = f"{run.trust['verdict']} {mark} {'; '.join(run.trust['reasons'])}"
            print(f"{name} {run.seed} {way}: {run.what} -> {verdict}", file=sys.stderr)
        print(*tally(name, judged), sep=" | ", flush=True)


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1].split("-")), sys.argv[2:] or faulty_logs.CLASSES)
