"""Whether to trust a run: are the innovations as large as the filter says, can its gates fire, where is it blind?"""

from __future__ import annotations

from typing import Any

import numpy as np

from ftproc.records import FloatArray

NORMAL_99 = 2.576  # two-sided 99 % point
LEAST_WIDTH = 0.2  # no model is better than so, whatever the number of readings
VAGUE = 8.0  # innovation sigmas per noise sigma, in the median, from which a gate can hardly fire
BLIND = 10.0  # times the median position sigma
MOST_BLIND = 20  # stretches that are listed


def scatter(squares: float, count: int) -> dict[str, Any]:
    """Root mean square of the used innovations over their sigmas, from the sum of squares of so many; with the bounds
    within which 99 % of honest filters lie (chi-square, normal approximation), but at least 20 % wide, and the verdict.
    """
    if not count:
        return {"innovation_ratio": None, "innovation_bounds": None, "verdict": "not observable"}
    ratio = float(np.sqrt(squares / count))
    spread = NORMAL_99 * np.sqrt(2 / count)
    low = min(float(np.sqrt(max(1 - spread, 0.0))), 1 - LEAST_WIDTH)
    high = max(float(np.sqrt(1 + spread)), 1 + LEAST_WIDTH)
    verdict = "cautious" if ratio < low else "overconfident" if ratio > high else "consistent"
    return {"innovation_ratio": ratio, "innovation_bounds": [low, high], "verdict": verdict}


def nis_bounds(freedom: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Within which the sum of normalised innovations squared of so many degrees of freedom (n,) lies: 99 % of honest
    filters (chi-square by Wilson and Hilferty's cube root), but at least 20 % of a sigma wide; NaN for no freedom."""
    freedom = np.where(freedom > 0, freedom, np.nan)
    share = 2 / (9 * freedom)
    low, high = (1 - share + sign * NORMAL_99 * np.sqrt(share) for sign in (-1, 1))
    low, high = freedom * np.maximum(low, 0.0) ** 3, freedom * high**3
    return np.minimum(low, freedom * (1 - LEAST_WIDTH) ** 2), np.maximum(high, freedom * (1 + LEAST_WIDTH) ** 2)


def vagueness(innovation_sigma: FloatArray, noise_sigma: float) -> float | None:
    """By how much predictions are vaguer than readings, median over the used ones (m,): a gate of C sigmas lets pass
    what is C times so many noise sigmas off."""
    typical = float(np.median(innovation_sigma)) if len(innovation_sigma) else np.nan
    return typical / noise_sigma if np.isfinite(typical) and 0 < noise_sigma < np.inf else None


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
