"""The unscented Kalman filter for slant range, azimuth and elevation, with an exact shortcut.

The dynamics are linear, so the prediction is the Kalman filter's own. In the update, h sees only the position. With
a Cholesky factor ordered position-first only the first three columns move the position, so of the 2n + 1 = 19 sigma
points of the scaled transform (alpha = 1, beta = 0, kappa = 0; centre weight 0, the others 1/18, spread 3 sigma)
only 7 differ in h: the centre and three pairs. With d+-_j = h(x +- 3 L_j) - h(x), wrapped,

    z^   = h(x) + 1/18 sum d            C = 1/18 sum d d' - dbar dbar'
    P_xz = P H',  H' = L^-T B,  B_j = (d+_j - d-_j) / 6,  L L' = position block of P

which are the 19-point results to rounding. H is the statistical linearisation of h, and C - H P H' >= 0 is what the
bend of h adds to the measurement noise.

The update is done with whitened innovations. With S = C + R = L L',

    y = L^-1 e     G = L^-1 H     U = G P     x+ = x + U' y     P+ = P - U' U     NIS = y' y

which equals the form with the gain K = U' L^-1 in fewer steps, and leaves P symmetric to the last bit.

Noise that is correlated in time is part of the state where the record is `Coloured`: z = h(x) + b + v with an offset b
of each component that wanders (Gauss-Markov, see `motion.wander`). What is said of H above then holds for [H, I].
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import part, record
from ftproc.core.model.measurement import NO_RANGE_M, SMALL_TURN, small_turn, turn, wrap_angle
from ftproc.core.signatures import Layout

FloatArray = NDArray[np.float64]

SPREAD = 3.0  # sqrt(n + lambda) with n = 9, alpha = 1, kappa = 0
MAX_SPREAD_IN_RANGES = 0.3  # of the sigma points about the state
ROUNDING = 1e-15  # of a number, below which its last digits say nothing


class Filter(Protocol):
    """The record of a filter: its state, and what one measurement update computes on its way.

    x, p: state and covariance, SI units. noise, late: of this sample, see `records.Sample`. wander, fade_s: variance
    and correlation time of the offset of each component. q: coefficients of Q. z_hat: predicted measurement. e:
    innovation. used: weight of each component, zero for none. h: H on the position. c: C of the
    module's head. s: innovation covariance. root: L^-1, whose rows and columns are zero for components not used. y, g,
    u: of the head. pxz: P H', where it is asked for. factor: of the position block of P. d: by pair of sigma points,
    component and side. bend: its mean, h(x) to z_hat.
    """

    x: Annotated[FloatArray, 9]
    p: Annotated[FloatArray, 9, 9]
    noise: Annotated[FloatArray, 3]
    late: Annotated[FloatArray, 3]
    wander: Annotated[FloatArray, 3]
    fade_s: Annotated[FloatArray, 3]
    q: Annotated[FloatArray, 3, 3]
    z_hat: Annotated[FloatArray, 3]
    e: Annotated[FloatArray, 3]
    used: Annotated[FloatArray, 3]
    h: Annotated[FloatArray, 3, 3]
    c: Annotated[FloatArray, 3, 3]
    s: Annotated[FloatArray, 3, 3]
    root: Annotated[FloatArray, 3, 3]
    y: Annotated[FloatArray, 3]
    g: Annotated[FloatArray, 3, 3]
    u: Annotated[FloatArray, 3, 9]
    pxz: Annotated[FloatArray, 9, 3]
    factor: Annotated[FloatArray, 3, 3]
    d: Annotated[FloatArray, 3, 3, 2]
    bend: Annotated[FloatArray, 3]


class Coloured(Filter, Protocol):
    """The record of a filter whose state ends with the offsets of range, azimuth and elevation."""

    x: Annotated[FloatArray, 12]
    p: Annotated[FloatArray, 12, 12]
    u: Annotated[FloatArray, 3, 12]
    pxz: Annotated[FloatArray, 12, 3]


FILTER, COLOURED = record(Filter), record(Coloured)
Filters = Annotated[Any, Layout(FILTER)]
ColouredFilters = Annotated[Any, Layout(COLOURED)]
OFFSETS = 9  # where these begin


@part
def position_factor(f: Filter) -> None:
    """Lower Cholesky factor of the position block; a pivot lost to rounding is floored, never taken the root of. With
    the roots last (L D L') no division waits for one."""
    p, factor = f.p, f.factor
    floor = 1e-12 * (p[0, 0] + p[1, 1] + p[2, 2]) + 1e-300
    d0 = max(p[0, 0], floor)
    i0 = 1 / d0
    d1 = max(p[1, 1] - p[1, 0] * p[1, 0] * i0, floor)
    i1 = 1 / d1
    rest = p[2, 1] - p[2, 0] * p[1, 0] * i0
    d2 = max(p[2, 2] - p[2, 0] * p[2, 0] * i0 - rest * rest * i1, floor)
    r0, r1 = math.sqrt(d0), math.sqrt(d1)
    factor[0, 0], factor[1, 1], factor[2, 2] = r0, r1, math.sqrt(d2)
    factor[1, 0], factor[2, 0] = p[1, 0] * i0 * r0, p[2, 0] * i0 * r0
    factor[2, 1] = rest * i1 * r1
    factor[0, 1] = factor[0, 2] = factor[1, 2] = 0.0


@part
def linearise(f: Filter) -> None:
    """The unscented transform of h at (x, P): fills z_hat, H and C.

    When P is so wide (a long coast) that the points would straddle the station, alpha is made smaller, which draws
    the points together; at alpha = 1 the formulas are those of the module's head.
    """
    x, p, factor, d, bend, z_hat, h, c = f.x, f.p, f.factor, f.d, f.bend, f.z_hat, f.h, f.c
    position_factor(f)
    ground = math.sqrt(x[0] * x[0] + x[1] * x[1])
    slant = max(math.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]), NO_RANGE_M)
    widest = math.sqrt(p[0, 0] + p[1, 1] + p[2, 2])
    spread = SPREAD
    if spread * widest > MAX_SPREAD_IN_RANGES * slant:
        spread = MAX_SPREAD_IN_RANGES * slant / widest
    _deviations(f, ground, slant, spread)
    if not spread * widest < SMALL_TURN * ground:
        _wide_deviations(f, ground, spread)
    alpha2 = spread * spread / (SPREAD * SPREAD)
    weight = 0.5 / (spread * spread)
    for i in range(3):
        bend[i] = weight * ((d[0, i, 0] + d[0, i, 1]) + (d[1, i, 0] + d[1, i, 1]) + (d[2, i, 0] + d[2, i, 1]))
    z_hat[0] = slant + bend[0]
    z_hat[1] = math.atan2(x[1], x[0]) + bend[1]
    z_hat[2] = math.atan2(x[2], ground) + bend[2]
    for i in range(3):
        for j in range(i + 1):
            v = 0.0
            for k in range(3):
                v += d[k, i, 0] * d[k, j, 0] + d[k, i, 1] * d[k, j, 1]
            v = weight * v - alpha2 * bend[i] * bend[j]
            c[i, j] = v
            c[j, i] = v
    half = 0.5 / spread
    i0, i1, i2 = 1 / factor[0, 0], 1 / factor[1, 1], 1 / factor[2, 2]
    for i in range(3):  # H' = L^-T B by back substitution, one component at a time
        h[i, 2] = half * (d[2, i, 0] - d[2, i, 1]) * i2
        h[i, 1] = (half * (d[1, i, 0] - d[1, i, 1]) - factor[2, 1] * h[i, 2]) * i1
        h[i, 0] = (half * (d[0, i, 0] - d[0, i, 1]) - factor[1, 0] * h[i, 1] - factor[2, 0] * h[i, 2]) * i0


@part
def _deviations(f: Filter, ground: float, slant: float, spread: float) -> None:
    """What the sigma points on both sides of x differ in h, if the directions to them differ by small angles.

    The columns of the factor begin with zeros: the second pair moves along y and z, the third along z alone.
    """
    x, factor, d = f.x, f.factor, f.d
    px, py, pz = x[0], x[1], x[2]
    for j in range(3):
        for side in range(2):
            by = spread if side == 0 else -spread
            ux = px + by * factor[0, j] if j < 1 else px
            uy = py + by * factor[1, j] if j < 2 else py
            uz = pz + by * factor[2, j]
            square = ux * ux + uy * uy
            along = math.sqrt(square) if j < 2 else ground
            d[j, 0, side] = max(math.sqrt(square + uz * uz), NO_RANGE_M) - slant
            d[j, 1, side] = small_turn((px * uy - py * ux) / (px * ux + py * uy)) if j < 2 else 0.0
            d[j, 2, side] = small_turn((ground * uz - pz * along) / (ground * along + pz * uz))


@part
def _wide_deviations(f: Filter, ground: float, spread: float) -> None:
    """The same of the angles where they may be large: as angles between directions, already wrapped."""
    x, factor, d = f.x, f.factor, f.d
    px, py, pz = x[0], x[1], x[2]
    for j in range(3):
        for side in range(2):
            by = spread if side == 0 else -spread
            ux, uy, uz = px + by * factor[0, j], py + by * factor[1, j], pz + by * factor[2, j]
            along = math.sqrt(ux * ux + uy * uy)
            d[j, 1, side] = turn(px * uy - py * ux, px * ux + py * uy)
            d[j, 2, side] = turn(ground * uz - pz * along, ground * along + pz * uz)


@part
def expect(f: Filter) -> None:
    """The unscented transform with the offsets, if the state has such: z^ = h + b, and C with their covariances."""
    linearise(f)
    p, h, c, z_hat = f.p, f.h, f.c, f.z_hat
    if len(f.x) > OFFSETS:
        for i in range(3):
            z_hat[i] += f.x[OFFSETS + i]
            for j in range(3):
                v = p[OFFSETS + i, OFFSETS + j]
                for k in range(3):
                    v += h[i, k] * p[k, OFFSETS + j] + h[j, k] * p[k, OFFSETS + i]
                c[i, j] += v


@part
def innovate(sample: Any, f: Filter) -> None:
    """Take the reading of a sample and its noise: e = z - z^ with the azimuth wrapped; NaN where z is missing."""
    e, z, z_hat = f.e, sample.measurement, f.z_hat
    for i in range(3):
        f.noise[i] = sample.noise[i]
        f.late[i] = sample.late[i]
        e[i] = z[i] - z_hat[i]
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
def whiten(f: Filter) -> tuple[float, float]:
    """Fill L^-1, y, G and U from S, e, H and P for the components whose weight is positive; NIS and ln det S of these.

    Zeros in the rows and columns of L^-1 make one formula serve all seven missing patterns.
    """
    s, used, e, h, p, root, y, g, u = f.s, f.used, f.e, f.h, f.p, f.root, f.y, f.g, f.u
    on0, on1, on2 = used[0] > 0, used[1] > 0, used[2] > 0
    # S = M D M' with ones on the diagonal of M; the roots come last, so that no division waits for one.
    d0 = s[0, 0] if on0 else 1.0
    i0 = 1 / d0
    m10, m20 = (s[1, 0] * i0 if on0 and on1 else 0.0), (s[2, 0] * i0 if on0 and on2 else 0.0)
    d1 = s[1, 1] - s[1, 0] * m10 if on1 else 1.0
    i1 = 1 / d1
    m21 = (s[2, 1] - s[2, 0] * m10) * i1 if on1 and on2 else 0.0
    d2 = s[2, 2] - s[2, 0] * m20 - m21 * m21 * d1 if on2 else 1.0
    r00 = math.sqrt(i0) if on0 else 0.0
    r11 = math.sqrt(i1) if on1 else 0.0
    r22 = math.sqrt(1 / d2) if on2 else 0.0
    r10 = -m10 * r11
    r20, r21 = (m10 * m21 - m20) * r22, -m21 * r22
    root[0, 0], root[1, 0], root[1, 1], root[2, 0], root[2, 1], root[2, 2] = r00, r10, r11, r20, r21, r22
    root[0, 1] = root[0, 2] = root[1, 2] = 0.0
    e0, e1, e2 = (e[0] if on0 else 0.0), (e[1] if on1 else 0.0), (e[2] if on2 else 0.0)
    y[0], y[1], y[2] = r00 * e0, r10 * e0 + r11 * e1, r20 * e0 + r21 * e1 + r22 * e2
    for i in range(3):
        g[0, i] = r00 * h[0, i]
        g[1, i] = r10 * h[0, i] + r11 * h[1, i]
        g[2, i] = r20 * h[0, i] + r21 * h[1, i] + r22 * h[2, i]
    for i in range(3):
        for j in range(len(f.x)):
            u[i, j] = g[i, 0] * p[0, j] + g[i, 1] * p[1, j] + g[i, 2] * p[2, j]
            for k in range(OFFSETS, len(f.x)):
                u[i, j] += root[i, k - OFFSETS] * p[k, j]
    return y[0] * y[0] + y[1] * y[1] + y[2] * y[2], math.log(d0 * d1 * d2)


@part
def cross_covariance(p: FloatArray, h: FloatArray, pxz: FloatArray) -> None:
    """P_xz = P H' for an H that sees the position, and the offsets if there are such."""
    for i in range(len(p)):
        for j in range(3):
            pxz[i, j] = p[i, 0] * h[j, 0] + p[i, 1] * h[j, 1] + p[i, 2] * h[j, 2]
            if len(p) > OFFSETS:
                pxz[i, j] += p[i, OFFSETS + j]


@part
def shared_noise(f: Filter, i: int, j: int) -> float:
    """What a late time stamp adds to the covariance of the noise of two components."""
    if f.late[i] == 0.0 or not f.used[i] * f.used[j] > 0:
        return 0.0
    return float(f.late[i] * f.late[j] / math.sqrt(f.used[i] * f.used[j]))


@part
def update(f: Filter) -> tuple[float, float]:
    """Measurement update in place with the components whose `used` weight m is positive, at noise variance R/m; without
    any, nothing changes.

    Takes e, used, H and C of the record. Returns NIS and the log-likelihood of the innovation (without the constant).
    """
    x, p, used, c, s, y, u = f.x, f.p, f.used, f.c, f.s, f.y, f.u
    stiff = False
    for i in range(3):
        for j in range(3):
            s[i, j] = c[i, j] + shared_noise(f, i, j)
        if used[i] > 0:
            extra = f.noise[i] / used[i]
            s[i, i] += extra
            stiff = stiff or c[i, i] > 1e7 * extra
    nis, log_det = whiten(f)
    if stiff:
        cross_covariance(f.p, f.h, f.pxz)
    for i in range(len(f.x)):
        x[i] += u[0, i] * y[0] + u[1, i] * y[1] + u[2, i] * y[2]
    for i in range(len(f.x)):
        for j in range(len(f.x)):
            p[i, j] = p[i, j] - u[0, i] * u[0, j] - u[1, i] * u[1, j] - u[2, i] * u[2, j]
    if stiff:
        _restore_joseph(f)
    return nis, -0.5 * (log_det + nis)


@part
def gain_of(f: Filter, gain: FloatArray) -> None:
    """K = U' L^-1, one row for each number of the state."""
    for i in range(len(f.x)):
        for j in range(3):
            gain[i, j] = f.u[0, i] * f.root[0, j] + f.u[1, i] * f.root[1, j] + f.u[2, i] * f.root[2, j]


@part
def _restore_joseph(f: Filter) -> None:
    """Turn P - U'U (already in p) into the Joseph form, which keeps P >= 0 when the prior dwarfs the noise; P_xz is
    that of the prior."""
    p, used, h, c, pxz = f.p, f.used, f.h, f.c, f.pxz
    gain = np.empty((len(f.x), 3))
    gain_of(f, gain)
    residue = np.empty((len(f.x), 3))  # (I - K H) P H': zero in exact arithmetic but for the measurement noise
    cross_covariance(p, h, residue)
    rest = np.zeros((3, 3))  # S - H P- H': noise and bend of h
    for i in range(3):
        for j in range(3):
            rest[i, j] = c[i, j] + shared_noise(f, i, j)
            for k in range(3):
                rest[i, j] -= h[i, k] * pxz[k, j]
            if len(f.x) > OFFSETS:
                rest[i, j] -= pxz[OFFSETS + i, j]
        if used[i] > 0:
            rest[i, i] = max(rest[i, i], 0.0) + f.noise[i] / used[i]
    for i in range(len(f.x)):
        for j in range(i + 1):
            v = p[i, j]
            for k in range(3):
                spread = gain[i, 0] * rest[0, k] + gain[i, 1] * rest[1, k] + gain[i, 2] * rest[2, k]
                v += (spread - residue[i, k]) * gain[j, k]
            p[i, j] = v
            p[j, i] = v
    for i in range(len(f.x)):  # what is left of a variance is not known better than what was taken from it
        taken = gain[i, 0] * pxz[i, 0] + gain[i, 1] * pxz[i, 1] + gain[i, 2] * pxz[i, 2]
        p[i, i] = max(p[i, i], ROUNDING * abs(taken))
