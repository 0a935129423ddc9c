"""Positions on the earth: from the station's local frame to latitude, longitude and height (WGS-84)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ftproc.errors import UsageError
from ftproc.records import FloatArray, Trajectory

COLUMNS = ("lat_deg", "lon_deg", "height_m")

#: frame of a log -> which local axes point east and north, and how that is said.
_AXES = {"local": ((0, 1), "x is taken as east, y as north"), "north-east-up": ((1, 0), "x is north, y is east")}

Site = tuple[float, float, float]


def require_pymap3d() -> Any:
    """The module pymap3d. Raises UsageError when it is not installed."""
    try:
        import pymap3d
    except ImportError as error:
        raise UsageError('--site needs pymap3d, which is not installed: pip install "pymap3d>=3.0".') from error
    return pymap3d


def axes(frame: str) -> str:
    """Which way the local axes are taken to point, in words."""
    return _AXES[frame][1]


def with_geodetic(trajectory: Trajectory, site: Site) -> Trajectory:
    """The trajectory with `lat_deg`, `lon_deg`, `height_m` among its extra columns, NaN where not estimated.

    site: the station's geodetic latitude deg, longitude deg and height above the ellipsoid m (WGS-84).
    The local z is the station's vertical. In the frame `local` the convention A = atan2(y, x) leaves open
    where x points: east is taken, as the metadata say under `site_axes`.
    Raises UsageError when pymap3d is missing or a kept column already has one of the names.
    """
    import pyarrow as pa

    frame = str(trajectory.metadata.get("frame", "local"))
    extra = trajectory.extra
    found = {} if extra is None else dict(zip(extra.column_names, extra.columns, strict=True))
    for name, values in zip(COLUMNS, geodetic(trajectory.state[:, :3], frame, site), strict=True):
        if name in found:
            raise UsageError(f'the log\'s column "{name}" has the name of an output column; leave --keep-columns out.')
        found[name] = pa.array(values)
    return replace(trajectory, extra=pa.table(found), metadata={**trajectory.metadata, "site_axes": axes(frame)})


def geodetic(position: FloatArray, frame: str, site: Site) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Latitude deg, longitude deg and height m, each (n,), of (n, 3) positions in m in the local frame."""
    east, north = (position[:, axis] for axis in _AXES[frame][0])
    latitude, longitude, height = require_pymap3d().enu2geodetic(east, north, position[:, 2], *site)
    return np.asarray(latitude, float), np.asarray(longitude, float), np.asarray(height, float)
