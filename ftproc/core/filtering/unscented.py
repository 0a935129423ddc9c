"""The unscented transform of h at a filter's state: the mean of what is measured, its linearisation and its bend, with
the seven points of which `ukf` says why they are enough."""

from __future__ import annotations

import math

from ftproc.core.compiled import part
from ftproc.core.filtering.filters import Filter
from ftproc.core.model.measurement import NO_RANGE_M, SMALL_TURN, small_turn, turn

SPREAD = 3.0  # sqrt(n + lambda) with n = 9, alpha = 1, kappa = 0
MAX_SPREAD_IN_RANGES = 0.3  # of the sigma points about the state


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
    the points together; at alpha = 1 the formulas are those of `ukf`.
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
