"""Positions on the earth: the station's local frame -> latitude, longitude and height, or ECEF (WGS-84)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ftproc.errors import UsageError
from ftproc.files import arrow, conventions
from ftproc.files.writing import tables
from ftproc.records import FloatArray, MeasurementLog, Trajectory
from ftproc.settings import FilterSettings

COLUMNS = ("lat_deg", "lon_deg", "height_m")
ECEF = ("x_ecef_m", "y_ecef_m", "z_ecef_m", "vx_ecef_mps", "vy_ecef_mps", "vz_ecef_mps")

#: Frame of a log -> indices of the axes that point east and north, and the same in words.
_AXES = {"local": ((0, 1), "x is taken as east, y as north"), "north-east-up": ((1, 0), "x is north, y is east")}

Site = tuple[float, float, float]


def require_pymap3d() -> Any:
    """The module pymap3d. Raises UsageError when it is not installed."""
    try:
        import pymap3d
    except ImportError as error:
        raise UsageError('--site needs pymap3d, which is not installed: pip install "pymap3d>=3.0.1".') from error
    return pymap3d


def axes(frame: str) -> str:
    """The directions of the local axes, in words."""
    return _AXES[frame][1]


def check(settings: FilterSettings) -> None:
    """Raise UsageError if positions on the earth are asked for and a library or the station is missing."""
    if settings.site is not None:
        require_pymap3d()
    elif settings.ecef:
        raise UsageError("--ecef needs the station: give --site LAT,LON,HEIGHT, or [site] in the --config file.")


def check_axes(log: MeasurementLog, settings: FilterSettings) -> None:
    """Raise InputError, a question, if positions on the earth are asked for and nothing says from where the azimuths of
    a log count."""
    if settings.site is not None and log.understood.get("axis_is_known") is False:
        raise conventions.axis_question(log.name, log.understood["columns"]["azimuth"]["column"])


def located(trajectory: Trajectory, settings: FilterSettings) -> Trajectory:
    """The trajectory with its positions on the earth as extra columns, NaN where not estimated.

    With a site: `lat_deg`, `lon_deg`, `height_m` (above the WGS-84 ellipsoid); with `ecef` also earth-centred,
    earth-fixed positions in m and velocities in m/s. Without a site: unchanged.
    The local z is the ellipsoid's normal at the station: the deflection of the vertical is not known. In the frame
    `local` the convention A = atan2(y, x) does not fix x: east is assumed, as the metadata say under `site_axes`.
    Raises UsageError if pymap3d is missing or a kept column already has one of the names.
    """
    check(settings)
    if settings.site is None:
        return trajectory
    frame = str(trajectory.metadata.get("frame", "local"))
    found = dict(zip(COLUMNS, geodetic(trajectory.state[:, :3], frame, settings.site), strict=True))
    if settings.ecef:
        found |= zip(ECEF, earth_centred(trajectory.state[:, :6], frame, settings.site), strict=True)
    columns = arrow.table(found)
    extra = columns if trajectory.extra is None else tables.with_extra(trajectory.extra, columns)
    return replace(trajectory, extra=extra, metadata={**trajectory.metadata, "site_axes": axes(frame)})


def geodetic(position: FloatArray, frame: str, site: Site) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Latitude deg, longitude deg and height m, each (n,), of (n, 3) positions in m in the local frame."""
    east, north = (position[:, axis] for axis in _AXES[frame][0])
    latitude, longitude, height = require_pymap3d().enu2geodetic(east, north, position[:, 2], *site)
    return np.asarray(latitude, float), np.asarray(longitude, float), np.asarray(height, float)


def earth_centred(state: FloatArray, frame: str, site: Site) -> list[FloatArray]:
    """x, y, z in m and velocities in m/s, each (n,), in the rotating earth-fixed frame, of (n, 6) local states."""
    pymap3d = require_pymap3d()
    (east, north), up = _AXES[frame][0], 2
    position = pymap3d.enu2ecef(state[:, east], state[:, north], state[:, up], *site)
    velocity = pymap3d.enu2uvw(state[:, 3 + east], state[:, 3 + north], state[:, 3 + up], *site[:2])
    return [np.asarray(column, float) for column in (*position, *velocity)]
