"""CCSDS Tracking Data Messages (503.0-B-1 and -2), in keywords (KVN) and in XML.

Of each segment the ranges, azimuths and elevations are read, and Doppler as range rate. The station is the participant
that receives, the target the one before it on the path. Whether a two-way range is the whole way or half of it is left
to the agreement of the parties by the standard, so it is asked.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ftproc.errors import InputError
from ftproc.files import leap_seconds
from ftproc.files.limits import Room
from ftproc.files.reading.formats.header import Stated, TableHeader
from ftproc.files.reading.formats.sparse import Sparse
from ftproc.files.units import LIGHT_MPS

_LIGHT_KMPS = LIGHT_MPS / 1e3
_LEAF = re.compile(r"<(?:\w{1,20}:)?(\w{1,60})(?:\s[^<>]*+)?>([^<>]*+)</|<(/?)(?:\w{1,20}:)?(metadata|data)>")
_ANGLES = {
    "RADEC": "right ascension and declination",
    "XEYN": "angles of an X-Y mount",
    "XSYE": "angles of an X-Y mount",
}
#: Time systems -> seconds that they are ahead of GPS time, which is ahead of UTC by the leap seconds since 1980.
_SYSTEMS = {"GPS": 0.0, "TAI": -19.0, **dict.fromkeys(("TT", "TDT", "TDB", "ET"), -51.184)}
_TWO_WAY = (
    "RANGE is along the path {path}, there and back, and the standard leaves open whether it is half of the way or the "
    "whole. Say --columns range=range if it is half of it, or --columns range=range_halved if it is the whole way."
)
_RELAYED = (
    "RANGE is along the path {path}, not between one station and its target. Say --columns range=none to leave it out, "
    "or --columns range=range to take it for a range all the same."
)


def read(text: str, room: Room) -> TableHeader:
    """The readings of all segments. Raises InputError where there are none."""
    columns, left, questions, others = Sparse(room), Counter[str](), dict[str, str](), set[str]()
    for meta, data in _segments(text):
        rows: dict[str, dict[str, Any]] = {}
        for keyword, epoch, value in data:
            found = _reading(meta, keyword, value)
            if found is None:
                left[_why(meta, keyword)] += 1
                continue
            rows.setdefault(epoch, {})[found[0]] = found[1]
        if (system := meta.get("TIME_SYSTEM", "UTC")) not in ("UTC", *_SYSTEMS):
            others.add(f"epochs of the time system {system} are taken for UTC")
        station, target, question = _ends(meta)
        for epoch, row in rows.items():
            if "range" in row:
                row["range_halved"] = row["range"] / 2 if question else row["range"]
                questions |= {"range": question} if question else {}
            columns.add([("time", _utc(epoch, meta, room)), *row.items(), ("station", station), ("target", target)])
    notes = (*(f"{count} values are left out: {what}" for what, count in left.items()), *sorted(others))
    if not {"range", "azimuth_deg", "elevation_deg"} & set(columns.columns):
        held = "; ".join(left) or "no observations"
        raise InputError(f"{room.name}: this TDM holds no range, azimuth or elevation of a target, but {held}.")
    if not questions:
        columns.columns.pop("range_halved", None)
    header = columns.header("CCSDS TDM")
    stated = Stated({}, "north", "target", "station", questions, notes)
    units = ["km" if name.startswith("range") and name != "range_rate_mps" else "" for name in header.names]
    return replace(header, stated=stated, units=units)


def _segments(text: str) -> Iterator[tuple[Mapping[str, str], list[tuple[str, str, str]]]]:
    """Metadata and data (keyword, epoch, value) of each segment."""
    meta: dict[str, str] = {}
    data: list[tuple[str, str, str]] = []
    for keyword, value, epoch in _of_xml(text) if "<" in text[:2000] else _of_keywords(text):
        if keyword == "META_START":
            if data:
                yield meta, data
            meta, data = {}, []
        elif epoch:
            data.append((keyword, epoch, value))
        else:
            meta[keyword] = value
    if data:
        yield meta, data


def _of_keywords(text: str) -> Iterator[tuple[str, str, str]]:
    """Keyword, value and, of data, epoch."""
    in_data = False
    for line in text.splitlines():
        word = line.strip()
        keyword, equals, behind = (part.strip() for part in word.partition("="))
        if word == "META_START":
            in_data = False
            yield word, "", ""
        elif word == "DATA_START":
            in_data = True
        elif equals and not word.startswith("COMMENT"):
            epoch, _, value = behind.partition(" ") if in_data else ("", "", behind)
            yield keyword, value.strip(), epoch


def _of_xml(text: str) -> Iterator[tuple[str, str, str]]:
    epoch, in_data = "", False
    for leaf in _LEAF.finditer(text):
        if leaf[4]:
            in_data = leaf[4] == "data" and not leaf[3]
            if leaf[4] == "metadata" and not leaf[3]:
                yield "META_START", "", ""
        elif leaf[1] == "EPOCH":
            epoch = leaf[2].strip()
        elif leaf[1] != "COMMENT":
            yield leaf[1], leaf[2].strip(), epoch if in_data else ""


def _reading(meta: Mapping[str, str], keyword: str, value: str) -> tuple[str, float] | None:
    """Column and value of an observation; None of what is no reading of a station."""
    correction = meta.get(f"CORRECTION_{keyword.removesuffix('_INSTANTANEOUS')}", "0")
    try:
        number = float(value) + (float(correction) if meta.get("CORRECTIONS_APPLIED") == "NO" else 0.0)
    except ValueError:
        return None
    if keyword == "RANGE":
        unit = meta.get("RANGE_UNITS", "km")
        scale = {"km": 1.0, "s": _LIGHT_KMPS}.get(unit)
        return None if scale is None or "DIFF" in meta.get("MODE", "") else ("range", number * scale)
    if keyword in ("ANGLE_1", "ANGLE_2") and meta.get("ANGLE_TYPE") == "AZEL":
        return ("azimuth_deg" if keyword == "ANGLE_1" else "elevation_deg"), number
    if keyword == "DOPPLER_INSTANTANEOUS":
        return "range_rate_mps", 1e3 * number
    return None


def _why(meta: Mapping[str, str], keyword: str) -> str:
    """What a value is that is not read."""
    if keyword.startswith("ANGLE"):
        kind = meta.get("ANGLE_TYPE", "")
        return _ANGLES.get(kind, f"angles of the type {kind or 'that is not stated'}")
    if keyword == "RANGE":
        return "differenced ranges" if "DIFF" in meta.get("MODE", "") else "ranges in units of the station"
    return keyword.rstrip("_12345").lower().replace("_", " ")


def _ends(meta: Mapping[str, str]) -> tuple[str, str, str]:
    """Station, target, and what is open about the range."""
    path = [word.strip() for word in meta.get("PATH", meta.get("PATH_1", "2,1")).split(",")]
    names = [meta.get(f"PARTICIPANT_{word}", word) for word in path]
    station, target = names[-1], names[-2] if len(names) > 1 else ""
    question = "" if len(path) < 3 else _TWO_WAY if len(path) == 3 and path[0] == path[-1] else _RELAYED
    return station, target, question.format(path=" - ".join(names))


def _utc(epoch: str, meta: Mapping[str, str], room: Room) -> str:
    """The epoch in UTC, as far as it is known; of other time systems as it stands."""
    system = meta.get("TIME_SYSTEM", "UTC").upper()
    if system not in _SYSTEMS:
        return epoch.rstrip("Z") + "Z"
    date, _, clock = epoch.rstrip("Z").partition("T")
    try:
        year, *rest = date.split("-")
        day = np.datetime64(f"{year}-01-01", "D") + (int(rest[0]) - 1) if len(rest) == 1 else np.datetime64(date, "D")
        hour, minute, second = clock.split(":")
        ticks = round((3600 * int(hour) + 60 * int(minute) + float(second) + _SYSTEMS[system]) * 1e9)
    except (ValueError, IndexError) as error:
        raise InputError(f'{room.name}: "{epoch[:40]}" is no epoch of a TDM; correct it.') from error
    leap = int(leap_seconds.before(np.array(day.astype(np.int64))))
    return str(day.astype("datetime64[ns]") + np.timedelta64(ticks - leap * 10**9, "ns")) + "Z"
