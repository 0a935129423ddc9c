"""How a log was understood, as a JSON-serialisable dictionary and as five lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from ftproc.files import conventions
from ftproc.files.layout import CANONICAL
from ftproc.files.reading.clocks.clock import Clock
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.further import HEIGHT, Further
from ftproc.files.reading.meaning import wording
from ftproc.files.reading.meaning.names import taken_apart
from ftproc.files.reading.meaning.questions import answer, listed
from ftproc.files.reading.meaning.schema import Column
from ftproc.files.words import AT_SEA, COURSES, NOT_UNITS, TURNED
from ftproc.records import COMPONENTS
from ftproc.settings import Station

Understood = Mapping[str, Any]

_AXIS = "nothing says where the azimuth counts from: if clockwise from north, say --azimuth-from north"
_AXES = {"x": "azimuth anticlockwise from x", "north": "azimuth clockwise from north, x is north and y is east"}


def describe(
    header: TableHeader, found: Mapping[str, Column], clock: Clock, station: Station, doubts: Sequence[str],
    axis_is_known: bool,     beside: Sequence[Further] = (),
) -> dict[str, Any]:  # fmt: skip
    """file: kind and layout. columns: of each quantity its column, unit and why. not_used: the other columns. clock and
    epoch: of the times. conventions: of the angles, and what was corrected. axis_is_known: whether anything says from
    where the azimuth counts. doubts: each with the option that settles
    it."""
    used = {index for column in found.values() for index in column.positions} | {each.position for each in beside}
    unused = [name for index, name in enumerate(header.names) if index not in used and name]
    return {
        "file": header.form or "table",
        "columns": {
            **{quantity: _column(column, header) for quantity, column in found.items()},
            **{each.quantity: each.described() for each in beside},
        },
        "not_used": unused,
        "clock": clock.words,
        "epoch": clock.epoch,
        "conventions": _conventions(station, found),
        "axis_is_known": axis_is_known,
        "doubts": [
            *_others(header.names, found),
            *_absent(found, [] if header.is_of_a_standard or HEIGHT in [each.quantity for each in beside] else unused),
            *doubts,
            *clock.doubts,
            *([] if header.is_of_a_standard or axis_is_known else [_axis(found)]),
        ],
    }


def _column(column: Column, header: TableHeader) -> dict[str, Any]:
    known = "by the format" if header.is_of_a_standard else "in its name"
    stated = "stated by the user" if column.unit_stated_by_user else known if column.unit_in_name else "assumed"
    if column.quantity == "time" and not (column.unit_stated_by_user or column.unit_in_name):
        stated = "see clock"
    if len(column.roles) > 1:
        stated = "by its parts"
    return {"column": column.name, "unit": column.unit.name, "unit_from": stated, "why": column.why}


def _conventions(station: Station, found: Mapping[str, Column]) -> list[str]:
    lines = [_AXES[conventions.axis(station)]] if "azimuth" in found else []
    zenith = station.elevation_from == "zenith"
    lines += [] if zenith or "elevation" not in found else ["elevation above the horizontal"]
    return lines + conventions.in_words(station)


def _others(names: Sequence[str], found: Mapping[str, Column]) -> list[str]:
    return [
        f"{', '.join(column.others)} could be the {quantity} too: if so, say "
        f"{answer(names, {quantity: names.index(column.others[0])})}"
        for quantity, column in found.items()
        if column.others
    ]


def _absent(found: Mapping[str, Column], unused: Sequence[str]) -> list[str]:
    """A doubt for each quantity that is not there, where columns are left that may be it."""
    names = [taken_apart(name) for name in unused]
    free = listed([name.text for name in names if not (name.foreign or NOT_UNITS & {*name.words})])
    absent = [quantity for quantity in COMPONENTS if quantity not in found]
    return [f"nothing is taken for the {q}: if one of {free} is it, say --columns {q}=NAME" for q in absent if free]


def lines(understood: Understood) -> list[tuple[str, str]]:
    """Five lines, each a name and a text."""
    columns = [
        f'{quantity} = "{column["column"]}" in {column["unit"]} ({column["unit_from"]})'
        if quantity != "time" else f'time = "{column["column"]}"'
        for quantity, column in understood["columns"].items()
    ]  # fmt: skip
    unused = listed(understood["not_used"])
    assumed = [f"nothing tells whether {each}, which is assumed" for each in understood.get("assumed", ())]
    zero = f"time zero is {understood['epoch']}" if understood["epoch"] else "no date known"
    clock = f"{understood['clock']}, {zero}"
    return [
        ("file", understood["file"]),
        ("columns", "; ".join(columns) + (f"; not used: {unused}" if unused else "")),
        ("clock", clock),
        ("readings", "; ".join(understood["conventions"]) or "as they are"),
        ("doubtful", "; ".join([*understood["doubts"], *assumed]) or "nothing"),
    ]


def as_named(station: Station, found: Mapping[str, Column]) -> Station:
    """The station with what the names of the angles' columns say."""
    zenith = "elevation" in found and found["elevation"].zenith
    north = "azimuth" in found and _is_from_north(found["azimuth"])
    return replace(
        station,
        elevation_from=station.elevation_from or ("zenith" if zenith else "horizon"),
        azimuth_from=station.azimuth_from or ("north" if north else "x"),
    )


def knows_axis(station: Station, found: Mapping[str, Column]) -> bool:
    """Whether anything says from where the azimuth counts: the user, its name, or that it is one of the program's own
    names, whose azimuths count from x."""
    azimuth = found.get("azimuth")
    stated = station.azimuth_from or station.azimuth_sense
    return bool(azimuth is None or stated or azimuth.name == CANONICAL["azimuth"] or _is_from_north(azimuth))


def assumed_of(found: Mapping[str, Column]) -> list[str]:
    """What must hold for names that say more than the program understands."""
    unheard = {column.name: wording.unheard(column.name, q) for q, column in found.items() if len(column.roles) == 1}
    words = [f'"{said}" in the name of column "{name}" changes nothing' for name, said in unheard.items() if said]
    return words + _of_bearings(found)


def _of_bearings(found: Mapping[str, Column]) -> list[str]:
    """What must hold for an azimuth whose name says that it counts from a direction which may change."""
    azimuth = found.get("azimuth")
    if azimuth is None:
        return []
    if "added" in azimuth.roles:
        added = azimuth.name.split(" + ")[azimuth.roles.index("added")]
        return [f'"{added}" is the heading of the carrier'] if COURSES & {*taken_apart(added).words} else []
    turns = wording.counts_from(taken_apart(azimuth.name))
    counts = "may count" if azimuth.key == AT_SEA else "counts"
    return [f"{turns}, from which the azimuth {counts}, stays where it is"] if turns == next(iter(TURNED)) else []


def _axis(found: Mapping[str, Column]) -> str:
    """The doubt about where azimuths count from."""
    azimuth = found.get("azimuth")
    what = wording.counts_from(taken_apart(azimuth.name)) if azimuth and azimuth.key != AT_SEA else ""
    return f"the azimuth counts from {what}" if what else _AXIS


def _is_from_north(azimuth: Column) -> bool:
    return "added" in azimuth.roles or wording.says_north(azimuth.name)
