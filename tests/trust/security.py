"""What becomes of bad files, attacks, floods, kills and other faults from outside: the first half of `make trust`."""

from __future__ import annotations

import tempfile
from pathlib import Path

from tests.faults import batches
from tests.fuzz import mutation
from tests.trust import corpus, elsewhere, streams
from tests.trust.attacks import running
from tests.trust.tables import Counted

KILLS, FUZZ_S = 50, 60.0


def run() -> Counted:
    """Try them all."""
    counts, lines = corpus.run()
    attacked, taken = running.run()
    fuzzed, wrong = mutation.run(FUZZ_S)
    kills, lost = _kills()
    streamed, astray = streams.run()
    faults = elsewhere.run(*elsewhere.FAULTS, FTPROC_TRUST="1")
    plain = elsewhere.run(*elsewhere.PLAIN, FTPROC_KERNELS="python")
    rows = [
        ("bad files tried", counts.total()),
        ("refused in a plain sentence", counts["refused"]),
        ("read correctly all the same", counts["right"]),
        ("attacks on readers, each in a process with limits", attacked),
        ("of these over 10 s or 1.5 GB, or not a result or a plain sentence", len(taken)),
        ("mutated files tried", fuzzed),
        ("tracebacks, warnings, hangs, wrong results", counts["wrong"] + counts["known"] + len(wrong)),
        ("streams followed: far and repeated times, floods, broken lines", streamed),
        ("of these not survived", len(astray)),
        ("runs killed at a random moment", kills),
        ("outputs lost or half-written", len(lost)),
        ("other faults injected", faults.passed + faults.failed),
        ("of these not survived", faults.failed),
        ("tests of the kernels with the compiler off", plain.passed + plain.failed),
        ("of these failed", plain.failed),
    ]
    failures = [*(line for line in lines if line.startswith("wrong")), *taken, *wrong, *lost, *astray]
    failures += [tests.failures or "no tests" for tests in (faults, plain) if not tests.all_passed]
    return Counted(rows, failures)


def _kills() -> tuple[int, list[str]]:
    with tempfile.TemporaryDirectory() as directory:
        names = batches.fill(Path(directory))
        try:
            return len(batches.killed(Path(directory), names, KILLS)), []
        except AssertionError as error:
            return KILLS, [str(error)]
