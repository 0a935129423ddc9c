"""What the name of a column says beside its quantity and its unit: from where an azimuth counts, that an angle counts
downwards, a factor, `Range/10 (m)`, and words that the program does not understand, `Range (m, smoothed)`."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from ftproc.errors import InputError, quoted
from ftproc.files.reading.meaning.names import EAST_OF_NORTH, NOTATIONS, Name, compatible, taken_apart
from ftproc.files.units import si_unit, unit_named
from ftproc.files.words import (
    ALIASES,
    AT_SEA,
    COURSES,
    DEPRESSIONS,
    HARMLESS,
    QUANTITIES,
    TRUE,
    TURNED,
    WEAK_ALIASES,
    plain_letters,
)

#: Words of azimuths that count clockwise from north.
_FROM_NORTH = TRUE.union(
    ("bearing", "brg", "taz", "north", "clockwise", "cw", "peilung", "пеленг", "relevement", "rilevamento", "demora"),
    ("peiling", "pejling", "baring", "suuntima", "namiar", "kerteriz", "真方位"),
)
_OF_GRIDS = [unit_named("azimuth", unit) for unit in ("gon", "grad", "mil")]  # of gunners and surveyors, not of ships
_FACTOR = re.compile(
    r"\*\s*\d[\d.]*|\d[\d.]*\s*\*|(?:[×·/]|\bx|(?<=_)x)\s*10+(?![\d.])|\b(?:half|quarter|tenths?|hundredths?)\b"
    r"|\bE[-+]\d+|^2(?=\s?R\b)",
    re.IGNORECASE,
)
#: That an angle is positive below the horizontal.
DOWNWARD = (
    r"(?:positive|\+(?:ve)?)[ :=]*(?:is |when )?(?:down|below)|down(?:wards?)?[ :=]*(?:is )?(?:positive|\+)"
    r"|counts? down|below (?:the )?horizon|negative[ :=]*(?:is |when )?(?:up\b|above)"
    r"|nach unten positiv|positiv nach unten|positif vers le bas|depressions? (?:is |are )?positive"
)
_DOWNWARD = re.compile(DOWNWARD, re.IGNORECASE)
#: Names of horizontal distances: whole words and stems, without accents.
HORIZONTAL = re.compile(
    r"hd|hdist|(?:horizontal|hor|horiz|ground|gnd|plan|map|2d)(?:distance|range|dist|rng)|horizontal(?:distanz|entfernung"
    r"|strecke|abstand)|(?:distance|distanza|distancia)(?:horizontale?|orizzontale|planimetri\w*)|水平(?:距离|距離|距|斜距)"
    r"|горизонтальна\w*(?:дальность|расстояние)|rxy|gr"
)
_BRACKETS = re.compile(r"[(\[{](.*?)[)\]}]")


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


def refuse_factor(source: str, name: Name, quantity: str) -> None:
    """Ask for the unit of a column whose name holds a factor beside the unit."""
    found = _FACTOR.search(compatible(name.text).replace(name.unit or "\0", ""))
    if found:
        unit = name.unit if name.is_in_a_unit_of(quantity) else si_unit(quantity).name
        scaled, plain = (quoted(f"{quantity}={each}") for each in (f"0.1 {unit}", unit))
        raise InputError(
            f'{source}: the name of column "{name.text}" holds a factor, "{found[0].strip()}". Say what one is worth, '
            f"such as --units {scaled}, or --units {plain} if nothing is to be multiplied."
        )


def key_of(name: str, quantity: str, otherwise: str) -> str:
    """The key of a column: that of angles below the horizontal where its name says that these are positive."""
    return DEPRESSIONS[0] if quantity == "elevation" and _DOWNWARD.search(name) else otherwise


def unheard(name: str, quantity: str) -> str:
    """The words in the brackets of a name that are neither a unit nor known to change nothing; "" if there are none."""
    if quantity == "elevation" and _DOWNWARD.search(name):
        return ""
    known = HARMLESS.union(NOTATIONS, ALIASES[quantity], WEAK_ALIASES[quantity])
    for inside in _BRACKETS.findall(compatible(name)):
        words = re.findall(r"[^\W\d_]+", plain_letters(inside))
        rest = [word for word in words if word not in known and not any(unit_named(q, word) for q in QUANTITIES)]
        if rest and len(words) > 1 and not any(unit_named(q, inside) for q in QUANTITIES):
            return str(inside).strip()
    return ""
