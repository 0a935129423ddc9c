"""Which rows of a file are read: those that meet conditions on their cells."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ftproc.errors import InputError, nearest
from ftproc.files.options import Condition
from ftproc.files.reading.meaning.numbers import as_text, parsed, without_text
from ftproc.files.reading.meaning.questions import listed

if TYPE_CHECKING:
    import pyarrow as pa

    from ftproc.files.reading.formats.header import TableHeader

_TESTS = {"<=": np.less_equal, ">=": np.greater_equal, "!=": np.not_equal, "=": np.equal, "<": np.less, ">": np.greater}


def position(source: str, names: list[str], name: str, option: str) -> int:
    """The position of a column named in an option, by its name or its number from 1. Raises InputError."""
    if name in names:
        return names.index(name)
    lower = [known.lower() for known in names]
    if lower.count(name.lower()) == 1:
        return lower.index(name.lower())
    if name.isdecimal() and 1 <= int(name) <= len(names):
        return int(name) - 1
    raise InputError(
        f'{source}: there is no column "{name}", which {option} names{nearest(name, names) or "."} '
        f"Its columns are: {listed(names)}."
    )


def meeting(
    header: TableHeader, conditions: Sequence[Condition], table: pa.Table, chosen: Sequence[int]
) -> NDArray[np.bool_]:
    """(n,) which rows of a table meet all conditions. chosen: where its columns are in the file. Raises InputError for
    an order among words."""
    kept = np.ones(table.num_rows, bool)
    for condition in conditions:
        index = position(header.source, header.names, condition.column, "--where")
        kept &= _mask(header.source, condition, table.column(chosen.index(index)), header.decimal_comma)
    return kept


def _mask(source: str, condition: Condition, column: pa.ChunkedArray, decimal_comma: bool) -> NDArray[np.bool_]:
    values = without_text(column)
    text = as_text(column)
    if values is None:
        values = parsed(text, decimal_comma)
    wanted = _number(condition.value)
    test = _TESTS[condition.test]
    if values is not None and wanted is not None:
        mask: NDArray[np.bool_] = test(np.where(np.isnan(values), np.nan, values), wanted)
        return mask
    if condition.test not in ("=", "!="):
        raise InputError(
            f'{source}: "{condition.column}{condition.test}{condition.value}" compares words by size; '
            f'use = or != for column "{condition.column}".'
        )
    same = np.array([cell == condition.value for cell in text.to_pylist()], bool)
    return same if condition.test == "=" else ~same


def cells(column: pa.ChunkedArray) -> NDArray[np.str_]:
    """The cells as text, "" where missing; whole numbers without a fraction."""
    values = without_text(column)
    if values is not None and np.array_equal(values[np.isfinite(values)], np.round(values[np.isfinite(values)])):
        return np.array(["" if np.isnan(value) else f"{value:.0f}" for value in values])
    return np.array([cell or "" for cell in as_text(column).to_pylist()], dtype=str)


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
