"""`make trust`: reliability and security as one table."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from tests.faults import batches
from tests.fuzz import mutation
from tests.trust import corpus, elsewhere, long_runs, streams, verdicts
from tests.trust.attacks import running

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
    judged = verdicts.table()
    tracebacks = counts["wrong"] + counts["known"] + len(wrong)
    for line in filter(
        None, [*lines, *taken, *wrong, *lost, *astray, faults.failures, plain.failures, *verdicts.too_many(judged)]
    ):
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
        *verdicts.rows(judged),
        ("tests of the kernels with the compiler off", plain.passed + plain.failed),
        ("of these failed", plain.failed),
    ):
        print(f"| {row[0]} | {row[1]} |")
    right = faults.all_passed and plain.all_passed and endless == "ok" and not verdicts.too_many(judged)
    return int(bool(counts["wrong"] or taken or wrong or lost or astray or diverged.unreported or not right))


def _kills() -> tuple[int, list[str]]:
    with tempfile.TemporaryDirectory() as directory:
        names = batches.fill(Path(directory))
        try:
            return len(batches.killed(Path(directory), names, KILLS)), []
        except AssertionError as error:
            return KILLS, [str(error)]


if __name__ == "__main__":
    sys.exit(main())
