"""The outcomes of a batch side by side: a row of a table for each log, a line for each, and a line of counts."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from typing import Any

from ftproc.batch.tasks import Outcome
from ftproc.errors import UsageError, encodable, printable
from ftproc.files import layout
from ftproc.files.layout import Target
from ftproc.files.writing import atomic
from ftproc.files.writing.csvtext import no_formula
from ftproc.files.writing.trajectories import plain
from ftproc.quality import verdict
from ftproc.quality.summary import counted
from ftproc.records import COMPONENTS
from ftproc.report import index

UNITS = {"range": "m", "azimuth": "rad", "elevation": "rad", "range_rate": "mps", "height": "m"}  # of noise
KINDS = (".csv", ".json", ".html")


def check(target: Target) -> None:
    """Raises UsageError for a name that does not end in one of KINDS."""
    if layout.ending(target, KINDS) is None:
        raise UsageError(f"--table {target}: end the name in {', '.join(KINDS)}.")


def write(outcomes: Sequence[Outcome], target: Target) -> None:
    """Write the table as its name says, whole or not at all. Raises OutputError."""
    kind = layout.ending(target, KINDS)
    if kind == ".html":
        index.write(entries(outcomes), target)
        return
    there = {name for each in outcomes if not each.failure for name in each.summary["components"]}
    rows = [plain(row(outcome, index.shown(there))) for outcome in outcomes]
    text = json.dumps(rows, indent=2, ensure_ascii=False) + "\n" if kind == ".json" else _csv(rows)
    with atomic.replacing(target) as stream:
        stream.write(encodable(text).encode())


def row(outcome: Outcome, channels: Sequence[str] = COMPONENTS) -> dict[str, Any]:
    """What the table says of a log. Percentages are of the readings that are not missing; of a log that failed only its
    error is known. channels: that have columns."""
    task, s, failure = outcome.task, outcome.summary, outcome.failure
    parts = s["components"] if failure is None else {}
    return {
        "log": task.log,
        "target": task.recipe.target or None,
        "method": s.get("method"),
        "verdict": index.FAILED if failure else s["trust"]["verdict"],
        "reasons": [] if failure else list(s["trust"]["reasons"]),
        "rows": s.get("rows"),
        "duration_s": s.get("duration_s"),
        **{f"outliers_{name}_percent": _percent(parts.get(name)) for name in channels},
        **{f"noise_{name}_{UNITS[name]}": parts.get(name, {}).get(f"noise_{UNITS[name]}") for name in channels},
        "output": None if failure else task.output,
        "report": None if failure else task.report,
        "error": failure.message if failure else None,
    }


def _percent(part: Any) -> float | None:
    return None if part is None else round(100 * verdict.outlier_share(part), 4)


def _csv(rows: Sequence[dict[str, Any]]) -> str:
    text = io.StringIO()
    file = csv.writer(text, lineterminator="\n")
    file.writerow(rows[0])
    file.writerows([_cell(value) for value in row.values()] for row in rows)
    return text.getvalue()


def _cell(value: Any) -> Any:
    value = "; ".join(value) if isinstance(value, list) else value
    return no_formula(value) if isinstance(value, str) else value


def entries(outcomes: Sequence[Outcome]) -> list[index.Entry]:
    """The same for a page."""
    return [
        index.Entry(o.task.log, o.task.report, o.summary, o.failure.message if o.failure else None, o.task.output)
        for o in outcomes
    ]


def line(outcome: Outcome) -> str:
    """An outcome without a failure in one line."""
    s = outcome.summary
    rates = " ".join(f"{_percent(part):.2f}" for part in s["components"].values())
    why = "; ".join(s["trust"]["reasons"])
    when = ", finished before" if outcome.before else ""
    text = f"{outcome.task.log}: {counted(s['rows'], 'row')}, {rates} % outliers{when}, {s['trust']['verdict']}"
    return printable(f"{text}{': ' if why else ''}{why} -> {outcome.task.output}")


def counts(outcomes: Sequence[Outcome]) -> str:
    """How many logs there are of each verdict, how many failed, and how many were finished before."""
    before = sum(outcome.before for outcome in outcomes)
    again = f"; {before} finished before (--redo filters them again)" if before else ""
    return index.counts([entry.level for entry in entries(outcomes)]) + again
