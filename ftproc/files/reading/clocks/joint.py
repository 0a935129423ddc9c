"""Times in several columns -> seconds: date and time, GPS week and seconds, calendar parts, see `meaning.parts`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ftproc.files import arrow, leap_seconds
from ftproc.files.reading.clocks import notations, numeric, timecode, times
from ftproc.files.reading.clocks.clock import DAY_S, WEEK_S, Clock, unrolled
from ftproc.files.reading.meaning.numbers import Origin, as_text, numbers, parsed, without_text
from ftproc.files.reading.meaning.schema import Column
from ftproc.files.units import UNITS, Unit, unit_named
from ftproc.order_statistics import median
from ftproc.records import FloatArray, IntArray

if TYPE_CHECKING:
    import pyarrow as pa

#: Days counted from: the count of 1970-01-01, and where counts lie. A Julian day begins at noon.
_JULIAN = 2440587.5
_DAY_COUNTS = ((25569, 3e4, 4.9e4), (40587, 5.5e4, 7e4), (_JULIAN, 2.4e6, 2.5e6))
_SAME_S = 1.0  # between the same time in minutes and in seconds
_SEVERAL_DATES = ("the date can be read in several ways, so it is left open",)


def read(columns: Mapping[str, pa.ChunkedArray], origin: Origin, described: Column) -> Clock:
    """The clock of several columns {role: column}, see `meaning.parts`. Raises InputError as `times.read`."""
    units = dict(zip(described.roles, described.written, strict=True))
    fraction = columns.get("fraction")
    if fraction is None:
        return _of_parts(columns, origin, units, described)
    rest = {role: column for role, column in columns.items() if role != "fraction"}
    if set(rest) == {"time"}:
        alone = described._replace(roles=("value",), unit=unit_named("time", units["time"]) or described.unit)
        whole = times.read(rest["time"], origin, alone._replace(unit_in_name=bool(units["time"])))
    else:
        whole = _of_parts(rest, origin, units, described)
    return _with_fraction(whole, numbers(fraction, origin), UNITS["time"][described.fraction])


def _with_fraction(clock: Clock, fraction: FloatArray, unit: Unit) -> Clock:
    """The clock with fractions of the second of a column of their own, if it counts whole seconds without them."""
    part = unit.to_si(fraction)
    known = clock.time_s[np.isfinite(clock.time_s)]
    if not (known == np.round(known)).all() or not ((part >= 0) & (part < 1)).all():
        return clock
    return clock._replace(
        time_s=clock.time_s + part, words=f"{clock.words}, with fractions of the second in {unit.name}"
    )


def _of_parts(
    columns: Mapping[str, pa.ChunkedArray], origin: Origin, units: Mapping[str, str], described: Column
) -> Clock:
    if "week" in columns:
        return _gps(columns, origin, unit_named("time", units["tow"]))
    if "date" in columns and (whole := _days_with_fractions(columns["date"], origin)) is not None:
        return numeric.read(
            whole, described._replace(roles=("value",), unit=UNITS["time"]["d"], key="day"), origin.source
        )
    clock = (
        _own_moments(columns["time"], origin, described, unit_named("time", units["time"]))
        if "time" in columns
        else None
    )
    if isinstance(clock, Clock):
        return clock
    second = clock if clock is not None else _parts_of_day(columns, origin)
    day, dated = _dates(columns, origin)
    if (day == day[0]).all():
        second, notes = unrolled(second, DAY_S)
    else:
        notes = ()
    words = f"{' and '.join(columns)} in columns of their own, in s since 00:00 of the first day"
    clock = times.counted(day, second, dated, words, notes)
    several = "date" in columns and not dated
    return clock._replace(doubts=_SEVERAL_DATES) if several else clock


def _gps(columns: Mapping[str, pa.ChunkedArray], origin: Origin, unit: Unit | None) -> Clock:
    week, second = numbers(columns["week"], origin), numbers(columns["tow"], origin)
    known = week[np.isfinite(week)]
    if not known.size:
        raise origin.nothing("a GPS week")
    if unit is not None:
        second = unit.to_si(second)
    elif np.nanmedian(second) > 2 * WEEK_S:
        second = second / 1e3
    first = int(known.min()) if (origin.whole_days(7 * week) >= 0).all() else 0
    notes: tuple[str, ...] = ()
    if (known == first).all():
        second, notes = unrolled(second, WEEK_S)
    whole = second + (week - first) * WEEK_S
    words = "GPS week and seconds, in s since the start of the first week"
    if first < 1024:  # of ten bits, which start again every 1024 weeks
        return Clock(whole, "", f"{words}; weeks below 1024 leave the year open", notes)
    return Clock(whole, leap_seconds.gps_epoch(first), words, notes)


def _own_moments(column: pa.ChunkedArray, origin: Origin, described: Column, unit: Unit | None) -> FloatArray | Clock:
    """(n,) seconds of the day of a time beside a date; or its clock, if it has dates of its own."""
    import pyarrow as pa

    if pa.types.is_time(column.type):
        return times.time_of_day(column)
    if pa.types.is_timestamp(column.type):
        time_s, epoch = times.since_midnight(column, origin)
        return Clock(time_s, epoch, times.STAMPED)
    values = without_text(column)
    if values is None:
        text = as_text(column)
        values = parsed(text, origin.decimal_comma)
        if values is None:
            return _of_day_or_stamped(text, origin, described)
    if unit is not None:
        return unit.to_si(values)
    known = values[np.isfinite(values)]
    if known.size and known.max() <= 1.0:  # Excel's fraction of a day
        return np.round(values * DAY_S, 6)
    if known.size and (per_second := numeric.digits_behind(values, described)):
        return numeric.from_hhmmss(values / per_second)
    return values / 1e3 if known.size and DAY_S * 2 < known.max() <= DAY_S * 1e3 else values


def _days_with_fractions(column: pa.ChunkedArray, origin: Origin) -> FloatArray | None:
    """(n,) day counts such as modified Julian dates that have the time of day behind the point; None of others."""
    values = without_text(column)
    known = np.zeros(0) if values is None else values[np.isfinite(values)]
    return values if known.size > 1 and np.ptp(known % 1.0) > 0 else None


def _of_day_or_stamped(text: pa.ChunkedArray, origin: Origin, described: Column) -> FloatArray | Clock:
    if (code := timecode.read(text, origin, described)) is not None:
        return code.time_s
    for moments in notations.matching(text, notations.STAMPS).values():
        if not moments.has_day:
            return moments.second
        break
    return times.stamped(text, origin)


def _parts_of_day(columns: Mapping[str, pa.ChunkedArray], origin: Origin) -> FloatArray:
    """(n,) seconds of parts; of those that are the same time in two units, the seconds."""
    sizes = {"hour": 3600.0, "minute": 60.0, "second": 1.0}
    parts = {role: size * numbers(columns[role], origin) for role, size in sizes.items() if role in columns}
    *others, last = parts.values()
    if "hour" not in columns and np.nanmax(np.abs(others[0] - last), initial=0.0) < _SAME_S:
        return last
    if "second" in columns and (others[-1] % 60 > 0).any():
        row = int(np.argmax(others[-1] % 60 > 0))
        raise origin.bad_cell(row, f"{others[-1][row] / 60:.10g}", "a whole number of minutes")
    return np.asarray(sum(others, last))


def _dates(columns: Mapping[str, pa.ChunkedArray], origin: Origin) -> tuple[IntArray, bool]:
    """(n,) days, and whether they are days since 1970."""
    n = len(next(iter(columns.values())))
    if "date" in columns:
        return _dates_in_cells(columns["date"], origin)
    if not {"doy", "day"} & set(columns):
        return np.zeros(n, np.int64), False
    import pyarrow as pa

    roles = [role for role in ("year", "doy") if role in columns] if "doy" in columns else ["year", "month", "day"]
    parts = [_filled(numbers(columns[role], origin)) for role in roles]
    if len(roles) == 1:
        return origin.whole_days(parts[0]), False
    cells = ["-".join(f"{part:.0f}" for part in row) for row in zip(*parts, strict=True)]
    pattern = r"(?P<year>\d{1,4})-(?P<doy>\d{1,3})" if "doy" in roles else notations.DATES["year-month-day"]
    moments = notations.parsed(pa.chunked_array([pa.array(cells, pa.string())]), pattern)
    if moments is None or not moments.right.all():
        row = 0 if moments is None else int(np.argmin(moments.right))
        raise origin.bad_cell(row, cells[row], "a date")
    return moments.day, True


def _dates_in_cells(column: pa.ChunkedArray, origin: Origin) -> tuple[IntArray, bool]:
    import pyarrow as pa

    if pa.types.is_timestamp(column.type) or pa.types.is_date(column.type):
        unit_s = column.cast(pa.timestamp("s"), safe=False).cast(pa.int64()).cast(pa.float64())
        return _filled(arrow.to_numpy(unit_s) // DAY_S).astype(np.int64), True
    values = without_text(column)
    if values is None and (text := as_text(column)) is not None:
        values = parsed(text, origin.decimal_comma) if not notations.matching(text, notations.DATES) else None
        if values is None:
            return _dates_in_text(text, origin)
    assert values is not None
    filled = _filled(values)
    middle = median(filled)
    if middle > 19e6:
        return _dates_in_text(as_text(column), origin)
    if 10_100 < middle < 320_000 and not 3e4 <= middle < 7e4:  # of six digits
        import pyarrow as pa

        return _dates_in_text(pa.chunked_array([pa.array([f"{value:06.0f}" for value in filled], pa.string())]), origin)
    if middle < 367:
        return origin.whole_days(filled), False
    start = next((start for start, low, high in _DAY_COUNTS if low <= middle < high), None)
    if start is None:
        raise origin.bad_cell(0, f"{values[0]:g}", "a date")
    return origin.whole_days(filled - start), start != _JULIAN or bool((filled % 1.0 == 0.5).all())


def _dates_in_text(text: pa.ChunkedArray, origin: Origin) -> tuple[IntArray, bool]:
    import pyarrow.compute as pc

    whole = pc.replace_substring_regex(text, r"[T ]00:00:00(\.0+)?$|\.0$", "")
    fits = notations.matching(whole, notations.DATES)
    if not fits:
        near = notations.nearest_fit(whole, notations.DATES)
        row = notations.first_present(whole) if near is None else int(np.argmin(near[1]))
        raise origin.bad_cell(row, str(whole[row]), "a date")
    chosen = times.likeliest(fits)
    present = ~np.array(whole.is_null().to_pylist(), bool)
    days = _filled(np.where(present, chosen[0].day, np.nan).astype(float)).astype(np.int64)
    return days, chosen[0].dated and chosen[1]


def _filled(values: FloatArray) -> FloatArray:
    """The values, each missing one like the one before it; a time without its date keeps the date above it."""
    present = np.flatnonzero(np.isfinite(values))
    if not present.size:
        return np.zeros(len(values))
    index = np.maximum(np.searchsorted(present, np.arange(len(values)), side="right") - 1, 0)
    found: FloatArray = values[present[index]]
    return found
