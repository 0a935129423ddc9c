"""What several stations measure of one target: places, levels and axes in a common frame; plain numpy.

A station stands at `place`; the rows of its `axes` are its own x, y and z (east, north and its own vertical). A tilt t
(about x and about y, rad, right-handed) turns what it sees: level = R(t) axes (p - place). Of the level position it
measures range, azimuth and elevation as `frames` has them, plus a bias of each; it writes the time t + clock offset.
"""

from __future__ import annotations

import math

import numpy as np

from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.records import FloatArray

MIN_COS_ELEVATION = 1e-3  # nearer to the zenith than this the azimuth says nothing


def levelled(axes: FloatArray, tilt: FloatArray) -> FloatArray:
    """(m, 3, 3) axes turned by tilts (m, 2), rad about x and about y."""
    turned = np.empty_like(axes)
    for k, (about_x, about_y) in enumerate(tilt):
        angle = math.hypot(about_x, about_y)
        cross = np.array([[0.0, 0.0, about_y], [0.0, 0.0, -about_x], [-about_y, about_x, 0.0]])
        near = (math.sin(angle) / angle, (1 - math.cos(angle)) / angle**2) if angle > 0 else (1.0, 0.5)
        turned[k] = (np.eye(3) + near[0] * cross + near[1] * cross @ cross) @ axes[k]
    return turned


def local(position: FloatArray, place: FloatArray, axes: FloatArray) -> FloatArray:
    """(n, 3) positions in a station's own axes; place (3,) and axes (3, 3), or (n, 3) and (n, 3, 3)."""
    found: FloatArray = np.einsum("...ij,...j->...i", axes, position - place)
    return found


def measured(position: FloatArray, place: FloatArray, axes: FloatArray) -> FloatArray:
    """(n, 3) range m, azimuth and elevation rad of positions (n, 3); place and axes as of `local`."""
    return from_cartesian(local(position, place, axes))


def innovation(measurement: FloatArray, expected: FloatArray) -> FloatArray:
    """(n, 3) measured minus expected, the azimuth wrapped."""
    difference: FloatArray = measurement - expected
    difference[..., 1] = wrap(difference[..., 1])
    return difference


def jacobian(position: FloatArray) -> FloatArray:
    """(n, 3, 3) of range, azimuth and elevation by local positions (n, 3)."""
    x, y, z = np.moveaxis(position, -1, 0)
    ground = np.hypot(x, y)
    slant = np.maximum(np.hypot(ground, z), 1e-9)
    ground = np.maximum(ground, MIN_COS_ELEVATION * slant)
    ca, sa, ce, se = x / ground, y / ground, ground / slant, z / slant
    zero = np.zeros_like(x)
    rows = ((ca * ce, sa * ce, se), (-sa / ground, ca / ground, zero), (-ca * se / slant, -sa * se / slant, ce / slant))
    return np.stack([np.stack(row, -1) for row in rows], -2)


def design(state: FloatArray, place: FloatArray, axes: FloatArray) -> FloatArray:
    """(n, 3, 3) derivative of range, azimuth and elevation of states (n, 9) by the two tilts, rad, and by the clock
    offset, s, of their stations; place (n, 3), axes (n, 3, 3)."""
    seen = local(state[:, :3], place, axes)
    slope = jacobian(seen)
    zero = np.zeros(len(seen))
    about_x = np.stack([zero, -seen[:, 2], seen[:, 1]], 1)
    about_y = np.stack([seen[:, 2], zero, -seen[:, 0]], 1)
    late = -np.einsum("nij,nj->ni", axes, state[:, 3:6])
    found: FloatArray = np.einsum("nij,njc->nic", slope, np.stack([about_x, about_y, late], 2))
    found[:, 0, :2] = 0.0  # a tilt leaves the range as it is
    return found
