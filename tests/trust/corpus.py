"""All cases, and what became of them. New kinds of files join here: a module with `all_cases`."""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from tests.trust import bad_files, bad_logs, bad_models, bad_stations, bad_times, bad_truths
from tests.trust.cases import Case, judge

TABLES = (bad_logs, bad_times, bad_files, bad_models, bad_truths, bad_stations)


def all_cases() -> Iterator[Case]:
    """Every case of every table."""
    for table in TABLES:
        yield from table.all_cases()


def run() -> tuple[Counter[str], list[str]]:
    """How many were refused, right, known to be wrong, or wrong; and a line for each that is wrong."""
    counts: Counter[str] = Counter()
    lines = []
    for case in all_cases():
        with tempfile.TemporaryDirectory() as directory:
            try:
                verdict = judge(case, Path(directory))
            except Exception as error:
                verdict = "known" if case.known else "wrong"
                lines.append(f"{verdict}: {case.kind} {case.name}: {case.known or f'{type(error).__name__}: {error}'}")
            counts[verdict] += 1
    return counts, lines
