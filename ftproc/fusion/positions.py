"""A station that is the target itself: GNSS on board, ADS-B. Its positions are seen from a place that is chosen.

The fusion knows ranges and angles. From a place far beside the track, at its height, the three components of a position
are a range and two angles: their errors stay those of the position, and nothing is bent that matters. The place is to
the south, so that no azimuth is near its cut.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ftproc.core.model.earth import Geodetic
from ftproc.core.model.frames import from_cartesian
from ftproc.errors import InputError
from ftproc.files.reading import positions
from ftproc.fusion.range_file import Instrument
from ftproc.records import FloatArray, MeasurementLog

AWAY, NEAREST_M = 5.0, 20_000.0  # times the track's extent, and at least so far, is the place
BASE_S = 1.0  # over which the direction of flight is taken, for a lever arm
STILL_MPS = 1.0  # of a target that is slower no direction is known


def read(instrument: Instrument, origin: Geodetic | None) -> tuple[Instrument, MeasurementLog]:
    """The station at the place from which its positions are seen, and the log of what it sees. Raises InputError."""
    recipe = instrument.recipe
    found = positions.read(instrument.log, recipe.columns if isinstance(recipe.columns, dict) else None)
    if found.geodetic and origin is None:
        raise InputError(
            f"{instrument.log}: it has latitudes and longitudes, and the range file no [origin]; write its lat_deg, "
            "lon_deg and height_m."
        )
    point = positions.local(found.place, origin) if found.geodetic and origin is not None else found.place
    time_s = found.time_s + recipe.station.time_offset_s
    if any(instrument.lever_arm_m):
        point = point - _levered(time_s, point, instrument.lever_arm_m)
    known = np.isfinite(point).all(1)
    if not known.any():
        raise InputError(f"{instrument.log}: no row has a position; check the columns.")
    low, high = np.quantile(point[known], (0.05, 0.95), axis=0)
    away = max(AWAY * float(np.linalg.norm(high - low)), NEAREST_M)
    place = 0.5 * (low + high) - [0.0, away, 0.0]
    options = dict(instrument.options)
    if instrument.sigma_m > 0:
        options["noise"] = (instrument.sigma_m, instrument.sigma_m / away, instrument.sigma_m / away)
    log = MeasurementLog(
        instrument.log, time_s, from_cartesian(point - place), found.row, rows_in_file=found.rows_in_file,
        rows_without_time=tuple(sorted(set(range(found.rows_in_file)) - set(found.row.tolist()))),
        duplicate_times=int((np.diff(time_s) == 0).sum()), epoch=found.epoch, sha256=found.sha256,
    )  # fmt: skip
    accuracy = None if found.accuracy is None else (found.accuracy / np.median(found.accuracy[known])) ** 2
    seen = replace(instrument, place=place, axes=np.eye(3), options=options, site=None, times=accuracy, away_m=away)
    return seen, log


def _levered(time_s: FloatArray, point: FloatArray, arm_m: tuple[float, float, float]) -> FloatArray:
    """(n, 3) of the antenna from the reference point, east, north, up m: ahead along the path, to its right, and up
    across both. Zero where the target has no direction."""
    known = np.flatnonzero(np.isfinite(point).all(1))
    arm = np.zeros_like(point)
    if len(known) < 2 or not time_s[known[-1]] > time_s[known[0]]:
        return arm
    ends = [np.clip(time_s + side * BASE_S, time_s[known[0]], time_s[known[-1]]) for side in (-1, 1)]
    before, after = (np.stack([np.interp(end, time_s[known], axis[known]) for axis in point.T], 1) for end in ends)
    velocity = (after - before) / np.maximum(ends[1] - ends[0], 1e-9)[:, None]
    speed, flat = np.sqrt((velocity**2).sum(1)), np.hypot(velocity[:, 0], velocity[:, 1])
    moving = (speed > STILL_MPS) & (flat > STILL_MPS)
    ahead = velocity[moving] / speed[moving, None]
    right = np.stack([ahead[:, 1], -ahead[:, 0], np.zeros(int(moving.sum()))], 1) * (speed / flat)[moving, None]
    arm[moving] = arm_m[0] * ahead + arm_m[1] * right + arm_m[2] * np.cross(right, ahead)
    assert math.isfinite(float(np.abs(arm[known]).max()))
    return arm
