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
_SURVEYORS = ("hz", "horizontalangle", "horizontaldirection", "hzangle", "v", "verticalangle", "vertangle", "ha", "va")
_TURNS = {"deg": 360.0, "grad": 400.0, "mil6000": 6000.0, "mrad": 2e3 * math.pi, "mil6300": 6300.0, "mil": 6400.0}
_FEWEST, _FEWEST_MINUTES = 24, 3  # rows, and different minutes in them, by which packed angles are known


class Judged(NamedTuple):
    """found: the columns with the units decided. doubts: what may be otherwise, with the option that settles it."""

    found: Mapping[str, Column]
    doubts: tuple[str, ...] = ()


class _Angles(NamedTuple):
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
    angles = {q: _angles(quantities[q], found[q].unit) for q in ("azimuth", "elevation") if q in found}
    known = {quantity: sizes for quantity, sizes in angles.items() if sizes is not None}
    bare = {quantity: sizes for quantity, sizes in known.items() if not found[quantity].unit_is_stated}
    decided, doubts = dict(found), []
    other = _other_mil(found, known)
    if other:
        for quantity in known:
            if _is_bare_mil(found[quantity]):
                decided[quantity] = found[quantity]._replace(unit=UNITS[quantity][other])
        doubts.append(f"the azimuth turns at {_TURNS[other]:g}, so its mils are {other}")
    zenith = station.elevation_from == "zenith" or ("elevation" in found and found["elevation"].zenith)
    if bare:
        unit, doubt = _common_unit(source, bare, found, zenith)
        for quantity in bare:
            decided[quantity] = found[quantity]._replace(unit=UNITS[quantity][unit])
        doubts += [doubt] if doubt else []
    for quantity, sizes in known.items():
        if quantity not in bare:
            _check(source, quantity, sizes, found, zenith)
    _ask_about_packed(source, quantities, found, decided)
    _ask_about_zenith(source, known, decided, station)
    return Judged(decided, tuple(doubts))


def _angles(values: FloatArray, unit: Unit) -> _Angles | None:
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
    return _Angles(half, most, float(known.min()), turn)


def _is_bare_mil(column: Column) -> bool:
    return column.unit.name == "mil" and column.unit_in_name and not column.unit_stated_by_user


def _other_mil(found: Mapping[str, Column], known: Mapping[str, _Angles]) -> str:
    """The other kind of mil at whose turn the azimuth jumps, or ""."""
    if "azimuth" not in known or not _is_bare_mil(found["azimuth"]):
        return ""
    return next((name for name in ("mil6000", "mil6300") if known["azimuth"].turn == _TURNS[name]), "")


def _common_unit(
    source: str, bare: Mapping[str, _Angles], found: Mapping[str, Column], zenith: bool
) -> tuple[str, str]:
    """The unit of the angles without one, which one instrument writes alike, and what is doubtful about it."""
    if all(_fits(quantity, "rad", sizes, zenith) for quantity, sizes in bare.items()):
        return "rad", ""
    names = " and ".join(f'"{found[quantity].name}"' for quantity in bare)
    say = ",".join(f"{quantity}=UNIT" for quantity in bare)
    turn = next((sizes.turn for sizes in bare.values() if sizes.turn), 0.0)
    turned = next((name for name, size in _TURNS.items() if size == turn), "")
    possible = [u for u in _TURNS if all(_fits(q, u, sizes, zenith) for q, sizes in bare.items())]
    if turned in possible:
        return turned, ""
    surveyors = any(found[quantity].key in _SURVEYORS for quantity in bare)
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


def _fits(quantity: str, unit: str, sizes: _Angles, zenith: bool) -> bool:
    """Whether angles are possible in a unit."""
    if unit == "rad":
        return sizes.half <= _MAX_MEDIAN["zenith angle" if quantity == "elevation" and zenith else quantity]
    turn = _TURNS[unit]
    if quantity == "azimuth":
        return sizes.half <= turn and (sizes.most <= 1.03 * turn or sizes.half <= turn / 2)
    return sizes.half <= (turn / 2 if zenith else turn / 3)


def _check(source: str, quantity: str, sizes: _Angles, found: Mapping[str, Column], zenith: bool) -> None:
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


def _ask_about_packed(
    source: str, quantities: Mapping[str, FloatArray], found: Mapping[str, Column], decided: Mapping[str, Column]
) -> None:
    """Raise InputError, a question, for degrees whose decimals may be minutes and seconds: 60.1608 as 60°16′08″."""
    degrees = [q for q, column in decided.items() if column.unit.name == "deg" and not column.unit_stated_by_user]
    packed = [q for q in degrees if not decided[q].notation and _is_packed(quantities[q], found[q].unit)]
    if packed:
        names = " and ".join(f'"{decided[quantity].name}"' for quantity in packed)
        named_so = " and ".join(f"{quantity}_dms" for quantity in packed)
        raise InputError(
            f"{source}: no minutes and seconds in the digits of {names} reach 60, as if they were packed (D.MMSS). "
            f"If they are, rename to {named_so}; if they are degrees with decimals, "
            f"say --units {','.join(f'{quantity}=deg' for quantity in packed)}."
        )


def _is_packed(values: FloatArray, unit: Unit) -> bool:
    """Whether the decimals are possible minutes and seconds, of all sizes."""
    with np.errstate(over="ignore", invalid="ignore"):
        digits = np.floor(np.abs(values[np.isfinite(values)]) * unit.divide / unit.multiply * 1e4 + 1e-5)
        minute, second = np.floor(digits / 100) % 100, digits % 100
    if len(digits) < _FEWEST or len(np.unique(minute)) < _FEWEST_MINUTES:
        return False
    return bool(minute.max() < 60 and second.max() < 60 and second.min() < 10 and second.max() >= 50)


def _ask_about_zenith(
    source: str, known: Mapping[str, _Angles], decided: Mapping[str, Column], station: Station
) -> None:
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
