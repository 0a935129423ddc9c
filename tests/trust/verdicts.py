"""The table of verdicts: of logs with a fault, how many are reported, and how many are called consistent and are wrong.

Wrong is as in `runs`. `python -m tests.trust.verdicts 0-5 held -v` tells the runs of some seeds and classes one by one.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from tests.trust import faulty_logs, runs, tables
from tests.trust.runs import Run

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


def run(name: str, seed: int) -> list[Run]:
    """A log filtered and smoothed."""
    return runs.run(name, seed, faulty_logs.make(name, seed))


def tally(name: str, judged: Iterable[Run]) -> Tally:
    """The counts of a class."""
    each = list(judged)
    return Tally(name, len(each), sum(run.reported for run in each), sum(run.confident for run in each))


def table(seeds: int = SEEDS, names: Iterable[str] = faulty_logs.CLASSES) -> list[Tally]:
    """The counts of all classes."""
    return [tally(name, (each for seed in range(seeds) for each in run(name, seed))) for name in names]


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


def main() -> None:
    """Print the counts."""
    given = tables.arguments(__doc__, faulty_logs.CLASSES)
    found = list(tables.spread(run, [(name, seed) for name in given.names for seed in given.seeds], given))
    tables.show(runs.HEADER, (runs.row(name, (r for r in found if r.name == name)) for name in given.names))


if __name__ == "__main__":
    main()
