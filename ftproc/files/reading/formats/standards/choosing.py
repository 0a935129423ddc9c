"""Which of several targets or stations of a file is meant, where its standard says which column tells them apart."""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
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
    column, found = told_apart(header, extract, kept)
    if not found:
        return
    if column == header.stated.target:
        raise InputError(
            f'{header.source}: it holds {len(found)} targets by column "{column}" ({shown(found)}). Say --target '
            f"{quoted(f'{column}={found[0]}')} for one, or leave the value out for a trajectory of each."
        )
    one = "NAME" if in_turns(header, column, kept) else found[0]
    raise InputError(
        f'{header.source}: it holds the readings of {len(found)} stations by column "{column}" '
        f"({shown(found)}), which no one trajectory can mix. Say --where {quoted(f'{column}={one}')} for "
        f"one; for all, ftproc filter --fuse --write-config {quoted(header.source)} prints a range file."
    )


def told_apart(header: TableHeader, extract: Extract, kept: IntArray | None) -> tuple[str, list[str]]:
    """The column by which the standard of a file tells several targets apart, or the stations of one target, and its
    values in the rows that are kept, the first first; no values if there is one of each."""
    target = header.stated.target if extract.target == "" else ""
    for column in filter(None, (target, header.stated.station)):
        found = values(header, column, kept)
        if len(found) > 1:
            return column, found
    return "", []


def in_turns(header: TableHeader, column: str, kept: IntArray | None) -> bool:
    """Whether the rows of a column change their value so often that its stations measure at one time."""
    cells = _cells(header, column, kept)
    return bool(sum(map(operator.ne, cells, cells[1:])) > _IN_TURNS * len(cells))


def conditions(header: TableHeader) -> list[Condition]:
    """The conditions that pick the rows of each station of a file; none for a file of one."""
    name = header.stated.station
    found = values(header, name, None) if name else []
    return [Condition(name, "=", value) for value in found] if len(found) > 1 else []


def values(header: TableHeader, column: str, kept: IntArray | None) -> list[str]:
    """The values of a column, the first first."""
    return list(dict.fromkeys(_cells(header, column, kept)))


def _cells(header: TableHeader, column: str, kept: IntArray | None) -> list[str]:
    """The cells of a column that hold something."""
    cells: pa.ChunkedArray = header.load([], [header.names.index(column)]).column(0)
    return [cell for cell in rows.cells(cells if kept is None else cells.take(kept)).tolist() if cell]


def shown(found: Sequence[str]) -> str:
    """The first of some values."""
    return ", ".join(found[:_SHOWN]) + (", ..." if len(found) > _SHOWN else "")
