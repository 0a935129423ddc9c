"""The linear Kalman filter on converted measurements: slant range, azimuth and elevation are turned into a position,
which a linear filter takes in (Lerro and Bar-Shalom 1993; unbiased form of Mo, Song, Zhou, Sun and Bar-Shalom 1998).

The conversion of noisy angles draws the position towards the station: E[cos(A + w)] = cos A exp(-s_A^2 / 2). Dividing
by l_A = exp(-s_A^2 / 2) and l_E makes it unbiased. Its covariance is exact, and taken at the predicted direction,
so that it does not depend on the reading's own noise; the axes are the line of sight's (radial, cross, up), in which
a component that is missing is a row that is left out.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part
from ftproc.core.filtering import ukf
from ftproc.core.filtering.forward import store
from ftproc.core.filtering.records import FilterRun
from ftproc.core.model import motion
from ftproc.core.model.measurement import measure

FloatArray = NDArray[np.float64]

MIN_COS_ELEVATION = 1e-3  # nearer to the zenith than this the azimuth says nothing


@kernel
def convert(
    z: FloatArray, noise: FloatArray, slant: float, azimuth: float, elevation: float, out: FloatArray, r: FloatArray
) -> None:
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


@kernel
def run_converted(
    first: int,
    last: int,
    time: FloatArray,
    z: FloatArray,
    noise: FloatArray,
    jerk: FloatArray,
    knot_s: float,
    x: FloatArray,
    p: FloatArray,
    run: FilterRun,
) -> float:
    """Filter samples [first, last) from the state x, P (in place); fills the run; returns the log-likelihood (of
    positions along the line-of-sight axes)."""
    h, c, r = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    z_hat, e, used, reading, along = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    scale, own = np.ones(3), np.zeros(3)
    pxz, gain, s, s_inv = np.zeros((9, 3)), np.zeros((9, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    likelihood = 0.0
    for k in range(first, last):
        if k > first:
            piece = motion.knot_index(time[k], time[0], knot_s, jerk.shape[0])
            motion.predict(x, p, time[k] - time[k - 1], jerk[piece], c)
        run.predicted[k] = x
        z_hat[0], z_hat[1], z_hat[2] = measure(x[0], x[1], x[2])
        for i in range(3):
            used[i] = 1.0 if math.isfinite(z[k, i]) else 0.0
            reading[i] = z[k, i] if used[i] > 0 else z_hat[i]
        ce = max(math.cos(z_hat[2]), MIN_COS_ELEVATION)
        convert(reading, noise, z_hat[0], z_hat[1], z_hat[2], along, r)
        _axes(math.cos(z_hat[1]), math.sin(z_hat[1]), math.cos(z_hat[2]), math.sin(z_hat[2]), h)
        scale[1], scale[2] = z_hat[0] * ce, z_hat[0]  # m per rad
        ukf.cross_covariance(p, h, pxz)
        for i in range(3):
            e[i] = along[i] - (h[i, 0] * x[0] + h[i, 1] * x[1] + h[i, 2] * x[2])
            for j in range(3):
                c[i, j] = h[j, 0] * pxz[0, i] + h[j, 1] * pxz[1, i] + h[j, 2] * pxz[2, i]
                if i != j:
                    c[i, j] += r[i, j]
            own[i] = r[i, i]
            run.innovation[k, i] = e[i] / scale[i] if used[i] > 0 else math.nan
            run.innovation_sigma[k, i] = math.sqrt(c[i, i] + own[i]) / scale[i]
            run.weight[k, i] = used[i]
        if used[0] > 0 or used[1] > 0 or used[2] > 0:
            nis, gained = ukf.update(x, p, pxz, c, h, e, own, used, s, s_inv, gain)
            run.nis[k] = nis
            likelihood += gained
        store(k, first, x, p, run)
    return likelihood
