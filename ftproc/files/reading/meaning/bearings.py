"""From where an azimuth counts, as its name says: true north, magnetic north, or the head of the carrier."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from ftproc.files.reading.meaning.names import EAST_OF_NORTH, Name, taken_apart
from ftproc.files.units import unit_named
from ftproc.files.words import ALIASES, AT_SEA, COURSES, TRUE, TURNED, plain_letters

#: Words of azimuths that count clockwise from north.
_FROM_NORTH = TRUE.union(
    ("bearing", "brg", "taz", "north", "clockwise", "cw", "peilung", "пеленг", "relevement", "rilevamento", "demora"),
    ("peiling", "pejling", "baring", "suuntima", "namiar", "kerteriz", "真方位"),
)
_OF_GRIDS = [unit_named("azimuth", unit) for unit in ("gon", "grad", "mil")]  # of gunners and surveyors, not of ships


def counts_from(name: Name) -> str:
    """What an azimuth of this name counts from, one of TURNED; "" where the name does not say so."""
    bracket = name.text[max(map(name.text.rfind, "([")) :] if name.text.endswith((")", "]")) else ""
    mine = {name.stem, *name.words, *re.findall(r"\w+", plain_letters(bracket))}
    if name.unit and unit_named("azimuth", name.unit) in _OF_GRIDS:
        mine -= {AT_SEA}
    marks = re.findall(r"[A-Z]+", bracket)
    found = (what for what, (words, mark, _) in TURNED.items() if words & mine or mark in marks)
    is_azimuth = {name.stem, name.core(), *name.words} & {*ALIASES["azimuth"]} - {"a"}
    return next(found, "") if is_azimuth and not TRUE & mine else ""


def says_north(text: str) -> bool:
    """Whether the name of an azimuth says that it counts clockwise from true north."""
    name = taken_apart(text)
    if counts_from(name):
        return False
    from_north = name.notation in ("t", "true") or name.words[:1] == ("true",) or _FROM_NORTH & {name.stem, *name.words}
    return bool(from_north or EAST_OF_NORTH.search(text))


def turned(names: Mapping[int, Name]) -> dict[str, int] | None:
    """The columns of an azimuth that counts from the head of the carrier, or from magnetic north, and of what is to be
    added to it: {"azimuth": position, "added": position}."""
    for what, (_, _, words) in TURNED.items():
        mine = [index for index, name in names.items() if counts_from(name) == what]
        added = [index for index, name in names.items() if words & {*name.words} and not name.foreign]
        added = [index for index in added if not COURSES & {*names[index].words}] or added
        if len(mine) == len(added) == 1 and mine != added:
            return {"azimuth": mine[0], "added": added[0]}
    return None


def preferred(names: Sequence[Name], free: Sequence[int]) -> list[int]:
    """Of free columns those that count from nowhere else, where one of them is an azimuth that counts from north."""
    rest = [index for index in free if not counts_from(names[index])]
    meant = [(names[index], names[index].means("azimuth")) for index in rest]
    return rest if any(rank == 1 or (rank and says_north(name.text)) for name, rank in meant) else list(free)
