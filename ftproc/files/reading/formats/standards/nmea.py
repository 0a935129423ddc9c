"""NMEA 0183: the targets of a radar (TTM), with the clock of ZDA, RMC or the logger; other sentences as they stand."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ftproc.errors import InputError
from ftproc.files import limits
from ftproc.files.options import ABSENT
from ftproc.files.reading.formats.header import Stated, TableHeader
from ftproc.files.reading.formats.sparse import Sparse

_SENTENCE = re.compile(
    r"(?P<before>[^$!]{0,60}?)[$!](?P<type>[A-Z][A-Z0-9]{2,7}),(?P<body>[^*]*?)(?P<comma>,?)(?:\*(?P<code>[0-9A-Fa-f]{2}))?"
)
_MOSTLY = 0.6  # of the lines of a text are sentences
#: The time that a logger writes before a sentence: seconds or ms since 1970, also in a tag block; or a stamp.
_UNIX = re.compile(r"(?<![\d.])(\d{10})(?:\.(\d{1,9})|(\d{3}))?(?![\d.])")
_STAMP = re.compile(r"(?:\d{4}[-/.]\d\d[-/.]\d\d[T ])?\d\d:\d\d:\d\d(?:[.,]\d+)?(?:\s?Z|[+-]\d\d:?\d\d)?")
_HEADINGS = ("HDT", "THS", "OSD")
_LENGTHS_M = {"K": 1000.0, "N": 1852.0, "S": 1609.344}
_CLOCKS = {"ZDA": 0, "RMC": 0, "GGA": 0, "GLL": 4}  # the field of the time of day
_LOST = "L"
_STILL_KN = 0.5  # of the ship
_POSITIONS = {
    "TLL": "positions of targets (TLL)",
    **dict.fromkeys(("GGA", "GLL", "RMC"), "a receiver's own positions"),
    "VDM": "positions that ships broadcast (AIS)",
}
_RELATIVE = (
    "its bearings are relative to the ship's bow, and no heading (HDT) stands beside. Say --columns "
    "azimuth=bearing_deg to take them as they are, or --columns azimuth=none."
)
_DAY_S = 86400


class _Sentence(NamedTuple):
    before: str
    kind: str
    fields: Sequence[str]


class _Ship:
    """What the sentences before tell of clock and heading."""

    def __init__(self) -> None:
        self.day: np.datetime64 | None = None
        self.second: float | None = None
        self.heading: float | None = None
        self.moves = False

    def hear(self, sentence: _Sentence) -> None:
        kind, fields = sentence.kind[-3:], sentence.fields
        if kind in _CLOCKS:
            self.second = _of_day(_at(fields, _CLOCKS[kind]))
            date = fields[3:0:-1] if kind == "ZDA" else re.findall("..", _at(fields, 8))[::-1] if kind == "RMC" else []
            if len(date) == 3 and all(part.isdecimal() for part in date):
                year = int(date[0]) + (2000 if len(date[0]) == 2 else 0)
                self.day = np.datetime64(f"{year:04d}-{int(date[1]):02d}-{int(date[2]):02d}", "D")
            self.moves |= kind == "RMC" and (_number(_at(fields, 6)) or 0.0) > _STILL_KN
        elif kind in _HEADINGS:
            self.heading = _number(_at(fields, 0))

    def moment(self, second: float | None) -> str:
        """A second of the day with the day that is nearest to the clock's, where it is known."""
        if second is None:
            return ""
        ticks = np.timedelta64(round(second * 1e6), "us")
        if self.day is None or self.second is None:
            return str(np.datetime64(0, "us") + ticks).partition("T")[2]
        return str(self.day + round((self.second - second) / _DAY_S) + ticks)


def read(text: str, room: limits.Room) -> TableHeader | None:
    """The targets of TTM sentences; else the fields of the sentence of which there are the most, such as
    `$PTRK,120000.05,1234.5*42`. None if most lines are no sentences. Raises InputError for positions alone."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    found = [match for line in lines if (match := _SENTENCE.fullmatch(line))]
    sound = [match for match in found if _is_sound(match)]
    damaged = len(found) - len(sound)
    if damaged < _MOSTLY * len(found):  # else nobody has reckoned the checksums
        found = sound
    sentences = [_Sentence(match["before"], match["type"], match["body"].split(",")) for match in found]
    if not sentences or len(sentences) < _MOSTLY * len(lines):
        return None
    kinds = Counter(each.kind for each in sentences)
    if any(kind[-3:] == "TTM" for kind in kinds):
        return _targets(sentences, room, damaged)
    held = [what for kind in kinds if (what := _POSITIONS.get(kind[-3:]))]
    if held and all(len(kind) == 5 for kind in kinds):
        raise InputError(
            f"{room.name}: these NMEA sentences hold {held[0]}, and no ranges and bearings (TTM) of a radar."
        )
    return _fields(sentences, kinds, len(lines), room)


def _is_sound(match: re.Match[str]) -> bool:
    """Whether the checksum of a sentence is right, if it has one."""
    code = 0
    for byte in f"{match['type']},{match['body']}{match['comma']}".encode():
        code ^= byte
    return match["code"] is None or int(match["code"], 16) == code


def _targets(sentences: Sequence[_Sentence], room: limits.Room, damaged: int) -> TableHeader:
    columns, ship = Sparse(room), _Ship()
    left = Counter({"sentences with a wrong checksum": damaged} if damaged else {})
    relative, rows = False, list[tuple[list[str], dict[str, float | str | None]]]()
    for each in sentences:
        ship.hear(each)
        if each.kind[-3:] != "TTM":
            continue
        fields = each.fields
        if _at(fields, 11) == _LOST:
            left["sentences of lost targets"] += 1
            continue
        bearing, is_relative = _number(_at(fields, 2)), _at(fields, 3) == "R"
        if bearing is not None and is_relative and ship.heading is not None:
            bearing = (bearing + ship.heading) % 360
            is_relative = False
        relative |= is_relative
        distance, unit = _number(_at(fields, 1)), _LENGTHS_M.get(_at(fields, 9), 1852.0)
        times = [ship.moment(_of_day(_at(fields, 13))), _stamp(each.before), ship.moment(ship.second)]
        values = {"range_m": None if distance is None else distance * unit, "bearing_deg": bearing,
                  "target_number": _at(fields, 0), "name": _at(fields, 10), "status": _at(fields, 11)}  # fmt: skip
        rows.append((times, values))
    clock = next((k for k in range(3) if sum(bool(times[k]) for times, _ in rows) > 0.9 * len(rows)), None)
    if not rows or clock is None:
        what = "nothing says when a target was seen" if rows else "no sentence TTM is of a tracked target"
        raise InputError(
            f"{room.name}: {what}; a log needs TTM with a clock of its own, ZDA, RMC, or the logger's time in front of "
            "each sentence."
        )
    for times, values in rows:
        columns.add(
            ("time" if name == "" else name, value)
            for name, value in {"": times[clock], **values}.items()
            if value is not None
        )
    notes = [f"{count} {what}, left out" for what, count in left.items()]
    notes += ["the ship moves, and its motion is not taken out of ranges and bearings"] if ship.moves else []
    quantities = {"range": "range_m", "azimuth": "bearing_deg", "elevation": ABSENT}
    questions = {"azimuth": _RELATIVE} if relative else {}
    stated = Stated(quantities, "" if relative else "north", "target_number", questions=questions, notes=tuple(notes))
    return replace(columns.header("NMEA 0183, sentences TTM"), stated=stated)


def _fields(sentences: Sequence[_Sentence], kinds: Counter[str], lines: int, room: limits.Room) -> TableHeader:
    """The fields of the most frequent sentence, by their numbers."""
    chosen = kinds.most_common(1)[0][0]
    bodies = [each.fields for each in sentences if each.kind == chosen]
    width = 1 + max(map(len, bodies))
    if width > limits.MOST_COLUMNS:
        raise limits.too_many_columns(room.name)
    names, left = [str(k + 1) for k in range(width)], lines - kinds[chosen]
    columns = Sparse(room, names)
    for body in bodies:
        columns.add((name, cell) for name, cell in zip(names, (chosen, *body), strict=False) if cell)
    form = f"text, sentences {chosen}, no column names" + (f", {left} others" if left else "")
    return columns.header(form, decimal_comma=True)


def _stamp(before: str) -> str:
    """The time that a logger writes before a sentence, or ""."""
    if (stamp := _STAMP.search(before)) is not None:
        return stamp[0].replace(",", ".")
    unix = _UNIX.search(before)
    if unix is None:
        return ""
    return str(np.datetime64(int(unix[1]) * 10**9 + int((unix[2] or unix[3] or "").ljust(9, "0")), "ns"))


def _at(fields: Sequence[str], index: int) -> str:
    return fields[index].strip() if index < len(fields) else ""


def _number(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None


def _of_day(cell: str) -> float | None:
    """hhmmss.ss in seconds of the day."""
    found = re.fullmatch(r"(\d\d)(\d\d)(\d\d(?:\.\d*)?)", cell)
    return None if found is None else 3600 * int(found[1]) + 60 * int(found[2]) + float(found[3])
