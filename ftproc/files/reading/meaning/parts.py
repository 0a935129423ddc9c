"""Quantities that several columns hold together: date and time, GPS week and seconds, degrees, minutes, seconds."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Mapping, Sequence

from ftproc.files.reading.meaning.names import Name, taken_apart
from ftproc.files.reading.meaning.wording import turned
from ftproc.files.units import unit_named
from ftproc.files.words import ALIASES, OF_TIMES, WEAK_ALIASES, ZENITH_ALIASES

_SECONDS_OF_WEEK = frozenset(
    ["tow", "sow", "gpstow", "gpssow", "timeofweek", "secondsofweek", "secofweek", "itow", "gpsseconds", "weekseconds"]
)
#: Part of a time -> stems of the names that it has.
_TIME = {
    "date": (
        "date",
        "utcdate",
        "dateutc",
        "datum",
        "gpsdate",
        "yyyymmdd",
        "calendardate",
        "ddmmyyyy",
        "ddmmyy",
        "yymmdd",
    ),
    "week": ("week", "gpsweek", "wk", "wn", "gpswk", "weeknumber", "gpsweekno", "weekno", "gpsweeknumber"),
    "doy": ("doy", "dayofyear", "yday", "jday", "ddd", "day", "daynumber", "julday", "dayno", "yearday", "irigday"),
    "year": ("year", "yr", "yyyy", "utcyear"),
    "month": ("month", "mon", "mo", "utcmonth"),
    "day": ("day", "dd", "dom", "dayofmonth", "utcday"),
    "hour": ("hour", "hours", "hr", "hrs", "hh", "h", "utchour"),
    "minute": ("minute", "minutes", "min", "mins", "mi", "mn", "mm", "m", "utcminute", "utcmin"),
    "second": ("second", "seconds", "sec", "secs", "ss", "s", "utcsecond", "utcsec", "tvsec"),
}
#: Counts of days that are the date of a time of day beside them.
_DAY_COUNTS = frozenset(("mjd", "jd", "modifiedjuliandate", "juliandate", "julianday"))
#: Names of a time of day that need a date beside them: `ms of day`, `UT (h)`, `FracDay`.
_OF_DAY = re.compile(r"(?P<unit>[a-z]*?)(?:of|past|after|since)?(?:the)?(?:day|midnight)")
_OF_DAY_STEMS = frozenset(("msod", "fracday", "fractionofday", "dayfraction", "dayfrac", "ut", "hour", "hours", "hrs"))
#: Stems of the names of a fraction of the second beside whole seconds -> its unit.
FRACTIONS = {
    **dict.fromkeys(("ms", "msec", "msecs", "millis", "millisec", "millisecs", "millisecond", "milliseconds"), "ms"),
    **dict.fromkeys(("us", "usec", "usecs", "micros", "microsec", "microsecond", "microseconds", "tvusec"), "us"),
    **dict.fromkeys(
        ("ns", "nsec", "nsecs", "nanos", "nanosec", "nanosecs", "nanosecond", "nanoseconds", "tvnsec"), "ns"
    ),
}
_OF_CLOCK = frozenset(word for role in ("hour", "minute", "second") for word in _TIME[role])
_PREFIXES = ("utc", "gps", "gmt")  # of the names of parts, such as UTC_HH
#: Times that do not count from a midnight, and parts of one.
_ELAPSED = frozenset([*_TIME["second"], "t", "elapsed", "elapsedtime", "elapsedseconds", "missiontime"])
#: Parts of an angle -> what its unit is called, and how it is abbreviated.
_ANGLE = {
    "deg": {"deg", "grad", "d", "dd", "ddd"},
    "min": {"min", "arcmin", "m", "mm", "'", "′"},
    "sec": {"s", "arcsec", "ss", "''", '"', "″"},
}


def role(word: str) -> str:
    """The part of an angle that a unit is, one of _ANGLE; "" of other words."""
    units = [unit_named(quantity, word) for quantity in ("azimuth", "time")]
    names = {word.lower(), *(unit.name for unit in units if unit)}
    return next((part for part, words in _ANGLE.items() if words & names), "")


def under(groups: Sequence[str], units: Sequence[str]) -> tuple[list[str], list[str]] | None:
    """Names and units of columns, some of which are parts of what stands over several: `AZIMUTH` over `DEG MIN SEC`,
    `ZULU TIME` over `HH MM SS.SSS`; None unless all that stands over several does. A column of metres beside one of
    degrees has a name of its own. groups: what stands over each column. units: the words under it."""
    words = [unit.lower().strip("()[]").partition(".")[0] for unit in units]
    names, left, column = list(groups), list(units), 0
    for group, run in itertools.groupby(groups):
        mine = slice(column, column := column + len(list(run)))
        if mine.stop - mine.start == 1:
            continue
        angle = [role(word) == part for word, part in zip(words[mine], _ANGLE, strict=False)]
        clock = {*taken_apart(group).words} & {*ALIASES["time"]} and _OF_CLOCK.issuperset(words[mine])
        if clock:
            names[mine], left[mine] = words[mine], [""] * len(words[mine])
        elif group and len(angle) == len(words[mine]) and all(angle):
            names[mine] = [f"{group} {unit}" for unit in units[mine]]
        else:
            return None
    return (names, left) if names != [*groups] else None


def found(quantity: str, names: Mapping[int, Name]) -> dict[str, int] | None:
    """The columns {role: position} that are the quantity together, or None. names: by position."""
    if quantity == "time":
        return _time(names)
    return None if quantity == "range" else _angle(quantity, names)


def together(quantity: str, names: Sequence[Name]) -> dict[str, int] | None:
    """The roles {role: index} of the columns that the user names for one quantity, in any order."""
    by_index = dict(enumerate(names))
    if quantity == "time":
        return _time(by_index) or ({"date": 0, "time": 1} if len(names) == 2 else None)
    if quantity == "range":
        return {f"part {k + 1}": k for k in by_index}
    return _angle(quantity, by_index) or (dict(zip(_ANGLE, by_index, strict=False)) if len(names) <= 3 else None)


def _time(names: Mapping[int, Name]) -> dict[str, int] | None:
    def one(role: str) -> int | None:
        return _only(names, lambda name: bool(_spellings(name) & set(_TIME[role])))

    clock = [k for k, name in names.items() if name.stem in ALIASES["time"] and name.stem not in _ELAPSED]
    hms = {role: one(role) for role in ("hour", "minute", "second")}
    in_two = {name.unit.lower(): k for k, name in names.items() if name.stem in ("time", "t") and name.unit}
    for role in ("minute", "second") if len(in_two) == 2 else ():  # Time_min, Time_sec
        hms[role] = next((k for unit, k in in_two.items() if unit in _TIME[role]), hms[role])
    if hms["second"] is None:  # SS.SSS
        hms["second"] = _only(names, lambda name: len(name.stem) > 1 and not name.stem.strip("s"))
    if hms["minute"] is None and hms["hour"] is not None and hms["hour"] + 1 in names:  # the second of two MM
        hms["minute"] = hms["hour"] + 1 if names[hms["hour"] + 1].stem in _TIME["minute"] else None
    week = one("week")
    if week is not None:
        of_week = _only(names, lambda name: name.stem in _SECONDS_OF_WEEK)
        seconds = of_week if of_week is not None else next(iter(clock), hms["second"])
        return None if seconds is None else {"week": week, "tow": seconds}
    fraction = _fraction(names)
    clock = [index for index in clock if index != fraction]
    calendar = {role: one(role) for role in ("year", "month", "day")}
    if calendar["month"] is None:  # MM beside YYYY and DD
        minute = None if hms["hour"] is None else hms["minute"]
        calendar["month"] = _only({k: names[k] for k in names if k != minute}, lambda name: name.stem == "mm")
    days = {role: index for role, index in calendar.items() if index is not None}
    if len(days) < 3:
        days = {role: index for role in ("year", "doy") if (index := one(role)) is not None}
        days = days if "doy" in days else {}
    date = one("date")
    counted = _only(names, lambda name: name.stem in _DAY_COUNTS)
    if date is None and not days and counted is not None:
        date, clock = counted, [index for index in clock if index != counted]
    if date is not None:
        days = {"date": date}
        of_day = _only({k: names[k] for k in names if k != date}, lambda name: unit_of_day(name) is not None)
        clock += [of_day] if not clock and None in hms.values() and of_day is not None else []
    parts = {role: index for role, index in hms.items() if index is not None}
    alone = not any(name.means("time") == 1 for k, name in names.items() if k not in parts.values())
    if len(parts) == 3 or (len(parts) == 2 and "minute" in parts and alone):
        days |= parts
    else:
        clock += [hms["second"]] if not clock and hms["second"] is not None and (days or fraction is not None) else []
        if not clock or not (days or fraction is not None):
            return None
        days |= {"time": clock[0]}
    return days if fraction is None or fraction in days.values() else {**days, "fraction": fraction}


def _fraction(names: Mapping[int, Name]) -> int | None:
    """The column of a fraction of the second: `ms`, or `stamp.nanosec` beside `stamp.sec`."""
    seconds = [name for name in names.values() if {name.stem, name.unit.lower()} & set(_TIME["second"])]

    def beside_seconds(name: Name) -> bool:
        whole = [other for other in seconds if other is not name]
        words = {word for other in whole for word in (other.stem, *other.text.lower().split(".")[-2:-1])}
        return name.unit.lower() in FRACTIONS and name.stem in words

    beside = _only(names, beside_seconds)
    return _only(names, lambda name: bool(_spellings(name) & set(FRACTIONS))) if beside is None else beside


def _spellings(name: Name) -> set[str]:
    """The stem of a name, with its unit, and without a prefix such as UTC."""
    core = "".join(word for k, word in enumerate(name.words) if k or word not in _PREFIXES)
    return {name.stem, core, name.stem + name.unit.lower(), core + name.unit.lower()} - {""}


def is_day_of_year(name: Name) -> bool:
    """Whether it names a day of the year, perhaps with a word that says it has a fraction."""
    bare = "".join(word for word in name.words if word not in ("decimal", "dec", "fractional", "frac", "utc"))
    return bool({name.stem, bare} & {*_TIME["doy"]}) and not name.foreign


def unit_of_day(name: Name) -> str | None:
    """The unit of a time of day beside a date, such as `Msec of day` or `UT (h)`, "" where its name states none; None
    of other names."""
    text = re.sub("[^a-z]", "", name.text.lower())
    if {name.stem, text} & _OF_DAY_STEMS:
        return "ms" if name.stem == "msod" else name.unit or ("h" if name.stem[0] == "h" else "")
    found = _OF_DAY.fullmatch(text)
    if found is None or not found["unit"] or unit_named("time", found["unit"]) is None:
        return None
    return found["unit"]


def unit_alone(name: Name) -> str:
    """The unit of a time that a name is, perhaps with words of when it counts from: `minutes since start`; or ""."""
    units = {*_TIME["minute"][:2], *_TIME["hour"][:2], *FRACTIONS} - {"ms", "us", "ns"}
    words = [word for word in (*name.words, name.unit.lower()) if word in units]
    rest = {*name.words, name.unit.lower()} - {*words, ""}
    return FRACTIONS.get(words[0], words[0]) if len(words) == 1 and OF_TIMES.issuperset(rest) else ""


def unit_of_fraction(name: Name) -> str:
    """The unit of a fraction of the second."""
    return next(FRACTIONS[word] for word in (*_spellings(name), name.unit.lower()) if word in FRACTIONS)


def _angle(quantity: str, names: Mapping[int, Name]) -> dict[str, int] | None:
    if quantity == "azimuth" and (roles := turned(names)) is not None:
        return roles
    for stem in (*ALIASES[quantity], *WEAK_ALIASES[quantity], *(ZENITH_ALIASES if quantity == "elevation" else ())):
        mine = {index: role(name.unit or name.text.split()[-1]) for index, name in names.items() if name.stem == stem}
        fits = {part: [index for index, found in mine.items() if found == part] for part in _ANGLE}
        known = {part: only[0] for part, only in fits.items() if len(only) == 1}
        if len(known) == len(mine) > 1 and {"deg", "min"} <= set(known):
            return known
    return None


def _only(names: Mapping[int, Name], test: Callable[[Name], bool]) -> int | None:
    fits = [index for index, name in names.items() if test(name)]
    return fits[0] if len(fits) == 1 else None
