"""Slant range, azimuth, elevation <-> local Cartesian x, y, z; plain numpy, so that importing it is cheap.

A = atan2(y, x), E = atan2(z, hypot(x, y)) (Zuo et al. 2021 eq. 3 with its misprinted "cot" read as arctan: the
paper's own Jacobian, eq. 4, is that of the arctangent). With x north and y east this azimuth is the surveyor's,
clockwise from north.
"""

from __future__ import annotations

import math

import numpy as np

from ftproc.records import FloatArray

ANY_ANGLE_RAD = np.pi / math.sqrt(3)  # 1-sigma of an angle of which nothing is known
_NO_DISTANCE_M = 1e-9  # stands in for zero


def wrap(angle: FloatArray) -> FloatArray:
    """Angle(s) in rad brought into [-pi, pi)."""
    wrapped: FloatArray = np.mod(angle + np.pi, 2 * np.pi) - np.pi
    return wrapped


def to_cartesian(measurement: FloatArray) -> FloatArray:
    """(..., 3) range m, azimuth rad, elevation rad -> (..., 3) x, y, z in m. NaN stays NaN."""
    slant_range, azimuth, elevation = np.moveaxis(np.asarray(measurement, float), -1, 0)
    ground = slant_range * np.cos(elevation)
    return np.stack([ground * np.cos(azimuth), ground * np.sin(azimuth), slant_range * np.sin(elevation)], -1)


def from_cartesian(position: FloatArray) -> FloatArray:
    """(..., 3) x, y, z in m -> (..., 3) range m, azimuth rad in [-pi, pi], elevation rad."""
    # Contiguous, for some versions of numpy round an arctan2 of strided memory by where it lies.
    x, y, z = np.ascontiguousarray(np.moveaxis(np.asarray(position, float), -1, 0))
    ground = np.hypot(x, y)
    return np.stack([np.hypot(ground, z), np.arctan2(y, x), np.arctan2(z, ground)], -1)


def measurement_sigma(measurement: FloatArray, along: FloatArray) -> FloatArray:
    """(n, 3) 1-sigma of range m, azimuth rad and elevation rad of positions that are known along the radial, cross and
    up axes to (n, 3) m. measurement: (n, 3) of these positions.

    The azimuth's is a third of the angle that three sigmas of the position fill, seen from the vertical through the
    station: far from it that is the Jacobian's. Where they reach it, the azimuth may be any.
    """
    slant = np.maximum(np.abs(measurement[:, 0]), _NO_DISTANCE_M)
    across = 3 * along[:, 1] / np.maximum(slant * np.abs(np.cos(measurement[:, 2])), _NO_DISTANCE_M)
    azimuth = np.where(across >= 1, ANY_ANGLE_RAD, np.arcsin(np.minimum(across, 1.0)) / 3)
    return np.stack([along[:, 0], azimuth, np.minimum(along[:, 2] / slant, ANY_ANGLE_RAD)], -1)


def unwrap(azimuth: FloatArray) -> FloatArray:
    """(n,) azimuth rad with the jumps of whole turns taken out; NaN is stepped over and stays NaN."""
    unwrapped = azimuth.copy()
    seen = np.isfinite(azimuth)
    unwrapped[seen] = np.unwrap(azimuth[seen])
    return unwrapped


def line_of_sight_axes(position: FloatArray) -> FloatArray:
    """(n, 3) positions -> (n, 3, 3) rotation whose rows are the radial, cross and up unit vectors.

    Cross points to growing azimuth in the horizontal, up to growing elevation.
    """
    _, azimuth, elevation = np.moveaxis(from_cartesian(position), -1, 0)
    ca, sa, ce, se = np.cos(azimuth), np.sin(azimuth), np.cos(elevation), np.sin(elevation)
    radial = np.stack([ca * ce, sa * ce, se], -1)
    cross = np.stack([-sa, ca, np.zeros_like(sa)], -1)
    up = np.stack([-ca * se, -sa * se, ce], -1)
    return np.stack([radial, cross, up], -2)
