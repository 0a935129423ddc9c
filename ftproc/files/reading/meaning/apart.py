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
_NOISES = 6.0  # of how far rows of one time are apart, as it changes from time to time, at most
_MOST_NOISE_M, _MOST_NOISE_RAD = 458.0, 0.08
_BEAM_RAD = 0.02  # of radars
_EVEN = 0.3  # of the way to the next time, by which rows miss their share of it where the clock stands meanwhile
_MOST = 20_000  # rows that are judged, in stretches
_OFTEN, _ALWAYS = 1 / 3, 0.8  # of the times have several rows, and of these are apart: single ones are outliers
_LARGEST = 1e15  # of a reading


def refuse(log: MeasurementLog, known: Sequence[str]) -> None:
    """Raise InputError if the rows of one time, of a log in SI units and in time order, are of several targets. known:
    the components of which the units are known."""
    parts = [slice(0, len(log))]
    if len(log) > _MOST:
        parts = [slice(k * len(log) // 4, k * len(log) // 4 + _MOST // 4) for k in range(4)]
    for part in parts:
        _refuse(log.name, log.time_s[part], np.array(log.measurement[part]), known)


def _refuse(source: str, time_s: FloatArray, measurement: FloatArray, known: Sequence[str]) -> None:
    if len(time_s) < _FEWEST:
        return
    gap = np.diff(time_s)
    start = np.flatnonzero(np.r_[True, gap > _AT_ONCE * gap.mean()])
    count = np.diff(np.r_[start, len(time_s)])
    several = count > 1
    if several.sum() < max(_OFTEN * len(count), 2):
        return
    reading = np.where([c in known for c in COMPONENTS], np.clip(measurement, -_LARGEST, _LARGEST), np.nan)
    away = _within_half_a_turn(reading - np.repeat(reading[start], count, axis=0))
    low, high = np.fmin.reduceat(away, start), np.fmax.reduceat(away, start)
    span, middle = (high - low)[several], reading[start] + (low + high) / 2
    first, share = reading[start[:-1]], ((count - 1) / count)[:-1, None]
    on = _within_half_a_turn(reading[start[1:]] - first)
    missed = _within_half_a_turn(reading[start[1:] - 1] - first) - on * share
    distance = middle[several, :1]
    wide_m = span * np.where(np.isfinite(distance), np.abs(distance), math.inf)
    wide_m[:, 0] = span[:, 0]
    far = np.zeros(len(span), bool)
    for c in range(3):
        if _typical(missed[several[:-1], c]) >= _EVEN * _typical(on[several[:-1], c]):
            noise_m, noise_rad = (_NOISES * _typical(np.diff(each[:, c])) for each in (wide_m, span))
            beam_rad = _BEAM_RAD + min(noise_rad, _MOST_NOISE_RAD) if c else 0.0
            far |= (span[:, c] > beam_rad) & (wide_m[:, c] > _LONGEST_M + min(noise_m, _MOST_NOISE_M))
    if far.mean() < _ALWAYS:
        return
    most = np.fmax.reduce(wide_m[far], axis=1)
    angle = math.degrees(median(np.fmax.reduce(span[far, 1:], axis=1)))
    size = f"{median(most) / 1e3:.3g} km" if np.isfinite(most).all() else f"{min(angle, 360 - angle):.3g} deg"
    raise InputError(
        f"{source}: rows of one time are {size} apart (median), which no target is (the longest ship has "
        f"{_LONGEST_M:.0f} m) and no noise makes: these are several targets. Keep the rows of one, with --target "
        "COLUMN=VALUE or --where, or split the file."
    )


def _typical(values: FloatArray) -> float:
    """The median size of those that are there."""
    present = np.abs(values[np.isfinite(values)])
    return float(median(present)) if present.size else 0.0


def _within_half_a_turn(step: FloatArray) -> FloatArray:
    """Steps (n, 3), those of the azimuth within half a turn."""
    step[:, 1] = (step[:, 1] + np.pi) % (2 * np.pi) - np.pi
    return step
