"""Columns of a table -> the quantities of a log in SI units, and the units that their values show."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ftproc.files.moments import NO_ZONE
from ftproc.files.reading.clocks import joint, numeric, restarts, times
from ftproc.files.reading.clocks.clock import Clock
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.meaning import readings, schema
from ftproc.files.reading.meaning.numbers import Origin, finite, without_thousands
from ftproc.files.reading.meaning.values import deciding, faces, ways
from ftproc.records import FloatArray
from ftproc.settings import Station

if TYPE_CHECKING:
    import pyarrow as pa

_LOCAL = frozenset(("local", "localtime", "lt", "ortszeit", "lokalzeit"))
_UTC = frozenset(("utc", "gmt", "zulu", "utcdate", "utctime", "dateutc", "timeutc", "utcdatetime", "datetimeutc", "z"))

Found = Mapping[str, schema.Column]


class Converted(NamedTuple):
    """quantities: in SI units. found: the columns with the units that their cells show. notes: what was done.
    undecided: see `readings.undecided`."""

    quantities: dict[str, FloatArray]
    found: Found
    clock: Clock
    notes: tuple[str, ...]
    undecided: bool


def converted(header: TableHeader, found: Found, columns: list[pa.ChunkedArray]) -> Converted:
    """The quantities in SI units. columns: of all quantities, in their order. Raises InputError for cells that are no
    numbers or times, or too large in SI units."""
    with np.errstate(over="ignore", invalid="ignore"):
        read = _converted(header, found, columns)
    for quantity, values in read.quantities.items():
        finite(values, _origin(header, found[quantity]))
    return read


def _converted(header: TableHeader, found: Found, columns: list[pa.ChunkedArray]) -> Converted:
    quantities: dict[str, FloatArray] = {}
    decided = dict(found)
    notes: list[str] = []
    clock = Clock(np.empty(0), "", "")
    read_here: dict[str, readings.Readings] = {}
    origins = {quantity: _origin(header, column) for quantity, column in found.items()}
    each_origin = [origins[quantity] for quantity, column in found.items() for _ in column.positions]
    columns, marks = without_thousands(columns, each_origin)
    index = 0
    for quantity, column in found.items():
        mine, origin = columns[index : index + len(column.positions)], origins[quantity]
        index += len(mine)
        if quantity == "time":
            if len(mine) > 1:
                clock = joint.read(dict(zip(column.roles, mine, strict=True)), origin, column)
            else:
                clock = times.read(mine[0], origin, column)
            clock = _of_a_zone(clock, column)
            quantities[quantity] = clock.time_s
            continue
        read_here[quantity] = readings.read(mine, origin, column)
    read_here = readings.without_sentinels(read_here)
    for quantity, each in read_here.items():
        decided[quantity] = each.column
        quantities[quantity] = each.column.unit.to_si(each.values)
        notes += each.notes
    notes += faces.turned_back(quantities, decided)
    if "time" in quantities:
        quantities["time"], turns = restarts.unwrapped(quantities, decided["time"].unit)
        notes += turns
    return Converted(quantities, decided, clock, (*marks, *notes), readings.undecided(read_here))


def _of_a_zone(clock: Clock, column: schema.Column) -> Clock:
    """Without an epoch if the times are local ones and name no zone: they are no UTC; with a doubt if nothing names a
    zone."""
    words = set(re.findall(r"[a-z]+", column.name.lower()))
    of_parts = len(column.roles) > 1 and "week" not in column.roles
    zoned = not of_parts and NO_ZONE not in clock.doubts
    if not clock.epoch or zoned:
        return clock
    doubts = tuple(doubt for doubt in clock.doubts if doubt != NO_ZONE)
    if _LOCAL & words:
        doubt = f'"{column.name}" is a local time without its zone, so there is no time_utc'
        return clock._replace(epoch="", doubts=(*doubts, doubt))
    return clock._replace(doubts=doubts if _UTC & words else (*doubts, NO_ZONE))


def _origin(header: TableHeader, column: schema.Column) -> Origin:
    timestamp = " or an ISO-8601 timestamp" if column.quantity == "time" else ""
    expected = f"{'an' if column.quantity[0] in 'ae' else 'a'} {column.quantity} in {column.unit.name}{timestamp}"
    return Origin(header.source, column.name, expected, header.decimal_comma)


def judged(
    source: str, quantities: Mapping[str, FloatArray], found: Found, clock: Clock, station: Station,
    standard: bool = False,
) -> deciding.Open:  # fmt: skip
    """What the values show of the units and conventions that the names leave open, see `deciding`. standard: the format
    says what the columns are."""
    time = found["time"]
    bare_time = not (time.unit_is_stated or clock.epoch) and clock.words.startswith(numeric.BARE)
    numbered = not clock.epoch and clock.words.startswith("numbers in")
    known = ways.Known(source, found, station, bare_time, numbered, standard)
    return deciding.judged(known, quantities)


def in_other_units(quantities: Mapping[str, FloatArray], found: Found, decided: Found) -> dict[str, FloatArray]:
    """The quantities, which are in SI units if those of `found` are right, if those of `decided` are."""
    return {
        quantity: values
        if (before := found[quantity].unit) == (after := decided[quantity].unit)
        else after.to_si(values * before.divide / before.multiply)
        for quantity, values in quantities.items()
    }
