"""The truth at the times of a trajectory: the same sample where there is one, else interpolated."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.records import FlagArray, FloatArray, IntArray, Truth

LONGEST = 5.0  # intervals between the truth's times, over which it is interpolated
_NEAR = 5  # intervals on both sides by which the usual one is judged


class MatchedTruth(NamedTuple):
    """The truth row for row with a trajectory of n samples.

    position_m: (n, 3), NaN where unmatched. velocity_mps, acceleration_mps2: (n, 3) or None. outlier: (n, 3) or None,
    zero where not `exact`. exact: (n,) the truth has the same sample. interpolated: (n,) between two of its times.
    """

    position_m: FloatArray
    velocity_mps: FloatArray | None
    acceleration_mps2: FloatArray | None
    outlier: FlagArray | None
    exact: NDArray[np.bool_]
    interpolated: NDArray[np.bool_]


def match(time_s: FloatArray, truth: Truth) -> MatchedTruth:
    """The truth at (n,) non-decreasing times in s.

    The k-th sample at a time gets the truth's k-th row at that time; times are equal when they differ by no more than
    the rounding of printed numbers. Other samples are interpolated, but not over gaps: cubic Hermite where the truth
    has velocities, else linear, as are accelerations. Outlier flags belong to single readings and are not interpolated.
    """
    rows = _same_sample(time_s, truth.time_s)
    exact = rows >= 0
    position, velocity, acceleration = _interpolate(time_s, truth)
    position[exact] = truth.position_m[rows[exact]]
    if velocity is not None and truth.velocity_mps is not None:
        velocity[exact] = truth.velocity_mps[rows[exact]]
    if acceleration is not None and truth.acceleration_mps2 is not None:
        acceleration[exact] = truth.acceleration_mps2[rows[exact]]
    outlier = None
    if truth.outlier is not None:
        outlier = np.zeros((len(time_s), 3), np.uint8)
        outlier[exact] = truth.outlier[rows[exact]]
    between = ~exact & np.isfinite(position).all(axis=1)
    return MatchedTruth(position, velocity, acceleration, outlier, exact, between)


def _same_sample(time_s: FloatArray, truth_s: FloatArray) -> IntArray:
    """(n,) row of the truth that is the same sample, -1 where there is none."""
    if not len(time_s) or not len(truth_s):
        return np.full(len(time_s), -1)
    right = np.clip(np.searchsorted(truth_s, time_s), 1, max(1, len(truth_s) - 1))
    near = np.stack([truth_s[right - 1], truth_s[np.minimum(right, len(truth_s) - 1)]])
    nearest = near[np.abs(near - time_s).argmin(axis=0), np.arange(len(time_s))]
    rounding = 1e-9 + 4 * np.spacing(np.abs(time_s))
    key = np.where(np.abs(nearest - time_s) <= rounding, nearest, np.nan)
    first = np.searchsorted(truth_s, key, side="left")
    count = np.searchsorted(truth_s, key, side="right") - first
    occurrence = _occurrence(key)
    return np.where(np.isfinite(key) & (occurrence < count), first + occurrence, -1)


def _occurrence(key: FloatArray) -> IntArray:
    """(n,) number of equal keys before each in its run; keys are sorted up to NaN."""
    index = np.arange(len(key))
    new = np.concatenate([[True], key[1:] != key[:-1]])
    return np.asarray(index - np.maximum.accumulate(np.where(new, index, 0)))


def _interpolate(time_s: FloatArray, truth: Truth) -> tuple[FloatArray, FloatArray | None, FloatArray | None]:
    """Position and, where the truth has them, velocity and acceleration at (n,) times; NaN outside the truth's own
    times and in gaps."""
    position = np.full((len(time_s), 3), np.nan)
    velocity = None if truth.velocity_mps is None else position.copy()
    acceleration = None if truth.acceleration_mps2 is None else position.copy()
    usable = np.isfinite(truth.position_m).all(axis=1)
    if truth.velocity_mps is not None:
        usable &= np.isfinite(truth.velocity_mps).all(axis=1)
    knots, first = np.unique(truth.time_s[usable], return_index=True)
    p = truth.position_m[usable][first]
    if not len(knots):
        return position, velocity, acceleration
    cell = np.clip(np.searchsorted(knots, time_s, side="right") - 1, 0, max(0, len(knots) - 2))
    inside = (time_s >= knots[0]) & (time_s <= knots[-1])
    inside &= ~_gaps(knots)[cell] | np.isin(time_s, knots)
    cell = cell[inside]
    following = np.minimum(cell + 1, len(knots) - 1)
    width = np.where(following > cell, knots[following] - knots[cell], 1.0)[:, None]
    s = (time_s[inside] - knots[cell])[:, None] / width
    if acceleration is not None and truth.acceleration_mps2 is not None:
        a = truth.acceleration_mps2[usable][first]
        acceleration[inside] = a[cell] + s * (a[following] - a[cell])
    if velocity is None or truth.velocity_mps is None:
        position[inside] = p[cell] + s * (p[following] - p[cell])
        return position, None, acceleration
    v = truth.velocity_mps[usable][first]
    position[inside], velocity[inside] = _hermite(s, width, p[cell], p[following], v[cell], v[following])
    return position, velocity, acceleration


def _gaps(knots: FloatArray) -> NDArray[np.bool_]:
    """(m,) whether the time from each knot to the next is far longer than is usual there."""
    step = np.diff(knots)
    gap = np.zeros(len(knots), bool)
    long = np.flatnonzero(step / LONGEST > step.min(initial=np.inf))
    around = np.clip(long[:, None] + np.arange(-_NEAR, _NEAR + 1), 0, max(0, len(step) - 1))
    gap[long] = step[long] / LONGEST > np.median(step[around], axis=1)
    return gap


def _hermite(
    s: FloatArray, width: FloatArray, p0: FloatArray, p1: FloatArray, v0: FloatArray, v1: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Cubic Hermite (m, 3) position and its derivative at the share (m, 1) of cells (m, 1) seconds wide."""
    rise, d0, d1 = p1 - p0, width * v0, width * v1
    c2, c3 = 3 * rise - 2 * d0 - d1, d0 + d1 - 2 * rise
    return p0 + s * (d0 + s * (c2 + s * c3)), (d0 + s * (2 * c2 + 3 * s * c3)) / width
