"""What becomes of faults in the readings, long runs and next steps: the second half of `make trust`."""

from __future__ import annotations

from tests.trust import faulty_logs, fused_faults, hard, long_runs, next_steps, runs, tables, verdicts
from tests.trust.tables import Counted, Given

COUNTS = "runs, reported, wrong, confident and wrong"
FLIGHTS, SAMPLES = 200, 10_000_000


def run() -> Counted:
    """Try them all."""
    diverged = long_runs.many(FLIGHTS)
    endless = long_runs.endless(SAMPLES)
    judged, broken = _faults()
    steps = list(tables.spread(next_steps.run, [(cause,) for cause in next_steps.CASES], Given(range(1), ())))
    deceiving = sum(each.deceives for each in steps)
    rows = [
        ("flights with 20 % outliers and patches", diverged.flights),
        ("of these diverged (20 sigma for 2 s)", diverged.diverged),
        ("divergences called consistent", diverged.unreported),
        (f"{SAMPLES:,} samples, sigmas finite and positive, as after a late start", endless),
        *judged,
        ("runs that are suspect, each for a cause of its own", len(steps)),
        ("of these whose first next step helps", sum(each.helps for each in steps)),
        ("of these that it makes wrong and consistent", deceiving),
    ]
    failures = [
        *broken,
        *[f"{diverged.unreported} divergences are called consistent"] * bool(diverged.unreported),
        *[f"{SAMPLES:,} samples: {endless}"] * (endless != "ok"),
        *[f"{deceiving} next steps deceive"] * bool(deceiving),
    ]
    return Counted(rows, failures)


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
