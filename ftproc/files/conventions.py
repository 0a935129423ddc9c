"""Readings of an instrument -> range, azimuth and elevation in the canonical convention.

The only place where the conventions and known errors of a station are applied, in this order: time offset and biases
(of the reading, in its own sense), sense and zero of the azimuth, zenith angle to elevation, refraction. The station
is kept in the log and goes, also in words, into the trajectory's metadata.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import cast

import numpy as np

from ftproc.errors import InputError, UsageError
from ftproc.records import FloatArray, MeasurementLog
from ftproc.settings import Air, Station

#: Axis that the azimuth is counted from -> frame of the log.
FRAMES = {"x": "local", "north": "north-east-up"}
#: Frame -> convention of the angles of a trajectory, whatever the log's was.
CONVENTION = {
    "local": "azimuth_rad = atan2(y, x), elevation_rad above the horizontal, both true",
    "north-east-up": "azimuth_rad clockwise from north = atan2(y, x), elevation_rad above the horizontal, both true",
}
_OWN_SENSE = {"x": "anticlockwise", "north": "clockwise"}
_CHOICES = {"azimuth_from": ("x", "north"), "elevation_from": ("horizon", "zenith")}

_NEIGHBOURS = 11  # ranges whose median is the target's distance for refraction: robust against outliers


def check(station: Station) -> None:
    """Raise UsageError for values that are not understood."""
    for name, words in _CHOICES.items():
        value = getattr(station, name)
        if value not in (*words, None):
            option = "--" + name.replace("_", "-")
            raise UsageError(f'{option}: "{value}" is not understood; say {" or ".join(words)}.')
    if station.azimuth_sense not in (None, *_OWN_SENSE.values()):
        raise UsageError(f'The azimuth\'s sense is clockwise or anticlockwise, not "{station.azimuth_sense}".')


def apply(log: MeasurementLog, station: Station) -> MeasurementLog:
    """A log in SI units as the instrument counts them -> the log in the canonical convention.

    The frame becomes `north-east-up` (x north, y east) for an azimuth from north, else `local`. Azimuths are not
    reduced to one turn. Raises UsageError as `check`.
    """
    check(station)
    with np.errstate(invalid="ignore"):  # a signalling NaN is missing too
        measurement, time_s = log.measurement - station.bias, log.time_s
    if _reversed(station):
        measurement[:, 1] = -measurement[:, 1]
    if station.azimuth_zero_rad:  # adding 0.0 would turn -0.0 into +0.0
        measurement[:, 1] += station.azimuth_zero_rad
    if station.elevation_from == "zenith":
        measurement[:, 2] = math.pi / 2 - measurement[:, 2]
    if station.refraction is not None:
        measurement[:, 2] -= _refraction(measurement, station.refraction)
    if station.time_offset_s:
        time_s = time_s + station.time_offset_s
    return replace(log, measurement=measurement, time_s=time_s, frame=frame(station), station=station)


def axis(station: Station) -> str:
    """The axis that the azimuth is counted from, x where nothing is known."""
    return station.azimuth_from or "x"


def frame(station: Station) -> str:
    """The frame of a log of the station."""
    return FRAMES[axis(station)]


def axis_question(source: str, name: str) -> InputError:
    """Asked where positions on the earth are wanted. name: of the azimuth's column."""
    return InputError(
        f'{source}: nothing says from where the azimuth in column "{name}" counts, so there are no positions on the '
        "earth. Say --azimuth-from north if clockwise from north, or --azimuth-from x if anticlockwise from east."
    )


def _reversed(station: Station) -> bool:
    return station.azimuth_sense not in (None, _OWN_SENSE[axis(station)])


def _refraction(measurement: FloatArray, air: Air) -> FloatArray:
    """(n,) observed minus true elevation, rad; a target without any range counts as outside the atmosphere."""
    from ftproc.core.model import refraction

    distance, elevation = _distance(measurement[:, 0]), measurement[:, 2]
    present = np.isfinite(elevation)
    error = np.full(len(elevation), np.nan)
    clipped = np.clip(elevation[present], -math.pi / 2, math.pi / 2)
    error[present] = refraction.elevation_error(distance[present], clipped, air.temperature_c, air.pressure_hpa)
    return error


def _distance(range_m: FloatArray) -> FloatArray:
    """(n,) range at every sample: a running median, interpolated where ranges are missing."""
    present = np.flatnonzero(np.isfinite(range_m))
    if not present.size:
        return np.full(len(range_m), np.inf)
    width = min(_NEIGHBOURS, present.size - 1 + present.size % 2)  # odd
    padded = np.pad(range_m[present], width // 2, mode="edge")
    middle = np.median(np.lib.stride_tricks.sliding_window_view(padded, width), axis=1)
    return cast(FloatArray, np.interp(np.arange(len(range_m)), present, np.maximum(middle, 0.0)))


def in_words(station: Station) -> list[str]:
    """What is done to the readings, one phrase each; none for the defaults."""
    elevation = "zenith angle" if station.elevation_from == "zenith" else "elevation"
    bias = zip(("range", "azimuth", elevation), station.bias, ((1, "m"), (1e3, "mrad"), (1e3, "mrad")), strict=True)
    lines = [f"{name} bias of {value * scale:g} {unit} subtracted" for name, value, (scale, unit) in bias if value]
    if station.time_offset_s:
        lines.append(f"{station.time_offset_s:g} s added to the time")
    if _reversed(station):
        lines.append(f"azimuth counted {station.azimuth_sense} from {axis(station)}, reversed")
    if station.azimuth_zero_rad:
        lines.append(f"azimuth zero at {math.degrees(station.azimuth_zero_rad):.9g} deg from {axis(station)}")
    if station.elevation_from == "zenith":
        lines.append("elevation from zenith angles")
    if station.refraction is not None:
        air = station.refraction
        lines.append(f"refraction of light corrected for {air.temperature_c:g} deg C and {air.pressure_hpa:g} hPa")
    return lines
