"""Heights beside elevations that an instrument has computed from these say nothing that they do not say.

Measured heights have nothing of the noise of the elevations. Computed ones, r sin e plus what the bend of the earth,
refraction and a zero add, rounded or from smoothed elevations, have: third differences, which hold little of the motion
and much of the noise, are correlated, of single rows or of the means of several, at once or some rows later.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ftproc.order_statistics import median
from ftproc.records import FloatArray, MeasurementLog

FEWEST = 32  # rows, or means of rows, that tell
SIZES, LAGS = (1, 2, 4, 8, 16), 32  # rows of a mean, and means by which heights come later or earlier at most
CORRELATED, SURE = 0.3, 4.5  # correlation that no measured height has, and standard errors of one by chance
MOTION = 1.6  # times the variance by their noise that elevations have: with more, what is common is the motion
ORDER, NEIGHBOURS = 3, 7  # of differences; rows of a median
LIMIT, SCALE = 3.0, 1.4826  # sigmas, one of which is so many medians, beyond which values count less
COMPUTED = "the heights follow the noise of the elevations, from which they are computed: they are not used"
CONSTANT = "the heights do not change: they are not used"


def checked(log: MeasurementLog) -> MeasurementLog:
    """A log whose heights beside elevations are measured, with a word on them; or without them."""
    if log.heights is None or not np.isfinite(log.measurement[:, 2]).any():
        return log
    if why := why_not(log):
        return replace(log, heights=None, remarks=(*log.remarks, why))
    name = log.understood["columns"]["height"]["column"]
    return replace(log, remarks=(*log.remarks, f'"{name}" is the height of the target, beside the elevation'))


def why_not(log: MeasurementLog) -> str:
    """Why the heights beside the elevations of a log are not used; "" if nothing speaks against them."""
    if log.heights is None:
        return ""
    (r, _, e), h = log.measurement.T, log.heights.above_m
    known = np.isfinite(r) & np.isfinite(e) & np.isfinite(h) & (r > 0)
    if known.sum() < FEWEST:
        return ""
    if len(np.unique(h[known])) == 1:
        return CONSTANT
    rows = np.stack([log.time_s[known], *(_without_outliers(each[known]) for each in (h, r * np.sin(e)))])
    return COMPUTED if any(_correlated(means) for means in _means(rows)) else ""


def _means(rows: FloatArray) -> Iterator[FloatArray]:
    """Means (3, m) of as many of rows (3, n): times, heights by the range, and sines of elevations. Only where these
    show their noise, not the motion."""
    noise = math.inf
    for size in SIZES:
        found = rows[:, : rows.shape[1] // size * size].reshape(3, -1, size).mean(2)
        if found.shape[1] < FEWEST:
            return
        own = [_spread(np.diff(found[2], order)) ** 2 / math.comb(2 * order, order) for order in (ORDER, ORDER + 2)]
        noise = min(noise, own[1] * size)
        if size == 1 or own[0] * size < MOTION * noise:
            yield found


def _correlated(means: FloatArray) -> bool:
    """Whether the noise of heights and elevations has something in common."""
    span = means[0, ORDER:] - means[0, :-ORDER]
    even = np.abs(span - median(span)) <= 0.5 * median(span)
    u, v = (np.where(even, _clipped(np.diff(each, ORDER)), 0.0) for each in means[1:])
    power = math.sqrt(float((u**2).sum() * (v**2).sum()))
    if power == 0:
        return False
    lags = min(LAGS, len(u) // 4)
    common = np.correlate(u, np.pad(v, lags)) if len(u) else np.zeros(1)
    return bool(np.abs(common).max() / power > max(CORRELATED, SURE / math.sqrt(len(u))))


def _without_outliers(values: FloatArray) -> FloatArray:
    """Values (n,) no farther from the median of their neighbours than noise is."""
    from scipy.ndimage import median_filter

    middle: FloatArray = median_filter(values, NEIGHBOURS)
    return middle + _clipped(values - middle)


def _clipped(values: FloatArray) -> FloatArray:
    most = LIMIT * _spread(values)
    return np.clip(values, -most, most)


def _spread(values: FloatArray) -> float:
    return SCALE * median(np.abs(values))
