"""Single cells of columns that came out as text: which one is no number, and the sentence that says so."""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from ftproc.errors import InputError
from ftproc.files.reading.csvtext import MISSING_WORDS, row_named

if TYPE_CHECKING:
    import pyarrow as pa

_POINT = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_COMMA = re.compile(r"[+-]?(\d+,?\d*|,\d+)([eE][+-]?\d+)?", re.ASCII)

#: For a cell: None when it is all right, else what it is not and (perhaps empty) the cure.
Check = Callable[[str], tuple[str, str] | None]


class Origin(NamedTuple):
    """Where a column comes from, for messages. expected: such as `a range in km`. cure: of a bad cell."""

    source: str
    column: str
    expected: str
    decimal_comma: bool = False
    cure: str = "Correct the cell, or leave it empty if there was no reading."

    def bad(self, row: int, text: str, why: str, cure: str = "") -> InputError:
        """The error for the cell in 0-based data row `row`."""
        return InputError(
            f'{self.source}: {row_named(row)}, column "{self.column}": '
            f'"{" ".join(text[:60].split())}" is not {why}; expected {self.expected}. {cure or self.cure}'
        )


def as_text(column: pa.ChunkedArray) -> pa.ChunkedArray:
    """The column as trimmed strings, null where missing."""
    import pyarrow as pa
    import pyarrow.compute as pc

    types, kind = pa.types, column.type
    if types.is_dictionary(kind):
        column = column.cast(kind.value_type)
    if types.is_binary(column.type) or types.is_large_binary(column.type):
        try:
            column = column.cast(pa.string())
        except pa.ArrowInvalid:  # not UTF-8; the replacement character stands for what is not
            cells = [None if cell is None else cell.decode("utf-8", "replace") for cell in column.to_pylist()]
            column = pa.chunked_array([pa.array(cells, pa.string())])
    elif not (types.is_string(column.type) or types.is_large_string(column.type)):
        cells = [None if cell is None else str(cell) for cell in _in_python(column)]
        column = pa.chunked_array([pa.array(cells, pa.string())])
    trimmed = pc.utf8_trim_whitespace(column)
    return pc.if_else(pc.is_in(trimmed, pa.array(MISSING_WORDS, trimmed.type)), None, trimmed)


def _in_python(column: pa.ChunkedArray) -> list[object]:
    import pyarrow as pa

    try:
        return list(column.to_pylist())
    except (OverflowError, ValueError):  # a time beyond Python's calendar
        ticks = column.cast(pa.int64()).to_pylist()
        return [None if tick is None else f"{tick} as {column.type}" for tick in ticks]


def has_comma(text: pa.ChunkedArray) -> bool:
    """Whether any cell has a comma in it."""
    import pyarrow.compute as pc

    return bool(pc.any(pc.match_substring(text, ",")).as_py())


def instant(text: str) -> str | None:
    """`zone` or `no zone` for an ISO-8601 date and time, None for other text."""
    try:
        moment = dt.datetime.fromisoformat(text.replace(",", "."))
    except ValueError:
        return None
    return "no zone" if moment.tzinfo is None else "zone"


def not_a_number(text: pa.ChunkedArray, decimal_comma: bool) -> Check:
    """The check that each cell of `text` must pass; decimal_comma: whether the file may have them."""
    commas = decimal_comma and has_comma(text)

    def check(cell: str) -> tuple[str, str] | None:
        if (_COMMA if commas else _POINT).fullmatch(cell) or cell.lower().lstrip("+-") in ("inf", "infinity"):
            return None
        if commas and _POINT.fullmatch(cell):
            return "a number with a decimal comma, as others of its column", "Write all alike."
        if _COMMA.fullmatch(cell):
            return "a number with a decimal point", "Write points, or separate the cells with semicolons."
        if re.match(r"[+-]?\d{1,2}:\d{2}", cell):
            return "a number", "A time of day needs its date: 2024-05-31T12:34:56.789Z, or count seconds."
        return "a number", ""

    return check


def first_bad(text: pa.ChunkedArray, origin: Origin, check: Check) -> InputError:
    """The error for the first cell that does not pass `check`."""
    for row, cell in enumerate(text.to_pylist()):
        found = None if cell is None else check(cell)
        if found is not None:
            return origin.bad(row, cell, *found)
    return InputError(f'{origin.source}: column "{origin.column}" cannot be read; expected {origin.expected}.')
