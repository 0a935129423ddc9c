"""What a log holds beside range, azimuth and elevation: the height of the target, where its elevation is not measured.

Names and units are those of `words.FURTHER_ALIASES` and `units.UNITS`. A column is asked about only where its name is
that of such a quantity and neither its name nor `--units` says its unit.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ftproc.errors import InputError, nearest
from ftproc.files.options import ABSENT
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.meaning.names import Name, taken_apart
from ftproc.files.reading.meaning.numbers import Origin, numbers
from ftproc.files.reading.meaning.questions import answer, listed
from ftproc.files.reading.meaning.readings import sentinel
from ftproc.files.units import UNITS, Unit, unit_named
from ftproc.files.words import FURTHER_ALIASES
from ftproc.records import FloatArray, Heights

HEIGHT = "height"
#: Words of names by which a height is geometric; any other is taken for a barometric one. And names of flight levels.
_GEOMETRIC = ("geo", "gnss", "gps", "msl", "ellips", "height_m")
_LEVELS = ("flightlevel", "fl", "modec", "flugflache", "эшелон", "飞行高度层")


class Further(NamedTuple):
    """The column of a quantity, its unit, and whether it is a barometric height."""

    quantity: str
    place: int
    name: str
    unit: Unit
    barometric: bool

    def read(self, header: TableHeader) -> FloatArray:
        """(n,) in SI units, NaN where missing. Raises InputError for a cell that is no number."""
        origin = Origin(header.source, self.name, f"a {self.quantity} in {self.unit.name}", header.decimal_comma)
        values = numbers(header.load([], [self.place]).column(0), origin)
        while (number := sentinel(values)) is not None:
            values = np.where(values == number, np.nan, values)
        return self.unit.to_si(values)

    def described(self) -> dict[str, Any]:
        """As `understanding` describes columns."""
        kind = "barometric" if self.barometric else "geometric"
        return {"column": self.name, "unit": self.unit.name, "unit_from": kind, "why": "its name"}

    def of_rows(self, values: FloatArray) -> Heights:
        """The heights of some rows (m,), from those of all."""
        return Heights(values, self.barometric)


def find(
    header: TableHeader, found: Mapping[str, Any], units: Mapping[str, str], columns: Mapping[str, str]
) -> Further | None:
    """The height of a log that has ranges and azimuths, but no elevations; None of others, and without one.

    found: the columns of the log by quantity. units, columns: as stated by the user. Raises InputError where the user
    names a column that is not there, and, with a question, for a height whose unit is not known.
    """
    stated = columns.get(HEIGHT, "")
    if stated == ABSENT or not {"range", "azimuth"} <= set(found) or "elevation" in found:
        return None
    apart = [_apart(name, unit) for name, unit in zip(header.names, _units(header), strict=True)]
    taken = {place for column in found.values() for place in column.positions}
    places = [_stated(header, stated)] if stated else [k for k, n in enumerate(apart) if k not in taken and _means(n)]
    if len(places) > 1 and not header.is_of_a_standard:
        both = listed([header.names[place] for place in places])
        say = answer(header.names, {HEIGHT: places[0]})
        raise InputError(
            f"{header.source}: columns {both} could each be the height of the target. Say which one it is with {say}, "
            f"or --columns {HEIGHT}={ABSENT}."
        )
    if not places or not (stated or _has_numbers(header, places[0])):
        return None
    name, text = apart[places[0]], header.names[places[0]]
    level = {name.core(), name.stem} & {*_LEVELS} != set()
    unit = unit_named(HEIGHT, units.get(HEIGHT) or name.unit or ("fl" if level else ""))
    if unit is None:
        raise InputError(
            f'{header.source}: column "{text}" is the height of the target in a unit that its name does not state. Say '
            f"--units {HEIGHT}=ft (or {', '.join(UNITS[HEIGHT])}), or --columns {HEIGHT}={ABSENT} if it is something "
            "else."
        )
    barometric = unit.name == "fl" or not any(word in text.lower() for word in _GEOMETRIC)
    return Further(HEIGHT, places[0], text, unit, barometric)


def _units(header: TableHeader) -> list[str]:
    return list(header.units) or [""] * len(header.names)


def _apart(text: str, unit: str) -> Name:
    """The name taken apart; FL is a unit here, and a name by itself."""
    found = taken_apart(text, unit)
    if found.foreign and text.lower().rstrip(")]").endswith("fl"):
        found = found._replace(
            stem=found.stem if found.stem in FURTHER_ALIASES[HEIGHT] else "fl", foreign=False, unit="fl"
        )
    return found


def _means(name: Name) -> bool:
    aliases = FURTHER_ALIASES[HEIGHT]
    unit = unit_named(HEIGHT, name.unit) if name.unit else None
    return (not name.unit or unit is not None) and not name.foreign and {name.stem, name.core()} & {*aliases} != set()


def _stated(header: TableHeader, name: str) -> int:
    if name in header.names:
        return header.names.index(name)
    if name.isdecimal() and 1 <= int(name) <= len(header.names):
        return int(name) - 1
    raise InputError(
        f'{header.source}: there is no column "{name}", which --columns names for the {HEIGHT}'
        f"{nearest(name, header.names) or '.'} Its columns are: {listed(header.names)}."
    )


def _has_numbers(header: TableHeader, place: int) -> bool:
    """Whether a column that nobody names holds numbers at all."""
    try:
        values = numbers(header.load([], [place]).column(0), Origin(header.source, header.names[place], ""))
    except InputError:
        return False
    return bool(np.isfinite(values).any())
