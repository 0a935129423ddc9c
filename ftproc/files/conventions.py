"""From what an instrument reads to range, azimuth and elevation as everything else understands them.

The one place where the conventions and the known errors of a station are applied, in this order: time offset and
biases (of the reading, in its own sense and unit), sense and zero of the azimuth, zenith angle to elevation,
refraction. The station goes into the log, and from there, also in words, into the trajectory's metadata.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import cast

import numpy as np

from ftproc.errors import UsageError
from ftproc.records import FloatArray, MeasurementLog
from ftproc.settings import Air, Station

#: What the azimuth is counted from -> the frame of the log, and the sense in which that frame counts.
FRAMES = {"x": "local", "north": "north-east-up"}
#: Of each frame: what the angles of a trajectory are, whatever the log's were.
CONVENTION = {
    "local": "azimuth_rad = atan2(y, x), elevation_rad above the horizontal, both true",
    "north-east-up": "azimuth_rad clockwise from north = atan2(y, x), elevation_rad above the horizontal, both true",
}
_OWN_SENSE = {"x": "anticlockwise", "north": "clockwise"}
_CHOICES = {"azimuth_from": ("x", "north"), "elevation_from": ("horizon", "zenith")}

_STEEP_DEG = 60  # hardly any record is steeper than this for half of its length
_NEIGHBOURS = 11  # readings whose median range stands for the target's distance: an outlier must not bend the ray


def check(station: Station) -> None:
    """Raise UsageError for words that are not understood."""
    for name, words in _CHOICES.items():
        value = getattr(station, name)
        if value not in words:
            option = "--" + name.replace("_", "-")
            raise UsageError(f'{option}: "{value}" is not understood; say {" or ".join(words)}.')
    if station.azimuth_sense not in (None, *_OWN_SENSE.values()):
        raise UsageError(f'The azimuth\'s sense is clockwise or anticlockwise, not "{station.azimuth_sense}".')


def apply(log: MeasurementLog, station: Station) -> MeasurementLog:
    """The log in the canonical convention, from one in SI units whose numbers are as the instrument counts them.

    The frame becomes `north-east-up` (x north, y east) for an azimuth from north, else `local`; azimuths are not
    brought into one turn. Raises UsageError as `check`.
    """
    check(station)
    with np.errstate(invalid="ignore"):  # a NaN that signals is missing like any other
        measurement, time_s = log.measurement - station.bias, log.time_s
    if _reversed(station):
        measurement[:, 1] = -measurement[:, 1]
    if station.azimuth_zero_rad:  # adding nothing would make +0.0 of -0.0, and every bit is to come back
        measurement[:, 1] += station.azimuth_zero_rad
    if station.elevation_from == "zenith":
        measurement[:, 2] = math.pi / 2 - measurement[:, 2]
    if station.refraction is not None:
        measurement[:, 2] -= _bent(measurement, station.refraction)
    if station.time_offset_s:
        time_s = time_s + station.time_offset_s
    remarks = (*log.remarks, *_doubts(log.measurement, station))
    frame = FRAMES[station.azimuth_from]
    return replace(log, measurement=measurement, time_s=time_s, frame=frame, station=station, remarks=remarks)


def _doubts(measurement: FloatArray, station: Station) -> list[str]:
    """Forgotten options that no check can prove, from the readings as they are."""
    wild = 1e6  # rad, which no doubt rests on
    angles = np.clip(measurement.T[1:], -wild, wild)
    azimuth, elevation = (np.degrees(column[np.isfinite(column)]) for column in angles)
    doubts = []
    if azimuth.size and azimuth.min() > -1 and 370 < np.quantile(azimuth, 0.99) <= 400:
        doubts.append("the azimuth runs from 0 to 400 deg: if they are gon, say --units azimuth=gon")
    if station.elevation_from == "horizon" and elevation.size and np.median(elevation) > _STEEP_DEG:
        doubts.append(
            f"half of the elevations are above {_STEEP_DEG} deg: if they are zenith angles, say --elevation-from zenith"
        )
    return doubts


def _reversed(station: Station) -> bool:
    return station.azimuth_sense not in (None, _OWN_SENSE[station.azimuth_from])


def _bent(measurement: FloatArray, air: Air) -> FloatArray:
    """(n,) observed minus true elevation; a target whose range is never read counts as outside the air."""
    from ftproc.core.model import refraction

    distance, elevation = _distance(measurement[:, 0]), measurement[:, 2]
    seen = np.isfinite(elevation)
    error = np.full(len(elevation), np.nan)
    upright = np.clip(elevation[seen], -math.pi / 2, math.pi / 2)
    error[seen] = refraction.elevation_error(distance[seen], upright, air.temperature_c, air.pressure_hpa)
    return error


def _distance(range_m: FloatArray) -> FloatArray:
    """The range at every sample, by the median of its neighbours, and between readings where there is none."""
    present = np.flatnonzero(np.isfinite(range_m))
    if not present.size:
        return np.full(len(range_m), np.inf)
    width = min(_NEIGHBOURS, present.size - 1 + present.size % 2)  # odd
    padded = np.pad(range_m[present], width // 2, mode="edge")
    middle = np.median(np.lib.stride_tricks.sliding_window_view(padded, width), axis=1)
    return cast(FloatArray, np.interp(np.arange(len(range_m)), present, np.maximum(middle, 0.0)))


def in_words(station: Station) -> list[str]:
    """What is done to the readings, one sentence each; nothing of what is usual."""
    elevation = "zenith angle" if station.elevation_from == "zenith" else "elevation"
    bias = zip(("range", "azimuth", elevation), station.bias, ((1, "m"), (1e3, "mrad"), (1e3, "mrad")), strict=True)
    said = [f"{name} bias of {value * many:g} {unit} taken off" for name, value, (many, unit) in bias if value]
    if station.time_offset_s:
        said.append(f"{station.time_offset_s:g} s added to the time")
    if _reversed(station):
        said.append(f"azimuth counted {station.azimuth_sense} from {station.azimuth_from}, turned round")
    if station.azimuth_zero_rad:
        said.append(f"azimuth zero at {math.degrees(station.azimuth_zero_rad):.9g} deg from {station.azimuth_from}")
    if station.elevation_from == "zenith":
        said.append("elevation from zenith angles")
    if station.refraction is not None:
        air = station.refraction
        said.append(f"refraction of light taken off at {air.temperature_c:g} deg C and {air.pressure_hpa:g} hPa")
    return said
