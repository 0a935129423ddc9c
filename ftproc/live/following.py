"""A log that still grows, line by line: what is published leaves at once."""

from __future__ import annotations

import contextlib
import csv
import io
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from ftproc.config.recipe import Recipe
from ftproc.errors import InputError, UsageError
from ftproc.files import conventions
from ftproc.files.options import parse_columns, parse_units
from ftproc.files.reading.meaning import schema
from ftproc.files.words import QUANTITIES
from ftproc.live.live import Live
from ftproc.records import FloatArray, MeasurementLog, Trajectory

MOST = 1 << 18  # bytes that are read at once
LINES = 4096  # that are taken at once, of those that are there
NAP_S = 0.05  # between looks at a file that has not grown


class Stop:
    """Within its context, an interruption (Ctrl-C, SIGTERM) ends the reading, and not what is being computed or
    written."""

    def __init__(self) -> None:
        self.asked = self._reading = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Stop:
        for number in (signal.SIGINT, signal.SIGTERM):
            self._before[number] = signal.signal(number, self._ask)
        return self

    def __exit__(self, *error: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _ask(self, number: int, frame: object) -> None:
        self.asked = True
        if self._reading:
            raise KeyboardInterrupt

    def read(self, stream: IO[bytes], endless: bool) -> bytes:
        """What there is to read, when there is something; empty at the end, or when a stop is asked for."""
        self._reading = True
        try:
            while not self.asked:
                found: bytes = stream.read1(MOST) if isinstance(stream, io.BufferedReader) else stream.read(MOST)
                if found or not endless:
                    return found
                time.sleep(NAP_S)
        except KeyboardInterrupt:
            pass
        finally:
            self._reading = False
        return b""


def follow(source: str, recipe: Recipe, track: Live, stop: Stop) -> Iterator[Trajectory]:
    """The rows that are published while a log grows: a file, which has no end, or `-` for standard input. Ends at the
    end of the input, or when a stop is asked for. Raises InputError for a header that is not understood, and for a
    line that is not made of numbers."""
    if recipe.station.refraction is not None:
        raise UsageError("--follow corrects no refraction, which needs the ranges around each reading; leave it out.")
    columns: _Columns | None = None
    number = 0
    for lines in _lines(source, stop):
        if columns is None:
            columns, lines, number = _Columns.of(source, lines[0], recipe), lines[1:], 1
        readings = columns.read(lines, number)
        number += len(lines)
        if len(readings) and len(found := track.push(*_converted(readings, recipe).T)):
            yield found
    if columns is None:
        raise InputError(f"{source}: there is no line; the first one names the columns.")
    if len(found := track.finish()):
        yield found


def _lines(source: str, stop: Stop) -> Iterator[list[str]]:
    """Complete lines, as many as there are, up to LINES at a time."""
    rest = b""
    with contextlib.ExitStack() as open_:
        stream: IO[bytes] = sys.stdin.buffer if source == "-" else open_.enter_context(Path(source).open("rb"))
        while more := stop.read(stream, endless=source != "-"):
            *whole, rest = (rest + more).split(b"\n")
            for low in range(0, len(whole), LINES):
                yield [_text(line) for line in whole[low : low + LINES]]
    if rest.strip() and source == "-":
        yield [_text(rest)]


def _text(line: bytes) -> str:
    return line.decode("utf-8", "replace").strip("\r\ufeff")


class _Columns(NamedTuple):
    """Where the quantities stand in a line, and their factors to s, m and rad."""

    source: str
    separator: str
    names: Sequence[str]
    places: tuple[int | None, ...]
    factors: tuple[float, ...]

    @classmethod
    def of(cls, source: str, header: str, recipe: Recipe) -> _Columns:
        separator = next((mark for mark in (",", ";", "\t") if mark in header), ",")
        names = [name.strip() for name in next(csv.reader([header], delimiter=separator))]
        units = recipe.units if not isinstance(recipe.units, str) else parse_units(recipe.units)
        named = recipe.columns if not isinstance(recipe.columns, str) else parse_columns(recipe.columns)
        found = schema.resolve(source, names, units or {}, named or {})
        places: list[int | None] = []
        factors: list[float] = []
        for quantity in QUANTITIES:
            column = found.get(quantity)
            if column is not None and (len(column.roles) > 1 or column.notation):
                raise InputError(
                    f'{source}: --follow reads one column of numbers for each quantity, not "{column.name}".'
                )
            places.append(None if column is None else column.position)
            factors.append(1.0 if column is None else column.unit.multiply / column.unit.divide)
        return cls(source, separator, names, tuple(places), tuple(factors))

    def read(self, lines: Sequence[str], first: int) -> FloatArray:
        """(n, 4) time s, range m, azimuth rad, elevation rad of the lines that are not empty; NaN for an empty cell.
        first: number of the first line."""
        rows = []
        for k, line in enumerate(lines):
            if not line.strip():
                continue
            cells = line.split(self.separator)
            row = []
            for quantity, place, factor in zip(QUANTITIES, self.places, self.factors, strict=True):
                text = cells[place].strip() if place is not None and place < len(cells) else ""
                try:
                    row.append(float(text) * factor if text else np.nan)
                except ValueError:
                    raise InputError(
                        f'{self.source}: line {first + k + 1}: the {quantity} is "{text[:40]}", which is no number; '
                        "correct it, or leave the cell empty."
                    ) from None
            if np.isfinite(row[0]):
                rows.append(row)
        return np.array(rows, float).reshape(-1, 4)


def _converted(readings: FloatArray, recipe: Recipe) -> FloatArray:
    """The readings (n, 4) in the canonical convention, without the station's known errors."""
    log = MeasurementLog("", readings[:, 0], readings[:, 1:], np.arange(len(readings)))
    log = conventions.apply(log, recipe.station)
    return np.column_stack([log.time_s, log.measurement])
