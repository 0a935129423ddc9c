"""Patches that one component alone shows by their two jumps: away from the track, and back.

A run of readings is a patch when the readings on both sides lie on one smooth curve, a cubic, and those inside lie off
it. A manoeuvre has no such jumps, and no such curve.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part
from ftproc.core.signatures import Vector

FloatArray = NDArray[np.float64]

JUMP = 4.0  # sigmas of the difference of two readings
LONGEST = 48  # readings in a patch that is looked for
SHORTEST = 3
SIDE = 12  # readings on each side that the cubic is fitted to
FIT = 1.6  # sigmas: scatter of these about it
OFF = 3.5  # sigmas from it that count as off
MOSTLY = 0.75  # share of the readings inside that must be off


@part
def _cubic(t: FloatArray, z: FloatArray, n: int, normal: FloatArray, coefficient: FloatArray) -> bool:
    """Least-squares cubic through n points with t within about [-1, 1]; normal (4, 5) is scratch."""
    normal[:] = 0.0
    for k in range(n):
        power_i = 1.0
        for i in range(4):
            power_j = power_i
            for j in range(4):
                normal[i, j] += power_j
                power_j *= t[k]
            normal[i, 4] += power_i * z[k]
            power_i *= t[k]
    # Row i holds the moments i ... i + 3, so the loops above fill the Gram matrix of 1, t, t^2, t^3.
    for i in range(4):
        if abs(normal[i, i]) < 1e-12:
            return False
        for j in range(i + 1, 4):
            factor = normal[j, i] / normal[i, i]
            for m in range(i, 5):
                normal[j, m] -= factor * normal[i, m]
    for i in range(3, -1, -1):
        v = normal[i, 4]
        for m in range(i + 1, 4):
            v -= normal[i, m] * coefficient[m]
        coefficient[i] = v / normal[i, i]
    return True


@part
def _value(coefficient: FloatArray, t: float) -> float:
    return float(coefficient[0] + t * (coefficient[1] + t * (coefficient[2] + t * coefficient[3])))


class Scratch(NamedTuple):
    """Memory for one fit: the points x, y (2 SIDE,), the normal equations (4, 5) and the coefficients (4,)."""

    x: FloatArray
    y: FloatArray
    normal: FloatArray
    coefficient: FloatArray


@part
def _is_patch(begin: int, end: int, t: FloatArray, z: FloatArray, sigma: float, scratch: Scratch) -> bool:
    """Whether readings [begin, end) lie off the cubic through the SIDE readings on each side."""
    x, y, normal, coefficient = scratch
    low, high = begin - SIDE, end + SIDE
    middle, half = 0.5 * (t[low] + t[high - 1]), 0.5 * (t[high - 1] - t[low])
    if half <= 0:
        return False
    n = 0
    for k in range(low, high):
        if k < begin or k >= end:
            x[n], y[n] = (t[k] - middle) / half, z[k] - z[low]
            n += 1
    if not _cubic(x, y, n, normal, coefficient):
        return False
    scatter = 0.0
    for i in range(n):
        scatter += (y[i] - _value(coefficient, x[i])) ** 2
    if math.sqrt(scatter / (n - 4)) > FIT * sigma:
        return False
    off = 0
    for k in range(begin, end):
        away = abs(z[k] - z[low] - _value(coefficient, (t[k] - middle) / half)) > OFF * sigma
        if not away and (k < begin + 2 or k >= end - 2):
            return False  # a manoeuvre leaves the cubic gently, a patch at once
        off += away
    return off >= MOSTLY * (end - begin)


@kernel
def find(time: Vector, channel: Vector, good: Vector, sigma: float) -> Vector:
    """(n,) 1 where a reading that was thought good belongs to a patch between two jumps.

    time (n,) s, channel (n,) one component (an azimuth unwrapped), good (n,) weight so far, sigma: its noise.
    """
    found = np.zeros(len(channel))
    seen = np.flatnonzero((good > 0) & np.isfinite(channel))
    t, z = time[seen], channel[seen]
    n = len(seen)
    scratch = Scratch(np.empty(2 * SIDE), np.empty(2 * SIDE), np.empty((4, 5)), np.empty(4))
    jumps = np.zeros(n)
    for k in range(2, n - 1):
        # Against the mean of the differences just before and after, which a steady motion shares.
        around = 0.5 * (z[k - 1] - z[k - 2] + z[k + 1] - z[k])
        jumps[k] = 1.0 if abs(z[k] - z[k - 1] - around) > JUMP * math.sqrt(3.0) * sigma else 0.0
    begin = SIDE
    while begin < n - SIDE:
        step = 1
        if jumps[begin] > 0:
            for end in range(begin + SHORTEST, min(begin + LONGEST, n - SIDE) + 1):
                if jumps[end] > 0 and _is_patch(begin, end, t, z, sigma, scratch):
                    for k in range(begin, end):
                        found[seen[k]] = 1.0
                    step = end - begin
                    break
        begin += step
    return found
