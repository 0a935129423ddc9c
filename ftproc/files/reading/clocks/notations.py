"""Times as text, in every notation that instruments write: a table of patterns, and what their parts mean.

The patterns are matched on whole columns by pyarrow (RE2).
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.files import leap_seconds
from ftproc.records import FloatArray, IntArray

if TYPE_CHECKING:
    import pyarrow as pa

_CLOCK = r"(?P<hour>\d{1,2}):(?P<minute>\d{2}):(?P<second>\d{2}(?:[.,]\d*|:\d{3})?)(?:\s*(?P<half>[AaPp])\.?[Mm]\.?)?"
#: Zones by their usual letters, in hours ahead of UTC; those that several zones share are left out.
_ZONES = {
    "CET": 1, "CEST": 2, "EET": 2, "EEST": 3, "MSK": 3, "WEST": 1, "EST": -5, "EDT": -4, "CDT": -5, "MST": -7,
    "MDT": -6, "PST": -8, "PDT": -7, "AKDT": -8, "HST": -10, "JST": 9, "KST": 9, "AEST": 10, "AEDT": 11,
}  # fmt: skip
_ZONE = rf"\s*(?P<zone>Z|z|UTC|UT|GMT|[+-]\d{{2}}(?::?\d{{2}})?|{'|'.join(_ZONES)})?(?:\[[\w/]+\])?"
_YEAR_FIRST = r"(?P<year>\d{4})[-/._](?P<month>\d{1,2})[-/._](?P<day>\d{1,2})"
_COMPACT = r"(?P<year>(?:19|20)\d{2})(?P<month>\d{2})(?P<day>\d{2})"
_DAY_FIRST = r"(?P<day>\d{1,2})[-/.](?P<month>\d{1,2})[-/.](?P<year>\d{4}|\d{2})"
_MONTH_FIRST = r"(?P<month>\d{1,2})[-/.](?P<day>\d{1,2})[-/.](?P<year>\d{4}|\d{2})"
_WEEKDAY = r"(?:[A-Za-z]{3,9}\.?,?\s+)?"
_NAMED = rf"{_WEEKDAY}(?P<day>\d{{1,2}})[-/. ]?(?P<name>[A-Za-z]{{3,9}})\.?[-/. ,]*(?P<year>\d{{4}}|\d{{2}})"
_YEAR_NAMED = r"(?P<year>\d{4})[-/. ]?(?P<name>[A-Za-z]{3,9})\.?[-/. ]?(?P<day>\d{1,2})"
_NAMED_FIRST = _WEEKDAY + r"(?P<name>[A-Za-z]{3,9})\.?[-/. ](?P<day>\d{1,2})[-/. ,]+(?P<year>\d{4}|\d{2})"
_ORDINAL = r"(?P<year>\d{4})[-:/. ]?(?P<doy>\d{3})"
_SHORT_ORDINAL = _ORDINAL.replace("{4}", "{2}")
_DOTTED = _CLOCK.replace(":", "[-._ ]", 2).replace("[.,]", "[.,_]")  # as Oracle and names of files write them
_WITHOUT = r"(?P<hour>\d{2})(?P<minute>\d{2})(?P<second>\d{2}(?:[.,]\d*)?)"
_BETWEEN = r"[T _,;:.-]+\s*"
_HAN = r"(?P<year>\d{4})年(?P<month>\d{1,2})月(?P<day>\d{1,2})[日号]\s*"

_DATES = {
    "year-month-day": _YEAR_FIRST,
    "yyyymmdd": _COMPACT,
    "day.month.year": _DAY_FIRST,
    "month/day/year": _MONTH_FIRST,
    "day month year": _NAMED,
    "month day year": _NAMED_FIRST,
    "year month day": _YEAR_NAMED,
    "year and day of year": _ORDINAL,
}
MINUTES = r"(?P<hour>)(?P<minute>\d{1,2}):(?P<second>\d{2}[.,]\d+)"  # as Excel shows times of day
#: Name of a notation -> its pattern, for whole cells.
STAMPS: Mapping[str, str] = {
    **{
        f"{name} and time of day{how}": f"{date}{_BETWEEN}{clock}{_ZONE}"
        for name, date in {**_DATES, "two digits of the year and day of year": _SHORT_ORDINAL}.items()
        for how, clock in (("", _CLOCK), (" with dots", _DOTTED), (" without colons", _WITHOUT))
    },
    "年月日": f"{_HAN}{_CLOCK}{_ZONE}",
    "年月日时分秒": _HAN + r"(?P<hour>\d{1,2})[时時点](?P<minute>\d{1,2})分(?P<second>\d{1,2}(?:\.\d*)?)秒?",
    "month day, time of day and year": (
        rf"{_WEEKDAY}(?P<name>[A-Za-z]{{3,9}})\s+(?P<day>\d{{1,2}})\s+{_CLOCK}{_ZONE}\s+(?P<year>\d{{4}})"
    ),
    "day of year and time of day": rf"(?P<doy>\d{{1,3}})[-:/.T ]+{_CLOCK}{_ZONE}",
    "time of day": f"T?{_CLOCK}{_ZONE}",
    "time of day with dots": r"(?P<hour>\d{2})[-._](?P<minute>\d{2})[-._](?P<second>\d{2}[.,_]\d+)",
    "minutes and seconds": MINUTES,
    "duration": rf"(?:T?[+]|[+]?0 days )(?:0 days )?{_CLOCK}",
    "hours, minutes and seconds": r"(?P<hour>\d{1,2})h\s*(?P<minute>\d{1,2})m\s*(?P<second>\d{1,2}(?:[.,]\d*)?)s?",
    "compact time of day": r"(?P<hour>\d{2})(?P<minute>\d{2})(?P<second>\d{2}(?:\.\d*)?)(?P<zone>Z|z)",
}
DATES: Mapping[str, str] = {
    **_DATES,
    "day of year": r"(?P<doy>\d{1,3})",
    "ddmmyy": r"(?P<day>\d{2})(?P<month>\d{2})(?P<year>\d{2})",
    "yymmdd": r"(?P<year>\d{2})(?P<month>\d{2})(?P<day>\d{2})",
    "mmddyy": r"(?P<month>\d{2})(?P<day>\d{2})(?P<year>\d{2})",
}

_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec",
           "mai", "mär", "okt", "dez")  # fmt: skip
_MONTH_NUMBERS = {name: k + 1 for k, name in enumerate(_MONTHS[:12])} | {"mai": 5, "mär": 3, "okt": 10, "dez": 12}
_MAX_SECOND = 61


class Moments(NamedTuple):
    """Moments as written. day: (n,) days since 1970, or of an unknown year since its day 0, or zeros without any date.

    second: (n,) seconds since 00:00 of that day, NaN where missing; 86400 and more within a leap second. dated: the
    year is known. zoned: the cells name their zone. has_day: a date or a day of the year is there. right: (n,) whether
    each cell is a possible moment (or missing).
    """

    day: IntArray
    second: FloatArray
    dated: bool
    zoned: bool
    has_day: bool
    right: NDArray[np.bool_]


def matching(text: pa.ChunkedArray, patterns: Mapping[str, str]) -> dict[str, Moments]:
    """The notations in which every cell of a column is a moment, in the order of `patterns`."""
    found = {}
    first = text.slice(first_present(text), 1)
    for name, pattern in patterns.items():
        moments = parsed(text, pattern) if parsed(first, pattern) else None
        if moments is not None and moments.right.all():
            found[name] = moments
    return found


def nearest_fit(text: pa.ChunkedArray, patterns: Mapping[str, str]) -> tuple[str, NDArray[np.bool_]] | None:
    """The first notation in which the first cell is a moment, and (n,) which cells are one too; or None."""
    for name, pattern in patterns.items():
        moments = parsed(text, pattern)
        if moments is not None and moments.right[first_present(text)]:
            return name, moments.right
    return None


def first_present(text: pa.ChunkedArray) -> int:
    """The row of the first cell that is not missing; 0 if there is none."""
    import pyarrow.compute as pc

    index = int(pc.index(pc.is_valid(text), True).as_py())
    return max(index, 0)


def parsed(text: pa.ChunkedArray, pattern: str) -> Moments | None:
    """The moments of a column in one notation; None if no cell is in it."""
    import pyarrow.compute as pc

    fields = pc.extract_regex(text, pattern=f"^{pattern}$")
    matched = _bool(pc.is_valid(fields))
    if not matched.any():
        return None
    get = functools.partial(_field, fields)
    day, right_day = _days(get, len(matched))
    hour, minute, second = (get(name) for name in ("hour", "minute", "second"))
    clock = np.zeros(len(matched))
    right = matched & right_day
    if pattern == MINUTES:
        hour = np.zeros(len(matched))
    if hour is not None and minute is not None and second is not None:
        half = _strings(fields, "half")
        if half is not None and any(half):
            late = np.array([cell.lower() == "p" for cell in half])
            right &= (hour >= 1) & (hour <= 12)
            hour = hour % 12 + 12 * late
        leap = (hour == 23) & (minute == 59) & (second >= 60) & (second < _MAX_SECOND)
        dated = "year" in pattern
        offset, zoned = _offsets(fields, len(matched))
        if dated:
            leap = (second >= 60) & (second < _MAX_SECOND) & _is_leap(day, hour, minute, offset)
        right &= (hour < 24) & (minute < 60) & ((second < 60) | leap)
        right &= _zones_alike(fields, matched)
        minute_start = 3600 * hour + 60 * minute - offset
        later = np.floor(np.nan_to_num(minute_start) / 86400).astype(np.int64)  # second 60 belongs to the day it ends
        day, clock = day + later, minute_start - 86400.0 * later + second
    else:
        zoned = False
    present = _bool(pc.is_valid(text))
    has_day = "doy" in pattern or "day" in pattern
    return Moments(
        np.where(matched, day, 0), np.where(matched, clock, np.nan), "year" in pattern, zoned, has_day, right | ~present
    )


def _is_leap(day: IntArray, hour: FloatArray, minute: FloatArray, offset: FloatArray) -> NDArray[np.bool_]:
    """Whether a minute is, in UTC, the last of a day with a leap second."""
    start = np.nan_to_num(3600 * hour + 60 * minute - offset)
    days = np.floor(start / 86400).astype(np.int64)
    last: NDArray[np.bool_] = start - 86400.0 * days == 86340
    return last & leap_seconds.ends_with_one(day + days)


def _days(get: functools.partial[FloatArray | None], n: int) -> tuple[IntArray, NDArray[np.bool_]]:
    """Days of the dates, and which of these are possible."""
    year, month, date, doy = (get(name) for name in ("year", "month", "day", "doy"))
    names = _strings(get.args[0], "name")
    right = np.ones(n, bool)
    if doy is not None:
        right &= (doy >= 1) & (doy <= 366)
        if year is None:
            return np.nan_to_num(doy).astype(np.int64), right
        first = (
            (_of_century(np.nan_to_num(year)).astype(np.int64) - 1970).astype("datetime64[Y]").astype("datetime64[D]")
        )
        return first.astype(np.int64) + np.nan_to_num(doy).astype(np.int64) - 1, right
    if names is not None:
        month = np.array([_MONTH_NUMBERS.get(cell[:3].lower(), 0) for cell in names], float)
    if year is None or month is None or date is None:
        return np.zeros(n, np.int64), right
    return _of_calendar(_of_century(year), month, date)


def _of_century(year: FloatArray) -> FloatArray:
    """Years of four digits."""
    return np.where(year < 100, year + np.where(year < 70, 2000, 1900), year)


def _of_calendar(year: FloatArray, month: FloatArray, date: FloatArray) -> tuple[IntArray, NDArray[np.bool_]]:
    right = (month >= 1) & (month <= 12) & (date >= 1)
    whole = [np.where(right, column, 1).astype(np.int64) for column in (year, month, date)]
    months = ((whole[0] - 1970) * 12 + whole[1] - 1).astype("datetime64[M]")
    days = months.astype("datetime64[D]").astype(np.int64) + whole[2] - 1
    right &= days < (months + 1).astype("datetime64[D]").astype(np.int64)
    return days, right


def _offsets(fields: pa.ChunkedArray, n: int) -> tuple[FloatArray, bool]:
    """(n,) seconds that the zones are ahead of UTC, and whether zones are named."""
    import pyarrow.compute as pc

    words = _strings(fields, "zone")
    if words is None or not any(words):
        return np.zeros(n), False
    column = pc.struct_field(fields, "zone")
    seconds = {word: _offset(word) for word in pc.unique(column).to_pylist() if word is not None}
    return np.array([seconds.get(word, 0.0) for word in words]), True


def _zones_alike(fields: pa.ChunkedArray, matched: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) whether each cell names its zone or not, like the first one."""
    words = _strings(fields, "zone")
    if words is None:
        return matched
    named = np.array([bool(word) for word in words])
    alike: NDArray[np.bool_] = named == named[int(np.argmax(matched))]
    return alike


def _offset(word: str) -> float:
    if word[:1] not in ("+", "-"):
        return 3600.0 * _ZONES.get(word, 0)
    digits = word[1:].replace(":", "")
    return (-1.0 if word[0] == "-" else 1.0) * (3600 * int(digits[:2]) + 60 * int(digits[2:] or 0))


def _field(fields: pa.ChunkedArray, name: str) -> FloatArray | None:
    """(n,) a group of a pattern as numbers, NaN where no number; None if the pattern lacks it."""
    import pyarrow as pa
    import pyarrow.compute as pc

    from ftproc.files import arrow

    if name not in [field.name for field in fields.type]:
        return None
    cells = pc.replace_substring_regex(pc.struct_field(fields, name), "[,:_]", ".")
    cells = pc.if_else(pc.equal(cells, ""), None, cells)
    return arrow.to_numpy(cells.cast(pa.float64()))


def _strings(fields: pa.ChunkedArray, name: str) -> list[str] | None:
    import pyarrow.compute as pc

    if name not in [field.name for field in fields.type]:
        return None
    return [cell or "" for cell in pc.struct_field(fields, name).to_pylist()]


def _bool(column: pa.ChunkedArray) -> NDArray[np.bool_]:
    return np.array(column.to_pylist(), bool)
