"""The extended Kalman filter's linearisation: the Jacobian of range, azimuth and elevation (Zuo et al. 2021 eq. 4).

It fills the same z^, H, C as the unscented transform, so the update is shared.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import part
from ftproc.core.model.measurement import NO_RANGE_M, measure

FloatArray = NDArray[np.float64]

MIN_COS_ELEVATION = 1e-3  # nearer to the zenith than this the azimuth says nothing


class Linearised(Protocol):
    """x (9,) and P (9, 9) of a record, and what `linearise` fills: z_hat (3,), H (3, 3) on the position, C (3, 3)."""

    x: FloatArray
    p: FloatArray
    z_hat: FloatArray
    h: FloatArray
    c: FloatArray


@part
def jacobian(x: FloatArray, h: FloatArray) -> None:
    """Rows R, A, E of eq. 4 on the position columns (its others are zero), at the state x (9,)."""
    ground = math.hypot(x[0], x[1])
    slant = max(math.hypot(ground, x[2]), NO_RANGE_M)
    ground = max(ground, MIN_COS_ELEVATION * slant)
    ca, sa, ce, se = x[0] / ground, x[1] / ground, ground / slant, x[2] / slant
    h[0, 0], h[0, 1], h[0, 2] = ca * ce, sa * ce, se
    h[1, 0], h[1, 1], h[1, 2] = -sa / ground, ca / ground, 0.0
    h[2, 0], h[2, 1], h[2, 2] = -ca * se / slant, -sa * se / slant, ce / slant


@part
def linearise(f: Linearised) -> None:
    """z^ = h(x), H the Jacobian, C = H P H'."""
    x, p, z_hat, h, c = f.x, f.p, f.z_hat, f.h, f.c
    z_hat[0], z_hat[1], z_hat[2] = measure(x[0], x[1], x[2])
    jacobian(x, h)
    for i in range(3):
        for j in range(3):
            v = 0.0
            for a in range(3):
                for b in range(3):
                    v += h[i, a] * p[a, b] * h[j, b]
            c[i, j] = v


@part
def linearise_about(f: Linearised, place: FloatArray) -> None:
    """The same at another place (3,): z^ = h(place) + H (x - place), H the Jacobian there."""
    x, z_hat, h = f.x, f.z_hat, f.h
    x0, x1, x2 = x[0], x[1], x[2]
    x[0], x[1], x[2] = place[0], place[1], place[2]
    linearise(f)
    x[0], x[1], x[2] = x0, x1, x2
    for i in range(3):
        z_hat[i] += h[i, 0] * (x0 - place[0]) + h[i, 1] * (x1 - place[1]) + h[i, 2] * (x2 - place[2])
