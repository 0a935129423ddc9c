"""The linear Kalman filter on converted measurements: slant range, azimuth and elevation are turned into a position,
which a linear filter takes in (Lerro and Bar-Shalom 1993; unbiased form of Mo, Song, Zhou, Sun and Bar-Shalom 1998).

The conversion of noisy angles draws the position towards the station: E[cos(A + w)] = cos A exp(-s_A^2 / 2). Dividing
by l_A = exp(-s_A^2 / 2) and l_E makes it unbiased. Its covariance is exact, and taken at the predicted direction,
so that it does not depend on the reading's own noise; the axes are the line of sight's (radial, cross, up), in which
a component that is missing is a row that is left out.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part, record, zeros
from ftproc.core.filtering import ukf
from ftproc.core.filtering.filters import Filter
from ftproc.core.filtering.forward import recursion
from ftproc.core.filtering.records import Row, Sample
from ftproc.core.model.measurement import measure
from ftproc.core.signatures import Layout, Matrix, Vector

FloatArray = NDArray[np.float64]

MIN_COS_ELEVATION = 1e-3  # nearer to the zenith than this the azimuth says nothing


@kernel
def convert(z: Vector, noise: Vector, slant: float, azimuth: float, elevation: float, out: Vector, r: Matrix) -> None:
    """The unbiased position of a reading z (3,) with noise variances (3,), along the radial, cross and up axes of the
    direction azimuth, elevation: out (3,) m; its covariance at that direction and slant range: r (3, 3) m^2."""
    la, le = math.exp(-noise[1] / 2), math.exp(-noise[2] / 2)
    turned = z[1] - azimuth
    x = z[0] * math.cos(z[2]) * math.cos(turned) / (la * le)  # north of the frame turned to the azimuth
    y = z[0] * math.cos(z[2]) * math.sin(turned) / (la * le)
    up = z[0] * math.sin(z[2]) / le
    ce, se = math.cos(elevation), math.sin(elevation)
    out[0], out[1], out[2] = ce * x + se * up, y, ce * up - se * x
    # Second moments, in differences that do not cancel: a4 - 1 = expm1(-2 s_A^2) and so on.
    square = slant * slant
    full = square + noise[0]
    a, b = math.expm1(-2 * noise[1]), math.expm1(-2 * noise[2])
    grow_a, grow_e = math.exp(noise[1]), math.exp(noise[2])  # 1 / l^2
    cos2 = ce * ce + 0.5 * b * (ce * ce - se * se)  # E[cos^2 E], E[sin^2 E], E[cos E sin E]
    sin2 = 1 - cos2
    both = (1 + b) * ce * se
    cos_a2 = 1 + 0.5 * a
    vx = full * cos2 * cos_a2 * grow_a * grow_e - square * ce * ce
    vy = -0.5 * a * full * cos2 * grow_a * grow_e
    vz = full * sin2 * grow_e - square * se * se
    vxz = full * both * grow_e - square * ce * se
    r[0, 0] = ce * ce * vx + 2 * ce * se * vxz + se * se * vz
    r[1, 1] = vy
    r[2, 2] = se * se * vx - 2 * ce * se * vxz + ce * ce * vz
    r[0, 2] = r[2, 0] = ce * ce * vxz - se * se * vxz + ce * se * (vz - vx)
    r[0, 1] = r[1, 0] = r[1, 2] = r[2, 1] = 0.0


@part
def _axes(ca: float, sa: float, ce: float, se: float, h: FloatArray) -> None:
    """Rows: the radial, cross and up unit vectors."""
    h[0, 0], h[0, 1], h[0, 2] = ca * ce, sa * ce, se
    h[1, 0], h[1, 1], h[1, 2] = -sa, ca, 0.0
    h[2, 0], h[2, 1], h[2, 2] = -ca * se, -sa * se, ce


class Conversion(Protocol):
    """The record of the filter's measurements: noise of range and angles, the reading with what is missing filled in,
    its position along the line-of-sight axes, the covariance of that, and metres per unit of each component."""

    noise: Annotated[FloatArray, 3]
    reading: Annotated[FloatArray, 3]
    along: Annotated[FloatArray, 3]
    r: Annotated[FloatArray, 3, 3]
    scale: Annotated[FloatArray, 3]


CONVERSION = record(Conversion)
Conversions = Annotated[Any, Layout(CONVERSION)]


def conversion_of(noise_variance: FloatArray) -> Any:
    """An array of one `Conversion` for noise variances (3,)."""
    conversions = zeros(CONVERSION)
    conversions["noise"] = noise_variance
    return conversions


@part
def _converted(f: Filter, sample: Sample, conversions: Conversions, row: Row) -> tuple[float, bool]:
    """The update of a sample by its converted position; every reading is used. The log-likelihood is that of positions
    along the line-of-sight axes."""
    v = conversions[0]
    x, h, c = f.x, f.h, f.c
    slant, azimuth, elevation = measure(x[0], x[1], x[2])
    f.z_hat[0], f.z_hat[1], f.z_hat[2] = slant, azimuth, elevation
    any_used = False
    for i in range(3):
        f.used[i] = 1.0 if math.isfinite(sample.measurement[i]) else 0.0
        v.reading[i] = sample.measurement[i] if f.used[i] > 0 else f.z_hat[i]
        any_used = any_used or f.used[i] > 0
    convert(v.reading, v.noise, slant, azimuth, elevation, v.along, v.r)
    _axes(math.cos(azimuth), math.sin(azimuth), math.cos(elevation), math.sin(elevation), h)
    v.scale[0] = 1.0
    v.scale[1], v.scale[2] = slant * max(math.cos(elevation), MIN_COS_ELEVATION), slant  # m per rad
    ukf.cross_covariance(f.p, f.h, f.pxz)
    for i in range(3):
        f.e[i] = v.along[i] - (h[i, 0] * x[0] + h[i, 1] * x[1] + h[i, 2] * x[2])
        for j in range(3):
            c[i, j] = h[j, 0] * f.pxz[0, i] + h[j, 1] * f.pxz[1, i] + h[j, 2] * f.pxz[2, i]
            if i != j:
                c[i, j] += v.r[i, j]
        f.noise[i] = v.r[i, i]
        row.innovation[i] = f.e[i] / v.scale[i] if f.used[i] > 0 else math.nan
        row.innovation_sigma[i] = math.sqrt(c[i, i] + f.noise[i]) / v.scale[i]
        row.weight[i] = f.used[i]
    gained = 0.0
    if any_used:
        row.nis, gained = ukf.update(f)
    return gained, False


run_converted = recursion(_converted, Conversions)
