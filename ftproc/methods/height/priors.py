"""What is known beforehand of the height of a target where nothing in its log tells it: by the user, by how fast it is,
and by how near."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ftproc.order_statistics import median
from ftproc.records import FloatArray, MeasurementLog
from ftproc.settings import FilterSettings

SLOW_MPS = 30.0  # a target that is never faster is taken for a ship or a vehicle
CHANGES_S = 300.0  # correlation time of an unknown height, for the sigmas of its rates; no longer than the range
# takes at its speed
FEWEST, BLOCKS, MOST_OF_BLOCKS = 3, 64, 0.9  # readings in a block, and blocks, for the speed; and of these speeds


class Prior(NamedTuple):
    """What is known of the height of all targets: m above the station, and 1-sigma. why: in words. changes_s: its
    correlation time."""

    height_m: float
    sigma_m: float
    why: str
    changes_s: float = CHANGES_S


SPECIFIED = "specified"
SLOW = Prior(0.0, 100.0, "a target that is never faster than 30 m/s")
FAST = Prior(6000.0, 3500.0, "an aircraft")
ANY = Prior(0.0, 6000.0, "any target")


def prior_of(log: MeasurementLog, settings: FilterSettings, causal: bool = False) -> Prior:
    """What is known of the height where a log tells nothing of it. causal: whether its later rows are not known yet."""
    if settings.height is not None:
        return Prior(*settings.height, SPECIFIED)
    if causal:
        return ANY
    fastest_mps, range_m = _fastest(log.time_s, log.measurement), log.measurement[:, 0]
    typical_m = median(range_m[np.isfinite(range_m)]) if np.isfinite(range_m).any() else math.inf
    if fastest_mps < SLOW_MPS:
        return SLOW._replace(sigma_m=min(SLOW.sigma_m, _even(typical_m)))
    return _at(typical_m)._replace(changes_s=min(typical_m / fastest_mps, CHANGES_S))


def _at(range_m: float) -> Prior:
    """That of an aircraft; where its range is shorter, of any height that is no larger."""
    if range_m > FAST.height_m + FAST.sigma_m:
        return FAST
    return Prior(float(f"{range_m / 2:.2g}"), _even(range_m), "an aircraft as near as this one")


def _even(range_m: float) -> float:
    """1-sigma of an even chance of all heights up to a range, in two digits."""
    return float(f"{range_m / math.sqrt(12):.2g}")


def _fastest(time_s: FloatArray, measurement: FloatArray) -> float:
    """m/s over the ground in nearly all of the log, by the medians of blocks of readings; infinite of too few."""
    there = np.flatnonzero(np.isfinite(measurement[:, :2]).all(1))
    if len(there) < FEWEST * FEWEST:
        return math.inf
    blocks = np.array_split(there, min(BLOCKS, len(there) // FEWEST))
    x, y = measurement[:, 0] * np.cos(measurement[:, 1]), measurement[:, 0] * np.sin(measurement[:, 1])
    t, east, north = (np.array([median(each[block]) for block in blocks]) for each in (time_s, x, y))
    passed = np.diff(t) > 0
    speed = np.hypot(np.diff(east), np.diff(north))[passed] / np.diff(t)[passed]
    return float(np.quantile(speed, MOST_OF_BLOCKS)) if len(speed) else math.inf
