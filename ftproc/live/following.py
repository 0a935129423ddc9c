"""A log that still grows, line by line: what is published leaves at once."""

from __future__ import annotations

import csv
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO, NamedTuple

import numpy as np

from ftproc.config.recipe import Recipe
from ftproc.errors import InputError, UsageError
from ftproc.files import conventions
from ftproc.files.options import parse_columns, parse_units
from ftproc.files.reading.meaning import schema
from ftproc.files.units import QUANTITIES
from ftproc.live.live import Live
from ftproc.records import FloatArray, MeasurementLog, Trajectory

LINES = 4096  # that are taken at once, of those that are there
NAP_S = 0.05  # between looks at a file that has not grown


def follow(source: str, recipe: Recipe, track: Live) -> Iterator[Trajectory]:
    """The rows that are published while a log grows: a file, or `-` for standard input. Ends at the end of the input,
    or when the user interrupts; a file has no end. Raises InputError for a header that is not understood, and for a
    line that is not made of numbers."""
    if recipe.station.refraction is not None:
        raise UsageError("--follow corrects no refraction, which needs the ranges around each reading; leave it out.")
    lines = _lines(source)
    header = next(lines, None)
    if not header:
        raise InputError(f"{source}: there is no header; the first line names the columns.")
    columns = _Columns.of(source, header[0], recipe)
    batch, number = header[1:], 1
    try:
        while batch is not None:
            readings = columns.read(batch, number)
            number += len(batch)
            if len(readings):
                found = track.push(*_converted(readings, recipe).T)
                if len(found):
                    yield found
            batch = next(lines, None)
    except KeyboardInterrupt:
        pass
    found = track.finish()
    if len(found):
        yield found


def _lines(source: str) -> Iterator[list[str]]:
    """Complete lines, as many as there are, up to LINES at a time."""
    stream: IO[bytes] = sys.stdin.buffer if source == "-" else Path(source).open("rb")
    rest = b""
    with stream:
        while True:
            more = stream.read1(1 << 18) if hasattr(stream, "read1") else stream.read(1 << 18)
            if not more and source == "-":
                break
            if not more:
                time.sleep(NAP_S)
                continue
            *whole, rest = (rest + more).split(b"\n")
            for low in range(0, len(whole), LINES):
                yield [line.decode("utf-8", "replace").strip("\r\ufeff") for line in whole[low : low + LINES]]
    if rest.strip():
        yield [rest.decode("utf-8", "replace").strip("\r\ufeff")]


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
                        f'{self.source}: line {first + k + 1}: the {quantity} is "{text[:40]}", not a number; correct it, '
                        "or leave the cell empty."
                    ) from None
            if np.isfinite(row[0]):
                rows.append(row)
        return np.array(rows, float).reshape(-1, 4)


def _converted(readings: FloatArray, recipe: Recipe) -> FloatArray:
    """The readings (n, 4) in the canonical convention, without the station's known errors."""
    log = MeasurementLog("", readings[:, 0], readings[:, 1:], np.arange(len(readings)))
    log = conventions.apply(log, recipe.station)
    return np.column_stack([log.time_s, log.measurement])
