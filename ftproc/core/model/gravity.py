"""The gravity of an earth that turns, for what is far above it: its mass, its flattening J2, and the apparent forces.

    g = -mu p / r^3 - 3/2 J2 mu R^2 / r^5 ((1 - 5 u^2 / r^2) p + 2 u n)      n = W / |W|      u = n.p

(Montenbruck and Gill 2000, section 3.2.) The first term is in `forces`, with a mass that stands for the gravity of the
surface where no rotation is known.
"""

from __future__ import annotations

import math
from typing import Annotated, Protocol

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import part
from ftproc.core.model.motion import Motion

FloatArray = NDArray[np.float64]

MASS_M3PS2, FLATTENING, EQUATOR_M = 3.986004418e14, 1.08262982e-3, 6378137.0  # mu, J2 (EGM2008), R


class Pulled(Protocol):
    """How the acceleration changes: push, and slope, its derivatives by velocity and acceleration."""

    slope: Annotated[FloatArray, 3, 6]
    push: Annotated[FloatArray, 3]


@part
def rotate(f: Pulled, x: FloatArray, w0: float, w1: float, w2: float, turns: float, swell: float) -> None:
    """Add the apparent forces of a turning earth, whose rotation is half of w, to slope and push."""
    s, v, a = f.slope, (x[3], x[4], x[5]), (x[6], x[7], x[8])
    spin = ((0.0, -w2, w1), (w2, 0.0, -w0), (-w1, w0, 0.0))
    for i in range(3):
        for j in range(3):
            f.push[i] -= spin[i][j] * a[j]
            s[i, 3 + j] -= spin[i][j]
            s[i, j] += swell * spin[i][j]
            for k in range(3):
                s[i, j] += (turns * (a[i] * v[k] - v[i] * a[k]) - 0.25 * spin[i][k]) * spin[k][j]
                f.push[i] -= 0.25 * spin[i][k] * spin[k][j] * v[j]


@part
def flatten(f: Pulled, x: FloatArray, r: tuple[float, float, float], by: Motion) -> None:
    """Add what the earth's flattening does to its gravity, at r from its centre, to slope and push."""
    s, w = f.slope, by.earth
    spin = 1 / math.sqrt(w[0, 0] * w[0, 0] + w[0, 1] * w[0, 1] + w[0, 2] * w[0, 2])
    n = (spin * w[0, 0], spin * w[0, 1], spin * w[0, 2])
    ir2 = 1 / (r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
    u = n[0] * r[0] + n[1] * r[1] + n[2] * r[2]
    m, ir5 = 1 - 5 * u * u * ir2, ir2 * ir2 * math.sqrt(ir2)
    size = -1.5 * FLATTENING * MASS_M3PS2 * EQUATOR_M * EQUATOR_M * ir5
    for i in range(3):
        near = m * r[i] + 2 * u * n[i]
        for j in range(3):
            of_m = 10 * u * ir2 * (u * ir2 * r[j] - n[j])
            tide = size * (2 * n[i] * n[j] + r[i] * of_m - 5 * ir2 * near * r[j] + (m if i == j else 0.0))
            s[i, j] += tide
            f.push[i] += tide * x[3 + j]
