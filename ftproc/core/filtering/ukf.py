"""The unscented Kalman filter for slant range, azimuth and elevation, with an exact shortcut.

The dynamics are linear, so the prediction is the Kalman filter's own. In the update, h sees only the position. With
a Cholesky factor ordered position-first only the first three columns move the position, so of the 2n + 1 = 19 sigma
points of the scaled transform (alpha = 1, beta = 0, kappa = 0; centre weight 0, the others 1/18, spread 3 sigma)
only 7 differ in h: the centre and three pairs. With d+-_j = h(x +- 3 L_j) - h(x), wrapped,

    z^   = h(x) + 1/18 sum d            C = 1/18 sum d d' - dbar dbar'
    P_xz = P H',  H' = L^-T B,  B_j = (d+_j - d-_j) / 6,  L L' = position block of P

which are the 19-point results to rounding. H is the statistical linearisation of h, and C - H P H' >= 0 is what the
bend of h adds to the measurement noise.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import part, record
from ftproc.core.model.measurement import MIN_RANGE_M, turn, wrap_angle
from ftproc.core.signatures import Layout

FloatArray = NDArray[np.float64]

SPREAD = 3.0  # sqrt(n + lambda) with n = 9, alpha = 1, kappa = 0
MAX_SPREAD_IN_RANGES = 0.3  # of the sigma points about the state
ROUNDING = 1e-15  # of a number, below which its last digits say nothing


class Filter(Protocol):
    """The record of a filter: its state, and what one measurement update computes on its way.

    x, p: state and covariance, SI units. noise: variance of each component. q: coefficients of Q. z_hat: predicted
    measurement. e: innovation. used: weight of each component, zero for none. h: H on the position. c: C of the
    module's head. s, s_inv: innovation covariance of the components used, and its inverse. pxz: P H'. gain. factor, b:
    of the transform.
    """

    x: Annotated[FloatArray, 9]
    p: Annotated[FloatArray, 9, 9]
    noise: Annotated[FloatArray, 3]
    q: Annotated[FloatArray, 3, 3]
    z_hat: Annotated[FloatArray, 3]
    e: Annotated[FloatArray, 3]
    used: Annotated[FloatArray, 3]
    h: Annotated[FloatArray, 3, 3]
    c: Annotated[FloatArray, 3, 3]
    s: Annotated[FloatArray, 3, 3]
    s_inv: Annotated[FloatArray, 3, 3]
    pxz: Annotated[FloatArray, 9, 3]
    gain: Annotated[FloatArray, 9, 3]
    factor: Annotated[FloatArray, 3, 3]
    b: Annotated[FloatArray, 3, 3]


FILTER = record(Filter)
Filters = Annotated[Any, Layout(FILTER)]


@part
def position_factor(f: Filter) -> None:
    """Lower Cholesky factor of the position block; a pivot lost to rounding is floored, never taken the root of."""
    p, factor = f.p, f.factor
    floor = 1e-12 * (p[0, 0] + p[1, 1] + p[2, 2]) + 1e-300
    for i in range(3):
        for j in range(i + 1):
            s = p[i, j]
            for k in range(j):
                s -= factor[i, k] * factor[j, k]
            if i == j:
                factor[i, i] = math.sqrt(max(s, floor))
            else:
                factor[i, j] = s / factor[j, j]


@part
def linearise(f: Filter) -> None:
    """The unscented transform of h at (x, P): fills z_hat, H and C.

    When P is so wide (a long coast) that the points would straddle the station, alpha is made smaller, which draws
    the points together; at alpha = 1 the formulas are those of the module's head.
    """
    x, p, factor, b, z_hat, h, c = f.x, f.p, f.factor, f.b, f.z_hat, f.h, f.c
    position_factor(f)
    px, py, pz = x[0], x[1], x[2]
    ground = math.sqrt(px * px + py * py)
    slant = max(math.sqrt(px * px + py * py + pz * pz), MIN_RANGE_M)
    widest = math.sqrt(p[0, 0] + p[1, 1] + p[2, 2])
    spread = SPREAD
    if spread * widest > MAX_SPREAD_IN_RANGES * slant:
        spread = MAX_SPREAD_IN_RANGES * slant / widest
    alpha2 = spread * spread / (SPREAD * SPREAD)
    weight = 0.5 / (spread * spread)
    m0 = m1 = m2 = 0.0
    c00 = c01 = c02 = c11 = c12 = c22 = 0.0
    for j in range(3):
        dx = spread * factor[0, j]
        dy = spread * factor[1, j]
        dz = spread * factor[2, j]
        # Deviations from the centre point, directly as angles between directions: already wrapped.
        ux, uy, uz = px + dx, py + dy, pz + dz
        vx, vy, vz = px - dx, py - dy, pz - dz
        ug2, vg2 = ux * ux + uy * uy, vx * vx + vy * vy
        ug, vg = math.sqrt(ug2), math.sqrt(vg2)
        u0 = max(math.sqrt(ug2 + uz * uz), MIN_RANGE_M) - slant
        v0 = max(math.sqrt(vg2 + vz * vz), MIN_RANGE_M) - slant
        u1 = turn(px * uy - py * ux, px * ux + py * uy)
        v1 = turn(px * vy - py * vx, px * vx + py * vy)
        u2 = turn(ground * uz - pz * ug, ground * ug + pz * uz)
        v2 = turn(ground * vz - pz * vg, ground * vg + pz * vz)
        m0 += u0 + v0
        m1 += u1 + v1
        m2 += u2 + v2
        c00 += u0 * u0 + v0 * v0
        c01 += u0 * u1 + v0 * v1
        c02 += u0 * u2 + v0 * v2
        c11 += u1 * u1 + v1 * v1
        c12 += u1 * u2 + v1 * v2
        c22 += u2 * u2 + v2 * v2
        b[j, 0] = (u0 - v0) / (2 * spread)
        b[j, 1] = (u1 - v1) / (2 * spread)
        b[j, 2] = (u2 - v2) / (2 * spread)
    m0 *= weight
    m1 *= weight
    m2 *= weight
    z_hat[0], z_hat[1], z_hat[2] = slant + m0, math.atan2(py, px) + m1, math.atan2(pz, ground) + m2
    c[0, 0] = weight * c00 - alpha2 * m0 * m0
    c[1, 1] = weight * c11 - alpha2 * m1 * m1
    c[2, 2] = weight * c22 - alpha2 * m2 * m2
    c[0, 1] = c[1, 0] = weight * c01 - alpha2 * m0 * m1
    c[0, 2] = c[2, 0] = weight * c02 - alpha2 * m0 * m2
    c[1, 2] = c[2, 1] = weight * c12 - alpha2 * m1 * m2
    for i in range(3):  # H' = L^-T B by back substitution, one component at a time
        h[i, 2] = b[2, i] / factor[2, 2]
        h[i, 1] = (b[1, i] - factor[2, 1] * h[i, 2]) / factor[1, 1]
        h[i, 0] = (b[0, i] - factor[1, 0] * h[i, 1] - factor[2, 0] * h[i, 2]) / factor[0, 0]


@part
def innovate(z: FloatArray, f: Filter) -> None:
    """e = z - z^ with the azimuth wrapped; NaN where z (3,) is missing."""
    e, z_hat = f.e, f.z_hat
    e[0] = z[0] - z_hat[0]
    e[1] = z[1] - z_hat[1]
    e[2] = z[2] - z_hat[2]
    if math.isfinite(e[1]):
        e[1] = wrap_angle(e[1])


@part
def use(weight: FloatArray, f: Filter) -> bool:
    """Take the weights (3,) for the components that have an innovation; whether any is used."""
    any_used = False
    for i in range(3):
        f.used[i] = weight[i] if math.isfinite(f.e[i]) else 0.0
        any_used = any_used or f.used[i] > 0
    return any_used


@part
def invert_used(f: Filter) -> float:
    """Inverse of the rows and columns of S whose weight is positive, zero elsewhere; returns ln det of them.

    Embedding the inverse of the sub-matrix in zeros makes one formula serve all seven missing patterns.
    """
    s, used, out = f.s, f.used, f.s_inv
    on0, on1, on2 = used[0] > 0, used[1] > 0, used[2] > 0
    a = math.sqrt(s[0, 0]) if on0 else 1.0
    b = s[1, 0] / a if on0 and on1 else 0.0
    c = s[2, 0] / a if on0 and on2 else 0.0
    d = math.sqrt(s[1, 1] - b * b) if on1 else 1.0
    e = (s[2, 1] - c * b) / d if on1 and on2 else 0.0
    g = math.sqrt(s[2, 2] - c * c - e * e) if on2 else 1.0
    # Inverse of the lower factor [[a,0,0],[b,d,0],[c,e,g]], then its Gram matrix.
    ia, id_, ig = 1 / a, 1 / d, 1 / g
    ib = -b * ia * id_
    ie = -e * id_ * ig
    ic = -(c * ia + e * ib) * ig
    out[0, 0] = ia * ia + ib * ib + ic * ic if on0 else 0.0
    out[1, 1] = id_ * id_ + ie * ie if on1 else 0.0
    out[2, 2] = ig * ig if on2 else 0.0
    out[0, 1] = out[1, 0] = ib * id_ + ic * ie if on0 and on1 else 0.0
    out[0, 2] = out[2, 0] = ic * ig if on0 and on2 else 0.0
    out[1, 2] = out[2, 1] = ie * ig if on1 and on2 else 0.0
    return 2 * math.log(a * d * g)


@part
def cross_covariance(f: Filter) -> None:
    """P_xz = P H' for an H that sees the position only."""
    _times_h(f.p, f.h, f.pxz)


@part
def _times_h(p: FloatArray, h: FloatArray, pxz: FloatArray) -> None:
    for i in range(9):
        for j in range(3):
            pxz[i, j] = p[i, 0] * h[j, 0] + p[i, 1] * h[j, 1] + p[i, 2] * h[j, 2]


@part
def update(f: Filter) -> tuple[float, float]:
    """Measurement update in place with the components whose `used` weight m is positive, at noise variance R/m.

    Takes e, used, H, C and P_xz of the record, fills S, its inverse and the gain. Returns NIS and the log-likelihood of
    the innovation (without the constant).
    """
    x, p, e, used, c, s, s_inv, pxz, gain = f.x, f.p, f.e, f.used, f.c, f.s, f.s_inv, f.pxz, f.gain
    stiff = False
    for i in range(3):
        for j in range(3):
            s[i, j] = c[i, j]
        if used[i] > 0:
            extra = f.noise[i] / used[i]
            s[i, i] += extra
            stiff = stiff or c[i, i] > 1e7 * extra
    log_det = invert_used(f)
    nis = 0.0
    for i in range(3):
        if used[i] > 0:
            for j in range(3):
                if used[j] > 0:
                    nis += e[i] * s_inv[i, j] * e[j]
    for i in range(9):
        for j in range(3):
            gain[i, j] = pxz[i, 0] * s_inv[0, j] + pxz[i, 1] * s_inv[1, j] + pxz[i, 2] * s_inv[2, j]
    for j in range(3):
        if used[j] > 0:
            for i in range(9):
                x[i] += gain[i, j] * e[j]
    for i in range(9):
        for j in range(i + 1):
            v = p[i, j] - gain[i, 0] * pxz[j, 0] - gain[i, 1] * pxz[j, 1] - gain[i, 2] * pxz[j, 2]
            p[i, j] = v
            p[j, i] = v
    if stiff:
        _restore_joseph(f)
    return nis, -0.5 * (log_det + nis)


@part
def _restore_joseph(f: Filter) -> None:
    """Turn P - K P_xz' (already in p) into the Joseph form, which keeps P >= 0 when the prior dwarfs the noise."""
    p, used, h, c, pxz, gain = f.p, f.used, f.h, f.c, f.pxz, f.gain
    residue = np.empty((9, 3))  # (I - K H) P H': zero in exact arithmetic but for the measurement noise
    _times_h(p, h, residue)
    rest = np.zeros((3, 3))  # S - H P- H': noise and bend of h
    for i in range(3):
        for j in range(3):
            rest[i, j] = c[i, j]
            for k in range(3):
                rest[i, j] -= h[i, k] * pxz[k, j]
        if used[i] > 0:
            rest[i, i] = max(rest[i, i], 0.0) + f.noise[i] / used[i]
    for i in range(9):
        for j in range(i + 1):
            v = p[i, j]
            for k in range(3):
                spread = gain[i, 0] * rest[0, k] + gain[i, 1] * rest[1, k] + gain[i, 2] * rest[2, k]
                v += (spread - residue[i, k]) * gain[j, k]
            p[i, j] = v
            p[j, i] = v
    for i in range(9):  # what is left of a variance is not known better than what was taken from it
        taken = gain[i, 0] * pxz[i, 0] + gain[i, 1] * pxz[i, 1] + gain[i, 2] * pxz[i, 2]
        p[i, i] = max(p[i, i], ROUNDING * abs(taken))
