"""Decisions on readings by hand: a CSV that the engineer writes, and what it means for a log.

    component,from_s,to_s,use,reason
    range,412.0,418.5,bad,multipath off the hangar
    all,500.2,500.2,good,

`component` is one of CHANNELS or `all`; `use` is `bad` (never used), `good` (used whatever the editor thinks) or
`auto` (the editor decides). Instead of times a line may name rows of the log, `from_row` and `to_row`, counted from 0
without the header. Both ends belong to it. Of lines that name the same reading the last counts. With several logs the
column `station` says which one a line is for.
"""

from __future__ import annotations

import csv
import hashlib
import io
import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ftproc.errors import InputError, UsageError, nearest
from ftproc.records import (
    ACCEPTED,
    CHANNELS,
    ENDS,
    GOOD,
    ISOLATED,
    MISSING,
    PATCH,
    USES,
    ByHand,
    FlagArray,
    FloatArray,
    IntArray,
    Line,
    Lines,
    MeasurementLog,
)

ALL = "all"
COLUMNS = ("component", *ENDS[0], *ENDS[1], "use", "station", "reason")
_REASONS = {ISOLATED: "isolated outlier", PATCH: "patch"}
_LARGEST = 16 << 20  # bytes
_HOW = "See the head of a file that --write-decisions writes."


class Decisions(Lines):
    """The lines of a file, and what they mean for a log."""

    def of(self, station: str) -> Decisions:
        """The lines for one station, and those for all."""
        return replace(self, lines=tuple(line for line in self.lines if line.station in ("", station)))

    def check(self, stations: Sequence[str], same_clock: bool = False) -> None:
        """Raise UsageError if no line is for one of these stations, or a line is for all of several: their rows, and if
        they have not the same clock their times, have nothing to do with each other."""
        if self.lines and not any(self.of(station).lines for station in stations):
            raise UsageError(f"{self.name}: no line is for {', '.join(stations[:3])}; correct the column station.")
        for line in self.lines:
            if len(stations) > 1 and not line.station and (line.by_row or not same_clock):
                raise UsageError(
                    f"{self.name}: line {line.number} names no station, and there are several; write the name of its "
                    f"station, or of its log without the ending, in the column station: {', '.join(stations[:3])}."
                )

    def applied(self, log: MeasurementLog, station: str = "") -> MeasurementLog:
        """The log with these decisions on its readings. station: its name in the file, in which there may be none for
        it. Raises InputError if lines are for it and none names a reading of it, or if only one of two readings of the
        same time is accepted."""
        own = self.of(station)
        if not own.lines:
            return log
        there = np.isfinite(readings(log))
        line = np.zeros(there.shape, np.int64)
        by_row = np.argsort(log.row, kind="stable")
        for number, each in enumerate(own.lines, 1):
            order = log.row[by_row] if each.by_row else log.time_s
            low, high = np.searchsorted(order, each.first), np.searchsorted(order, each.last, side="right")
            rows = by_row[low:high] if each.by_row else slice(low, high)
            line[rows, component_slice(each.component)] = number
        line[~there] = 0
        if not line.any():
            raise InputError(self._names_nothing(log, station))
        found = ByHand(own, line)
        _check_same_times(self.name, log, found.flags)
        return replace(log, by_hand=found)

    def _names_nothing(self, log: MeasurementLog, station: str) -> str:
        named = sorted({line.station for line in self.lines} - {""})
        other = f", whose station is {station}" if station and named else ""
        stations = f"; its stations: {', '.join(named)}" if named else ""
        times = (
            f"times from {log.time_s[0]:.12g} to {log.time_s[-1]:.12g} s, rows from {log.row.min()} to {log.row.max()}"
        )
        return f"{self.name}: no line names a reading of {log.name}{other} ({times}{stations}); check the file."


def as_dict(line: Line) -> dict[str, Any]:
    """JSON-serialisable, with the names of the file's columns."""
    first, last = (int(each) if line.by_row else each for each in (line.first, line.last))
    found = {"line": line.number, "component": line.component, line.ends[0]: first, line.ends[1]: last}
    more = {"station": line.station, "reason": line.reason}
    return {**found, "use": line.use, **{name: text for name, text in more.items() if text}}


def component_slice(component: str) -> slice:
    """The columns of an (n, 5) array that a component names."""
    c = 0 if component == ALL else CHANNELS.index(component)
    return slice(None) if component == ALL else slice(c, c + 1)


def readings(log: MeasurementLog) -> FloatArray:
    """(n, 5) of CHANNELS, NaN where missing."""
    missing = np.full(len(log), np.nan)
    rate, height = log.range_rate, None if log.heights is None else log.heights.above_m
    return np.column_stack([log.measurement, *(missing if each is None else each for each in (rate, height))])


def _check_same_times(name: str, log: MeasurementLog, flags: FlagArray) -> None:
    """Raise InputError where of two readings of the same time one is accepted and the other left to the editor, which
    knows readings by their times."""
    same = (log.time_s[1:] == log.time_s[:-1])[:, None] & np.isfinite(log.measurement[1:] + log.measurement[:-1])
    one, other = flags[1:], flags[:-1]
    unequal = same & (((one == ACCEPTED) & (other == GOOD)) | ((one == GOOD) & (other == ACCEPTED)))
    if unequal.any():
        k = int(np.flatnonzero(unequal.any(1))[0])
        raise InputError(
            f"{name}: rows {log.row[k]} and {log.row[k + 1]} of {log.name} have the same time, and one of them is good "
            "by hand; say good or bad of the other too."
        )


def read(path: str | Path) -> Decisions:
    """The decisions in a file. Raises UsageError, naming file and line, for what is not understood."""
    try:
        with Path(path).open("rb") as stream:
            content = stream.read(_LARGEST + 1)
        text = content.decode("utf-8-sig")
    except FileNotFoundError as error:
        raise UsageError(
            f"{path}: there is no such file. ftproc filter LOG --write-decisions {path} makes one."
        ) from error
    except UnicodeDecodeError as error:
        raise UsageError(f"{path}: this is not UTF-8 text; save it as CSV in UTF-8.") from error
    except OSError as error:
        raise UsageError(f"{path}: cannot be read ({(error.strerror or str(error)).lower()}).") from error
    if len(content) > _LARGEST:
        raise UsageError(f"{path}: far too large for decisions by hand; name a file that --write-decisions wrote.")
    return Decisions(str(path), hashlib.sha256(content).hexdigest(), tuple(_lines(str(path), text)))


def from_metadata(found: Mapping[str, Any]) -> Decisions:
    """The decisions that the metadata of a trajectory hold, so that it can be computed without the file."""
    lines = []
    for each in found["lines"]:
        ends = ENDS[1] if ENDS[1][0] in each else ENDS[0]
        more = (each.get("station", ""), each.get("reason", ""))
        lines.append(Line(each["line"], each["component"], ends, each[ends[0]], each[ends[1]], each["use"], *more))
    return Decisions(found["file"], found["sha256"], tuple(lines))


def _lines(name: str, text: str) -> Iterator[Line]:
    names = next((each for each in text.splitlines() if each.strip() and not each.startswith("#")), "")
    semicolons = ";" in names  # as spreadsheets write where the comma is the decimal point
    rows = csv.reader(io.StringIO(text), delimiter=";" if semicolons else ",", strict=True)
    header: list[str] | None = None
    try:
        for cells in rows:
            cells = [cell.strip() for cell in cells]
            if not any(cells) or cells[0].startswith("#"):
                continue
            if header is None:
                header = [cell.lower() for cell in cells]
                _check_header(name, header)
                continue
            where = f"{name}: line {rows.line_num}"
            if len(cells) > len(header):
                raise UsageError(f"{where} has {len(cells)} cells under {len(header)} names; put quotes round a comma.")
            row = dict(zip(header, cells, strict=False))
            yield _line(where, rows.line_num, row, semicolons)
    except csv.Error as error:
        raise UsageError(f"{name}: line {rows.line_num} is not CSV ({error}); correct it there.") from error
    if header is None:
        raise UsageError(f"{name}: the file is empty; expected a header line, {','.join(COLUMNS[:3])},use. {_HOW}")


def _check_header(name: str, header: Sequence[str]) -> None:
    for column in header:
        if column not in COLUMNS or header.count(column) > 1:
            what = "is there twice" if column in COLUMNS else f"is not known{nearest(column, COLUMNS) or '.'}"
            raise UsageError(f'{name}: column "{column}" {what} The columns: {", ".join(COLUMNS)}.')
    missing = [column for column in ("component", "use") if column not in header]
    if missing or not any(set(ends) <= set(header) for ends in ENDS):
        lacks = missing[0] if missing else "from_s and to_s, or from_row and to_row"
        raise UsageError(f"{name}: there is no column {lacks}. The columns: {', '.join(COLUMNS)}.")


def _line(where: str, number: int, row: Mapping[str, str], decimal_comma: bool) -> Line:
    component, use = (row.get(column, "").lower() for column in ("component", "use"))
    for column, word, known in (("component", component, (*CHANNELS, ALL)), ("use", use, tuple(USES))):
        if word not in known:
            hint = nearest(word, known) or "."
            raise UsageError(f'{where}: {column} is "{word}", expected one of {", ".join(known)}{hint}')
    filled = [ends for ends in ENDS if any(row.get(end) for end in ends)]
    if len(filled) != 1:
        what = "both times and rows" if filled else "neither times nor rows"
        raise UsageError(f"{where} has {what}; fill in from_s and to_s, or from_row and to_row.")
    first, last = (_end(where, end, row.get(end, ""), decimal_comma) for end in filled[0])
    if last < first:
        raise UsageError(f"{where}: {filled[0][1]} is {last:.12g}, before {filled[0][0]}, {first:.12g}; exchange them.")
    return Line(number, component, filled[0], first, last, use, row.get("station", ""), row.get("reason", ""))


def _end(where: str, column: str, cell: str, decimal_comma: bool) -> float:
    try:
        value = float(cell.replace(",", ".") if decimal_comma else cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or (column in ENDS[1] and (value != int(value) or value < 0)):
        expected = "a row number, such as 120" if column in ENDS[1] else "seconds, as in time_s, such as 12.5"
        raise UsageError(f'{where}: {column} is "{cell}", expected {expected}.')
    return value


def taken(time_s: FloatArray, row: IntArray, outlier: FlagArray, station: str = "") -> Iterator[Line]:
    """The editor's decisions in a trajectory as lines that give them again, without those by hand. time_s, row: (n,);
    outlier: (n, 3), or (n, 5) with that of all CHANNELS."""
    for c, component in enumerate(CHANNELS[: outlier.shape[1]]):
        there = np.flatnonzero(outlier[:, c] != MISSING)
        times, flags = time_s[there], outlier[there, c]
        edges = np.r_[0, np.flatnonzero(flags[1:] != flags[:-1]) + 1, len(flags)]
        for low, high in itertools.pairwise(edges.tolist()):
            if high > low and (why := _REASONS.get(int(flags[low]))):
                reason = why if high == low + 1 else f"{why}, {high - low} readings"
                made = partial(Line, 0, component, use="bad", station=station, reason=reason)
                ambiguous = [*(times[low - 1 : low] == times[low]), *(times[high : high + 1] == times[high - 1])]
                if any(ambiguous):
                    yield from (made(ENDS[1], each, each) for each in row[there[low:high]].tolist())
                else:
                    yield made(ENDS[0], float(times[low]), float(times[high - 1]))
