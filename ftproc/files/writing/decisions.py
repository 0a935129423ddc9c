"""Decisions on readings out, in the form in which `files.decisions` reads them."""

from __future__ import annotations

import csv
import io
from collections.abc import Collection, Sequence

from ftproc.files.decisions import COLUMNS, as_dict
from ftproc.files.layout import Target
from ftproc.files.writing import atomic
from ftproc.files.writing.csvtext import no_formula
from ftproc.records import ENDS, Line


def write(lines: Sequence[Line], target: Target) -> None:
    """Write a file of these lines, complete or not at all. Raises OutputError."""
    with atomic.replacing(target) as stream:
        stream.write(text(lines).encode())


def text(lines: Sequence[Line], more: Collection[str] = ()) -> str:
    """The file of these lines, with the columns that they need, and more."""
    ends = {end for line in lines for end in line.ends} or set(ENDS[0])
    station = {"station"} if any(line.station for line in lines) else set()
    found = io.StringIO()
    named = [column for column in COLUMNS if column in {"component", "use", "reason", *ends, *station, *more}]
    writer = csv.DictWriter(found, named, restval="", extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    for line in lines:
        cells = as_dict(line)
        writer.writerow({**cells, **{name: no_formula(cells.get(name, "")) for name in ("station", "reason")}})
    return found.getvalue()
