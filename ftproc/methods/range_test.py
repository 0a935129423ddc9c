"""Real-time editing of a range instrument's readings (Yu, Feng, Li and Guo, Luoyang): the simple gate, the line
through four points, and the anti-outlier Kalman filter, each as first given and as improved there.

The paper's thresholds are those of one radar (0.06 degrees; D = 0.6; Q : R : P0 = 3 : 1 : 5 of a random walk in
longitude and latitude); here they follow from the log, in the same proportions where it gives any.
"""

from __future__ import annotations

import numpy as np

from ftproc.core.comparators import channels as kernels
from ftproc.methods import channels
from ftproc.methods.channels import AZIMUTH, Cleaned
from ftproc.methods.estimate import Estimate, Readings
from ftproc.records import FloatArray, IntArray
from ftproc.settings import FilterSettings

LINE_SCATTER = 1.58  # sigmas: a reading about the line through the four before it
SMALL_GAIN = 0.002  # m of the paper
FIRST_VARIANCE = 5.0  # times the noise variance


def gate(readings: Readings, settings: FilterSettings, check_first: bool = False) -> Estimate:
    """Readings that differ too much from the last accepted one are dropped: there is no estimate then."""
    log = channels.look(readings, settings)
    weight = _accepted(readings, log, settings.gate, check_first)
    value = np.where(weight > 0, readings.measurement, np.nan)
    return channels.estimate(readings, log, Cleaned(value, weight))


def four_points(readings: Readings, settings: FilterSettings) -> Estimate:
    """Readings too far from the line through the last four values are replaced by it."""
    log = channels.look(readings, settings)
    value, weight = np.empty_like(readings.measurement), np.empty_like(readings.measurement)
    for c in range(3):
        bound = max(settings.gate * LINE_SCATTER * log.sigma[c], _largest_bend(log, c))
        value[:, c], weight[:, c] = kernels.four_point_line(
            readings.time_s, np.ascontiguousarray(readings.measurement[:, c]), bound, log.interval_s, c == AZIMUTH
        )
    return channels.estimate(readings, log, Cleaned(value, weight))


def outlier_kalman(readings: Readings, settings: FilterSettings, improved: bool = False) -> Estimate:
    """The anti-outlier Kalman filter. improved: begin with a pair of readings that agree, and turn down the gain of
    the component that is off only."""
    log = channels.look(readings, settings)
    seen = np.isfinite(readings.measurement).astype(float)
    begin = _first(_accepted(readings, log, settings.gate, True), seen) if improved else _first(seen, seen)
    noise = log.sigma**2
    walk = np.array([channels.walk_variance(log, c) for c in range(3)])
    x0 = readings.measurement[begin, range(3)]
    model = kernels.Walk(begin, x0, FIRST_VARIANCE * noise, noise, walk, log.interval_s)
    value, variance, *rest, weight = kernels.outlier_kalman(
        readings.time_s, readings.measurement, model, settings.gate, SMALL_GAIN, improved
    )
    early = (np.arange(len(value))[:, None] < begin) & (seen > 0)
    weight[early] = 1.0 if not improved else 0.0
    return channels.estimate(readings, log, Cleaned(value, weight, rest[0], rest[1], np.sqrt(variance)))


def _accepted(readings: Readings, log: channels.Log, gate: float, check_first: bool) -> FloatArray:
    """(n, 3) 1 for what the simple gate accepts."""
    columns = [
        kernels.gate(
            readings.time_s, np.ascontiguousarray(readings.measurement[:, c]),
            channels.largest_change(log, c, gate), log.interval_s, c == AZIMUTH, check_first,
        )
        for c in range(3)
    ]  # fmt: skip
    return np.stack(columns, 1)


def _first(accepted: FloatArray, seen: FloatArray) -> IntArray:
    """(3,) first accepted sample of each component; the first seen one where none is."""
    first: IntArray = np.where(accepted.any(0), accepted.argmax(0), seen.argmax(0))
    return first


def _largest_bend(log: channels.Log, c: int) -> float:
    """How far trusted readings stray from the line through the four before them, where intervals are even."""
    change, near = log.change[c], log.elapsed_s[c] <= 1.5 * log.interval_s
    even = near[3:] & near[2:-1] & near[1:-2] & near[:-3]
    if not even.any():
        return 0.0
    off = change[3:] - 0.5 * (change[:-3] + change[1:-2])  # v5 - v4 - (v3 - v1) / 2
    return channels.MARGIN * float(np.quantile(np.abs(off[even]), channels.SHARE))
