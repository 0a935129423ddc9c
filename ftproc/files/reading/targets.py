"""Which targets, or stations, a log holds, so that each gets a trajectory of its own."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ftproc.errors import InputError
from ftproc.files.options import Extract
from ftproc.files.reading.formats import tables
from ftproc.files.reading.formats.standards import choosing
from ftproc.files.reading.meaning import rows, several


class Targets(NamedTuple):
    """A column that tells targets apart, or stations of one target, and its values, the first first."""

    column: str = ""
    values: tuple[str, ...] = ()
    stations: bool = False

    def __str__(self) -> str:
        what = "stations" if self.stations else "targets"
        return f'{len(self.values)} {what} by column "{self.column}" ({choosing.shown(self.values)})'


def targets(source: tables.Source, extract: Extract) -> Targets:
    """Those in the rows that are wanted, by the column that is named as `target`, or, where none is, by the one that
    the standard of the file has for it; none if there is one, or if stations take turns, as those that follow one
    target do. Raises InputError."""
    header = tables.read_header(source, extract.widths)
    column, found = extract.target, list[str]()
    if column == "" and not (header.stated.target or header.stated.station):
        return Targets()
    asked = list({rows.position(header.source, header.names, each.column, "--where"): None for each in extract.where})
    kept = np.flatnonzero(rows.meeting(header, extract.where, header.load([], asked), asked)) if asked else None
    if column == "":
        column, found = choosing.told_apart(header, extract, kept)
        stations = bool(found) and column != header.stated.target
        if len(found) > several.MOST_TARGETS or (stations and choosing.in_turns(header, column, kept)):
            return Targets()
        return Targets(column, tuple(found), stations)
    name = header.names[rows.position(header.source, header.names, column, "--target")]
    found = choosing.values(header, name, kept)
    if not 0 < len(found) <= several.MOST_TARGETS:
        raise InputError(
            f'{header.source}: column "{column}" has {len(found)} values, which are no targets; name another column.'
        )
    return Targets(column, tuple(found))
