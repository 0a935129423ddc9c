"""The sizes of angles: which units and conventions they allow, and the turns and digits by which some are known."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

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
    "rad": 2 * math.pi, "deg": 360.0, "grad": 400.0, "mil6000": 6000.0, "mrad": 2e3 * math.pi, "mil6300": 6300.0,
    "mil": 6400.0,
}  # fmt: skip
_SAME_TURN = 0.002
_FEWEST, _FEWEST_MINUTES = 24, 3  # rows, and different minutes in them, by which packed angles are known
FEW_ANGLES = 24  # angles, among which one is no rule


class Sizes(NamedTuple):
    """Sizes of the angles of a column in its own unit: the median and the 99th percentile of the absolute values, the
    smallest value, the turn by which they jump, or 0, and how many there are."""

    half: float
    most: float
    least: float
    turn: float
    rows: int


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
    return Sizes(half, most, float(known.min()), turn, known.size)


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


def fits(quantity: str, unit: Unit, sizes: Sizes, zenith: bool, stated: bool = False) -> bool:
    """Whether angles are possible in a unit. stated: by a name, so that an azimuth may count on beyond a turn."""
    if unit.name == "rad" or stated:
        most = _MAX_MEDIAN["zenith angle" if quantity == "elevation" and zenith else quantity]
        return sizes.half * unit.multiply / unit.divide <= most
    turn = 2 * math.pi * unit.divide / unit.multiply
    if quantity == "azimuth":
        return (sizes.half <= turn and (sizes.most <= 1.03 * turn or sizes.half <= turn / 2)) or counts_on(unit, sizes)
    return sizes.half <= (turn / 2 if zenith else turn / 4)


def counts_on(unit: Unit, sizes: Sizes) -> bool:
    """Whether many azimuths go on beyond a turn of the unit, 359, 361, ... without a jump."""
    turn = 2 * math.pi * unit.divide / unit.multiply
    return not sizes.turn and sizes.rows >= FEW_ANGLES and sizes.most > 1.03 * turn and sizes.half <= 2 * turn


def turns(unit: Unit, sizes: Sizes) -> bool:
    """Whether the azimuth jumps by a whole turn of the unit."""
    return abs(2 * math.pi * unit.divide / unit.multiply / sizes.turn - 1) < _SAME_TURN


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
