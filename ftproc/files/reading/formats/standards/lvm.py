"""Measurement files of LabVIEW (.lvm): tags above the rows of each segment, and the first column is the time.

X values count seconds from the date and time of their segment, or from those of the first one where they go on from
segment to segment.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ftproc.errors import InputError
from ftproc.files.limits import Room
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.formats.sparse import Sparse

_SEPARATORS = {"Tab": "\t", "Comma": ","}
_NOT_CHANNELS = ("X_Value", "Comment", "")
_END = "***End_of_Header***"


class _Segment(NamedTuple):
    """tags: those above it, {name: cells}. names: of its columns. rows: their cells."""

    tags: dict[str, list[str]]
    names: list[str]
    rows: list[list[str]]

    def x_values(self, column: int) -> np.ndarray:
        """(n,) of a column; of an empty one from their start and step."""
        cells = [row[column] if column < len(row) else "" for row in self.rows]
        if any(cells):
            return np.array([_number(cell or "nan") for cell in cells])
        start, step = (_number(self.tags.get(tag, [usual])[0]) for tag, usual in (("X0", "0"), ("Delta_X", "nan")))
        return start + step * np.arange(len(cells))


def read(text: str, room: Room) -> TableHeader | None:
    """The channels of all segments; None for a table with its time in a channel. Raises InputError for channels that
    have times of their own."""
    segments = [segment for segment in [*_segments(text)] if segment.rows]
    if not segments:
        return None
    x_values = [_of_all_channels(segment, room) for segment in segments]
    goes_on = all(before[-1] < after[0] for before, after in pairwise(x_values))
    columns = Sparse(room)
    units: dict[str, str] = {}
    for segment, x in zip(segments, x_values, strict=True):
        tags, names = segment.tags, segment.names
        start = _moment((segments[0] if goes_on else segment).tags)
        absolute = tags.get("Time_Pref") == ["Absolute"]
        times = x if absolute or start is None else start + (x * 1e9).round().astype("timedelta64[ns]")
        called = "time" if times.dtype.kind == "M" or absolute else "time_s"
        labels = dict(zip(names[1:], tags.get("Y_Unit_Label", []), strict=False))
        units |= {name: label for name, label in labels.items() if name not in _NOT_CHANNELS}
        for time, cells in zip(times, segment.rows, strict=True):
            channels = (
                (name, cell or None) for name, cell in zip(names, cells, strict=False) if name not in _NOT_CHANNELS
            )
            columns.add([(called, time), *channels])
    found = columns.header("LabVIEW measurement", decimal_comma=True)
    return replace(found, units=[units.get(name, "") for name in found.names])


def _segments(text: str) -> Iterator[_Segment]:
    separator = _SEPARATORS.get(next(iter(re.findall(r"^Separator\W(\w+)", text, re.MULTILINE)), "Tab"), "\t")
    tags: dict[str, list[str]] = {}
    segment = None
    special = False
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.split(separator)]
        special = (special or cells[0] == "***Start_Special***") and cells[0] != "***End_Special***"
        if special or not any(cells):
            continue
        if cells[0] == "Channels":
            segment = None
        if segment is not None:
            segment.rows.append(cells)
        elif cells[0] == "X_Value":
            yield (segment := _Segment(dict(tags), cells, []))
        elif cells[0] != _END:
            tags[cells[0]] = [cell for cell in cells[1:] if cell] if cells[0] != "Y_Unit_Label" else cells[1:]


def _of_all_channels(segment: _Segment, room: Room) -> np.ndarray:
    each = [segment.x_values(k) for k, name in enumerate(segment.names) if name == "X_Value"]
    if any(not np.array_equal(x, each[0]) for x in each):
        raise InputError(f"{room.name}: its channels have X values of their own; write it with one X column.")
    return each[0]


def _number(cell: str) -> float:
    return float(cell.replace(",", "."))


def _moment(tags: Mapping[str, Sequence[str]]) -> np.datetime64 | None:
    date, time = (tags.get(tag, [""])[0] for tag in ("Date", "Time"))
    found = re.fullmatch(r"(\d{4})/(\d\d)/(\d\d) (\d\d:\d\d:\d\d)[.,]?(\d{0,9})\d*", f"{date} {time}")
    return np.datetime64(f"{found[1]}-{found[2]}-{found[3]}T{found[4]}.{found[5] or 0}", "ns") if found else None
