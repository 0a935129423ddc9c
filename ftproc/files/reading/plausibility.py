"""Angles in a mistaken unit or convention: refused where no flight can have them, else remarked on."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ftproc.errors import InputError
from ftproc.files.reading.schema import Column
from ftproc.files.units import UNITS
from ftproc.records import FloatArray
from ftproc.settings import Station

#: The median of a flight's angles is below these (rad). Single outliers are for editing.
_MAX_MEDIAN = {"azimuth": 4 * math.pi, "elevation": math.pi / 2, "zenith angle": math.pi}
_STEEP_DEG = 60  # few records have a median elevation above this
_MAX_ANGLE = 1e6  # rad; larger ones are clipped


def check_units(
    source: str, quantities: Mapping[str, FloatArray], found: Mapping[str, Column], elevation_from: str
) -> None:
    """Raise InputError if the angles cannot be in the unit assumed. A unit specified by the user is accepted.

    quantities: (n,) in SI units. found: their columns. elevation_from: `horizon` or `zenith`.
    """
    for quantity in ("azimuth", "elevation"):
        what = "zenith angle" if (quantity, elevation_from) == ("elevation", "zenith") else quantity
        limit = _MAX_MEDIAN[what]
        angles = np.abs(quantities.get(quantity, np.empty(0)))
        angles = angles[~np.isnan(angles)]
        if not angles.size or found[quantity].unit_stated_by_user:
            continue
        with np.errstate(over="ignore"):  # an angle that overflows is beyond the limit too
            half, most = np.quantile(angles, [0.5, 0.99]).tolist()
        if half <= limit:
            continue
        column = found[quantity]
        assumed = column.unit
        half, most = (value * assumed.divide / assumed.multiply for value in (half, most))
        # Degrees end at 360; values beyond 400 are outliers.
        typical = most if quantity == "azimuth" and 370 < most <= 400 else half
        other = _likely_unit(quantity, typical, limit / (2 if quantity == "azimuth" else 1))  # one turn, straight up
        named = f"--columns {quantity}={column.name} " if column.unit_in_name else ""
        raise InputError(
            f'{source}: half of column "{column.name}" lies beyond {half:.4g} {assumed.name}, which is no '
            f"{what}: it looks like {other[1]}; use {named}--units {quantity}={other[0]}"
            f"{_and_the_other_angle(quantity, found, other[0])}. "
            f"If {assumed.name} is right, say {named}--units {quantity}={assumed.name}."
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


def doubts(measurement: FloatArray, station: Station) -> tuple[str, ...]:
    """Remarks on options that may be forgotten, from (n, 3) readings in SI units as the instrument counts them."""
    angles = np.clip(measurement.T[1:], -_MAX_ANGLE, _MAX_ANGLE)
    azimuth, elevation = (np.degrees(column[np.isfinite(column)]) for column in angles)
    found = []
    if azimuth.size and azimuth.min() > -1 and 370 < np.quantile(azimuth, 0.99) <= 400:
        found.append("the azimuth runs from 0 to 400 deg: if they are gon, say --units azimuth=gon")
    if station.elevation_from == "horizon" and elevation.size and np.median(elevation) > _STEEP_DEG:
        found.append(
            f"half of the elevations are above {_STEEP_DEG} deg: if they are zenith angles, say --elevation-from zenith"
        )
    return tuple(found)
