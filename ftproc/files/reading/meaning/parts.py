"""Quantities that several columns hold together: date and time, GPS week and seconds, degrees, minutes, seconds."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from ftproc.files.reading.meaning.names import Name
from ftproc.files.words import ALIASES, WEAK_ALIASES

_SECONDS_OF_WEEK = frozenset(
    ["tow", "sow", "gpstow", "gpssow", "timeofweek", "secondsofweek", "secofweek", "itow", "gpsseconds", "weekseconds"]
)
#: Part of a time -> stems of the names that it has.
_TIME = {
    "date": ("date", "utcdate", "dateutc", "datum", "gpsdate", "yyyymmdd", "calendardate", "ddmmyyyy"),
    "week": ("week", "gpsweek", "wk", "wn", "gpswk", "weeknumber", "gpsweekno", "weekno", "gpsweeknumber"),
    "doy": ("doy", "dayofyear", "yday", "jday", "ddd", "day", "daynumber", "julday", "dayno", "yearday", "irigday"),
    "year": ("year", "yr", "yyyy", "utcyear"),
    "month": ("month", "mon", "mo", "utcmonth"),
    "day": ("day", "dd", "dom", "dayofmonth", "utcday"),
    "hour": ("hour", "hours", "hr", "hrs", "hh", "h", "utchour"),
    "minute": ("minute", "minutes", "min", "mins", "mi", "mn", "mm", "utcminute", "utcmin"),
    "second": ("second", "seconds", "sec", "secs", "ss", "s", "utcsecond", "utcsec"),
}
#: Times that do not count from a midnight, and parts of one.
_ELAPSED = frozenset([*_TIME["second"], "t", "elapsed", "elapsedtime", "elapsedseconds", "missiontime"])
#: Parts of an angle -> units in the names.
_ANGLE = {
    "deg": ("d", "deg", "degs", "degree", "degrees", "°", "dd", "ddd"),
    "min": ("m", "min", "mins", "minute", "minutes", "'", "mm", "arcmin"),
    "sec": ("s", "sec", "secs", "second", "seconds", '"', "ss", "arcsec"),
}


def found(quantity: str, names: Mapping[int, Name]) -> dict[str, int] | None:
    """The columns {role: position} that are the quantity together, or None. names: by position."""
    if quantity == "time":
        return _time(names)
    return None if quantity == "range" else _angle(quantity, names)


def together(quantity: str, names: Sequence[Name]) -> dict[str, int] | None:
    """The roles {role: index} of the columns that the user names for one quantity, in any order."""
    by_index = dict(enumerate(names))
    if quantity == "time":
        return _time(by_index) or _in_order(names)
    roles = _angle(quantity, by_index)
    return roles or (dict(zip(_ANGLE, range(3), strict=True)) if len(names) == 3 else None)


def _in_order(names: Sequence[Name]) -> dict[str, int] | None:
    return {"date": 0, "time": 1} if len(names) == 2 else None


def _time(names: Mapping[int, Name]) -> dict[str, int] | None:
    def one(role: str) -> int | None:
        return _only(
            names, lambda name: name.stem in _TIME[role] or "".join((name.stem, name.unit.lower())) in _TIME[role]
        )

    clock = [k for k, name in names.items() if name.stem in ALIASES["time"] and name.stem not in _ELAPSED]
    hms = {role: one(role) for role in ("hour", "minute", "second")}
    week = one("week")
    if week is not None:
        of_week = _only(names, lambda name: name.stem in _SECONDS_OF_WEEK)
        seconds = of_week if of_week is not None else next(iter(clock), hms["second"])
        return None if seconds is None else {"week": week, "tow": seconds}
    calendar = {role: one(role) for role in ("year", "month", "day")}
    days = {role: place for role, place in calendar.items() if place is not None}
    if len(days) < 3:
        days = {role: place for role in ("year", "doy") if (place := one(role)) is not None}
        days = days if "doy" in days else {}
    date = one("date")
    if date is not None:
        days = {"date": date}
    if None not in hms.values():
        return {**days, **{role: place for role, place in hms.items() if place is not None}}
    if days and not clock and hms["second"] is not None:
        clock = [hms["second"]]
    return {**days, "time": clock[0]} if days and clock else None


def _angle(quantity: str, names: Mapping[int, Name]) -> dict[str, int] | None:
    for stem in (*ALIASES[quantity], *WEAK_ALIASES[quantity]):
        mine = {place: name for place, name in names.items() if name.stem == stem}
        roles = {role: _only(mine, partial(_has_unit, words)) for role, words in _ANGLE.items()}
        known = {role: place for role, place in roles.items() if place is not None}
        if len(known) == len(mine) > 1 and {"deg", "min"} <= set(known):
            return known
    return None


def _has_unit(words: Sequence[str], name: Name) -> bool:
    return name.unit.lower() in words


def _only(names: Mapping[int, Name], test: Callable[[Name], bool]) -> int | None:
    fits = [place for place, name in names.items() if test(name)]
    return fits[0] if len(fits) == 1 else None
