"""The path that readings give a target, by the medians of blocks of rows: its speed, how bent it is, and the noise."""

from __future__ import annotations

import math

import numpy as np

from ftproc.order_statistics import median
from ftproc.records import FloatArray

FEWEST = 6  # rows
STRAIGHT = (6, 12, 24)  # blocks, by whose medians the path is judged
_BLOCKS = 24  # by whose medians the speed is judged
_LARGER = 3.0  # times the step from row to row is the way of a target that moves
_HIGHEST_ORDER = 5  # of the differences by which noise is judged


def positions(distance: FloatArray, azimuth: FloatArray, elevation: FloatArray) -> FloatArray:
    """(n, 3) positions in the unit of the range; angles in rad."""
    flat = distance * np.cos(elevation)
    return np.column_stack([flat * np.cos(azimuth), flat * np.sin(azimuth), distance * np.sin(elevation)])


def speed(time: FloatArray, position: FloatArray) -> float | None:
    """The usual speed, or None if the way is hidden in the noise."""
    count = min(_BLOCKS, len(time) // 5 if len(time) >= 5 * FEWEST else len(time))
    size = len(time) // count
    middle = np.median(position[: count * size].reshape(count, size, 3), axis=1)
    moment = np.median(time[: count * size].reshape(count, size), axis=1)
    way = float(np.linalg.norm(np.ptp(middle, axis=0)))
    step = median(np.linalg.norm(np.diff(position, axis=0), axis=1))
    past = np.diff(moment) > 0
    if (size > 1 and way < _LARGER * step) or not past.any():
        return None
    return median(np.linalg.norm(np.diff(middle, axis=0), axis=1)[past] / np.diff(moment)[past])


def medians(values: FloatArray, count: int) -> FloatArray:
    """(count,) of (n,) values, the medians of so many blocks of rows."""
    size = len(values) // count
    return np.asarray(np.median(values[: count * size].reshape(count, size), axis=1))


def middles(angle: FloatArray, count: int) -> FloatArray:
    """(count,) of (n,) angles in rad, the same round the circle."""
    size = len(angle) // count
    a = angle[: count * size].reshape(count, size)
    middle = np.arctan2(np.median(np.sin(a), axis=1), np.median(np.cos(a), axis=1))
    off = (a - middle[:, None] + np.pi) % (2 * np.pi) - np.pi
    return np.asarray(middle + np.median(off, axis=1))


@np.errstate(over="ignore", invalid="ignore")  # of values that nothing has
def derived(moment: FloatArray, position: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(n - 1, 3) velocities and (n - 2, 3) accelerations of n positions."""
    velocity = np.diff(position, axis=0) / np.diff(moment)[:, None]
    return velocity, 2 * np.diff(velocity, axis=0) / (moment[2:] - moment[:-2])[:, None]


@np.errstate(over="ignore", invalid="ignore")  # of these, too
def bent(moment: FloatArray, position: FloatArray, distance: FloatArray) -> float:
    """The acceleration of a path of n medians, or what is left of it without its mean (gravity, thrust), in units of
    v^2 / r; infinite where rows share their times."""
    if (np.diff(moment) <= 0).any():
        return math.inf
    velocity, acceleration = derived(moment, position)
    squares = np.sum(((velocity[1:] + velocity[:-1]) / 2) ** 2, axis=1)
    bending = float((squares / np.maximum(np.abs(distance[1:-1]), 1e-9)).sum())
    if not bending > 0:
        return math.inf
    least = float(np.linalg.norm(acceleration, axis=1).sum()) / bending
    if len(moment) > STRAIGHT[0]:
        left = np.linalg.norm(acceleration - acceleration.mean(0), axis=1).sum() / bending
        least = min(least, float(left) * len(moment) / (len(moment) - 3))
    return least


def noise(angle: FloatArray) -> float:
    """The standard deviation of the noise, by the differences of that order in which the motion shows least; of coarse
    readings that of their rounding at least."""
    steps = np.abs(np.diff(angle))
    if not steps.any():
        return 0.0
    least = float(steps[steps > 0].min())
    grid = steps / least
    coarse = least / math.sqrt(12) if np.allclose(grid, np.round(grid), atol=1e-3) else 0.0
    found = math.inf
    for order in range(2, _HIGHEST_ORDER + 1):
        size = median(np.abs(np.diff(angle, order))) * 1.4826
        found = min(found, size / math.sqrt(math.comb(2 * order, order)))
    return max(found, coarse)
