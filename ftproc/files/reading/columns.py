"""Columns by their exact names, for the files whose names are fixed: truths and trajectories."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ftproc.errors import InputError, nearest
from ftproc.files.reading import cells, values
from ftproc.files.reading.csvtext import row_named
from ftproc.files.reading.header import OpenTable
from ftproc.files.reading.schema import listed
from ftproc.records import FlagArray, FloatArray

if TYPE_CHECKING:
    import pyarrow as pa


def load(opened: OpenTable, names: Sequence[str], others: Sequence[str] = ()) -> tuple[dict[str, FloatArray], pa.Table]:
    """Columns `names` as float64 (n,), NaN where missing, and a table of `others`.

    A timestamp `time_s` becomes seconds as in a log. Raises InputError for a column that is absent or there
    twice, for a cell that is no finite number, and for a table without rows.
    """
    for name in (*names, *others):
        _require_once(opened, name, names)
    position = opened.names.index
    table = opened.load([position(name) for name in names], [position(name) for name in others])
    if table.num_rows == 0:
        raise InputError(f"{opened.source}: there are column names but no rows.")
    found = {name: _numbers(table.column(index), name, opened) for index, name in enumerate(names)}
    return found, table.select(list(range(len(names), table.num_columns)))


def require_present(opened: OpenTable, column: FloatArray, name: str) -> None:
    """Raise InputError for the first NaN in `column`, called `name`."""
    missing = np.isnan(column)
    if missing.any():
        raise InputError(
            f'{opened.source}: {row_named(int(np.argmax(missing)))}, column "{name}": '
            "the value is missing. Fill it in or delete the row."
        )


def flags(opened: OpenTable, column: FloatArray, name: str, highest: int) -> FlagArray:
    """`column` as uint8, a missing cell as 0. Raises InputError for what is no whole number 0..highest."""
    numbers = np.nan_to_num(column)
    wrong = (numbers != np.floor(numbers)) | (numbers < 0) | (numbers > highest)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InputError(
            f'{opened.source}: {row_named(row)}, column "{name}": '
            f'"{numbers[row]:g}" is not a flag; expected a whole number from 0 to {highest}.'
        )
    return numbers.astype(np.uint8)


def _numbers(column: pa.ChunkedArray, name: str, opened: OpenTable) -> FloatArray:
    expected = "seconds or an ISO-8601 timestamp" if name == "time_s" else "a number"
    origin = cells.Origin(opened.source, name, expected, opened.decimal_comma, cure="Correct the cell.")
    if name == "time_s":
        return values.seconds(column, origin, lambda time: time)[0]
    return values.numbers(column, origin)


def _require_once(opened: OpenTable, name: str, wanted: Sequence[str]) -> None:
    if name not in opened.names:
        free = [other for other in opened.names if other not in wanted]
        raise InputError(
            f'{opened.source}: there is no column "{name}"{nearest(name, free) or "."} '
            f"Its columns are: {listed(opened.names)}. Rename the right one to {name}."
        )
    if opened.names.count(name) > 1:
        raise InputError(f'{opened.source}: column "{name}" is there twice; rename or delete all but one.')
