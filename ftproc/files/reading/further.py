"""What a log holds beside range, azimuth and elevation: range rates, heights, and, for a network that learned from it,
the strength of the signal.

Names and units are those of `words.FURTHER_ALIASES` and `units.UNITS`. Where neither the name nor
`--units` says the unit, a height is asked about, because the positions rest on it, or, beside elevations, left out with
a word; a rate is in the unit that the ranges show, or left out with a word; others are left out.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ftproc.errors import InputError, nearest
from ftproc.files.options import ABSENT
from ftproc.files.reading import rates
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.meaning.names import Name, compatible, taken_apart
from ftproc.files.reading.meaning.numbers import Origin, numbers
from ftproc.files.reading.meaning.questions import answer, listed
from ftproc.files.reading.meaning.readings import sentinel
from ftproc.files.units import UNITS, Unit, unit_named
from ftproc.files.words import DEPTHS, FURTHER_ALIASES, NOT_UNITS, WEAK_ALIASES
from ftproc.records import COMPONENTS, FloatArray, Heights, MeasurementLog

HEIGHT, RANGE_RATE, SIGNAL = "height", "range_rate", "signal"
#: Words of names by which a height is geometric; any other is taken for a barometric one. And names of flight levels.
_GEOMETRIC = ("geo", "gnss", "gps", "msl", "ellips", "height_m")
_LEVELS = ("flightlevel", "fl", "modec", "flugflache", "эшелон", "飞行高度层")
OPEN = Unit("")  # that nothing states
_CLOSING = ("closing", "closure")  # begin the names of rates that count inward
_WHAT = {HEIGHT: "the height of the target", RANGE_RATE: "the range rate", SIGNAL: "the strength of the signal"}


class Further(NamedTuple):
    """The column of a quantity, its unit, and what its name says of it: a height may be barometric, a rate closing."""

    quantity: str
    position: int
    name: str
    unit: Unit
    other_kind: bool
    why: str = "its name"

    def read(self, header: TableHeader) -> FloatArray:
        """(n,) in SI units, rates outward, NaN where missing. Raises InputError for a cell that is no number."""
        origin = Origin(header.source, self.name, f"a {self.quantity} in {self.unit.name}", header.decimal_comma)
        values = numbers(header.load([], [self.position]).column(0), origin)
        while (number := sentinel(values)) is not None:
            values = np.where(values == number, np.nan, values)
        return self.to_si(values)

    def to_si(self, values: FloatArray) -> FloatArray:
        """Values as written -> rates outward, heights upward: a depth is below, with whichever sign it is written."""
        values = np.abs(values) if self.unit.multiply < 0 else values
        return self.unit.to_si(-values if self.quantity == RANGE_RATE and self.other_kind else values)

    def described(self) -> dict[str, Any]:
        """As `understanding` describes columns."""
        kinds = {HEIGHT: ("geometric", "barometric"), RANGE_RATE: ("outward", "inward, by its name")}
        kind = kinds.get(self.quantity, ("over any reference",))[self.other_kind]
        return {"column": self.name, "unit": self.unit.name, "unit_from": kind, "why": self.why}


def published(beside: tuple[Further, ...], found: Mapping[str, Any]) -> list[int]:
    """Positions of the columns that the trajectory has cleaned, and need not be kept. found: columns by quantity."""
    raw = {SIGNAL, HEIGHT} if "elevation" in found else {SIGNAL}
    return [each.position for each in beside if each.quantity not in raw]


def of_rows(beside: tuple[Further, ...], header: TableHeader, row: Any) -> dict[str, Any]:
    """The fields of a `MeasurementLog` of these rows of the file."""
    found = {each.quantity: each.read(header)[row] for each in beside}
    height = next((each for each in beside if each.quantity == HEIGHT), None)
    heights = Heights(found[HEIGHT], height.other_kind) if height else None
    return {"heights": heights, "range_rate": found.get(RANGE_RATE), "signal_db": found.get(SIGNAL)}


def in_known_units(
    beside: tuple[Further, ...], header: TableHeader, log: MeasurementLog
) -> tuple[tuple[Further, ...], tuple[str, ...]]:
    """Those whose unit something states, or the ranges of the log show; and a word on each that is left out."""
    known: list[Further] = []
    doubts: list[str] = []
    for each in beside:
        unit: Unit | None = each.unit
        if unit == OPEN and each.quantity == HEIGHT:
            say = f"--columns {HEIGHT}=NAME --units {HEIGHT}=m (or {', '.join(UNITS[HEIGHT])})"
            doubts.append(f'"{each.name}" may be the height of the target: if so, say {say}')
            continue
        if unit == OPEN:
            ranges_m = log.measurement[:, COMPONENTS.index("range")]
            unit = rates.unit_by_motion(log.time_s, ranges_m, each.read(header)[log.row])
            each = each._replace(why="its name, and its unit by the ranges")
        if unit is None:
            say = f"--units {RANGE_RATE}=mps (or km/h, kt)"
            doubts.append(f'"{each.name}" may be a range rate: if so, say {say}')
        else:
            known.append(each._replace(unit=unit))
    return tuple(known), tuple(doubts)


def find(
    header: TableHeader, found: Mapping[str, Any], units: Mapping[str, str], columns: Mapping[str, str], signal: bool
) -> tuple[Further, ...]:
    """The range rate of a log with ranges, its height, where it has azimuths too, and, if wanted, the strength of its
    signal.

    found: the columns of the log by quantity. units, columns: as stated by the user. Raises InputError where the user
    names a column that is not there, and, with a question, for a quantity whose unit is not known.
    """
    wanted = [RANGE_RATE] if "range" in found else []
    wanted += [HEIGHT] if {"range", "azimuth"} <= set(found) else []
    wanted += [SIGNAL] if signal or SIGNAL in columns else []
    taken = {index for column in found.values() for index in column.positions}
    return tuple(_found(header, wanted, taken, units, columns, "elevation" in found))


def _found(
    header: TableHeader,
    wanted: list[str],
    taken: set[int],
    units: Mapping[str, str],
    columns: Mapping[str, str],
    elevated: bool,
) -> Iterator[Further]:
    """elevated: whether elevations are measured, so that nothing is asked about a height."""
    for quantity in wanted:
        stated = columns.get(quantity, "")
        if stated == ABSENT:
            continue
        apart = _all_apart(quantity, header.names, header.units)
        indices = [k for k, name in enumerate(apart) if k not in taken and _means(quantity, name)]
        unasked = quantity == HEIGHT and elevated and not stated
        if quantity != HEIGHT or unasked:  # of no known unit it is none
            indices = [k for k in indices if _unit(quantity, apart[k], units.get(quantity))] or indices
        indices = [_stated(header, quantity, stated)] if stated else indices
        if quantity == HEIGHT and not indices and not elevated:
            _refuse_depth(header, apart, [k for k in range(len(apart)) if k not in taken])
        if unasked and indices and (len(indices) > 1 or not _unit(quantity, apart[indices[0]], units.get(quantity))):
            if not header.is_of_a_standard:
                yield Further(quantity, indices[0], ", ".join(header.names[k] for k in indices), OPEN, False)
            continue
        if len(indices) > 1 and not header.is_of_a_standard:
            both = listed([header.names[index] for index in indices])
            say = answer(header.names, {quantity: indices[0]})
            raise InputError(
                f"{header.source}: columns {both} could each be {_WHAT[quantity]}. Say which one it is with {say}, or "
                f"--columns {quantity}={ABSENT}."
            )
        if indices and (stated or _has_numbers(header, indices[0])):
            known = _described(header, quantity, indices[0], apart[indices[0]], units.get(quantity))
            if known is not None:
                yield known


def by_name(
    quantity: str, names: Sequence[str], row: Sequence[str], units: Mapping[str, str], columns: Mapping[str, str]
) -> Further | None:
    """A quantity by the names of columns alone, and the row of units below them, where there is one."""
    stated = columns.get(quantity, "")
    apart = _all_apart(quantity, names, row)
    indices = [k for k, name in enumerate(apart) if (names[k] == stated if stated else _means(quantity, name))]
    if len(indices) != 1:
        return None
    text, name = names[indices[0]], apart[indices[0]]
    unit = _unit(quantity, name, units.get(quantity))
    return None if unit is None else Further(quantity, indices[0], text, unit, _other_kind(quantity, text, name, unit))


def _all_apart(quantity: str, names: Sequence[str], row: Sequence[str]) -> list[Name]:
    return [_apart(quantity, *each) for each in zip(names, row or [""] * len(names), strict=True)]


def _described(header: TableHeader, quantity: str, index: int, name: Name, stated: str | None) -> Further | None:
    text, unit = header.names[index], _unit(quantity, name, stated)
    if unit is None and header.is_of_a_standard and quantity == RANGE_RATE:
        unit = unit_named(quantity, "mps")
    unit = OPEN if unit is None and quantity == RANGE_RATE else unit
    if unit is None and quantity != HEIGHT:
        return None
    if unit is None:
        raise InputError(
            f'{header.source}: column "{text}" is the height of the target in a unit that its name does not state. Say '
            f"--units {HEIGHT}=ft (or {', '.join(UNITS[HEIGHT])}), or --columns {HEIGHT}={ABSENT} if it is something "
            f"else{_as_angle(text, name)}."
        )
    return Further(quantity, index, text, unit, _other_kind(quantity, text, name, unit))


def _as_angle(text: str, name: Name) -> str:
    """What is said of an altitude that may be an elevation, as astronomers call it."""
    if name.stem not in WEAK_ALIASES["elevation"]:
        return ""
    return f", or {answer([text], {'elevation': 0})} --units elevation=deg if it is an angle above the horizon"


def _unit(quantity: str, name: Name, stated: str | None) -> Unit | None:
    level = quantity == HEIGHT and {name.core(), name.stem} & {*_LEVELS}
    unit = unit_named(quantity, stated or name.unit or ("fl" if level else ""))
    return unit._replace(multiply=-unit.multiply) if unit and _is_depth(quantity, name) else unit


def _is_depth(quantity: str, name: Name) -> bool:
    return quantity == HEIGHT and bool(DEPTHS & {name.stem, *name.words})


def _refuse_depth(header: TableHeader, apart: Sequence[Name], free: Iterable[int]) -> None:
    """Ask whether a depth is that of the target."""
    for index in free:
        name = apart[index]
        if (
            _is_depth(HEIGHT, name)
            and not name.foreign
            and not NOT_UNITS & {*name.words}
            and _has_numbers(header, index)
        ):
            say = answer(header.names, {HEIGHT: index})
            unit = "" if name.unit else f" --units {HEIGHT}=m (or {', '.join(UNITS[HEIGHT])})"
            raise InputError(
                f'{header.source}: column "{header.names[index]}" may be the depth of the target below the station. '
                f"Say {say}{unit}, which counts it downwards, or --columns {HEIGHT}={ABSENT} if it is something else, "
                "such as the depth of the water."
            )


def _other_kind(quantity: str, text: str, name: Name, unit: Unit) -> bool:
    """Whether a height is barometric, a rate closing."""
    if quantity == HEIGHT:
        geometric = any(word in text.lower() for word in _GEOMETRIC) or _is_depth(quantity, name)
        return unit.name == "fl" or not geometric
    return quantity == RANGE_RATE and any(word.startswith(_CLOSING) for word in (name.core(), name.stem))


def _apart(quantity: str, text: str, unit: str) -> Name:
    """The name taken apart, with the units of this quantity, of which FL is a name too."""
    if unit_named(quantity, unit):
        return taken_apart(text)._replace(foreign=False, unit=unit)
    plain = compatible(text).strip().rstrip(")]}> ")
    endings = (found.end() for found in _WHERE_UNITS_BEGIN.finditer(plain))
    begin = next((k for k in endings if unit_named(quantity, plain[k:])), None)
    if begin is None:
        return taken_apart(text, unit)
    ending, before = plain[begin:], plain[:begin].rstrip(" _.,:([{</-")
    found = taken_apart(before.removesuffix(" in").removesuffix("_in"))
    level = unit_named(HEIGHT, ending) == UNITS[HEIGHT]["fl"]
    if level and found.stem not in FURTHER_ALIASES[HEIGHT]:
        found = found._replace(stem="fl")
    return found._replace(foreign=False, unit=ending)


#: Before a word, and before a capital letter within one: range_rate|_m_s, range|Rate|Kt.
_WHERE_UNITS_BEGIN = re.compile(r"(?:^|(?<![\W_])[\W_]++|(?<=[^\W\d_A-Z])(?=[A-Z]))(?=[^\W\d]|\d[^_]*$)")


def _means(quantity: str, name: Name) -> bool:
    unit = unit_named(quantity, name.unit) if name.unit else None
    known = {name.stem, name.core()} & {*FURTHER_ALIASES[quantity]} != set()
    known |= quantity == HEIGHT and unit is not None and name.stem in ("elevation", "elev")
    return known and not name.foreign and (not name.unit or unit is not None)


def _stated(header: TableHeader, quantity: str, name: str) -> int:
    if name in header.names:
        return header.names.index(name)
    if name.isdecimal() and 1 <= int(name) <= len(header.names):
        return int(name) - 1
    raise InputError(
        f'{header.source}: there is no column "{name}", which --columns names for the {quantity}'
        f"{nearest(name, header.names) or '.'} Its columns are: {listed(header.names)}."
    )


def _has_numbers(header: TableHeader, index: int) -> bool:
    """Whether a column that nobody names holds numbers at all."""
    try:
        values = numbers(header.load([], [index]).column(0), Origin(header.source, header.names[index], ""))
    except InputError:
        return False
    return bool(np.isfinite(values).any())
