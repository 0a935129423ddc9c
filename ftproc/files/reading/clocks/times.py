"""The time columns -> seconds: numbers, durations, dates, timestamps, times of day; in one column or several."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from ftproc.errors import InputError
from ftproc.files import arrow, leap_seconds
from ftproc.files.moments import NO_ZONE
from ftproc.files.reading.clocks import notations, numeric, timecode
from ftproc.files.reading.clocks.clock import DAY_S, HOUR_S, Clock, unrolled
from ftproc.files.reading.meaning.numbers import Origin, as_text, not_a_number, numbers, parsed, without_text
from ftproc.files.reading.meaning.schema import Column
from ftproc.files.units import unit_named
from ftproc.records import FloatArray, IntArray

if TYPE_CHECKING:
    import pyarrow as pa

_DAY_S = 86400
_MAX_TICKS = 2**63 - 1
_FIRST_DAY, _LAST_DAY = (int(np.datetime64(day).astype(int)) for day in ("0001-01-01", "9999-12-31"))
_PER_SECOND = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}
STAMPED = "timestamps, in s since 00:00 UTC of the first day"
_COUNTED = (  # whole cells: from the start of a flight, and with a unit
    r"^[TL]\s?(?P<number>[+-]\d+\.?\d*)\s*(?P<unit>[A-Za-z]*)$",
    r"^(?P<number>[+-]?\d+\.?\d*)\s*(?P<unit>[A-Za-z]+)$",
)
_TO_AN_EVENT = r"^(?:[TL]\s?)?(?P<sign>[+-]?)\s?(?P<hour>\d{1,3}):(?P<minute>\d{2}):(?P<second>\d{2}(?:[.,]\d*)?)$"
_MOST_OF_A_YEAR = 360  # days


def read(column: pa.ChunkedArray, origin: Origin, described: Column) -> Clock:
    """The clock of one column of any type.

    Timestamps (UTC unless they name a zone) become seconds since 00:00 UTC of the day of the earliest one: float64
    resolves 0.1 microsecond for a week, the order of the rows does not matter, and all logs of one day share their
    origin. Raises InputError for the first cell that is neither a finite number nor a time.
    """
    import pyarrow as pa

    kind = column.type
    if pa.types.is_timestamp(kind) or pa.types.is_date(kind):
        time_s, epoch = since_midnight(column, origin)
        return Clock(time_s, epoch, STAMPED)
    if pa.types.is_time(kind):
        whole, notes = unrolled(time_of_day(column), DAY_S)
        return Clock(whole, "", "time of day, in s since midnight", notes)
    if pa.types.is_duration(kind):
        return Clock(_ticks_to_seconds(column.cast(pa.int64()), kind.unit), "", "durations")
    if without_text(column) is None:
        text = as_text(column)
        if parsed(text, origin.decimal_comma) is None:
            counted_up = _with_unit(text) or _counted_down(text)
            counted_up = counted_up or timecode.read(text, origin, described)
            if counted_up is not None:
                return counted_up
            return _on_gps(stamped(text, origin), described)
        column = text
    return numeric.read(numbers(column, origin), described, origin.source)


def _on_gps(clock: Clock, described: Column) -> Clock:
    """A clock of timestamps without a zone, in UTC although the name of the column says that they are in GPS time."""
    if described.key not in ("gpst", "gpstime", "timegps") or not clock.epoch or NO_ZONE not in clock.doubts:
        return clock
    start = np.datetime64(clock.epoch.removesuffix("Z"), "s")
    ahead = int(leap_seconds.before(start.astype("datetime64[D]").astype(np.int64)))
    if described.key != "gpst":
        doubt = f"taken for UTC, though named GPS: if it is GPS time, {ahead} s are to be taken off"
        return clock._replace(doubts=(f'"{described.name}" is {doubt}',))
    return clock._replace(epoch=f"{start - np.timedelta64(ahead, 's')}Z", words=f"{clock.words}, GPS time", doubts=())


def _with_unit(text: pa.ChunkedArray) -> Clock | None:
    """The clock of cells such as `12.5 sec` or `T+12.5`; None of others."""
    import pyarrow as pa
    import pyarrow.compute as pc

    found = [pc.extract_regex(text, pattern=pattern) for pattern in _COUNTED]
    fields = next((some for some in found if some.null_count <= text.null_count), None)
    if fields is None:
        return None
    words = {word or "s" for word in pc.unique(pc.struct_field(fields, "unit")).to_pylist() if word is not None}
    units = {unit_named("time", word) for word in words}
    unit = units.pop() if len(units) == 1 else None
    if unit is None:
        return None
    values = arrow.to_numpy(pc.struct_field(fields, "number").cast(pa.float64()))
    return Clock(unit.to_si(values), "", f"numbers in {unit.name}, as every cell says")


def _counted_down(text: pa.ChunkedArray) -> Clock | None:
    """The clock of cells such as `T-00:00:05.0` before an event and `T+00:00:01.0` after it; None of others."""
    import pyarrow as pa
    import pyarrow.compute as pc

    fields = pc.extract_regex(text, pattern=_TO_AN_EVENT)
    signs = pc.struct_field(fields, "sign")
    if fields.null_count > text.null_count or not pc.any(pc.equal(signs, "-")).as_py():
        return None

    def part(name: str) -> FloatArray:
        cells = pc.replace_substring(pc.struct_field(fields, name), ",", ".")
        return arrow.to_numpy(cells.cast(pa.float64()))

    size = 3600 * part("hour") + 60 * part("minute") + part("second")
    return Clock(np.where(np.array(signs.to_pylist()) == "-", -size, size), "", "durations before and after an event")


def seconds(
    column: pa.ChunkedArray, origin: Origin, to_si: Callable[[FloatArray], FloatArray]
) -> tuple[FloatArray, str]:
    """(n,) float64 seconds of numbers (through `to_si`) or timestamps, and the instant of time zero or "", for truths
    and trajectories. Raises InputError as `read`."""
    import pyarrow as pa

    plain = without_text(column)
    if (
        plain is None
        and not pa.types.is_temporal(column.type)
        and parsed(as_text(column), origin.decimal_comma) is None
    ):
        clock = stamped(as_text(column), origin)
        return clock.time_s, clock.epoch
    if plain is None and pa.types.is_temporal(column.type):
        if pa.types.is_duration(column.type):
            return _ticks_to_seconds(column.cast(pa.int64()), column.type.unit), ""
        if not pa.types.is_time(column.type):
            return since_midnight(column, origin)
    return unrolled(to_si(numbers(column, origin)))[0], ""


def stamped(text: pa.ChunkedArray, origin: Origin) -> Clock:
    stamps = _timestamps(text)
    if stamps is not None:
        time_s, epoch = since_midnight(stamps, origin)
        zoned = stamps.type.tz is not None
        return Clock(time_s, epoch, STAMPED, doubts=() if zoned else (NO_ZONE,))
    fits = notations.matching(text, notations.STAMPS)
    if not fits:
        raise _no_time(text, origin)
    moments, sure = likeliest(fits)
    words = next(name for name, found in fits.items() if found is moments)
    if moments.zoned and not moments.has_day:
        words += " (UTC)"
    if not moments.has_day:
        whole, notes = unrolled(moments.second, HOUR_S if words == "minutes and seconds" else DAY_S)
        return Clock(whole, "", f"{words}, in s since midnight", notes)
    doubts: tuple[str, ...] = () if sure else ("day and month cannot be told apart, so the date is left open",)
    doubts += () if moments.zoned or not (moments.dated and sure) else (NO_ZONE,)
    clock = counted(moments.day, moments.second, moments.dated and sure, f"{words}, in s since 00:00 of the first day")
    return clock._replace(doubts=doubts)


def likeliest(fits: Mapping[str, notations.Moments]) -> tuple[notations.Moments, bool]:
    """The notation in which the days are nearest to each other, and whether no other is as likely."""

    def days(moments: notations.Moments) -> int:
        known = moments.day[np.isfinite(moments.second)]
        return int(np.ptp(known)) if known.size else 0

    order = sorted(fits.values(), key=days)
    same = [found for found in order if days(found) == days(order[0])]
    return order[0], all(np.array_equal(found.day, order[0].day) for found in same)


def counted(day: IntArray, second: FloatArray, dated: bool, words: str, notes: tuple[str, ...] = ()) -> Clock:
    """Seconds since 00:00 of the first day, leap seconds counted."""
    known = day[np.isfinite(second)]
    if not dated:
        day = _over_new_year(day)
        known = day[np.isfinite(second)]
    first = int(known.min()) if known.size else 0
    time_s = (day - first) * DAY_S + second
    if not dated:
        return Clock(time_s, "", words, notes)
    leaps = leap_seconds.before(day) - leap_seconds.before(np.array(first))
    return Clock(time_s + leaps, f"{np.datetime64(first, 'D')}T00:00:00Z", words, notes)


def _over_new_year(day: IntArray) -> IntArray:
    """Days of an unknown year, that go on counting after 31 December."""
    falls = np.flatnonzero(np.diff(day) <= -_MOST_OF_A_YEAR) + 1
    if len(falls) != 1 or day[falls[0]] != 1:
        return day
    later = np.arange(len(day)) >= falls[0]
    return np.where(later, day + day[falls[0] - 1], day)


def _no_time(text: pa.ChunkedArray, origin: Origin) -> InputError:
    """The error for the first cell that is not a time like the first one."""
    written = [cell for cell in text.to_pylist() if cell is not None]
    zone_of_first = _zone(written[0])
    if zone_of_first is not None:
        like = f"a timestamp {zone_of_first} time zone like the first one, {written[0]}"
        return origin.first_bad_cell(text, lambda cell: None if _zone(cell) == zone_of_first else (like, ""))
    near = notations.nearest_fit(text, notations.STAMPS)
    if near is not None and not near[1].all():
        row = int(np.argmin(near[1]))
        return origin.bad_cell(row, str(text[row]), f"a possible {near[0]} like the first one, {written[0]}")
    return origin.first_bad_cell(text, not_a_number(text, origin.decimal_comma))


def _timestamps(text: pa.ChunkedArray) -> pa.ChunkedArray | None:
    """The moments of a column in ISO 8601; None if a cell is something else."""
    import pyarrow as pa
    import pyarrow.compute as pc

    pointed = pc.replace_substring(text, ",", ".")  # ISO 8601 allows both before the fraction
    for zone in (None, "UTC"):
        try:
            return pointed.cast(pa.timestamp("ns", zone))
        except pa.ArrowInvalid:
            continue
    written = [cell for cell in text.to_pylist() if cell is not None]
    zone_of_first = _zone(written[0])
    if zone_of_first is None or not all(_zone(cell) == zone_of_first for cell in written):
        return None
    # such as 20240531T123456Z
    moments = [None if cell is None else dt.datetime.fromisoformat(cell) for cell in pointed.to_pylist()]
    return pa.chunked_array([pa.array(moments, pa.timestamp("us", "UTC" if zone_of_first == "with" else None))])


def _zone(text: str) -> str | None:
    """`with` or `without` a time zone, for an ISO-8601 date and time; None for other text."""
    try:
        moment = dt.datetime.fromisoformat(text.replace(",", "."))
    except ValueError:
        return None
    return "without" if moment.tzinfo is None else "with"


def time_of_day(column: pa.ChunkedArray) -> FloatArray:
    import pyarrow as pa

    unit = column.type.unit
    return _ticks_to_seconds(column.cast(pa.int32() if unit in ("s", "ms") else pa.int64()), unit)


def since_midnight(column: pa.ChunkedArray, origin: Origin) -> tuple[FloatArray, str]:
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
    day = np.datetime64(earliest // per_day, "D")
    time_s = _ticks_to_seconds(pc.subtract(ticks, midnight), unit)
    first, last = (leap_seconds.before(np.array(tick // per_day)) for tick in (earliest, latest))
    if first != last:
        known = np.nan_to_num(time_s)
        time_s = time_s + leap_seconds.before(day.astype(np.int64) + (known // _DAY_S).astype(np.int64)) - first
    return time_s, f"{day}T00:00:00Z"


def _ticks_to_seconds(ticks: pa.ChunkedArray, unit: str) -> FloatArray:
    import pyarrow as pa

    return arrow.to_numpy(ticks.cast(pa.float64(), safe=False)) / _PER_SECOND[unit]
