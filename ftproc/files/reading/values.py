"""Arrow columns of whatever type -> float64 numbers, or seconds for timestamps.

Everything is done on whole columns; single cells are looked at only to name the one that is wrong.
"""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ftproc.files import arrow
from ftproc.files.reading import rollover
from ftproc.files.reading.cells import Origin, as_text, first_bad, has_comma, instant, not_a_number
from ftproc.records import FloatArray

if TYPE_CHECKING:
    import pyarrow as pa

_DAY_S = 86400
_MOST_TICKS = 2**63 - 1
_FIRST_DAY, _LAST_DAY = (int(np.datetime64(day).astype(int)) for day in ("0001-01-01", "9999-12-31"))
_PER_SECOND = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}


def numbers(column: pa.ChunkedArray, origin: Origin) -> FloatArray:
    """(n,) float64, NaN where missing. Raises InputError for the first cell that is no finite number."""
    values = _plain_numbers(column)
    if values is None:
        text = as_text(column)
        values = _parsed(text, origin.decimal_comma)
        if values is None:
            raise first_bad(text, origin, not_a_number(text, origin.decimal_comma))
    _refuse_infinite(values, origin)
    return values


def seconds(
    column: pa.ChunkedArray, origin: Origin, to_si: Callable[[FloatArray], FloatArray]
) -> tuple[FloatArray, str]:
    """(n,) float64 seconds, NaN where missing: numbers through `to_si`, timestamps from midnight; and which midnight.

    The latter is such as 2024-05-31T00:00:00Z, or "" where nothing tells.

    Timestamps (UTC where they name no zone) become seconds since 00:00 UTC of the day of the earliest one. So
    float64 keeps better than 0.1 microsecond for a week, the order of the rows does not matter, and all logs
    of one day share their origin.
    Raises InputError for the first cell that is neither a finite number nor a timestamp, and for numbers that begin
    again at midnight.
    """
    import pyarrow as pa

    kind = column.type
    if pa.types.is_timestamp(kind) or pa.types.is_date(kind):
        return _since_midnight(column, origin)
    if pa.types.is_duration(kind):
        return _ticks_to_seconds(column.cast(pa.int64()), kind.unit), ""
    if _plain_numbers(column) is None:
        text = as_text(column)
        if _parsed(text, origin.decimal_comma) is None:
            return _since_midnight(_timestamps(text, origin), origin)
        column = text
    time = to_si(numbers(column, origin))
    rollover.refuse(origin, time)
    return time, ""


def _plain_numbers(column: pa.ChunkedArray) -> FloatArray | None:
    import pyarrow as pa

    types, kind = pa.types, column.type
    tests = (types.is_integer, types.is_floating, types.is_decimal, types.is_null)
    if types.is_float64(kind):
        return arrow.to_numpy(column)  # a cast, even to what it is, loads more of pyarrow
    if not any(test(kind) for test in tests):
        return None
    return arrow.to_numpy(column.cast(pa.float64(), safe=False))


def _parsed(text: pa.ChunkedArray, decimal_comma: bool) -> FloatArray | None:
    import pyarrow as pa
    import pyarrow.compute as pc

    if decimal_comma and has_comma(text):
        # A point in such a column would separate thousands; "?" makes it no number.
        text = pc.replace_substring(pc.replace_substring(text, ".", "?"), ",", ".")
    try:
        return arrow.to_numpy(text.cast(pa.float64()))
    except pa.ArrowInvalid:
        return None


def _timestamps(text: pa.ChunkedArray, origin: Origin) -> pa.ChunkedArray:
    import pyarrow as pa
    import pyarrow.compute as pc

    pointed = pc.replace_substring(text, ",", ".")  # ISO 8601 allows both before the fraction
    for zone in (None, "UTC"):
        try:
            return pointed.cast(pa.timestamp("ns", zone))
        except pa.ArrowInvalid:
            continue
    written = [cell for cell in text.to_pylist() if cell is not None]
    first = written[0]
    if instant(first) is None:
        raise first_bad(text, origin, not_a_number(text, origin.decimal_comma))
    zoned = instant(first) == "zone"
    if all(instant(cell) == instant(first) for cell in written):  # such as 20240531T123456Z
        moments = [None if cell is None else dt.datetime.fromisoformat(cell) for cell in pointed.to_pylist()]
        return pa.chunked_array([pa.array(moments, pa.timestamp("us", "UTC" if zoned else None))])
    like = f"a timestamp {'with' if zoned else 'without'} time zone like the first one, {first}"
    raise first_bad(text, origin, lambda cell: None if instant(cell) == instant(first) else (like, ""))


def _refuse_infinite(values: FloatArray, origin: Origin) -> None:
    infinite = np.isinf(values)
    if infinite.any():
        row = int(np.argmax(infinite))
        raise origin.bad(row, f"{values[row]:g}", "finite")


def _since_midnight(column: pa.ChunkedArray, origin: Origin) -> tuple[FloatArray, str]:
    import pyarrow as pa
    import pyarrow.compute as pc

    if pa.types.is_date(column.type):
        column = column.cast(pa.timestamp("ms"))
    per_day = _DAY_S * _PER_SECOND[column.type.unit]
    ticks = column.cast(pa.int64())
    earliest, latest = (found or 0 for found in pc.min_max(ticks).as_py().values())  # None when every cell is missing
    day = earliest // per_day
    for tick in (earliest, latest):
        if not _FIRST_DAY <= tick // per_day <= _LAST_DAY:
            said = f"{tick} {column.type.unit} from 1970 on"
            raise origin.bad(ticks.to_pylist().index(tick), said, "a time between the years 1 and 9999")
    if day * per_day < -_MOST_TICKS or latest - day * per_day > _MOST_TICKS:
        raise origin.bad(
            ticks.to_pylist().index(earliest), f"{earliest} {column.type.unit}", "a time of the others' age"
        )
    midnight = f"{np.datetime64(day, 'D')}T00:00:00Z"
    return _ticks_to_seconds(pc.subtract(ticks, day * per_day), column.type.unit), midnight


def _ticks_to_seconds(ticks: pa.ChunkedArray, unit: str) -> FloatArray:
    import pyarrow as pa

    return arrow.to_numpy(ticks.cast(pa.float64(), safe=False)) / _PER_SECOND[unit]
