"""Columns by their exact names, for truths and trajectories."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ftproc.errors import InputError, nearest, row_named
from ftproc.files.layout import OUTLIER
from ftproc.files.reading.clocks.times import seconds
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.meaning.numbers import Origin, numbers, without_thousands
from ftproc.files.reading.meaning.questions import listed
from ftproc.records import FlagArray, FloatArray

if TYPE_CHECKING:
    import pyarrow as pa


def load(
    header: TableHeader, names: Sequence[str], others: Sequence[str] = ()
) -> tuple[dict[str, FloatArray], pa.Table]:
    """Columns `names` as float64 (n,), NaN where missing, and a table of `others`.

    A timestamp `time_s` becomes seconds as in a log. Raises InputError for a column that is absent or there twice, for
    a cell that is no finite number, and for a table without rows.
    """
    for name in (*names, *others):
        _require_once(header, name, names)
    position = header.names.index
    table = header.load([position(name) for name in names], [position(name) for name in others])
    if table.num_rows == 0:
        raise InputError(f"{header.source}: there are column names but no rows.")
    origins = [_origin(header, name) for name in names]
    columns, _ = without_thousands(table.columns[: len(names)], origins)
    found = {name: _numbers(*each) for name, *each in zip(names, columns, origins, strict=True)}
    return found, table.select(list(range(len(names), table.num_columns)))


def require_present(header: TableHeader, column: FloatArray, name: str) -> None:
    """Raise InputError for the first NaN in `column`, called `name`."""
    missing = np.isnan(column)
    if missing.any():
        raise InputError(
            f'{header.source}: {row_named(int(np.argmax(missing)))}, column "{name}": '
            "the value is missing. Fill it in or delete the row."
        )


def outlier_flags(header: TableHeader, found: Mapping[str, FloatArray], highest: int) -> FlagArray:
    """The `outlier_*` columns of `found` as (n, 3), 0 where one or a cell is missing.

    Raises InputError for a cell that is not a whole number from 0 to `highest`.
    """
    length = len(found["time_s"])
    columns = [_flags(header, found[name], name, highest) if name in found else np.zeros(length) for name in OUTLIER]
    return np.column_stack(columns).astype(np.uint8)


def _flags(header: TableHeader, column: FloatArray, name: str, highest: int) -> FloatArray:
    flags = np.nan_to_num(column)
    wrong = (flags != np.floor(flags)) | (flags < 0) | (flags > highest)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InputError(
            f'{header.source}: {row_named(row)}, column "{name}": '
            f'"{flags[row]:g}" is not a flag; expected a whole number from 0 to {highest}.'
        )
    return flags


def _origin(header: TableHeader, name: str) -> Origin:
    expected = "seconds or an ISO-8601 timestamp" if name == "time_s" else "a number"
    return Origin(header.source, name, expected, header.decimal_comma, cure="Correct the cell.")


def _numbers(column: pa.ChunkedArray, origin: Origin) -> FloatArray:
    if origin.column == "time_s":
        return seconds(column, origin, lambda time: time)[0]
    return numbers(column, origin)


def _require_once(header: TableHeader, name: str, wanted: Sequence[str]) -> None:
    if name not in header.names:
        free = [other for other in header.names if other not in wanted]
        raise InputError(
            f'{header.source}: there is no column "{name}"{nearest(name, free) or "."} '
            f"Its columns are: {listed(header.names)}. Rename the right one to {name}."
        )
    if header.names.count(name) > 1:
        raise InputError(f'{header.source}: column "{name}" is there twice; rename or delete all but one.')
