"""`make trust`: reliability and security as one table."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from tests.faults import batches
from tests.fuzz import mutation
from tests.trust import (
    corpus,
    elsewhere,
    faulty_logs,
    fused_faults,
    hard,
    long_runs,
    next_steps,
    runs,
    streams,
    tables,
    verdicts,
)  # fmt: skip
from tests.trust.attacks import running
from tests.trust.tables import Given

COUNTS = "runs, reported, wrong, confident and wrong"
KILLS, FLIGHTS, SAMPLES, FUZZ_S = 50, 200, 10_000_000, 60.0


def main() -> int:
    """Print the table; 1 when anything is wrong."""
    counts, lines = corpus.run()
    tried = counts.total()
    attacked, taken = running.run()
    fuzzed, wrong = mutation.run(FUZZ_S)
    kills, lost = _kills()
    streamed, astray = streams.run()
    faults = elsewhere.run(*elsewhere.FAULTS, FTPROC_TRUST="1")
    plain = elsewhere.run(*elsewhere.PLAIN, FTPROC_KERNELS="python")
    diverged = long_runs.many(FLIGHTS)
    endless = long_runs.endless(SAMPLES)
    judged, broken = _faults()
    steps = list(tables.spread(next_steps.run, [(cause,) for cause in next_steps.CASES], Given(range(1), ())))
    helpful, deceiving = sum(each.helps for each in steps), sum(each.deceives for each in steps)
    tracebacks = counts["wrong"] + counts["known"] + len(wrong)
    for line in filter(None, [*lines, *taken, *wrong, *lost, *astray, faults.failures, plain.failures, *broken]):
        print(line, file=sys.stderr)
    for row in (
        ("what", "count"),
        ("---", "---"),
        ("bad files tried", tried),
        ("refused in a plain sentence", counts["refused"]),
        ("read correctly all the same", counts["right"]),
        ("attacks on readers, each in a process with limits", attacked),
        ("of these over 10 s or 1.5 GB, or not a result or a plain sentence", len(taken)),
        ("mutated files tried", fuzzed),
        ("tracebacks, warnings, hangs, wrong results", tracebacks),
        ("streams followed: far and repeated times, floods, broken lines", streamed),
        ("of these not survived", len(astray)),
        ("runs killed at a random moment", kills),
        ("outputs lost or half-written", len(lost)),
        ("other faults injected", faults.passed + faults.failed),
        ("of these not survived", faults.failed),
        ("flights with 20 % outliers and patches", diverged.flights),
        ("of these diverged (20 sigma for 2 s)", diverged.diverged),
        ("divergences called consistent", diverged.unreported),
        (f"{SAMPLES:,} samples, sigmas finite and positive, as after a late start", endless),
        *judged,
        ("runs that are suspect, each for a cause of its own", len(steps)),
        ("of these whose first next step helps", helpful),
        ("of these that it makes wrong and consistent", deceiving),
        ("tests of the kernels with the compiler off", plain.passed + plain.failed),
        ("of these failed", plain.failed),
    ):
        print(f"| {row[0]} | {row[1]} |")
    right = faults.all_passed and plain.all_passed and endless == "ok" and not broken
    bad = (counts["wrong"], taken, wrong, lost, astray, diverged.unreported, deceiving)
    return int(any(bad) or not right)


def _faults() -> tuple[list[tuple[str, str]], list[str]]:
    """The rows of what becomes of faults on easy, hard and fused flights, and the bounds that are broken."""
    given = Given(range(verdicts.SEEDS), faulty_logs.CLASSES)
    easy = list(tables.spread(verdicts.run, given.jobs, given))
    given = Given(range(hard.SEEDS), list(hard.CLASSES))
    difficult = list(tables.spread(hard.run, given.jobs, given))
    given = Given(range(fused_faults.SEEDS), list(fused_faults.FAULTS))
    fused = fused_faults.but_drift(list(tables.spread(fused_faults.run, fused_faults.jobs(given), given)))
    each = {
        **{name: (runs.of(name, easy), bound) for name, bound in verdicts.BOUNDS.items()},
        **{group: (hard.of_group(group, difficult), bound) for group, bound in hard.BOUNDS.items()},
        "fused": (fused, fused_faults.BOUND),
    }
    broken = [line for name, (found, bound) in each.items() for line in tables.beyond(name, found, bound)]
    counted = {
        "clean and dirty logs of easy flights": [run for run in easy if run.name in faulty_logs.SOUND],
        "logs of easy flights with a fault": [run for run in easy if run.name not in faulty_logs.SOUND],
        "clean logs of hard flights": hard.of_group("sound", difficult),
        "logs of hard flights with a hard fault": [run for run in difficult if run.name not in hard.SOUND],
        "fused flights with a fault in one station": fused,
    }
    return [(f"{what}: {COUNTS}", tables.counts(found)) for what, found in counted.items()], broken


def _kills() -> tuple[int, list[str]]:
    with tempfile.TemporaryDirectory() as directory:
        names = batches.fill(Path(directory))
        try:
            return len(batches.killed(Path(directory), names, KILLS)), []
        except AssertionError as error:
            return KILLS, [str(error)]


if __name__ == "__main__":
    sys.exit(main())
