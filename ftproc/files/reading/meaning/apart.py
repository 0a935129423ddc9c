"""Rows of one time that are too far apart for one target, whatever its size and the noise of the instrument."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ftproc.errors import InputError
from ftproc.order_statistics import median
from ftproc.records import COMPONENTS, FloatArray, MeasurementLog

_FEWEST = 24  # rows, for a judgement
_AT_ONCE = 0.2  # of the mean gap: rows nearer in time than that are of one time
_LONGEST_M = 458.0  # the Seawise Giant, the longest ship
_APART_M = 2 * _LONGEST_M  # for the noise of two ranges
_APART_RAD = 0.1  # beyond the width of the beams of radars, and the noise of two angles
_MOVES, _LAGS = 3.0, 8  # times as far as the rows move on from the nearest of so many before, for a clock that stands
_OFTEN, _ALWAYS = 1 / 3, 0.8  # of the times have several rows, and of these are apart: single ones are outliers
_LARGEST = 1e15  # of a reading


def refuse(log: MeasurementLog, known: Sequence[str]) -> None:
    """Raise InputError if the rows of one time, of a log in SI units and in time order, are of several targets. known:
    the components of which the units are known."""
    if len(log) < _FEWEST:
        return
    gap = np.diff(log.time_s)
    start = np.flatnonzero(np.r_[True, gap > _AT_ONCE * gap.mean()])
    count = np.diff(np.r_[start, len(log)])
    several = count > 1
    if several.sum() < max(_OFTEN * len(count), 1):
        return
    reading = np.where([c in known for c in COMPONENTS], np.clip(log.measurement, -_LARGEST, _LARGEST), np.nan)
    away = _within_half_a_turn(reading - np.repeat(reading[start], count, axis=0))
    low, high = np.fmin.reduceat(away, start), np.fmax.reduceat(away, start)
    span, middle = (high - low)[several], reading[start] + (low + high) / 2
    steps = (np.abs(_within_half_a_turn(reading[lag:] - reading[:-lag]))[_LAGS - lag :] for lag in range(1, _LAGS + 1))
    moves = np.fmin.reduce(list(steps))
    distance = middle[several, :1]
    wide_m = span * np.where(np.isfinite(distance), np.abs(distance), math.inf)
    wide_m[:, 0] = span[:, 0]
    far = np.zeros(len(span), bool)
    for c in range(3):
        moved = _MOVES * median(moves[np.isfinite(moves[:, c]), c]) * count[several]
        far |= (span[:, c] > np.maximum(moved, _APART_RAD if c else 0.0)) & (wide_m[:, c] > _APART_M)
    if far.mean() < _ALWAYS:
        return
    most = np.fmax.reduce(wide_m[far], axis=1)
    angle = math.degrees(median(np.fmax.reduce(span[far, 1:], axis=1)))
    size = f"{median(most) / 1e3:.3g} km" if np.isfinite(most).all() else f"{min(angle, 360 - angle):.3g} deg"
    raise InputError(
        f"{log.name}: rows of one time are {size} apart (median), which no target is (the longest ship has "
        f"{_LONGEST_M:.0f} m) and no noise makes: these are several targets. Keep the rows of one, with --target "
        "COLUMN=VALUE or --where, or split the file."
    )


def _within_half_a_turn(step: FloatArray) -> FloatArray:
    """Steps (n, 3), those of the azimuth within half a turn."""
    step[:, 1] = (step[:, 1] + np.pi) % (2 * np.pi) - np.pi
    return step
