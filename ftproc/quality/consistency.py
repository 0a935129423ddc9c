"""Filter consistency: do the innovations have the size that the filter predicts, and where is the position poorly
observable?"""

from __future__ import annotations

from typing import Any

import numpy as np

from ftproc.order_statistics import median
from ftproc.records import FloatArray

NORMAL_99 = 2.576  # two-sided 99 % point
LEAST_WIDTH = 0.2  # of the bounds about 1: no model is better, however many the readings
POORLY_PREDICTED = 8.0  # innovation sigma over noise sigma (median), from which a gate detects too little
POORLY_OBSERVABLE = 10.0  # sigma over its median
BULK, FAR_OFF = (
    31,
    5.0,
)  # readings, of which more than half have such a residual in units of its 1-sigma: noise never does that
SURE = 3.0  # sigmas by which an acceleration is larger than zero
MOST_INTERVALS = 20  # that are listed


def innovation_test(squares: float, count: int) -> dict[str, Any]:
    """The innovation ratio (root mean square of the normalised innovations, from their sum of squares and their
    number), the bounds within which 99 % of consistent filters lie (chi-square, normal approximation; at least 20 %
    wide), and the verdict."""
    if not count:
        return {"innovation_ratio": None, "innovation_bounds": None, "verdict": "not observable"}
    ratio = float(np.sqrt(squares / count))
    spread = NORMAL_99 * np.sqrt(2 / count)
    low = min(float(np.sqrt(max(1 - spread, 0.0))), 1 - LEAST_WIDTH)
    high = max(float(np.sqrt(1 + spread)), 1 + LEAST_WIDTH)
    verdict = "cautious" if ratio < low else "overconfident" if ratio > high else "consistent"
    return {"innovation_ratio": ratio, "innovation_bounds": [low, high], "verdict": verdict}


def left_behind(time_s: FloatArray, squares: FloatArray) -> list[dict[str, float]]:
    """Stretches over which the bulk of the readings that are used, with these times (m,) and squares of normalised
    innovations (m,), lie far from the estimate: the median of BULK of them is more than FAR_OFF squared. In time order,
    with the root of the largest median."""
    if len(squares) < BULK:
        return []
    middle = np.sqrt(np.median(np.lib.stride_tricks.sliding_window_view(squares, BULK), 1))
    far = np.r_[False, middle > FAR_OFF, False]
    edges = np.flatnonzero(far[1:] != far[:-1]).reshape(-1, 2)
    return [
        {"from_s": float(time_s[a]), "to_s": float(time_s[b + BULK - 2]), "sigmas": float(middle[a:b].max())}
        for a, b in edges
    ]


def nis_bounds(freedom: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bounds of the sum of NIS with so many degrees of freedom (n,): 99 % of consistent filters (chi-square by Wilson
    and Hilferty's cube root), at least 20 % of a sigma wide; NaN for no freedom."""
    freedom = np.where(freedom > 0, freedom, np.nan)
    share = 2 / (9 * freedom)
    low, high = (1 - share + sign * NORMAL_99 * np.sqrt(share) for sign in (-1, 1))
    low, high = freedom * np.maximum(low, 0.0) ** 3, freedom * high**3
    return np.minimum(low, freedom * (1 - LEAST_WIDTH) ** 2), np.maximum(high, freedom * (1 + LEAST_WIDTH) ** 2)


def predicted_sigma_ratio(innovation_sigma: FloatArray, noise_sigma: float) -> float | None:
    """Median innovation sigma (m,) over the noise sigma: a gate of C sigmas passes outliers of C times so many noise
    sigmas."""
    typical = median(innovation_sigma) if len(innovation_sigma) else np.nan
    return typical / noise_sigma if np.isfinite(typical) and 0 < noise_sigma < np.inf else None


def poorly_observable(time_s: FloatArray, sigma: FloatArray, unit: str = "m") -> list[dict[str, float]]:
    """Intervals in which a sigma is far above its median, because too few readings determine the estimate.

    time_s (n,), sigma (n, 3) of x, y, z, or (n, 1) of a cleaned reading, in this unit; the longest MOST_INTERVALS of
    them, in time order.
    """
    size = np.sqrt((sigma**2).sum(1))
    large = np.r_[False, size > POORLY_OBSERVABLE * median(size), False]
    edges = np.flatnonzero(large[1:] != large[:-1]).reshape(-1, 2)
    found = [
        {"from_s": float(time_s[a]), "to_s": float(time_s[b - 1]), f"sigma_{unit}": float(size[a:b].max())}
        for a, b in edges
    ]
    longest = sorted(found, key=lambda s: s["from_s"] - s["to_s"])[:MOST_INTERVALS]
    return sorted(longest, key=lambda s: s["from_s"])


def least_acceleration(state: FloatArray, sigma: FloatArray) -> float:
    """The largest acceleration, m/s2, that a target had surely, by states (n, 9) and their 1-sigma (n, 9)."""
    least = np.sqrt((state[:, 6:] ** 2).sum(1)) - SURE * np.sqrt((sigma[:, 6:] ** 2).sum(1))
    return float(np.max(least, initial=0.0, where=np.isfinite(least)))
