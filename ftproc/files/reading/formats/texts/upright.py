"""Tables with a row for each quantity of each time, as databases keep them: a row for each time instead."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ftproc.errors import InputError
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.meaning.names import taken_apart
from ftproc.files.reading.meaning.numbers import as_text, parsed
from ftproc.files.reading.meaning.several import numbers_targets
from ftproc.files.units import unit_named
from ftproc.files.words import QUANTITIES

if TYPE_CHECKING:
    import pyarrow as pa

_MOST_COLUMNS, _MOST_NAMES = 12, 50
_VALUE = ("value", "val", "reading", "wert", "valeur", "valor")


def upright(header: TableHeader) -> TableHeader:
    """The table with a column for each quantity that a column of it names; other tables as they are."""
    if not 3 <= len(header.names) <= _MOST_COLUMNS or any(map(_is_reading, header.names)):
        return header
    try:
        table = header.load([], range(len(header.names)))
    except InputError:  # which is told where the columns are sought
        return header
    cells = [as_text(column) for column in table.columns]
    which = next((k for k, column in enumerate(cells) if _names_readings(column)), None)
    numeric = [k for k, column in enumerate(cells) if k != which and parsed(column, header.decimal_comma) is not None]
    called = [k for k in numeric if taken_apart(header.names[k]).stem in _VALUE] or numeric[-1:]
    if which is None or len(called) != 1:
        return header
    unit = next((k for k, column in enumerate(cells) if k != which and _are_units(column)), None)
    keys = [k for k in range(len(cells)) if k not in (which, unit, called[0])]
    times = [k for k in keys if taken_apart(header.names[k]).means("time") or numbers_targets(header.names[k])]
    keys = times or keys  # what else differs by the quantity, such as its quality, is left out
    found = _columns([column.to_pylist() for column in cells], which, called[0], unit, keys)
    return header if found is None else _with(header, keys, found)


def _with(header: TableHeader, keys: Sequence[int], found: dict[str, list[str | None]]) -> TableHeader:
    import pyarrow as pa

    columns = list(found.values())
    names = [*(header.names[k] for k in keys), *list(found)[len(keys) :]]

    def load(numeric: Sequence[int], others: Sequence[int]) -> pa.Table:
        chosen = [*numeric, *others]
        return pa.Table.from_arrays([pa.array(columns[k]) for k in chosen], names=[names[k] for k in chosen])

    form = f"{header.form}, a row for each quantity"
    apart = replace(header, names=names, load=load, blocks=lambda numeric: None, units=(), form=form)
    return replace(apart, written=lambda index: None)


def _columns(
    cells: Sequence[list[str | None]], which: int, value: int, unit: int | None, keys: Sequence[int]
) -> dict[str, list[str | None]] | None:
    """The columns of a row for each time, or for each of several rows of it, the keys by their numbers; None for too
    many columns."""
    rows: dict[tuple[str | None, ...], dict[str, str | None]] = {}
    times = Counter[tuple[str | None, ...]]()
    for row in range(len(cells[which])):
        name = cells[which][row] or ""
        name = f"{name} [{cells[unit][row]}]" if unit is not None and cells[unit][row] else name
        key = tuple(cells[k][row] for k in keys)
        rows.setdefault((*key, str(times[(*key, name)])), {})[name] = cells[value][row]
        times[(*key, name)] += 1
    names = dict.fromkeys(name for row in rows.values() for name in row)
    if len(names) > _MOST_NAMES:
        return None
    of_keys: dict[str, list[str | None]] = {str(k): [row[k] for row in rows] for k in range(len(keys))}
    return of_keys | {name: [row.get(name) for row in rows.values()] for name in names}


def _is_reading(name: str) -> bool:
    return any(map(taken_apart(name).means, QUANTITIES[1:]))


def _names_readings(column: pa.ChunkedArray) -> bool:
    """Whether the cells are names of columns, of two readings at least."""
    names = [cell for cell in column.unique().to_pylist() if cell]
    return len(names) <= _MOST_NAMES and sum(map(_is_reading, names)) > 1


def _are_units(column: pa.ChunkedArray) -> bool:
    words = [cell for cell in column.unique().to_pylist() if cell]
    return 0 < len(words) <= _MOST_NAMES and all(any(unit_named(q, word) for q in QUANTITIES) for word in words)
