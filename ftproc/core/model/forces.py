"""The forces on what flies: how the acceleration turns, grows and falls with the motion, beside its white jerk.

With g(p) the earth's gravity, W its rotation, D = a - g + 2 W x v the specific force, and u = v - wind,

    a' = G v - 2 W x a - W x (W x v) + w x D + b (2 u.a / s^2 - climb / H) D - c g (u.a / s^3) u + white jerk
    w = u x a / s^2      s^2 = u^2 + v0^2      G = dg/dp      b = max(-D.u / (|D| s), 0)

The specific force of an aircraft turns with its velocity through the air (w x D). What brakes also grows with the
square of the speed and falls with the density of the air; b is its share of the force, so that a motor, the wings of an
aircraft and the bomb that it drops follow one law. A speed settles where thrust meets drag, within about the time s / g
in which gravity would change it: the acceleration along the path fades (c), in steps longer than that by a half in each
kick. v0 lets the turn fade in hover and at rest. A model of motion is a choice of these. The earth is round and has the
gravity of its surface; where it turns, see `gravity`.

Over an interval T this is half a kick, the motion of constant acceleration, and half a kick (Strang splitting, of
second order in T): a <- a + T/2 (f + J (x - x0)), linearised about the states x0 of a course on both sides of the
interval, or about the estimate itself, b being held. A kick changes only the three rows of the acceleration.

The jerk has its densities along the path, across it, and upward: with t = v / s and u = z - z.t t, so that a path which
is steep, or has no direction, needs no special case, W = n I + (m - n) tt' + (o - n) uu'.
"""

from __future__ import annotations

import math
from typing import Annotated, Protocol

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import part
from ftproc.core.model.gravity import MASS_M3PS2, flatten, rotate
from ftproc.core.model.motion import EARTH_M, Adjoint, Motion, noise_coefficients, predict

FloatArray = NDArray[np.float64]

GRAVITY = 9.80665  # m/s2
AT_REST_MPS = 3.0  # v0
# H of the standard atmosphere (ISO 2533): at sea level, what it falls by per metre, and in the stratosphere
SCALE_HEIGHT_M, LAPSE, LEAST_SCALE_M = 10_417.0, 0.235, 6_342.0
LEAST_FORCE = 1e-300  # m2/s4: of none, nothing is known


class Forced(Protocol):
    """The part of a filter's record that forces use. slope: of the force, by velocity and acceleration. kick: what is
    added to the acceleration by velocity and acceleration; push: in any case. along, upward: t and u, the axes of the
    jerk; cross: its densities between x and y, x and z, y and z."""

    x: Annotated[FloatArray, 9]
    p: Annotated[FloatArray, 9, 9]
    jerk: Annotated[FloatArray, 3]
    q: Annotated[FloatArray, 3, 3]
    slope: Annotated[FloatArray, 3, 6]
    kick: Annotated[FloatArray, 3, 6]
    push: Annotated[FloatArray, 3]
    along: Annotated[FloatArray, 3]
    upward: Annotated[FloatArray, 3]
    cross: Annotated[FloatArray, 3]


class Scored(Adjoint, Protocol):
    """The same of the backward recursion. q: (3, 3) memory for the coefficients of Q."""

    q: FloatArray


@part
def linearise(f: Forced, x: FloatArray, by: Motion, h: float, variance: float) -> None:
    """Fill kick and push of a kick of h seconds at a state x (9,), whose acceleration has this variance."""
    w0, w1, w2 = 2 * by.earth[0, 0], 2 * by.earth[0, 1], 2 * by.earth[0, 2]
    spins = w0 != 0 or w1 != 0 or w2 != 0
    v0, v1, v2, a0, a1, a2 = x[3], x[4], x[5], x[6], x[7], x[8]
    r0, r1, r2 = x[0] - by.earth[1, 0], x[1] - by.earth[1, 1], x[2] - by.earth[1, 2]
    ir2 = 1 / (r0 * r0 + r1 * r1 + r2 * r2)
    ir = math.sqrt(ir2)
    u0, u1, u2 = v0 - by.wind[0], v1 - by.wind[1], v2 - by.wind[2]
    pull = (MASS_M3PS2 if spins else GRAVITY * EARTH_M * EARTH_M) * ir2 * ir  # g = -pull r
    rv = r0 * v0 + r1 * v1 + r2 * v2
    d0 = a0 + pull * r0 + w1 * v2 - w2 * v1
    d1 = a1 + pull * r1 + w2 * v0 - w0 * v2
    d2 = a2 + pull * r2 + w0 * v1 - w1 * v0
    i2 = 1 / (u0 * u0 + u1 * u1 + u2 * u2 + AT_REST_MPS * AT_REST_MPS)
    dd = max(d0 * d0 + d1 * d1 + d2 * d2, LEAST_FORCE)
    ud, ad, ua = u0 * d0 + u1 * d1 + u2 * d2, a0 * d0 + a1 * d1 + a2 * d2, u0 * a0 + u1 * a1 + u2 * a2
    known = dd / (dd + variance)
    braked = max(-ud * math.sqrt(i2 / dd), 0.0)
    turns, pressed = known * by.turns * i2, known * by.pressed * braked
    scale = max(SCALE_HEIGHT_M - LAPSE * (1 / ir - EARTH_M), LEAST_SCALE_M)
    swell = pressed * (2 * ua * i2 - rv * ir / scale)
    fades = by.fades * GRAVITY * math.sqrt(i2)
    fade = fades / max(fades * h, 1.0) * i2
    v, u, a, d, r = (v0, v1, v2), (u0, u1, u2), (a0, a1, a2), (d0, d1, d2), (r0, r1, r2)
    s, b = f.slope, f.kick
    for i in range(3):
        turned = turns * (a[i] * ud - u[i] * ad)
        f.push[i] = turned + swell * d[i] - pull * (v[i] - 3 * rv * ir2 * r[i]) - fade * ua * u[i]
        for j in range(3):
            by_force = turns * (a[i] * u[j] - u[i] * a[j])
            grows = pressed * d[i]
            s[i, 3 + j] = by_force - turns * u[i] * d[j] + grows * 2 * i2 * u[j]
            s[i, j] = turns * a[i] * d[j] - 2 * turned * i2 * u[j] + 3 * pull * ir2 * r[i] * r[j]
            s[i, j] += grows * (2 * i2 * a[j] - 4 * ua * i2 * i2 * u[j] - ir * r[j] / scale)
            s[i, j] -= fade * u[i] * (a[j] - 3 * ua * i2 * u[j])
            s[i, 3 + j] -= fade * u[i] * u[j]
        s[i, 3 + i] += turns * ud + swell
        s[i, i] -= turns * ad + pull + fade * ua
    if spins:
        rotate(f, x, w0, w1, w2, turns, swell)
        flatten(f, x, r, by)
    for i in range(3):  # h (1 + h/2 da) (f - J x) and h (1 + h/2 da) J, to second order
        for j in range(3):
            f.push[i] -= s[i, j] * v[j] + s[i, 3 + j] * a[j]
    p0, p1, p2 = f.push[0], f.push[1], f.push[2]
    half = 0.5 * h
    for i in range(3):
        e0, e1, e2 = half * s[i, 3], half * s[i, 4], half * s[i, 5]
        f.push[i] = h * (f.push[i] + (e0 * p0 + e1 * p1 + e2 * p2))
        for j in range(6):
            b[i, j] = h * (s[i, j] + (e0 * s[0, j] + e1 * s[1, j] + e2 * s[2, j]))


@part
def orient(f: Forced, x: FloatArray, y: FloatArray) -> None:
    """The axes of the jerk between two states (9,): t, shorter than one where the target is nearly at rest, and u,
    shorter where the path is steep."""
    v0, v1, v2 = 0.5 * (x[3] + y[3]), 0.5 * (x[4] + y[4]), 0.5 * (x[5] + y[5])
    i2 = 1 / (v0 * v0 + v1 * v1 + v2 * v2 + AT_REST_MPS * AT_REST_MPS)
    i, k = math.sqrt(i2), v2 * i2
    t, u = f.along, f.upward
    t[0], t[1], t[2], u[0], u[1], u[2] = i * v0, i * v1, i * v2, -k * v0, -k * v1, 1 - k * v2


@part
def spread(f: Forced) -> None:
    """The densities of the jerk along x, y, z and between them, from those along the path, across it and
    upward."""
    t, u, d, c = f.along, f.upward, f.jerk, f.cross
    across, m, o = d[1], d[0] - d[1], d[2] - d[1]
    for j in range(3):
        d[j] = across + m * t[j] * t[j] + o * u[j] * u[j]
    c[0] = m * t[0] * t[1] + o * u[0] * u[1]
    c[1] = m * t[0] * t[2] + o * u[0] * u[2]
    c[2] = m * t[1] * t[2] + o * u[1] * u[2]


@part
def couple(f: Forced) -> None:
    """Add the process noise between different axes to P."""
    p, c, q = f.p, f.cross, f.q
    for i in range(3):
        for j in range(i + 1, 3):
            w = c[i + j - 1]
            for a in range(3):
                for b in range(3):
                    p[3 * a + i, 3 * b + j] += w * q[a, b]
                    p[3 * b + j, 3 * a + i] = p[3 * a + i, 3 * b + j]


@part
def kick(f: Forced) -> None:
    """x and P after a kick, in place."""
    x, b = f.x, f.kick
    x3, x4, x5, x6, x7, x8 = x[3], x[4], x[5], x[6], x[7], x[8]
    for i in range(3):
        near = b[i, 0] * x3 + b[i, 1] * x4 + b[i, 2] * x5
        x[6 + i] += f.push[i] + (near + b[i, 3] * x6 + b[i, 4] * x7 + b[i, 5] * x8)
    kick_covariance(f.p, b, f.slope)


@part
def kick_covariance(p: FloatArray, b: FloatArray, t: FloatArray) -> None:
    """P after a kick that adds b (3, 6) to the rows of the acceleration, in place. t: (3, 6) memory."""
    for j in range(len(p)):
        for i in range(3):
            near = b[i, 0] * p[3, j] + b[i, 1] * p[4, j] + b[i, 2] * p[5, j]
            v = p[6 + i, j] + (near + b[i, 3] * p[6, j] + b[i, 4] * p[7, j] + b[i, 5] * p[8, j])
            if 3 <= j < 9:
                t[i, j - 3] = v
            else:
                p[j, 6 + i] = v
        if not 3 <= j < 9:
            for i in range(3):
                p[6 + i, j] = p[j, 6 + i]
    for i in range(3):
        for j in range(3):
            p[6 + i, 3 + j] = p[3 + j, 6 + i] = t[i, j]
        for j in range(i + 1):
            near = t[i, 0] * b[j, 0] + t[i, 1] * b[j, 1] + t[i, 2] * b[j, 2]
            v = t[i, 3 + j] + (near + t[i, 3] * b[j, 3] + t[i, 4] * b[j, 4] + t[i, 5] * b[j, 5])
            p[6 + i, 6 + j] = p[6 + j, 6 + i] = v


@part
def travel(f: Forced, by: Motion, before: int, after: int, interval: float) -> None:
    """x and P after an interval from sample `before` of the course to `after`, in place; the densities of the jerk that
    hold are in `jerk`."""
    if len(by.course) > 0:
        linearise(f, by.course[before], by, 0.5 * interval, 0.0)
        orient(f, by.course[before], by.course[after])
    else:
        linearise(f, f.x, by, 0.5 * interval, f.p[6, 6] + f.p[7, 7] + f.p[8, 8])
        orient(f, f.x, f.x)
    spread(f)
    kick(f)
    predict(f, interval)
    couple(f)
    if len(by.course) > 0:
        linearise(f, by.course[after], by, 0.5 * interval, 0.0)
    else:
        linearise(f, f.x, by, 0.5 * interval, f.p[6, 6] + f.p[7, 7] + f.p[8, 8])
    kick(f)


@part
def kick_back(b: Adjoint, f: Forced, by: Motion, k: int, interval: float) -> None:
    """r <- K' r and N <- K' N K in place, of the kick at sample k of the course on a side of an interval: the backward
    counterpart of `kick`. f: memory."""
    linearise(f, by.course[k], by, 0.5 * interval, 0.0)
    r, n, m = b.r, b.n, f.kick
    r0, r1, r2 = r[6], r[7], r[8]
    for i in range(6):
        r[3 + i] += m[0, i] * r0 + m[1, i] * r1 + m[2, i] * r2
    for j in range(3, 9):
        n0, n1, n2 = n[6, j], n[7, j], n[8, j]
        for i in range(6):
            n[3 + i, j] += m[0, i] * n0 + m[1, i] * n1 + m[2, i] * n2
    for i in range(len(r)):
        n0, n1, n2 = n[i, 6], n[i, 7], n[i, 8]
        for j in range(3, i + 1 if 3 <= i < 9 else 9):
            n[i, j] += m[0, j - 3] * n0 + m[1, j - 3] * n1 + m[2, j - 3] * n2
            n[j, i] = n[i, j]


@part
def unkick_covariance(f: Forced, p: FloatArray) -> None:
    """P before the kick of the filter after which it is p, in place. The kick is turned into its inverse."""
    b, m = f.kick, f.slope
    a00, a01, a02 = 1 + b[0, 3], b[0, 4], b[0, 5]
    a10, a11, a12 = b[1, 3], 1 + b[1, 4], b[1, 5]
    a20, a21, a22 = b[2, 3], b[2, 4], 1 + b[2, 5]
    c0, c1, c2 = a11 * a22 - a12 * a21, a12 * a20 - a10 * a22, a10 * a21 - a11 * a20
    i = 1 / (a00 * c0 + a01 * c1 + a02 * c2)
    m[0, 0], m[1, 0], m[2, 0] = i * c0, i * c1, i * c2
    m[0, 1], m[1, 1], m[2, 1] = i * (a02 * a21 - a01 * a22), i * (a00 * a22 - a02 * a20), i * (a01 * a20 - a00 * a21)
    m[0, 2], m[1, 2], m[2, 2] = i * (a01 * a12 - a02 * a11), i * (a02 * a10 - a00 * a12), i * (a00 * a11 - a01 * a10)
    for j in range(3):
        b0, b1, b2 = b[0, j], b[1, j], b[2, j]
        for k in range(3):
            b[k, j] = -(m[k, 0] * b0 + m[k, 1] * b1 + m[k, 2] * b2)
            b[k, 3 + j] = m[k, j] - (1.0 if k == j else 0.0)
    kick_covariance(p, b, m)


@part
def score_jerk(back: Scored, f: Forced, interval: float, sums: FloatArray, piece: int) -> None:
    """`backward.score_jerk` of the densities along the path, across it and upward, from the axes in f."""
    r, n, c = back.r, back.n, back.q
    noise_coefficients(interval, c)
    for i in range(3):
        for j in range(i, 3):
            of_r = of_n = along_r = along_n = up_r = up_n = 0.0
            for a in range(3):
                of_r += r[3 * i + a] * r[3 * j + a]
                of_n += n[3 * i + a, 3 * j + a]
                for b in range(3):
                    product, each = r[3 * i + a] * r[3 * j + b], n[3 * i + a, 3 * j + b]
                    t, u = f.along[a] * f.along[b], f.upward[a] * f.upward[b]
                    along_r, along_n = along_r + t * product, along_n + t * each
                    up_r, up_n = up_r + u * product, up_n + u * each
            share = c[i, j] if i < j else 0.5 * c[i, i]
            sums[piece, 0, 0] += share * along_r
            sums[piece, 1, 0] += share * along_n
            sums[piece, 0, 1] += share * (of_r - along_r - up_r)
            sums[piece, 1, 1] += share * (of_n - along_n - up_n)
            sums[piece, 0, 2] += share * up_r
            sums[piece, 1, 2] += share * up_n


@part
def kick_columns(s: FloatArray, f: Forced, by: Motion, k: int, interval: float) -> None:
    """The columns (9, m) of a matrix after the kick at sample k of the course on a side of an interval, in place. f:
    memory."""
    linearise(f, by.course[k], by, 0.5 * interval, 0.0)
    for c in range(s.shape[1]):
        s3, s4, s5, s6, s7, s8 = s[3, c], s[4, c], s[5, c], s[6, c], s[7, c], s[8, c]
        for i in range(3):
            b = f.kick[i]
            s[6 + i, c] += (b[0] * s3 + b[1] * s4 + b[2] * s5) + (b[3] * s6 + b[4] * s7 + b[5] * s8)


@part
def kick_columns_back(s: FloatArray, f: Forced, by: Motion, k: int, interval: float) -> None:
    """The same of the backward recursion."""
    linearise(f, by.course[k], by, 0.5 * interval, 0.0)
    for c in range(s.shape[1]):
        s6, s7, s8 = s[6, c], s[7, c], s[8, c]
        for i in range(6):
            s[3 + i, c] += f.kick[0, i] * s6 + f.kick[1, i] * s7 + f.kick[2, i] * s8
