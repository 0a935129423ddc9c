"""ILRS Consolidated Laser Ranging Data (CRD, versions 1 and 2): full rate, normal points and pointing angles.

A range is c/2 times the time of flight, at the time at which the light was at the target. Pointing angles count only
where the station measured them, because predicted ones are no readings.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ftproc.errors import InputError
from ftproc.files.limits import Room
from ftproc.files.reading.formats.header import Stated, TableHeader
from ftproc.files.reading.formats.sparse import Sparse
from ftproc.files.units import LIGHT_MPS

_DAY_S = 86400.0
_RECORDS = {"10": "full rate", "11": "normal points", "30": "pointing angles"}
_TIMED_AT = {"0": -0.5, "1": 0.0, "2": 0.5}  # ground receive, target, ground transmit: times of flight to the target
_WAYS = {"1": 1.0, "2": 2.0}
_MEASURED = "3"  # origin of pointing angles
_ORIGINS = {"0": "of unknown origin", "1": "computed", "2": "commanded"}


class _Pass(NamedTuple):
    """station and target as in the file. day: of the start, days since 1970; start: seconds of that day. ways: of the
    light."""

    station: str = ""
    target: str = ""
    day: int = 0
    start: float = 0.0
    ways: float = 2.0


def read(text: str, room: Room) -> TableHeader:
    """The ranges and measured angles of all passes. Raises InputError for a line that is none of the format."""
    columns, left = Sparse(room), Counter[str]()
    now = _Pass()
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split()
        kind = words[0].lower() if words else ""
        try:
            if kind in ("h2", "h3", "h4"):
                now = _headed(now, kind, words)
            elif kind in _RECORDS and not now.day:
                raise InputError(f"{room.name}: line {number} is a reading before the header H4, which gives its day.")
            elif kind in _RECORDS:
                values = _values(now, kind, words, left)
                if values:
                    columns.add([*values.items(), ("station", now.station), ("target", now.target)])
        except (IndexError, ValueError) as error:
            raise InputError(
                f"{room.name}: line {number} is no record of ILRS CRD ({line.strip()[:60]}); correct it or delete it."
            ) from error
    if not columns.rows:
        raise InputError(
            f"{room.name}: this ILRS CRD file has no ranges (records 10 or 11) and no measured angles (30)."
        )
    return _header(columns, left)


def _headed(now: _Pass, kind: str, words: Sequence[str]) -> _Pass:
    if kind == "h2":
        return now._replace(station=words[1])
    if kind == "h3":
        return now._replace(target=words[1])
    year, month, day, hour, minute, second = (int(float(word)) for word in words[2:8])
    date = np.datetime64(f"{year:04d}-{month:02d}-{day:02d}", "D").astype(np.int64)
    way = _WAYS.get(words[20], 0.0) if len(words) > 20 else 2.0
    return now._replace(day=int(date), start=3600.0 * hour + 60 * minute + second, ways=way)


def _values(now: _Pass, kind: str, words: Sequence[str], left: Counter[str]) -> dict[str, Any]:
    """Names and values of a record; nothing of one that is left out."""
    if kind == "30":
        if (origin := words[5]) != _MEASURED:
            left[f"pointing angles {_ORIGINS.get(origin, 'of unknown origin')}, not measured"] += 1
            return {}
        angles = {"azimuth_deg": float(words[2]), "elevation_deg": float(words[3])}
        return {"time": _moment(now, float(words[1])), **angles, "record": int(kind)}
    flight, shift = float(words[2]), _TIMED_AT.get(words[4])
    if shift is None or not now.ways:
        left["times of flight that are no ranges of this station alone"] += 1
        return {}
    second = float(words[1]) + (shift * flight if now.ways == 2 else 0.0)
    return {"time": _moment(now, second), "range_m": LIGHT_MPS * flight / now.ways, "record": int(kind)}


def _moment(now: _Pass, second: float) -> np.datetime64:
    """A second of the day, which starts again at midnight."""
    second += _DAY_S * (second < now.start - _DAY_S / 2)
    return np.datetime64(now.day * 86400 * 10**9 + round(second * 1e9), "ns")


def _header(columns: Sparse, left: Counter[str]) -> TableHeader:
    kinds = [_RECORDS[str(kind)] for kind in sorted(set(columns.columns["record"][1]))]
    notes = tuple(f"{count} {what}, left out" for what, count in left.items())
    known = Stated({}, "north", "target", "station", notes=notes)
    return replace(columns.header(f"ILRS CRD, {' and '.join(kinds)}"), stated=known)
