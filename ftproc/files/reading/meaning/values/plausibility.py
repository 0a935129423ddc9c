"""Units and conventions judged by the values: taken where only one fits, or one is far likelier; else asked about."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ftproc.errors import InputError, quoted
from ftproc.files.layout import CANONICAL
from ftproc.files.reading.meaning.questions import named
from ftproc.files.reading.meaning.schema import Column
from ftproc.files.units import UNITS, Unit
from ftproc.order_statistics import median, quantile
from ftproc.records import FloatArray
from ftproc.settings import Station

#: The median of a flight's angles is below these (rad). Single outliers are for editing.
_MAX_MEDIAN = {"azimuth": 4 * math.pi, "elevation": math.pi / 2, "zenith angle": math.pi}
_STEEP_DEG = 60  # few records have a median elevation above this
_MAX_ANGLE = 1e6  # rad; larger ones are clipped
SURVEYORS = ("hz", "horizontalangle", "horizontaldirection", "hzangle", "v", "verticalangle", "vertangle", "ha", "va")
_TURNS = {
    "rad": 2 * math.pi,
    "deg": 360.0,
    "grad": 400.0,
    "mil6000": 6000.0,
    "mrad": 2e3 * math.pi,
    "mil6300": 6300.0,
    "mil": 6400.0,
}
_SAME_TURN = 0.002
_FEWEST, _FEWEST_MINUTES = 24, 3  # rows, and different minutes in them, by which packed angles are known


class Judged(NamedTuple):
    """found: the columns with the units decided. doubts: what may be otherwise, with the option that settles it."""

    found: Mapping[str, Column]
    doubts: tuple[str, ...] = ()


class Sizes(NamedTuple):
    """Sizes of the angles of a column in its own unit: the median and the 99th percentile of the absolute values, the
    smallest value, and the turn by which they jump, or 0."""

    half: float
    most: float
    least: float
    turn: float


def judged(source: str, quantities: Mapping[str, FloatArray], found: Mapping[str, Column], station: Station) -> Judged:
    """The columns with the units of angles that nobody stated. Raises InputError if the angles cannot be in the unit
    stated in a name, and a question where several units are possible. A unit specified by the user is accepted.

    quantities: (n,) in SI units as `found` says. station: its `elevation_from` may be None (not stated).
    """
    known = sizes(quantities, found)
    bare = {quantity: mine for quantity, mine in known.items() if not found[quantity].unit_is_stated}
    decided, doubts = with_other_mil(found, known)
    zenith = station.elevation_from == "zenith" or ("elevation" in found and found["elevation"].zenith)
    if bare:
        unit, doubt = _common_unit(source, bare, found, zenith)
        for quantity in bare:
            decided[quantity] = found[quantity]._replace(unit=UNITS[quantity][unit])
        doubts += [doubt] if doubt else []
    for quantity, mine in known.items():
        if quantity not in bare:
            _check(source, quantity, mine, found, zenith)
    _ask_about_zenith(source, known, decided, station)
    return Judged(decided, tuple(doubts))


def sizes(quantities: Mapping[str, FloatArray], found: Mapping[str, Column]) -> dict[str, Sizes]:
    """The sizes of the angles that are there."""
    return sizes_in(quantities, {q: found[q].unit for q in ("azimuth", "elevation") if q in found})


def sizes_in(quantities: Mapping[str, FloatArray], units: Mapping[str, Unit]) -> dict[str, Sizes]:
    """The sizes of the angles of which there are units."""
    each = {quantity: _sizes(quantities[quantity], unit) for quantity, unit in units.items()}
    return {quantity: mine for quantity, mine in each.items() if mine is not None}


def _sizes(values: FloatArray, unit: Unit) -> Sizes | None:
    known = values[~np.isnan(values)]
    if not known.size:
        return None
    with np.errstate(over="ignore", invalid="ignore"):  # an angle that overflows is beyond all limits too
        known = known * unit.divide / unit.multiply
        half, most = (quantile(np.abs(known), share) for share in (0.5, 0.99))
        jumps = np.abs(np.diff(known))
        step = median(jumps) if jumps.size else 0.0
    turn = 0.0
    for size in _TURNS.values():
        near = (jumps > 0.97 * size) & (jumps + step <= 1.0005 * size)
        if near.any() and most <= 1.0001 * size:
            turn = size
            break
    return Sizes(half, most, float(known.min()), turn)


def _is_bare_mil(column: Column) -> bool:
    return column.unit.name == "mil" and column.unit_in_name and not column.unit_stated_by_user


def with_other_mil(found: Mapping[str, Column], known: Mapping[str, Sizes]) -> tuple[dict[str, Column], list[str]]:
    """The columns with the kind of mil at whose turn the azimuth jumps, and a note on it."""
    if "azimuth" not in known or not _is_bare_mil(found["azimuth"]):
        return dict(found), []
    other = next((name for name in ("mil6000", "mil6300") if known["azimuth"].turn == _TURNS[name]), "")
    if not other:
        return dict(found), []
    mils = {q: found[q]._replace(unit=UNITS[q][other]) for q in known if _is_bare_mil(found[q])}
    return {**found, **mils}, [f"the azimuth turns at {_TURNS[other]:g}, so its mils are {other}"]


def _common_unit(source: str, bare: Mapping[str, Sizes], found: Mapping[str, Column], zenith: bool) -> tuple[str, str]:
    """The unit of the angles without one, which one instrument writes alike, and what is doubtful about it."""
    if all(fits(quantity, UNITS[quantity]["rad"], sizes, zenith) for quantity, sizes in bare.items()):
        return "rad", ""
    names = " and ".join(f'"{found[quantity].name}"' for quantity in bare)
    say = ",".join(f"{quantity}=UNIT" for quantity in bare)
    turn = next((sizes.turn for sizes in bare.values() if sizes.turn), 0.0)
    turned = next((name for name, size in _TURNS.items() if size == turn), "")
    possible = [u for u in _TURNS if all(fits(q, UNITS[q][u], sizes, zenith) for q, sizes in bare.items())]
    if turned in possible:
        return turned, ""
    surveyors = any(found[quantity].key in SURVEYORS for quantity in bare)
    azimuth = bare.get("azimuth")
    if possible[:1] == ["deg"] and not surveyors and not (azimuth and azimuth.most > 360):
        grad = say.replace("UNIT", "grad")
        return "deg", f"{names} beyond any radians, taken for degrees: if they are gon, say --units {grad}"
    likely = [unit for unit in possible if unit in ("deg", "grad")] or possible
    first = next(iter(bare))
    half = bare[first].half
    answers = " or ".join(f"--units {say.replace('UNIT', unit)}" for unit in likely) or f"--units {say}"
    raise InputError(
        f'{source}: no unit is stated for {names}, and half of column "{found[first].name}" lies beyond {half:.4g}, '
        f"which is no {first} in rad. Say {answers}."
    )


def fits(quantity: str, unit: Unit, sizes: Sizes, zenith: bool, stated: bool = False) -> bool:
    """Whether angles are possible in a unit. stated: by a name, so that an azimuth may count on beyond a turn."""
    if unit.name == "rad" or stated:
        most = _MAX_MEDIAN["zenith angle" if quantity == "elevation" and zenith else quantity]
        return sizes.half * unit.multiply / unit.divide <= most
    turn = 2 * math.pi * unit.divide / unit.multiply
    if quantity == "azimuth":
        return sizes.half <= turn and (sizes.most <= 1.03 * turn or sizes.half <= turn / 2)
    return sizes.half <= (turn / 2 if zenith else turn / 4)


def turns(unit: Unit, sizes: Sizes) -> bool:
    """Whether the azimuth jumps by a whole turn of the unit."""
    return abs(2 * math.pi * unit.divide / unit.multiply / sizes.turn - 1) < _SAME_TURN


def _check(source: str, quantity: str, sizes: Sizes, found: Mapping[str, Column], zenith: bool) -> None:
    """Raise InputError if the angles cannot be in the unit that a name states."""
    column = found[quantity]
    what = "zenith angle" if quantity == "elevation" and zenith else quantity
    limit = _MAX_MEDIAN[what]
    assumed = column.unit
    if column.unit_stated_by_user or sizes.half * assumed.multiply / assumed.divide <= limit:
        return
    half_deg = math.degrees(sizes.half * assumed.multiply / assumed.divide)
    if what == "elevation" and half_deg <= 180 and assumed.name != "rad":
        raise InputError(
            f'{source}: half of column "{column.name}" lies beyond {sizes.half:.4g} {assumed.name}, which is no '
            "elevation: it looks like a zenith angle; say --elevation-from zenith."
        )
    # Degrees end at 360; values beyond 400 are outliers.
    typical = sizes.most if quantity == "azimuth" and 370 < sizes.most <= 400 else sizes.half
    other = _likely_unit(quantity, typical, limit / (2 if quantity == "azimuth" else 1))  # one turn, straight up
    say = f"--columns {quantity}={quoted(named(column.name, column.position))} --units {quantity}="
    raise InputError(
        f'{source}: half of column "{column.name}" lies beyond {sizes.half:.4g} {assumed.name}, which is no '
        f"{what}: it looks like {other[1]}; use {say}{other[0]}"
        f"{_and_the_other_angle(quantity, found, other[0])}. "
        f"If {assumed.name} is right, say {say}{quoted(assumed.name)}."
    )


def _likely_unit(quantity: str, typical: float, limit: float) -> tuple[str, str]:
    words = {"deg": "degrees (or gon)", "grad": "gradians (gon)", "mil": "mils"}
    for name, word in words.items():
        unit = UNITS[quantity][name]
        if typical * unit.multiply / unit.divide <= limit:
            return name, word
    return "UNIT", "another unit"


def _and_the_other_angle(quantity: str, found: Mapping[str, Column], unit: str) -> str:
    """An elevation of a few degrees is a possible number of radians, so the message names it with the azimuth."""
    other = found.get("elevation" if quantity == "azimuth" else "azimuth")
    if other is None or other.unit_stated_by_user or other.unit != found[quantity].unit:
        return ""
    return f" (and {other.quantity}={unit} if that is so too)"


def packed(
    quantities: Mapping[str, FloatArray], found: Mapping[str, Column], decided: Mapping[str, Column]
) -> list[str]:
    """The quantities in degrees whose decimals are minutes and seconds: 60.1608 is 60°16′08″."""
    degrees = [q for q, column in decided.items() if column.unit.name == "deg" and not column.unit_stated_by_user]
    return [q for q in degrees if not decided[q].notation and _is_packed(quantities[q], found[q].unit)]


def _is_packed(values: FloatArray, unit: Unit) -> bool:
    """Whether the decimals are possible minutes and seconds, of all sizes: of so many decimals that is no accident."""
    with np.errstate(over="ignore", invalid="ignore"):
        digits = np.floor(np.abs(values[np.isfinite(values)]) * unit.divide / unit.multiply * 1e4 + 1e-5)
        minute, second = np.floor(digits / 100) % 100, digits % 100
    if len(digits) < _FEWEST or len(np.unique(minute)) < _FEWEST_MINUTES:
        return False
    return bool(minute.max() < 60 and second.max() < 60 and second.min() < 10 and second.max() >= 50)


def _ask_about_zenith(source: str, known: Mapping[str, Sizes], decided: Mapping[str, Column], station: Station) -> None:
    """Raise InputError, a question, for steep angles in a column whose name does not say that they are elevations."""
    sizes, column = known.get("elevation"), decided.get("elevation")
    if sizes is None or column is None or station.elevation_from is not None or column.zenith:
        return
    half_deg = math.degrees(sizes.half * column.unit.multiply / column.unit.divide)
    if half_deg <= _STEEP_DEG or column.key == "elevation" or column.name == CANONICAL["elevation"]:
        return
    if column.unit.name == "rad" and not column.unit_is_stated:
        bare = [quantity for quantity in known if not decided[quantity].unit_is_stated]
        deg, rad = (",".join(f"{quantity}={unit}" for quantity in bare) for unit in ("deg", "rad"))
        raise InputError(
            f'{source}: no unit is stated for "{column.name}", and half of it lies beyond {sizes.half:.4g}. '
            f"Say --units {deg}, or --units {rad} --elevation-from horizon."
        )
    raise InputError(
        f'{source}: half of column "{column.name}" lies beyond {half_deg:.4g} deg, as zenith angles do. '
        "Say --elevation-from zenith if they are zenith angles, or --elevation-from horizon if the target was so high."
    )


def doubts(measurement: FloatArray, station: Station) -> tuple[str, ...]:
    """Remarks on options that may be forgotten, from (n, 3) readings in SI units as the instrument counts them."""
    angles = np.clip(measurement.T[1:], -_MAX_ANGLE, _MAX_ANGLE)
    azimuth, elevation = (np.degrees(column[np.isfinite(column)]) for column in angles)
    found = []
    if azimuth.size and azimuth.min() > -1 and 370 < quantile(azimuth, 0.99) <= 400:
        found.append("the azimuth runs from 0 to 400 deg: if they are gon, say --units azimuth=gon")
    if station.elevation_from != "zenith" and elevation.size and median(elevation) > _STEEP_DEG:
        found.append(
            f"half of the elevations are above {_STEEP_DEG} deg: if they are zenith angles, say --elevation-from zenith"
        )
    return tuple(found)
