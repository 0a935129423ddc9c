"""Arrow columns of any type -> float64; messages that name the first cell that is not a number.

Work is done on whole columns; single cells are read only to name the wrong one.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ftproc.errors import InputError, quoted, row_named
from ftproc.files import arrow
from ftproc.files.words import MISSING_WORDS
from ftproc.records import FloatArray, IntArray

if TYPE_CHECKING:
    import pyarrow as pa

MOST_DAYS = 719_162.0  # from the year 1 to 1970
_EVENT = re.compile(r"[A-Za-z][A-Za-z ]{3,20}")
_POINT = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_COMMA = re.compile(r"[+-]?(\d+,?\d*|,\d+)([eE][+-]?\d+)?", re.ASCII)
#: Whole cells, perhaps with a unit; with a mark that may be that of thousands, or is surely that of decimals.
_IN_THREES = r"^([+-]?([1-9]\d{0,2}(\%s\d{3})+|\d{1,3})\s*[A-Za-z°]*|-?9+|\D*)$"
_DECIMAL = r"^([+-]?(\d+\%s?\d*|\%s\d+)([eE][+-]?\d+)?\s*[A-Za-z°]*|\D*)$"
_GROUPED = "^[+-]?\\d{1,3}([\u00a0\u202f\u2009 '’]\\d{3})+([.,]\\d*)?$"  # by blanks or apostrophes
_PLAIN_OR_GROUPED = "^[+-]?(\\d{1,3}([\u00a0\u202f\u2009 '’]\\d{3})+|\\d+)([.,]\\d*)?$"
_FORTRAN = r"^([+-]?\d*\.?\d*)[DdQ]([+-]?\d{1,3})$"
_MOSTLY = 0.5  # share of the cells that must have Fortran's exponents: a single one is a slip

#: For a cell: None if it is right, else what it is not and (perhaps empty) the cure.
Check = Callable[[str], tuple[str, str] | None]


class Origin(NamedTuple):
    """Where a column comes from, for messages. expected: such as `a range in km`. cure: of a bad cell."""

    source: str
    column: str
    expected: str
    decimal_comma: bool = False
    cure: str = "Correct the cell, or leave it empty if there was no reading."

    def bad_cell(self, row: int, text: str, why: str, cure: str = "") -> InputError:
        """The error for the cell in 0-based data row `row`."""
        if not cure and self.expected.startswith("a time") and _EVENT.fullmatch(text):
            cure = f"Correct the cell, or leave such rows out with --where {quoted(f'{self.column}!={text}')}."
        return InputError(
            f'{self.source}: {row_named(row)}, column "{self.column}": '
            f'"{" ".join(text[:60].split())}" is not {why}; expected {self.expected}. {cure or self.cure}'
        )

    def whole_days(self, days: FloatArray) -> IntArray:
        """(n,) days since 1970 or of a year as whole numbers, 0 where missing. Raises InputError for the first that no
        calendar has."""
        beyond = ~(np.abs(np.nan_to_num(days)) <= MOST_DAYS)
        if beyond.any():
            row = int(np.argmax(beyond))
            raise self.bad_cell(row, f"{days[row]:g} days", "within the years 1 to 9999")
        return np.floor(np.nan_to_num(days)).astype(np.int64)

    def nothing(self, what: str) -> InputError:
        """The error for a column in which every cell is missing."""
        return InputError(f'{self.source}: column "{self.column}" holds no {what}; expected {self.expected}.')

    def first_bad_cell(self, text: pa.ChunkedArray, check: Check) -> InputError:
        """The error for the first cell that does not pass `check`."""
        for row, cell in enumerate(text.to_pylist()):
            found = None if cell is None else check(cell)
            if found is not None:
                return self.bad_cell(row, cell, *found)
        return InputError(f'{self.source}: column "{self.column}" cannot be read; expected {self.expected}.')


def numbers(column: pa.ChunkedArray, origin: Origin) -> FloatArray:
    """(n,) float64, NaN where missing. Raises InputError for the first cell that is no finite number."""
    return finite(loosely(column, origin), origin)


def loosely(column: pa.ChunkedArray, origin: Origin) -> FloatArray:
    """(n,) float64, NaN where missing, perhaps infinite. Raises InputError for the first cell that is no number."""
    values = without_text(column)
    if values is None:
        text = as_text(column)
        values = parsed(text, origin.decimal_comma)
        if values is None:
            raise origin.first_bad_cell(text, not_a_number(text, origin.decimal_comma))
    return values


def finite(values: FloatArray, origin: Origin) -> FloatArray:
    """The values. Raises InputError for the first that is infinite."""
    infinite = np.isinf(values)
    if infinite.any():
        row = int(np.argmax(infinite))
        raise origin.bad_cell(row, f"{values[row]:g}", "finite")
    return values


def without_text(column: pa.ChunkedArray) -> FloatArray | None:
    """The values of a column of numbers, or None for other types."""
    import pyarrow as pa

    types, kind = pa.types, column.type
    tests = (types.is_integer, types.is_floating, types.is_decimal, types.is_null)
    if types.is_float64(kind):
        return arrow.to_numpy(column)  # a cast, even to the same type, loads more of pyarrow
    if not any(test(kind) for test in tests):
        return None
    return arrow.to_numpy(column.cast(pa.float64(), safe=False))


def parsed(text: pa.ChunkedArray, decimal_comma: bool) -> FloatArray | None:
    """The values of a column of text, or None if a cell is not a number."""
    import pyarrow as pa
    import pyarrow.compute as pc

    text = _plainly_written(text, decimal_comma)
    if decimal_comma and _has(text, ","):
        # A point in such a column would separate thousands; "?" makes it no number.
        text = pc.replace_substring(pc.replace_substring(text, ".", "?"), ",", ".")
    try:
        return arrow.to_numpy(text.cast(pa.float64()))
    except pa.ArrowInvalid:
        return None


def without_thousands(
    columns: Sequence[pa.ChunkedArray], origins: Sequence[Origin]
) -> tuple[list[pa.ChunkedArray], tuple[str, ...]]:
    """The columns of one file without the marks between thousands that look like marks of decimals, where other columns
    show that decimals have the other mark (8.201 beside 0,5); and a note on each. origins: of the first columns, which
    are numbers.

    Raises InputError where both marks stand for decimals elsewhere.
    """
    written = [k for k in range(len(origins)) if without_text(columns[k]) is None]
    texts = {k: as_text(columns[k]) for k in written}
    marks = {k: [mark for mark in ".," if _has(text, mark)] for k, text in texts.items()}
    one_mark = {k: mine[0] for k, mine in marks.items() if len(mine) == 1}
    if set(one_mark.values()) != {".", ","}:
        return list(columns), ()
    open_ones = {k: mark for k, mark in one_mark.items() if _all(texts[k], _IN_THREES % mark)}
    sure = {m for k, m in one_mark.items() if k not in open_ones and _all(texts[k], _DECIMAL % (m, m))}
    found, notes = list(columns), []
    for k, mark in open_ones.items():
        other = "," if mark == "." else "."
        if {mark, other} <= sure:
            raise InputError(
                f'{origins[k].source}: column "{origins[k].column}" may have marks of thousands or of decimals '
                f'("{_first_with(texts[k], mark)}"), and other columns have points as well as commas for decimals. '
                "Write all decimals with the same mark."
            )
        if other in sure:
            found[k] = _without(texts[k], mark)
            name, first = origins[k].column, _first_with(texts[k], mark)
            notes.append(f'"{name}" has marks between thousands ("{first}"), as the decimals of others show')
    return found, tuple(notes)


def _has(text: pa.ChunkedArray, mark: str) -> bool:
    import pyarrow.compute as pc

    return bool(pc.any(pc.match_substring(text, mark)).as_py())


def _all(text: pa.ChunkedArray, pattern: str) -> bool:
    import pyarrow.compute as pc

    return bool(pc.all(pc.match_substring_regex(text, pattern)).as_py())


def _first_with(text: pa.ChunkedArray, mark: str) -> str:
    import pyarrow.compute as pc

    return str(text[int(pc.index(pc.match_substring(text, mark), True).as_py())])


def _without(text: pa.ChunkedArray, mark: str) -> pa.ChunkedArray:
    import pyarrow.compute as pc

    return pc.replace_substring(text, mark, "")


def _plainly_written(text: pa.ChunkedArray, decimal_comma: bool) -> pa.ChunkedArray:
    """The cells with E for Fortran's D, and without marks between thousands where a cell has both marks."""
    import pyarrow.compute as pc

    def share(pattern: str) -> float:
        return float(pc.mean(pc.match_substring_regex(text, pattern)).as_py() or 0.0)

    if share(_FORTRAN) > _MOSTLY:
        text = pc.replace_substring_regex(text, _FORTRAN, r"\1E\2")
    if share(_GROUPED) and share(_PLAIN_OR_GROUPED) == 1.0:
        text = pc.replace_substring_regex(text, "[\u00a0\u202f\u2009 '’]", "")
    for mark, point in ((",", "."), (".", ","))[: 1 + decimal_comma]:
        grouped = rf"^[+-]?(\d{{1,3}}(\{mark}\d{{3}})+|\d+)(\{point}\d*)?$"
        if share(rf"^[+-]?\d{{1,3}}(\{mark}\d{{3}})+\{point}\d*$") and share(grouped) == 1.0:
            return _without(text, mark)
    return text


def as_text(column: pa.ChunkedArray) -> pa.ChunkedArray:
    """The column as trimmed strings, null where missing."""
    import pyarrow as pa
    import pyarrow.compute as pc

    types, kind = pa.types, column.type
    values = kind.value_type if types.is_dictionary(kind) else kind
    if types.is_nested(values):  # which no number is, however large
        cells = pa.array(["" if gone else str(values) for gone in column.is_null().to_pylist()], pa.string())
        column = pa.chunked_array([cells])
    elif types.is_dictionary(kind):
        column = column.cast(kind.value_type)
    if types.is_binary(column.type) or types.is_large_binary(column.type):
        try:
            column = column.cast(pa.string())
        except pa.ArrowInvalid:  # not UTF-8: bytes that cannot be decoded become the replacement character
            cells = [None if cell is None else cell.decode("utf-8", "replace") for cell in column.to_pylist()]
            column = pa.chunked_array([pa.array(cells, pa.string())])
    elif not (types.is_string(column.type) or types.is_large_string(column.type)):
        cells = [None if cell is None else str(cell) for cell in _in_python(column)]
        column = pa.chunked_array([pa.array(cells, pa.string())])
    trimmed = pc.utf8_trim_whitespace(column)
    if _has(trimmed, '"'):  # quoted between blanks
        trimmed = pc.replace_substring_regex(trimmed, '^"\\s*([^"]*?)\\s*"$', r"\1")
    return pc.if_else(pc.is_in(trimmed, pa.array(MISSING_WORDS, trimmed.type)), None, trimmed)


def without_unit(text: pa.ChunkedArray) -> pa.ChunkedArray:
    """The cells without the unit that stands behind the number in all of them: 45.2°."""
    import pyarrow.compute as pc

    behind = pc.unique(pc.replace_substring_regex(text, r"^.*[\d.]", "")).drop_null().to_pylist()
    return _without(text, behind[0]) if len(behind) == 1 and behind[0] else text


def _in_python(column: pa.ChunkedArray) -> list[object]:
    import pyarrow as pa

    try:
        return list(column.to_pylist())
    except (OverflowError, ValueError):  # a time beyond Python's calendar
        ticks = column.cast(pa.int64()).to_pylist()
        return [None if tick is None else f"{tick} as {column.type}" for tick in ticks]


def not_a_number(text: pa.ChunkedArray, decimal_comma: bool) -> Check:
    """The check for the cells of `text`. decimal_comma: whether the file may have them."""
    commas = decimal_comma and _has(text, ",")

    def check(cell: str) -> tuple[str, str] | None:
        if (_COMMA if commas else _POINT).fullmatch(cell) or cell.lower().lstrip("+-") in ("inf", "infinity"):
            return None
        if commas and _POINT.fullmatch(cell):
            return "a number with a decimal comma, like others of its column", "Write all alike."
        if _COMMA.fullmatch(cell):
            return "a number with a decimal point", "Write points, or separate the cells with semicolons."
        if re.match(r"[+-]?\d{1,2}:\d{2}", cell):
            return "a number", "A time of day needs its date: 2024-05-31T12:34:56.789Z, or count seconds."
        return "a number", ""

    return check
