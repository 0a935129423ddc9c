"""States of a track at other times than its own."""

from __future__ import annotations

import numpy as np

from ftproc.records import FloatArray

_TURNED = np.repeat([1.0, -1.0, 1.0], 3)  # a state whose time runs backward


def moved_to(time_s: FloatArray, state: FloatArray, wanted: FloatArray) -> FloatArray:
    """(k, 9) states at other times, by the motion from the nearest one before."""
    at = np.clip(np.searchsorted(time_s, wanted, side="right") - 1, 0, len(time_s) - 1)
    late = (wanted - time_s[at])[:, None]
    p, v, a = state[at, :3], state[at, 3:6], state[at, 6:]
    return np.hstack([p + late * v + 0.5 * late**2 * a, v + late * a, a])


def between(time_s: FloatArray, state: FloatArray, wanted: FloatArray) -> FloatArray:
    """(k, 9) states at times between those of a track: from the motion of either side, blended."""
    after = np.clip(np.searchsorted(time_s, wanted), 0, len(time_s) - 1)
    before = np.clip(np.searchsorted(time_s, wanted, side="right") - 1, 0, len(time_s) - 1)
    length = time_s[after] - time_s[before]
    share = np.where(length > 0, (wanted - time_s[before]) / np.where(length > 0, length, 1.0), 0.0)[:, None]
    behind = moved_to(-time_s[::-1], state[::-1] * _TURNED, -wanted) * _TURNED
    found: FloatArray = (1 - share) * moved_to(time_s, state, wanted) + share * behind
    return found
