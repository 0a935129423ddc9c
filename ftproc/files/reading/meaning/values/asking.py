"""Questions about what the names of a log and its motion leave open, each with the options that answer it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ftproc.errors import InputError, quoted
from ftproc.files.reading.meaning.questions import named
from ftproc.files.reading.meaning.values import plausibility
from ftproc.files.reading.meaning.values.motion import Way
from ftproc.files.reading.meaning.values.plausibility import Sizes
from ftproc.files.reading.meaning.values.ways import Known
from ftproc.files.words import QUANTITIES

_PLUNGED_RAD = math.radians(120)  # as a zenith angle, the target would be 30 degrees below the station


class Choice(NamedTuple):
    """fit: the likelihood of a way. odds: this times how likely it was before."""

    way: Way
    fit: float
    odds: float


def impossible(log: Known, sizes: Mapping[str, Sizes]) -> InputError:
    """Where no unit is possible."""
    first = next(q for q in QUANTITIES[2:] if q in sizes)
    column, half = log.found[first], sizes[first].half
    return InputError(
        f'{log.source}: half of column "{column.name}" lies beyond {half:.4g}, which is no {first} in any unit that is '
        f"known. Say --columns {quoted(f'{first}={named(column.name, column.position)}')} --units {first}=UNIT."
    )


def contradicted(
    log: Known, sizes: Mapping[str, Sizes], likely: Sequence[Choice], named_so: Sequence[Choice]
) -> InputError:
    """The question where the sizes of the angles or the motion contradict the names."""
    ways = [choice.way for choice in (*likely, *named_so)]
    if plunged := _plunged(log, sizes):
        raise plunged
    *first, last = [*_answers(log, ways), *([] if named_so else [""])]
    names_are = f", or {last} if the names are right" if named_so else ""
    if first == ["--elevation-from zenith"] and not named_so:  # so half of them are beyond the horizon
        names_are = " if the target is below the station, or take 90 degrees off angles that count from the nadir"
    why = _impossible(log, sizes) or (
        f"what the names say of {_differing_words(log, ways)} gives the target no likely motion, and another way does"
    )
    return InputError(f"{log.source}: {why}. Say {' or '.join(first)}{names_are}.")


def _plunged(log: Known, sizes: Mapping[str, Sizes]) -> InputError | None:
    """Where elevations are those of a telescope in its second face, or of a target far below."""
    column, mine = log.found.get("elevation"), sizes.get("elevation")
    if column is None or mine is None or log.is_zenith or log.is_open("elevation"):
        return None
    if not _PLUNGED_RAD < mine.half * column.unit.multiply / column.unit.divide < math.pi:
        return None
    half = f"{mine.half:.4g} {column.unit.name}"
    return InputError(
        f'{log.source}: half of column "{column.name}" lies beyond {half}, as in the second face of a telescope. If '
        "so, write half a turn minus them for the elevations, and turn the azimuths by half a turn; if these are "
        "zenith angles of a target far below the station, name the column so."
    )


def _impossible(log: Known, sizes: Mapping[str, Sizes]) -> str:
    """Which angle cannot be what its name says; or ""."""
    for quantity, mine in sizes.items():
        column, zenith = log.found[quantity], quantity == "elevation" and log.is_zenith
        if not log.is_open(quantity) and not plausibility.fits(quantity, column.unit, mine, zenith, True):
            what = "zenith angle" if zenith else quantity
            return f'half of column "{column.name}" lies beyond {mine.half:.4g} {column.unit.name}, which is no {what}'
    return ""


def left_open(log: Known, likely: Sequence[Choice]) -> InputError:
    """The question where nothing is stated and the motion does not tell."""
    ways = sorted((choice.way for choice in likely), key=_in_mils)
    quantities, *_ = _differing(log, ways)
    what = f"no unit is stated for {_differing_words(log, ways)}" if quantities else "it is not stated from where " \
           f"{_differing_words(log, ways)} counts"  # fmt: skip
    return InputError(
        f"{log.source}: {what}, and the motion of the target does not tell which it is. "
        f"Say {' or '.join(_answers(log, ways))}."
    )


def _in_mils(way: Way) -> bool:
    """Whether an angle is in a unit of gunners, which others seldom use."""
    return any(unit is not None and unit.name.startswith(("mil", "mrad")) for unit in way.units[2:])


def _differing(log: Known, ways: Sequence[Way]) -> tuple[list[str], bool, bool]:
    """The quantities whose units differ among ways, whether the zenith does, and whether the angles are exchanged."""
    named = {q: c.unit.name for q, c in log.found.items() if len(ways) == 1 or not log.is_open(q)}
    units = [
        q for k, q in enumerate(QUANTITIES) if len({_unit(way, k) for way in ways} | {*[named.get(q)]} - {None}) > 1
    ]
    zenith = len({way.zenith for way in ways} | {log.is_zenith}) > 1
    return units, zenith, len({way.exchanged for way in ways} | {False}) > 1


def _unit(way: Way, k: int) -> str:
    """The name of the unit of the kth quantity, wherever its readings stand."""
    index = 5 - k if way.exchanged and k > 1 else k
    unit = way.units[index]
    return unit.name if unit else ""


def _differing_words(log: Known, ways: Sequence[Way]) -> str:
    units, zenith, exchanged = _differing(log, ways)
    quantities = [*units, *(["elevation"] if zenith else []), *(QUANTITIES[2:] if exchanged else ())]
    return " and ".join(dict.fromkeys(f'"{log.found[q].name}"' for q in quantities))


def _answers(log: Known, ways: Sequence[Way]) -> list[str]:
    """The options that say each way, each once."""
    units, zenith, exchanged = _differing(log, ways)
    return list(dict.fromkeys(_options(log, way, units, zenith, exchanged) for way in ways))


def _options(log: Known, way: Way, units: Sequence[str], zenith: bool, exchanged: bool) -> str:
    turned = {"azimuth": "elevation", "elevation": "azimuth"} if way.exchanged else {}
    insisted = [q for q in units if not log.is_open(turned.get(q, q))]
    columns = {
        q: log.found[turned.get(q, q)] for q in QUANTITIES if q in insisted or (exchanged and q in QUANTITIES[2:])
    }
    words = []
    if columns:
        each = (f"{q}={named(column.name, column.position)}" for q, column in columns.items())
        words.append(f"--columns {quoted(','.join(each))}")
    if units:
        words.append(f"--units {quoted(','.join(f'{q}={_unit(way, QUANTITIES.index(q))}' for q in units))}")
    if zenith:
        words.append(f"--elevation-from {'zenith' if way.zenith else 'horizon'}")
    return " ".join(words)


def of_angles(choices: Sequence[Choice]) -> list[Choice]:
    """The likeliest of each way to understand the angles, if these are what is open; else all."""
    tops = {choice.way[1:] + choice.way.units[2:]: choice for choice in reversed(choices)}
    return list(reversed(tops.values())) if len(tops) > 1 else list(choices)
