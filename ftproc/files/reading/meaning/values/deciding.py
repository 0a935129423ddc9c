"""What names leave open, or say wrongly, decided by the motion: the units, from where the elevation counts, and which
angle is which.

What is clear is taken. What contradicts the names is asked about. What stays open is taken as it is usual, and is a
condition of the verdict.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ftproc.files.layout import CANONICAL
from ftproc.files.reading.meaning.schema import Column
from ftproc.files.reading.meaning.values import asking, motion, plausibility, ways
from ftproc.files.reading.meaning.values.asking import Choice
from ftproc.files.reading.meaning.values.motion import Way
from ftproc.files.reading.meaning.values.plausibility import Sizes
from ftproc.files.reading.meaning.values.ways import Known
from ftproc.files.units import UNITS
from ftproc.files.words import DEPRESSIONS, QUANTITIES
from ftproc.records import FloatArray

DIGITS = "dms"  # the notation of degrees, minutes and seconds in the digits of a number
_CLEARLY = 10.0  # times likelier than any other is taken, or contradicts a name
_STILL = 3.0  # times likelier must the usual be than any other, to be taken without a word
_SHOWN = 30.0  # times likelier is it shown by the motion, and no condition
_QUESTIONED = 1e-6  # times as likely as the best
_BELOW_RAD = -0.02  # median elevation of a target below the station
_MOVES = 0.02  # likelihood of a motion that contradicts a name
_DOUBTED = 3.0  # times less likely than another is what a name says, to be a condition


class Open(NamedTuple):
    """found: the columns as the values show. doubts: what may be otherwise, with the option that settles it.
    conditions: of the verdict, what is assumed."""

    found: Mapping[str, Column]
    doubts: tuple[str, ...] = ()
    conditions: tuple[str, ...] = ()


def judged(log: Known, quantities: Mapping[str, FloatArray]) -> Open:
    """The columns with what their values show. quantities: (n,) in SI units, if the units of the columns are right.
    Raises InputError, a question."""
    if (packed := _packed_without_unit(log, quantities)) is not None:
        return packed
    moved = None if log.standard else motion.of(quantities, {q: column.unit for q, column in log.found.items()})
    sizes = plausibility.sizes(quantities, log.found)
    turned, notes = plausibility.with_other_mil(log.found, sizes)
    log = log._replace(found=turned)
    choices = _choices(log, sizes, moved)
    if not any(choice.odds for choice in choices):
        raise asking.impossible(log, sizes)
    choices.sort(key=lambda choice: -choice.odds)
    decided, conditions = _decided(log, sizes, choices, moved)
    if moved and _counts_down(moved, choices[0].way, decided.get("elevation")):
        conditions = (*conditions, "the elevation counts upwards")
    return _unpacked(log, quantities, Open(decided, tuple(notes), conditions))


def _counts_down(moved: motion.Motion, way: Way, elevation: Column | None) -> bool:
    """Whether most of the elevations are below the horizon, and the name does not say that they are."""
    known = elevation is None or elevation.name == CANONICAL["elevation"] or elevation.key in DEPRESSIONS
    return not known and moved.elevation(way) < _BELOW_RAD


def _packed_without_unit(log: Known, quantities: Mapping[str, FloatArray]) -> Open | None:
    """The angles without a unit in degrees, where the digits of all of them are degrees, minutes and seconds."""
    bare = [q for q in QUANTITIES[2:] if log.is_open(q) and not log.found[q].notation and not log.standard]
    in_degrees = {q: column._replace(unit=UNITS[q]["deg"]) for q, column in log.found.items() if q in bare}
    if not bare or plausibility.packed(quantities, log.found, in_degrees) != bare:
        return None
    return _unpacked(log, quantities, Open({**log.found, **in_degrees}))


def _unpacked(log: Known, quantities: Mapping[str, FloatArray], open_: Open) -> Open:
    """With the notation of angles whose digits are degrees, minutes and seconds."""
    mine = plausibility.packed(quantities, log.found, open_.found)
    if not mine:
        return open_
    units = ",".join(f"{q}=deg" for q in mine)
    names = " and ".join(f'"{log.found[q].name}"' for q in mine)
    doubt = (
        f"no minutes and seconds in the digits of {names} reach 60, so these are D.MMSS: if they are degrees with "
        f"decimals, say --units {units}"
    )
    found = {**open_.found, **{q: open_.found[q]._replace(notation=DIGITS) for q in mine}}
    return Open(found, (*open_.doubts, doubt), open_.conditions)


def _choices(log: Known, sizes: Mapping[str, Sizes], moved: motion.Motion | None) -> list[Choice]:
    """The ways to understand a log, without those of the angles that are out of the question."""
    angles = [
        (way, prior * (moved.of_angles(way) if moved else 1.0))
        for way, prior in ways.of_angles(log, sizes, moved is not None)
    ]
    least = _QUESTIONED * max((odds for _, odds in angles), default=0.0)
    found = []
    for (way, odds), (time, length, prior) in itertools.product(angles, ways.of_scales(log, moved is not None)):
        if odds > least:
            whole = way._replace(units=(time, length, *way.units[2:]))
            scales = moved.of_scales(whole) if moved else 1.0
            found.append(Choice(whole, scales * (moved.of_angles(way) if moved else 1.0), odds * prior * scales))
    return found


def _decided(
    log: Known, sizes: Mapping[str, Sizes], choices: Sequence[Choice], moved: motion.Motion | None
) -> tuple[Mapping[str, Column], tuple[str, ...]]:
    """The columns with the units of the likeliest way, and what is assumed. Raises InputError, a question."""
    best = choices[0]
    named_so = [choice for choice in choices if log.allows(choice.way)]
    contradicts = best.fit > _MOVES and not _in_own_names(log, best.way)
    if not named_so or (best.odds > _CLEARLY * named_so[0].odds and contradicts):
        raise asking.contradicted(log, sizes, _likely(choices, best.odds), named_so[:1])
    usual = _usual(log, named_so)
    rest = max((choice.odds for choice in named_so if choice is not usual), default=0.0)
    taken = usual
    if usual.odds < _STILL * rest:
        likely = _without_the_usual(_likely(named_so, named_so[0].odds), usual.way)
        taken = likely[0]
        if len(likely) > 1:
            likely = asking.of_angles(likely) if usual.way.units[:2] == taken.way.units[:2] else likely
            raise asking.left_open(log, likely if usual in likely else [*likely, usual])
    if moved and (zenith := _as_zenith(log, moved, choices, taken)):
        raise asking.left_open(log, [taken, zenith])
    units = dict(zip(QUANTITIES, taken.way.units, strict=True))
    found = {q: column._replace(unit=units[q] or column.unit) for q, column in log.found.items()}
    if taken.way.zenith and not log.is_zenith:
        found["elevation"] = found["elevation"]._replace(zenith=True)
    return found, _assumed(log, found, _rivals(log, choices, taken))


def _as_zenith(log: Known, moved: motion.Motion, choices: Sequence[Choice], taken: Choice) -> Choice | None:
    """The same with zenith angles, where most elevations would be steep, which they seldom are, and the motion does not
    speak against it."""
    elevation = log.found.get("elevation")
    if elevation is None or taken.way.zenith or ways.is_canonical(elevation):
        return None
    steep = abs(moved.elevation(taken.way)) > ways.STEEP_RAD
    same = (choice for choice in choices if choice.way == taken.way._replace(zenith=True))
    return next((choice for choice in same if steep and choice.odds * _DOUBTED > taken.odds), None)


def _in_own_names(log: Known, way: Way) -> bool:
    """Whether a way contradicts none but the program's own names, which nobody gives by mistake."""
    units = dict(zip(QUANTITIES, way.units, strict=True))
    own = {q: c._replace(unit=units[q] or c.unit) for q, c in log.found.items() if ways.is_canonical(c)}
    if "elevation" in own:
        own["elevation"] = own["elevation"]._replace(zenith=way.zenith)
    return log._replace(found={**log.found, **own}).allows(way)


def _usual(log: Known, choices: Sequence[Choice]) -> Choice:
    """What is taken where nothing tells: seconds, metres, the first unit that the angles fit."""

    def unusual(choice: Choice) -> tuple[int, ...]:
        each = zip(QUANTITIES, choice.way.units, strict=True)
        ranks = [list(UNITS[q]).index(unit.name) if unit and log.is_open(q) else 0 for q, unit in each]
        azimuth, elevation = choice.way.units[2:]
        mixed = azimuth is not None and elevation is not None and azimuth.name != elevation.name
        return (mixed, *ranks, choice.way.zenith != log.is_zenith)

    return min(choices, key=unusual)


def _likely(choices: Sequence[Choice], odds: float) -> list[Choice]:
    return [choice for choice in choices if choice.odds * _CLEARLY > odds]


def _without_the_usual(choices: Sequence[Choice], usual: Way) -> list[Choice]:
    """The choices without those that a likelier one differs from in nothing but units that are usual."""

    def is_beaten(choice: Choice, by: Choice) -> bool:
        each = zip(choice.way.units, by.way.units, usual.units, strict=True)
        differing = [second == third for first, second, third in each if first != second]
        alike = choice.way[1:] == by.way[1:]
        return alike and any(differing) and all(differing) and by.odds >= _STILL * choice.odds

    return [choice for choice in choices if not any(is_beaten(choice, other) for other in choices)]


def _rivals(log: Known, choices: Sequence[Choice], taken: Choice) -> list[Way]:
    """Ways that the motion leaves open; those that contradict a name only where they are nearly as likely."""
    return [
        choice.way
        for choice in choices
        if choice is not taken and choice.odds * (_SHOWN if log.allows(choice.way) else _DOUBTED) > taken.odds
    ]


def _assumed(log: Known, found: Mapping[str, Column], rivals: Sequence[Way] | None) -> tuple[str, ...]:
    """What of the units nothing states and nothing tells. rivals: ways that the motion leaves open; None: all."""
    units = {q: column.unit for q, column in found.items()}
    lines = [f"the range is in {units['range'].name}"] if log.is_open("range") else []
    lines += [f"the times are in {units['time'].name}"] if log.bare_time else []
    others = {q: {way.units[k] for way in rivals or ()} - {units.get(q)} for k, q in enumerate(QUANTITIES)}
    left = [q for q in QUANTITIES[2:] if q in found and (others[q] or (rivals is None and log.is_open(q)))]
    names = {units[q].name for q in left}
    if len(left) == 2 and len(names) == 1:
        lines.append(f"the angles are in {names.pop()}")
    else:
        lines += [f"the {q} is in {units[q].name}" for q in left]
    if any(way.zenith != ("elevation" in found and _is_zenith(log, found)) for way in rivals or ()):
        lines.append(f"the elevation counts from the {'zenith' if _is_zenith(log, found) else 'horizon'}")
    if any(way.exchanged for way in rivals or ()):
        lines.append("the azimuth and the elevation are not exchanged")
    doubted = [q for q in QUANTITIES[:2] if q in found and not log.is_open(q) and others[q]]
    return (*lines, *(f"the {'times are' if q == 'time' else f'{q} is'} in {units[q].name}" for q in doubted))


def _is_zenith(log: Known, found: Mapping[str, Column]) -> bool:
    stated = log.station.elevation_from
    return stated == "zenith" or (stated is None and found["elevation"].zenith)
