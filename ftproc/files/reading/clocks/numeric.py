"""Times that are numbers: which clock counts them, by the name of the column, its unit, and the size of the values."""

from __future__ import annotations

import re

import numpy as np

from ftproc.files import leap_seconds
from ftproc.files.layout import CANONICAL
from ftproc.files.reading.clocks.clock import DAY_S, WEEK_S, Clock, unrolled
from ftproc.files.reading.meaning.numbers import Origin
from ftproc.files.reading.meaning.schema import Column
from ftproc.order_statistics import median
from ftproc.records import FloatArray

BARE = "numbers in s"  # as is assumed
UNIX_EPOCH = "1970-01-01T00:00:00Z"
#: Day counts: stems of names -> (day of 1970-01-01, words).
_DAY_COUNTS = {
    "mjd": (40587.0, "modified Julian date"),
    "jd": (2440587.5, "Julian date"),
    "excel": (25569.0, "Excel date"),
    "datenum": (719529.0, "Matlab's datenum"),
    "days": (0.0, "days since 1970"),
}
_STEMS = {
    **dict.fromkeys(("mjd", "modifiedjuliandate"), "mjd"),
    **dict.fromkeys(("jd", "juliandate", "julianday"), "jd"),
    "datenum": "datenum",
    **dict.fromkeys(("excel", "exceldate", "exceltime", "excelserial", "excelserialdate", "excelserialday",
                     "exceldatenumber", "serialdate", "serialdatenumber", "oledate"), "excel"),
    **dict.fromkeys(("gpssow", "tow", "sow", "timeofweek", "secondsofweek", "gpstow", "gpstimeofweek", "itow"), "week"),
    **dict.fromkeys(("gps", "gpstime", "timegps", "gpsseconds", "gpst"), "gps"),
    **dict.fromkeys(("unix", "unixtime", "posix", "posixtime", "epoch", "epochtime"), "unix"),
    **dict.fromkeys(("timestamp", "unixtimestamp"), "unix"),
    **dict.fromkeys(("tod", "sod", "timeofday", "secondsofday", "secofday", "utcsod", "utctod", "day"), "day"),
    **dict.fromkeys((f"{unit}{word}midnight" for unit in ("secs", "seconds", "sec", "time")
                     for word in ("past", "after", "since")), "day"),
    **dict.fromkeys(("hms", "hhmmss", "hhmmssmmm", "hhmmsssss"), "digits"),
    **dict.fromkeys(("utc", "utctime", "timeutc", "zulu", "irig", "irigb", "irigtime", "daytime"), "day"),
}  # fmt: skip
_UNIX_FROM, _UNIX_TO = 1e8, 2.9e9  # s: 1973 to 2061
_1904_FROM, _1904_TO = 3.5e9, 4.2e9  # s since 1904, as Macintosh and LabVIEW count: 2014 to 2037
#: From, to, start in s before 1970, counts in a second, words.
_TICKS = (
    (_1904_FROM, _1904_TO, 2082844800, 1, "s since 1904 UTC"),
    (6.2e17, 6.6e17, 62135596800, 10**7, "ticks of .NET, 100 ns since the year 1"),
    (1.25e17, 1.42e17, 11644473600, 10**7, "Windows file times, 100 ns since 1601"),
)
_SURELY_UNIX = 1.5e9  # s: 2017; from there on seconds since 1980 are in the future
_GPS_FROM = 3e8
_DIGITS = re.compile(r"hms|hhmmss(?:m*|s*|f*)")  # names of such numbers
_CALENDAR = (1.97e13, 2.1e13)  # yyyymmddhhmmss
_BEHIND = (1e3, 1e2, 1e1, 1e6)  # digits of the second behind hhmmss, without a point
_SAMPLE = 2000  # times by which the size and the step are judged
_MOST_OF_A_YEAR = 367.0  # days, and their fraction
_LARGEST = 1e300  # two larger numbers would overflow in a mean
_MOST_DAYS_STEP = 5e-4  # in s it would be a rate of 2 kHz, in days it is 43 s


def read(values: FloatArray, column: Column, source: str = "") -> Clock:
    """The clock of (n,) numbers as they stand in the file, NaN where missing. Raises InputError for days that are in no
    calendar. source: the file, for messages."""
    known = values[np.isfinite(values)]
    kind = _STEMS.get(column.key, "")
    if not known.size:
        return Clock(column.unit.to_si(values), "", "no time is there")
    if _is_hhmmss_named_s(values, column):
        seconds, notes = unrolled(from_hhmmss(values), DAY_S)
        doubt = f'"{column.name}" jumps by 40 at each full minute, as hhmmss: if it is in s, say --units time=s'
        return Clock(seconds, "", "time of day as hhmmss, in s since midnight", notes, (doubt,))
    if column.unit_is_stated and not (kind in _DAY_COUNTS and column.unit.name == "d"):
        return _in_seconds(column.unit.to_si(values), kind, column, f"numbers in {column.unit.name}")
    size, most = _typical(known), float(known.max())
    counted = _day_count(kind, size, known)
    if counted == "jd" and known.min() >= 1 and most < _MOST_OF_A_YEAR:
        return Clock(values * DAY_S, "", "days of the year, which are called Julian, in s since its day 0")
    if counted:
        return _of_days(values, Origin(source, column.name, "a time"), *_DAY_COUNTS[counted])
    counted_from = next((entry for entry in _TICKS if entry[0] <= size < entry[1]), None)
    if counted_from and kind in ("", "unix", "day"):
        _, _, start, per_second, words = counted_from
        seconds = values / per_second - start if per_second == 1 else (values - start * per_second) / per_second
        return Clock(seconds, UNIX_EPOCH, f"{words}, by the size of the numbers")
    of_day = values % 1e6  # behind a date without year or in another order, such as yyyyddd or yymmdd
    if kind in ("", "unix", "day") and 1e6 <= size < _CALENDAR[0] and is_hhmmss(of_day) and _jumps(of_day):
        seconds, notes = unrolled(from_hhmmss(of_day), DAY_S)
        return Clock(seconds, "", "time of day as hhmmss behind a date, in s since midnight", notes)
    if kind in ("", "unix", "day") and 1e6 <= size < _CALENDAR[0] and _is_before_a_date(known):
        seconds, notes = unrolled(from_hhmmss(np.floor(values / 1e6)), DAY_S)
        return Clock(seconds, "", "time of day as hhmmss before a date, in s since midnight", notes)
    for power, name in ((1e9, "ns"), (1e6, "us"), (1e3, "ms")):
        if kind != "week" and column.name != CANONICAL["time"] and _UNIX_FROM <= size / power < _UNIX_TO:
            return Clock(values / power, UNIX_EPOCH, f"{name} since 1970 UTC, by the size of the numbers")
    if kind in ("", "unix", "day") and _is_calendar(known):
        return _of_calendar(values)
    if _is_hhmmss(kind, column.notation, values, most) or (kind in ("day", "") and _has_digits_behind(values)):
        seconds, notes = unrolled(from_hhmmss(values / (digits_behind(values, column) or 1.0)), DAY_S)
        return Clock(seconds, "", "time of day as hhmmss, in s since midnight", notes)
    period = {"day": DAY_S, "week": WEEK_S, "gps": WEEK_S}.get(kind)
    if kind in ("day", "week") and period and 2 * period < most <= 1e3 * period:
        return _in_seconds(values / 1e3, kind, column, "numbers in ms, by their size")
    if column.unit.name != "s":  # as the motion shows
        return _in_seconds(column.unit.to_si(values), kind, column, f"numbers in {column.unit.name}, by the motion")
    return _in_seconds(values, kind, column, BARE)


def _typical(known: FloatArray) -> float:
    some = known[:: 1 + len(known) // _SAMPLE]
    return median(np.minimum(np.abs(some), _LARGEST))


def _in_seconds(time_s: FloatArray, kind: str, column: Column, words: str) -> Clock:
    known = time_s[np.isfinite(time_s)]
    size = _typical(known)
    if kind == "gps" and _GPS_FROM <= size < _UNIX_TO:
        days = leap_seconds.GPS_EPOCH_DAY + int(np.clip(known.min(), 0, _UNIX_TO) // DAY_S)
        start = np.datetime64("1980-01-06T00:00:00") - np.timedelta64(int(leap_seconds.before(np.array(days))), "s")
        return Clock(time_s, f"{start}Z", f"{words} since the GPS epoch, 1980-01-06")
    named_unix = kind == "unix" and _UNIX_FROM <= size < _UNIX_TO
    if named_unix or (column.name != CANONICAL["time"] and _SURELY_UNIX <= size < _UNIX_TO and kind != "week"):
        return Clock(time_s, UNIX_EPOCH, f"{words} since 1970 UTC")
    whole, notes = unrolled(time_s, {"day": DAY_S, "week": WEEK_S}.get(kind))
    since = {"day": " since midnight", "week": " since the start of the GPS week"}.get(kind, "")
    if kind == "gps" and known.max() <= WEEK_S:
        since = " since the start of the GPS week"
    return Clock(whole, "", f"{words}{since}", notes)


def _day_count(kind: str, size: float, known: FloatArray) -> str:
    """Which of _DAY_COUNTS these are, or ""."""
    if kind in _DAY_COUNTS:
        return kind
    steps = np.abs(np.diff(np.clip(known[:_SAMPLE], -_LARGEST, _LARGEST)))
    steps = steps[steps > 0]
    if kind not in ("", "day", "unix") or not steps.size or median(steps) >= _MOST_DAYS_STEP:
        return ""
    if 2.4e6 <= size < 2.5e6:
        return "jd"
    if 3e4 <= size < 4.9e4:
        return "excel"
    if 7.2e5 <= size < 7.6e5:
        return "datenum"
    if 1.6e4 <= size < 2.4e4:
        return "days"
    return "mjd" if 5.5e4 <= size < 7e4 else ""


def _of_days(values: FloatArray, origin: Origin, of_1970: float, words: str) -> Clock:
    days = values - of_1970
    first = int(origin.whole_days(days)[np.isfinite(days)].min())
    epoch = f"{np.datetime64(first, 'D')}T00:00:00Z"
    return Clock(np.round((days - first) * DAY_S, 6), epoch, f"{words}, in s since 00:00 of the first day")


def is_hhmmss(values: FloatArray) -> bool:
    """Whether all numbers are possible times of day written as hhmmss."""
    known = values[np.isfinite(values)]
    minute, second = np.floor(known / 100) % 100, known % 100
    return bool(((known >= 0) & (known < 240_000) & (minute < 60) & (second < 60)).all())


def digits_behind(values: FloatArray, column: Column) -> float:
    """By how much numbers written as hhmmss with digits of the second behind it are to be divided: 1 without such
    digits, 0 for other numbers."""
    most = float(np.nanmax(values))
    named = next((word for word in (column.key, column.notation) if _DIGITS.fullmatch(word)), "")
    for by in (10.0 ** max(len(named) - 6, 0),) if named else (1.0, *_BEHIND):
        if is_hhmmss(values / by) and (named or most > DAY_S * (1.0 if by == 1.0 else 1e3) or _jumps(values / by)):
            return by
    return 1.0 if named and is_hhmmss(values) else 0.0


def _is_hhmmss(kind: str, notation: str, values: FloatArray, most: float) -> bool:
    if notation.startswith("hhmmss") or kind == "digits":
        return True
    return kind in ("day", "") and DAY_S < most < 240_000 and is_hhmmss(values) and (kind == "day" or _jumps(values))


def _is_before_a_date(known: FloatArray) -> bool:
    """Whether the numbers are hhmmss before six digits of a date, which steps at midnight alone: hhmmssddmmyy."""
    of_day, dates = np.floor(known / 1e6), known % 1e6
    steps = np.flatnonzero(np.diff(dates))
    at_midnight = bool((np.diff(of_day)[steps] < 0).all())
    return at_midnight and is_hhmmss(of_day) and _jumps(of_day) and _is_short_date(np.unique(dates))


def _is_short_date(dates: FloatArray) -> bool:
    """Whether six digits are ddmmyy, yymmdd or mmddyy."""
    first, middle, last = dates // 1e4, dates // 100 % 100, dates % 100
    pairs = ((first, middle), (last, middle), (middle, first))
    return any(bool(((day >= 1) & (day <= 31) & (month >= 1) & (month <= 12)).all()) for day, month in pairs)


def _has_digits_behind(values: FloatArray) -> bool:
    """Whether the numbers are hhmmss with digits of the second behind it, and jump at each full minute: 1031050."""
    most = float(np.nanmax(values))
    return any(
        DAY_S * by < most < 240_000 * by and is_hhmmss(values / by) and _jumps(values / by) for by in _BEHIND[:3]
    )


def _is_hhmmss_named_s(values: FloatArray, column: Column) -> bool:
    in_s = column.unit_in_name and not column.unit_stated_by_user and column.unit.name == "s"
    return in_s and _is_hhmmss("", "", values, float(np.nanmax(values)))


def _is_calendar(known: FloatArray) -> bool:
    """Whether all numbers are possible moments written as yyyymmddhhmmss."""
    if known.min() < _CALENDAR[0] or known.max() >= _CALENDAR[1]:
        return False
    day = np.floor(known / 1e6)
    month, date = np.floor(day / 100) % 100, day % 100
    return bool(((month >= 1) & (month <= 12) & (date >= 1) & (date <= 31)).all()) and is_hhmmss(known - day * 1e6)


def _of_calendar(values: FloatArray) -> Clock:
    day = np.floor(values / 1e6)
    year, month = np.floor(np.nan_to_num(day, nan=19700101.0) / 1e4), np.floor(np.nan_to_num(day, nan=19700101.0) / 100)
    months = ((year - 1970) * 12 + month % 100 - 1).astype(np.int64).astype("datetime64[M]").astype("datetime64[D]")
    days = months.astype(np.int64) + np.nan_to_num(day, nan=1.0) % 100 - 1
    first = int(days[np.isfinite(values)].min())
    time_s = (days - first) * DAY_S + from_hhmmss(np.round(values - day * 1e6, 2))
    words = "yyyymmddhhmmss, in s since 00:00 of the first day"
    doubt = "the times have 14 digits, of which programs keep hundredths of a second"
    return Clock(time_s, f"{np.datetime64(first, 'D')}T00:00:00Z", words, doubts=(doubt,))


def _jumps(values: FloatArray) -> bool:
    """Whether the numbers jump by 40 at each full minute, as hhmmss does."""
    known = values[np.isfinite(values)]
    steps = np.diff(known)
    jumps = np.abs(steps - median(steps) - 40) < 1e-3
    return bool(jumps.any() and (known[1:][jumps] % 100 < median(steps) + 1e-3).all())


def from_hhmmss(values: FloatArray) -> FloatArray:
    """(n,) hhmmss -> seconds since midnight."""
    seconds: FloatArray = 3600 * np.floor(values / 1e4) + 60 * (np.floor(values / 100) % 100) + values % 100
    return seconds
