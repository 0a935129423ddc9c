"""Whether to trust a run: are the innovations as large as the filter says, can its gates fire, where is it blind?"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ftproc.records import FloatArray

NORMAL_99 = 2.576  # two-sided 99 % point
LEAST_WIDTH = 0.2  # no model is better than so, whatever the number of readings
VAGUE = 8.0  # innovation sigmas per noise sigma, in the median, from which a gate can hardly fire
BLIND = 10.0  # times the median position sigma
MOST_BLIND = 20  # stretches that are listed


def scatter(scaled: FloatArray) -> dict[str, Any]:
    """Root mean square of the used innovations over their sigmas (n,), NaN where not used; with the bounds within
    which 99 % of honest filters lie (chi-square, normal approximation), but at least 20 % wide, and the verdict."""
    count = int(np.isfinite(scaled).sum())
    if not count:
        return {"innovation_ratio": None, "innovation_bounds": None, "verdict": "not observable"}
    ratio = float(np.sqrt(np.nanmean(scaled**2)))
    spread = NORMAL_99 * np.sqrt(2 / count)
    low = min(float(np.sqrt(max(1 - spread, 0.0))), 1 - LEAST_WIDTH)
    high = max(float(np.sqrt(1 + spread)), 1 + LEAST_WIDTH)
    verdict = "cautious" if ratio < low else "overconfident" if ratio > high else "consistent"
    return {"innovation_ratio": ratio, "innovation_bounds": [low, high], "verdict": verdict}


def vagueness(innovation_sigma: FloatArray, used: NDArray[np.bool_], noise_sigma: float) -> float | None:
    """By how much predictions are vaguer than readings (median over the used ones): a gate of C sigmas lets pass what
    is C times so many noise sigmas off."""
    return float(np.median(innovation_sigma[used]) / noise_sigma) if used.any() and 0 < noise_sigma < np.inf else None


def blind_stretches(time_s: FloatArray, sigma_m: FloatArray) -> list[dict[str, float]]:
    """Stretches in which the position is far vaguer than usual, because too few readings were left to tell it.

    time_s (n,), sigma_m (n, 3) of x, y, z; the longest MOST_BLIND of them, in time order.
    """
    size = np.sqrt((sigma_m**2).sum(1))
    blind = np.r_[False, size > BLIND * np.median(size), False]
    edges = np.flatnonzero(blind[1:] != blind[:-1]).reshape(-1, 2)
    found = [
        {"from_s": float(time_s[a]), "to_s": float(time_s[b - 1]), "sigma_m": float(size[a:b].max())} for a, b in edges
    ]
    longest = sorted(found, key=lambda s: s["from_s"] - s["to_s"])[:MOST_BLIND]
    return sorted(longest, key=lambda s: s["from_s"])
