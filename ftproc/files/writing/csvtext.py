"""Arrow tables -> CSV text: NaN as empty cells, and no cell that a spreadsheet would run as a formula."""

from __future__ import annotations

import contextlib
import csv
import io
import itertools
import re
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from ftproc.errors import OutputError
from ftproc.files import arrow

if TYPE_CHECKING:
    import pyarrow as pa

FEW = 64  # rows, which are written faster by `few_rows`
_CELLS_AT_ONCE = 1 << 21  # of text held in memory
_NUMBER = r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?"
#: Characters that show nothing, which a spreadsheet may drop before it looks for a formula: controls, blanks, formats
#: (Unicode's Cc, Zs, Zl, Zp, Cf) and fillers.
_UNSEEN = (
    "\x00-\x20\x7f-\xa0\xad\u034f\u0600-\u0605\u061c\u06dd\u070f\u0890\u0891\u08e2\u115f\u1160\u1680\u17b4\u17b5"
    "\u180b-\u180f\u2000-\u200f\u2028-\u202f\u205f-\u206f\u2800\u3000\u3164\ufe00-\ufe0f\ufeff\uffa0\ufff0-\ufffb"
    "\U000110bd\U000110cd\U00013430-\U0001343f\U0001bca0-\U0001bca3\U0001d173-\U0001d17a\U000e0000-\U000e0fff"
)
#: = + - @ and what a spreadsheet may take for one of them: the same in full width, small, raised or lowered.
_SIGNS = "=+\\-@\u207a-\u207c\u208a-\u208c\u2212\u2a75\u2a76\ufb29\ufe62\ufe63\ufe66\ufe6b\uff0b\uff0d\uff1d\uff20"
_FORMULA = rf"^(?:[\t\r\n]|[{_UNSEEN}]*[{_SIGNS}])"
_HARMLESS = rf"^[{_UNSEEN}]*{_NUMBER}[{_UNSEEN}]*$"


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


def few_rows(columns: Sequence[NDArray[Any]]) -> bytes:
    """The lines of columns (n,) of numbers, as `pieces` makes them: quick where n is small."""
    texts = iter(arrow.as_text(np.concatenate([column for column in columns if column.dtype.kind == "f"])))
    cells = [
        list(itertools.islice(texts, len(column))) if column.dtype.kind == "f" else map(str, column.tolist())
        for column in columns
    ]
    return "".join(f"{','.join(row)}\n" for row in zip(*cells, strict=True)).encode()


def no_formula(text: str) -> str:
    """`text` for a CSV cell, with an apostrophe in front if a spreadsheet would run it as a formula.

    That is text that starts with = + - @, also after characters that show nothing, or with the end of a line or a tab,
    and is not a number.
    """
    risky = re.match(_FORMULA, text) and not re.match(_HARMLESS, text, re.ASCII)
    return f"'{text}" if risky else text


def _for_csv(column: pa.ChunkedArray) -> pa.ChunkedArray:
    """NaN as missing, formulas as text."""
    import pyarrow as pa

    if pa.types.is_dictionary(column.type):
        column = column.cast(column.type.value_type)
    if pa.types.is_binary(column.type):  # of bytes, regular expressions know no characters
        with contextlib.suppress(pa.ArrowInvalid):
            column = column.cast(pa.string())
    kind = column.type
    if pa.types.is_float64(kind):
        return arrow.nan_as_missing(column)
    text = any(
        is_kind(kind)
        for is_kind in (pa.types.is_string, pa.types.is_large_string, pa.types.is_binary, pa.types.is_large_binary)
    )
    if not (text or pa.types.is_floating(kind)):
        return column
    import pyarrow.compute as pc  # takes a twentieth of a second to load

    if not text:
        return pc.if_else(pc.is_nan(column), None, column)
    number = pc.match_substring_regex(column, _HARMLESS)
    risky = pc.and_not(pc.match_substring_regex(column, _FORMULA), number)
    if not pc.any(risky).as_py():
        return column
    marked = pc.binary_join_element_wise(pa.scalar("'", kind), column, pa.scalar("", kind))
    return pc.if_else(risky, marked, column)
