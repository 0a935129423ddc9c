"""The components of readings: how large a reading may be, and sums over the readings of each component, and over the
components of each sample; numpy's own go along the short rows of (n, 3) one by one, which takes ten times as long."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

FARTHEST = 1e12  # m, rad, m/s: a larger reading is no more of an outlier, but its square would overflow


def bounded(readings: NDArray[Any]) -> NDArray[Any]:
    """A copy of readings, none of which is farther off than FARTHEST."""
    found: NDArray[Any] = np.clip(readings, -FARTHEST, FARTHEST)
    return found


def totals(values: NDArray[Any]) -> NDArray[Any]:
    """(3,) sums of values (n, 3), or how many of flags (n, 3) are set."""
    return np.array([values[:, c].sum() for c in range(values.shape[1])])


def sums(values: NDArray[Any]) -> NDArray[Any]:
    """(n,) sums of values (n, 3)."""
    return np.asarray(values[:, 0] + values[:, 1] + values[:, 2])


def any_of(flags: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) whether one of the three flags (n, 3) is set."""
    return np.asarray(flags[:, 0] | flags[:, 1] | flags[:, 2])
