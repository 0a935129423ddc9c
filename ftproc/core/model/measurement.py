"""What a station measures of a target, for kernels: h(x), differences of angles, and directions.

The conventions are those of `frames`, which has the same for whole arrays.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import part

FloatArray = NDArray[np.float64]

NO_RANGE_M = 1e-150  # stands in for a range of zero, by which nothing can be divided
TWO_PI = 2 * math.pi
SMALL_TURN = 0.04  # of a distance: a point moved by less is seen at less than 0.05 rad from where it was


@part
def wrap_angle(angle: float) -> float:
    """Angle in rad brought into [-pi, pi), NaN left as it is; cheap for the usual case of no wrap at all."""
    if angle < -math.pi or angle >= math.pi:
        return angle - TWO_PI * math.floor((angle + math.pi) / TWO_PI)
    return angle


@part
def wrapped(value: float, angular: bool) -> float:
    """An angle in [-pi, pi), and anything else as it is."""
    if angular and not -math.pi <= value < math.pi:
        return value - 2 * math.pi * math.floor((value + math.pi) / (2 * math.pi))
    return value


@part
def measure(x: float, y: float, z: float) -> tuple[float, float, float]:
    """h(x): slant range m, azimuth rad, elevation rad."""
    ground2 = x * x + y * y
    slant = math.sqrt(ground2 + z * z)
    return max(slant, NO_RANGE_M), math.atan2(y, x), math.atan2(z, math.sqrt(ground2))


@part
def small_turn(tangent: float) -> float:
    """atan(tangent) by its series, to rounding where |tangent| < 0.05."""
    q = tangent * tangent
    q2 = q * q
    return tangent * ((1 - q * (1 / 3)) + q2 * ((1 / 5 - q * (1 / 7)) + q2 * (1 / 9 - q * (1 / 11))))


@part
def turn(cross: float, dot: float) -> float:
    """atan2(cross, dot) in rad: the angle between two directions."""
    if not abs(cross) < 0.05 * dot:
        return math.atan2(cross, dot)
    return small_turn(cross / dot)


@part
def moves(before: FloatArray, after: FloatArray) -> tuple[float, float, float]:
    """h(after) - h(before) of two states: m, rad, rad."""
    ground0 = math.sqrt(before[0] * before[0] + before[1] * before[1])
    ground1 = math.sqrt(after[0] * after[0] + after[1] * after[1])
    slant0 = max(math.sqrt(ground0 * ground0 + before[2] * before[2]), NO_RANGE_M)
    slant1 = max(math.sqrt(ground1 * ground1 + after[2] * after[2]), NO_RANGE_M)
    azimuth = turn(before[0] * after[1] - before[1] * after[0], before[0] * after[0] + before[1] * after[1])
    elevation = turn(ground0 * after[2] - before[2] * ground1, ground0 * ground1 + before[2] * after[2])
    return slant1 - slant0, azimuth, elevation


@part
def line_of_sight_sigma(x: FloatArray, p: FloatArray, out: FloatArray) -> None:
    """1-sigma of position and velocity along the radial, cross and up axes at x."""
    ground = max(math.sqrt(x[0] * x[0] + x[1] * x[1]), 1e-9)
    slant = math.sqrt(ground * ground + x[2] * x[2])
    ca, sa, ce, se = x[0] / ground, x[1] / ground, ground / slant, x[2] / slant
    for o in (0, 3):
        xx, yy, zz = p[o, o], p[o + 1, o + 1], p[o + 2, o + 2]
        xy, up_along = 2 * ca * sa * p[o, o + 1], 2 * ce * se * (ca * p[o, o + 2] + sa * p[o + 1, o + 2])
        along = ca * ca * xx + sa * sa * yy + xy  # the horizontal direction
        out[o] = math.sqrt(max(ce * ce * along + se * se * zz + up_along, 0.0))
        out[o + 1] = math.sqrt(max(sa * sa * xx + ca * ca * yy - xy, 0.0))
        out[o + 2] = math.sqrt(max(se * se * along + ce * ce * zz - up_along, 0.0))
