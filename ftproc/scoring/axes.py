"""Whether a trajectory and its truth mean the same axes."""

from __future__ import annotations

import numpy as np

from ftproc.records import FloatArray, Trajectory, Truth
from ftproc.scoring.matching import match

FAR_BETTER = 0.1  # of the error, that is left when x and y are exchanged


def remark(trajectory: Trajectory, truth: Truth) -> str | None:
    """A sentence when the truth fits far better with x and y exchanged: one has x east, the other x north."""
    position = match(trajectory.time_s, truth).position_m
    error = _typical(trajectory.state[:, :3] - position)
    if not _typical(trajectory.state[:, :3] - position[:, [1, 0, 2]]) < FAR_BETTER * error:
        return None
    return (
        f"{truth.name} fits {trajectory.name} far better with x and y exchanged: one has x north, the other x east. "
        "Exchange x and y in the truth (vx and vy too)."
    )


def _typical(error: FloatArray) -> float:
    """Median length of (n, 3) errors in m; NaN when there is none."""
    length = np.sqrt((error**2).sum(1))
    there = length[np.isfinite(length)]
    return float(np.median(there)) if len(there) else np.nan
