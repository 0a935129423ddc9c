"""The time column -> seconds: numbers, durations, dates and timestamps; clocks that restart at midnight are refused."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ftproc.errors import InputError, row_named
from ftproc.files import arrow
from ftproc.files.reading.numbers import Origin, as_text, not_a_number, numbers, parsed, without_text
from ftproc.records import FloatArray

if TYPE_CHECKING:
    import pyarrow as pa

_DAY_S = 86400
_MAX_TICKS = 2**63 - 1
_FIRST_DAY, _LAST_DAY = (int(np.datetime64(day).astype(int)) for day in ("0001-01-01", "9999-12-31"))
_PER_SECOND = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}

#: Periods in s of clocks that restart at zero, and when they do.
_ROLLOVERS = {86400.0: "midnight", 604800.0: "the end of the GPS week"}
_MAX_ROLLOVER_GAP_S = 600.0  # from the last time before to the first after
_ROWS_AFTER = 20  # most of these must stay below; else the fall is a glitch


def seconds(
    column: pa.ChunkedArray, origin: Origin, to_si: Callable[[FloatArray], FloatArray]
) -> tuple[FloatArray, str]:
    """(n,) float64 seconds, NaN where missing, and the instant of time zero, such as 2024-05-31T00:00:00Z, or "".

    Numbers go through `to_si`. Timestamps (UTC unless they name a zone) become seconds since 00:00 UTC of the day of
    the earliest one: float64 resolves 0.1 microsecond for a week, the order of the rows does not matter, and all logs
    of one day share their origin.
    Raises InputError for the first cell that is neither a finite number nor a timestamp, and for numbers that restart
    at midnight.
    """
    import pyarrow as pa

    kind = column.type
    if pa.types.is_timestamp(kind) or pa.types.is_date(kind):
        return _since_midnight(column, origin)
    if pa.types.is_duration(kind):
        return _ticks_to_seconds(column.cast(pa.int64()), kind.unit), ""
    if without_text(column) is None:
        text = as_text(column)
        if parsed(text, origin.decimal_comma) is None:
            return _since_midnight(_timestamps(text, origin), origin)
        column = text
    time_s = to_si(numbers(column, origin))
    refuse_rollover(origin, time_s)
    return time_s, ""


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
    zone_of_first = _zone(first)
    if zone_of_first is None:
        raise origin.first_bad_cell(text, not_a_number(text, origin.decimal_comma))
    if all(_zone(cell) == zone_of_first for cell in written):  # such as 20240531T123456Z
        moments = [None if cell is None else dt.datetime.fromisoformat(cell) for cell in pointed.to_pylist()]
        return pa.chunked_array([pa.array(moments, pa.timestamp("us", "UTC" if zone_of_first == "with" else None))])
    like = f"a timestamp {zone_of_first} time zone like the first one, {first}"
    raise origin.first_bad_cell(text, lambda cell: None if _zone(cell) == zone_of_first else (like, ""))


def _zone(text: str) -> str | None:
    """`with` or `without` a time zone, for an ISO-8601 date and time; None for other text."""
    try:
        moment = dt.datetime.fromisoformat(text.replace(",", "."))
    except ValueError:
        return None
    return "without" if moment.tzinfo is None else "with"


def _since_midnight(column: pa.ChunkedArray, origin: Origin) -> tuple[FloatArray, str]:
    import pyarrow as pa
    import pyarrow.compute as pc

    if pa.types.is_date(column.type):
        column = column.cast(pa.timestamp("ms"))
    unit = column.type.unit
    per_day = _DAY_S * _PER_SECOND[unit]
    ticks = column.cast(pa.int64())
    earliest, latest = (found or 0 for found in pc.min_max(ticks).as_py().values())  # None if every cell is missing

    def refused(tick: int, why: str) -> InputError:
        return origin.bad_cell(ticks.to_pylist().index(tick), f"{tick} {unit} since 1970", why)

    for tick in (earliest, latest):
        if not _FIRST_DAY <= tick // per_day <= _LAST_DAY:
            raise refused(tick, "a time between the years 1 and 9999")
    midnight = earliest // per_day * per_day
    if midnight < -_MAX_TICKS or latest - midnight > _MAX_TICKS:
        raise refused(earliest, f"close enough to the latest time for 64-bit {unit}")
    day = f"{np.datetime64(earliest // per_day, 'D')}T00:00:00Z"
    return _ticks_to_seconds(pc.subtract(ticks, midnight), unit), day


def _ticks_to_seconds(ticks: pa.ChunkedArray, unit: str) -> FloatArray:
    import pyarrow as pa

    return arrow.to_numpy(ticks.cast(pa.float64(), safe=False)) / _PER_SECOND[unit]


def refuse_rollover(origin: Origin, time_s: FloatArray) -> None:
    """Raise InputError if (n,) times in s, in file order and NaN where missing, come from a clock that restarts.

    Sorted by time, the rows after midnight would come first and give a wrong trajectory. A single glitch, or a file
    whose rows are out of order, is accepted.
    """
    row = np.flatnonzero(~np.isnan(time_s))
    time = time_s[row]
    for period, what in _ROLLOVERS.items():
        for k in _rollovers(time, period):
            raise InputError(
                f'{origin.source}: {row_named(int(row[k]))}, column "{origin.column}": the time falls from '
                f"{time[k - 1]:.10g} s to {time[k]:.10g} s, which looks like {what}. If so, add {period:.0f} s to the "
                "times from this row on, or give timestamps with their date; if the rows are only out of order, sort "
                "them by time."
            )


def _rollovers(time: FloatArray, period: float) -> list[int]:
    """The first sample after each restart; none if any fall by half a period is not a restart."""
    if not len(time) or time.min() < 0 or time.max() > period:
        return []
    falls = (np.flatnonzero(np.diff(time) < -period / 2) + 1).tolist()
    return falls if all(_is_rollover(time, k, period) for k in falls) else []


def _is_rollover(time: FloatArray, k: int, period: float) -> bool:
    after = time[k : k + _ROWS_AFTER]
    stays = np.count_nonzero(after < time[k - 1] - period / 2) > len(after) / 2
    return bool(stays and 0 <= time[k] + period - time[k - 1] <= _MAX_ROLLOVER_GAP_S)
