"""Which of several targets or stations of a file is meant, where its standard says which column tells them apart."""

from __future__ import annotations

import operator
from collections.abc import Mapping
from typing import TYPE_CHECKING

from ftproc.errors import InputError, quoted
from ftproc.files.options import Condition, Extract
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.meaning import rows
from ftproc.records import IntArray

if TYPE_CHECKING:
    import pyarrow as pa

_SHOWN = 6  # values in a message
_IN_TURNS = 0.25  # of the rows are of another station than the row before, where stations measure at one time


def refuse_open(header: TableHeader, stated_by_user: Mapping[str, object]) -> None:
    """Raise InputError for what the standard leaves open and the user does not state."""
    for quantity, question in header.stated.questions.items():
        if quantity not in stated_by_user:
            raise InputError(f"{header.source}: {question}")


def refuse_several(header: TableHeader, extract: Extract, kept: IntArray | None) -> None:
    """Raise InputError, a question, if the rows that are kept (None: all) are of several targets or stations."""
    stated = header.stated
    if stated.target and extract.target == "":
        values = _values(header, stated.target, kept)
        if len(values) > 1:
            say = f"--target {quoted(f'{stated.target}={values[0]}')}"
            raise InputError(
                f'{header.source}: it holds {len(values)} targets by column "{stated.target}" ({_shown(values)}). Say '
                f"{say} for one, or leave the value out for a trajectory of each."
            )
    cells = _cells(header, stated.station, kept) if stated.station else []
    values = list(dict.fromkeys(cells))
    if len(values) > 1:
        in_turns = sum(map(operator.ne, cells, cells[1:])) > _IN_TURNS * len(cells)
        one = "NAME" if in_turns else values[0]
        raise InputError(
            f'{header.source}: it holds the readings of {len(values)} stations by column "{stated.station}" '
            f"({_shown(values)}), which no one trajectory can mix. Say --where {quoted(f'{stated.station}={one}')} for "
            f"one; for all, ftproc filter --fuse --write-config {quoted(header.source)} prints a range file."
        )


def conditions(header: TableHeader) -> list[Condition]:
    """The conditions that pick the rows of each station of a file; none for a file of one."""
    name = header.stated.station
    values = _values(header, name, None) if name else []
    return [Condition(name, "=", value) for value in values] if len(values) > 1 else []


def _values(header: TableHeader, column: str, kept: IntArray | None) -> list[str]:
    """The values of a column, the first first."""
    return list(dict.fromkeys(_cells(header, column, kept)))


def _cells(header: TableHeader, column: str, kept: IntArray | None) -> list[str]:
    """The cells of a column that hold something."""
    cells: pa.ChunkedArray = header.load([], [header.names.index(column)]).column(0)
    return [cell for cell in rows.cells(cells if kept is None else cells.take(kept)).tolist() if cell]


def _shown(values: list[str]) -> str:
    return ", ".join(values[:_SHOWN]) + (", ..." if len(values) > _SHOWN else "")
