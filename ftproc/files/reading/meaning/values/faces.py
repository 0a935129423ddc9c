"""Angles that point where others do: in the second face of a theodolite, its telescope turned over, where the vertical
circle counts beyond half a turn and the horizontal circle is half a turn on; and over the zenith."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ftproc.files.reading.meaning.schema import Column
from ftproc.files.reading.meaning.values.plausibility import SURVEYORS
from ftproc.records import FloatArray
from ftproc.settings import Station

_FEWEST_IN_RUNS = 3  # cells
_NEAR_RAD = math.radians(20)  # to the zenith: readings on both sides of it
_LEAST_OF_A_TURN_RAD = math.radians(315)  # 45 degrees below the horizon
_FROM_RAD, _TO_RAD = math.radians(190), math.radians(350)  # 80 degrees above the horizon in both faces


def turned_back(quantities: dict[str, FloatArray], found: Mapping[str, Column]) -> list[str]:
    """Change the angles of the second face among `quantities` (SI units) to those of the first, and say so. The
    vertical circle must count from the zenith by its name, in a unit that is stated."""
    column = found.get("elevation")
    if column is None or not column.unit_is_stated:
        return []
    if not (column.zenith or column.key in SURVEYORS):
        return _below_zero(quantities, column)
    if "azimuth" not in found:
        return []
    circle = quantities["elevation"]
    second = circle > math.pi
    if not _in_runs(second) or (circle[second] < _FROM_RAD).any() or (circle[second] > _TO_RAD).any():
        return []
    quantities["elevation"] = np.where(second, 2 * math.pi - circle, circle)
    quantities["azimuth"] = np.where(second, quantities["azimuth"] - math.pi, quantities["azimuth"])
    return [f'{np.count_nonzero(second)} rows of "{column.name}" are of the second face, and are turned back']


def _below_zero(quantities: dict[str, FloatArray], column: Column) -> list[str]:
    """Change elevations of circles that go on from zero to a whole turn, 359.5 degrees, to negative ones."""
    circle = quantities["elevation"]
    above = circle > math.pi / 2
    if not _in_runs(above) or (circle[above] < _LEAST_OF_A_TURN_RAD).any() or (circle[above] > 2 * math.pi).any():
        return []
    quantities["elevation"] = np.where(above, circle - 2 * math.pi, circle)
    return [
        f'{np.count_nonzero(above)} cells of "{column.name}" count on from a whole turn, and are below the horizontal'
    ]


def over_the_zenith(quantities: dict[str, FloatArray], found: Mapping[str, Column], station: Station) -> list[str]:
    """Change angles of a mount that follows a target over the zenith, to elevations of more than 90 degrees, to those
    of the same direction below 90, and say so. Most elevations must be below it."""
    if not {"azimuth", "elevation"} <= {*found} or found["elevation"].zenith or station.elevation_from == "zenith":
        return []
    elevation = quantities["elevation"]
    over = (elevation > math.pi / 2) & (elevation < math.pi)
    if not _in_runs(over) or np.count_nonzero(over) >= len(over) / 2 or not _crosses(elevation, over):
        return []
    quantities["elevation"] = np.where(over, math.pi - elevation, elevation)
    quantities["azimuth"] = np.where(over, quantities["azimuth"] - math.pi, quantities["azimuth"])
    name = found["elevation"].name
    return [f'{np.count_nonzero(over)} cells of "{name}" are beyond the zenith: the azimuths of their rows are turned']


def _crosses(elevation: FloatArray, over: NDArray[np.bool_]) -> bool:
    """Whether all runs beyond the zenith begin and end near it."""
    known = np.isfinite(elevation)
    edges = np.flatnonzero(np.diff(over[known]))
    beside = elevation[known][np.append(edges, edges + 1)]
    return bool((np.abs(beside - math.pi / 2) < _NEAR_RAD).all())


def _in_runs(cells: NDArray[np.bool_]) -> bool:
    """Whether most of the cells stand beside each other; single ones are outliers."""
    count = np.count_nonzero(cells)
    return bool(count >= _FEWEST_IN_RUNS and 2 * np.count_nonzero(cells[1:] & cells[:-1]) >= count)
