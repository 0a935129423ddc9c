"""What a station measures of a target, for kernels: h(x), differences of angles, and directions.

The conventions are those of `frames`, which has the same for whole arrays.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import part

FloatArray = NDArray[np.float64]

MIN_RANGE_M = 1.0  # below this the direction of the target has no meaning
TWO_PI = 2 * math.pi


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
    return max(slant, MIN_RANGE_M), math.atan2(y, x), math.atan2(z, math.sqrt(ground2))


@part
def turn(cross: float, dot: float) -> float:
    """atan2(cross, dot) in rad: the angle between two directions, by its series where it is small (to rounding)."""
    if not abs(cross) < 0.05 * dot:
        return math.atan2(cross, dot)
    t = cross / dot
    q = t * t
    tail = 1 / 7 - q * (1 / 9 - q * (1 / 11 - q * (1 / 13)))
    return t * (1 - q * (1 / 3 - q * (1 / 5 - q * tail)))


@part
def line_of_sight_sigma(x: FloatArray, p: FloatArray, out: FloatArray) -> None:
    """1-sigma of position and velocity along the radial, cross and up axes at x."""
    ground = max(math.sqrt(x[0] * x[0] + x[1] * x[1]), 1e-9)
    slant = math.sqrt(ground * ground + x[2] * x[2])
    ca, sa, ce, se = x[0] / ground, x[1] / ground, ground / slant, x[2] / slant
    for axis in range(3):
        u, v, w = -sa, ca, 0.0
        if axis == 0:
            u, v, w = ca * ce, sa * ce, se
        elif axis == 2:
            u, v, w = -ca * se, -sa * se, ce
        for b in range(2):
            o = 3 * b
            variance = u * u * p[o, o] + v * v * p[o + 1, o + 1] + w * w * p[o + 2, o + 2]
            variance += 2 * (u * v * p[o, o + 1] + u * w * p[o, o + 2] + v * w * p[o + 1, o + 2])
            out[o + axis] = math.sqrt(max(variance, 0.0))
