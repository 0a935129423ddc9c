"""Texts in which a word says what each line holds, as Orekit's measurements or lists of sensors:

2010-11-02T03:00:13.385  RANGE  Uralla  38014.9488
R  1.014892  0.554329  4.892807  1477010443050000
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ftproc.files import limits
from ftproc.files.options import ABSENT
from ftproc.files.reading.formats.header import Stated, TableHeader
from ftproc.files.reading.formats.sparse import Sparse

_MOSTLY = 0.9  # of the lines that are no comments


class _Kind(NamedTuple):
    """line: a line of one kind, with the names of its cells. units: of the cells."""

    line: re.Pattern[str]
    units: Mapping[str, str]


class _Layout(NamedTuple):
    """name. kinds: those that are read; others: the words of lines that are not. stated: by the format."""

    name: str
    kinds: Sequence[_Kind]
    others: re.Pattern[str]
    stated: Stated


def _kind(pattern: str, **units: str) -> _Kind:
    return _Kind(re.compile(pattern), units)


_N = r"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?"
_OREKIT = r"(?P<time>\d{4}-\d\d-\d\dT\S+)\s+"
LAYOUTS = (
    _Layout(  # replies of a Leica total station to TMC_GetSimpleMea, with the logger's clock before them
        "GeoCOM",
        (
            _kind(
                r"\W*(?P<time>\d{4}-\d\d-\d\d[T ][^\s,;<>]+|\d+:\d\d:[\d.]+|\d+(?:\.\d+)?)(?![\d.:]).*%R1P,0,\d+:0,"
                rf"(?P<Hz>{_N}),(?P<zenith>{_N}),(?:(?:{_N},){{4}})?(?P<range>{_N})(?:,\d+)?",
                Hz="rad",
                zenith="rad",
                range="m",
            ),
        ),
        re.compile(r".*%R1[QP],.*"),
        Stated({"elevation": "zenith"}),
    ),
    _Layout(
        "Orekit measurements",
        (
            _kind(rf"{_OREKIT}RANGE\s+(?P<station>\S+)\s+(?P<range>{_N})\b.*", range="km"),
            _kind(
                rf"{_OREKIT}AZ_EL\s+(?P<station>\S+)\s+(?P<azimuth>{_N})\s+(?P<elevation>{_N})\b.*",
                azimuth="deg",
                elevation="deg",
            ),
        ),
        re.compile(rf"{_OREKIT}(?:RANGE_RATE|PV|POSITION|BISTATIC\w*|ONBOARD\w*)\b.*"),
        Stated({}, "north", station="station"),
    ),
    _Layout(
        "a radar's lines among a lidar's",
        (
            _kind(
                rf"R\s+(?P<range>{_N})\s+(?P<azimuth>{_N})\s+(?P<range_rate_mps>{_N})\s+(?P<timestamp>(?:\d{{3}}){{4,6}}\d)\b.*",
                range="m",
                azimuth="rad",
            ),
        ),
        re.compile(rf"L\s+{_N}\s+{_N}\s+\d{{13,19}}\b.*"),
        Stated({"elevation": ABSENT}),
    ),
)
MARK = rf"^(?:.{{0,60}}%R1P,0,\d+:0,|{_OREKIT}(?:RANGE|AZ_EL|PV)\s|[RL]\s+{_N}\s+{_N}\s+(?:{_N}\s+)?\d{{13,19}}\s)"


def read(text: str, room: limits.Room) -> TableHeader | None:
    """The lines of one of LAYOUTS, each a row; None of other texts."""
    lines = [line.strip() for line in text.splitlines()]
    lines = [line for line in lines if line and not line.startswith(("#", "%", "//"))]
    for layout in LAYOUTS:
        columns, left = Sparse(room), 0
        units: dict[str, str] = {}
        counts = Counter[str]()
        for line in lines:
            found = next(((kind, m) for kind in layout.kinds if (m := kind.line.fullmatch(line))), None)
            if found is None:
                left += 1
                counts["other"] += not layout.others.fullmatch(line)
                continue
            columns.add(
                (name, _moment(cell) if name == "timestamp" else cell) for name, cell in found[1].groupdict().items()
            )
            units |= found[0].units
        if columns.rows and counts["other"] <= (1 - _MOSTLY) * len(lines):
            notes = (f"{left} lines of other kinds are left out",) if left else ()
            header = columns.header(f"text, {layout.name}")
            stated = layout.stated._replace(notes=notes)
            return replace(header, stated=stated, units=[units.get(name, "") for name in header.names])
    return None


def _moment(cell: str) -> np.datetime64:
    """The instant of a number of ms, us or ns since 1970, by its digits."""
    return np.datetime64(int(cell) * 10 ** (19 - len(cell)), "ns")
