"""The table of verdicts on easy flights: which faults are reported, and which runs are confident and wrong.

    python -m tests.trust.verdicts 0-5 held -v     seeds 0 to 5 of a class, a line for each run

Reported, wrong, missed and false alarms are as in `runs`.
"""

from __future__ import annotations

from collections.abc import Iterator

from tests.trust import faulty_logs, runs, tables
from tests.trust.runs import Run
from tests.trust.tables import Bound

SEEDS = 20
MOST_CONFIDENT = 0.01  # of the runs of a class that has no bound of its own
#: The share of runs that may be confident and wrong; of logs without a fault, that may be reported.
BOUNDS = {
    **{name: Bound(confident=MOST_CONFIDENT) for name in faulty_logs.CLASSES},
    **{name: Bound(confident=MOST_CONFIDENT, reported=0.1) for name in faulty_logs.SOUND},
    "step of 10 sigma": Bound(confident=0.1),
    "several steps": Bound(confident=0.03),
    "clock jump": Bound(confident=0.05),
    "held": Bound(confident=0.02),
    "resampled": Bound(confident=0.02),
    "one-sided errors": Bound(confident=0.05),
}


def run(name: str, seed: int) -> list[Run]:
    """A log filtered and smoothed."""
    return runs.run(name, seed, faulty_logs.make(name, seed))


def table(found: list[Run]) -> Iterator[tuple[str, ...]]:
    """A row for each class that was run."""
    for name in faulty_logs.CLASSES:
        if each := runs.of(name, found):
            yield runs.row(name, each)


def main() -> None:
    """Print the table."""
    given = tables.arguments(__doc__, faulty_logs.CLASSES)
    found = list(tables.spread(run, given.jobs, given))
    tables.show(runs.HEADER, table(found))


if __name__ == "__main__":
    main()
