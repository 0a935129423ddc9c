"""Arrow tables -> CSV text: NaN as empty cells, and no cell that a spreadsheet would run as a formula."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, cast

from ftproc.errors import OutputError
from ftproc.files import arrow

if TYPE_CHECKING:
    import pyarrow as pa

_CELLS_AT_ONCE = 1 << 21  # of text held in memory
_NUMBER = r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?"
_FORMULA = r"^[=+\-@\t\r]"


def pieces(table: pa.Table, with_header: bool = True) -> Iterator[bytes]:
    """The text, some rows at a time. Raises OutputError for a column that CSV cannot hold."""
    import pyarrow as pa
    import pyarrow.csv

    if with_header:
        header = io.StringIO()
        csv.writer(header, lineterminator="\n").writerow(map(no_formula, table.column_names))
        yield header.getvalue().encode()
    at_once = max(_CELLS_AT_ONCE // max(table.num_columns, 1), 1)
    options = pyarrow.csv.WriteOptions(include_header=False, batch_size=at_once)
    for start in range(0, table.num_rows, at_once):
        rows = table.slice(start, at_once)
        sink = pa.BufferOutputStream()
        try:
            cleaned = pa.Table.from_arrays([_for_csv(column) for column in rows.columns], table.column_names)
            pyarrow.csv.write_csv(cleaned, sink, options)
        except pa.ArrowException as error:  # such as a kept column of lists
            raise OutputError(f"This cannot be written as CSV ({error}); give the output the name .parquet.") from error
        yield cast(bytes, sink.getvalue().to_pybytes())


def no_formula(text: str) -> str:
    """`text` for a CSV cell, with an apostrophe in front if a spreadsheet would run it as a formula.

    That is text that starts with = + - @, a tab or a carriage return and is not a number.
    """
    risky = re.match(_FORMULA, text) and not re.fullmatch(_NUMBER, text, re.ASCII)
    return f"'{text}" if risky else text


def _for_csv(column: pa.ChunkedArray) -> pa.ChunkedArray:
    """NaN as missing, formulas as text."""
    import pyarrow as pa

    kind = column.type
    if pa.types.is_float64(kind):
        return arrow.nan_as_missing(column)
    text = pa.types.is_string(kind) or pa.types.is_large_string(kind)
    if not (text or pa.types.is_floating(kind)):
        return column
    import pyarrow.compute as pc  # takes a twentieth of a second to load

    if not text:
        return pc.if_else(pc.is_nan(column), None, column)
    number = pc.match_substring_regex(column, rf"^{_NUMBER}$")
    risky = pc.and_not(pc.match_substring_regex(column, _FORMULA), number)
    if not pc.any(risky).as_py():
        return column
    marked = pc.binary_join_element_wise(pa.scalar("'", kind), column, pa.scalar("", kind))
    return pc.if_else(risky, marked, column)
