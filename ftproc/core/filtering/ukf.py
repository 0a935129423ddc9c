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
of each component (Gauss-Markov, see `motion.decorrelate`). What is said of H above then holds for [H, I].
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import part
from ftproc.core.filtering.filters import OFFSETS, Filter
from ftproc.core.filtering.records import ABOUT
from ftproc.core.filtering.unscented import linearise
from ftproc.core.model import jacobian
from ftproc.core.model.measurement import wrap_angle

FloatArray = NDArray[np.float64]

ROUNDING = 1e-15  # of a number, below which its last digits say nothing


@part
def expect(f: Filter) -> None:
    """The unscented transform with the offsets, if the state has such: z^ = h + b, and C with their covariances."""
    linearise(f)
    _add_offsets(f)


@part
def _add_offsets(f: Filter) -> None:
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
def expect_at(sample: Any, f: Filter) -> None:
    """`expect` of the station that took a sample, if need be in its own axes and from its own place. H is that of the
    state's frame. The state has no offsets if a station is not at the origin."""
    if sample.placed == 0.0:
        expect(f)
        return
    if sample.placed == ABOUT:
        jacobian.linearise_about(f, sample.place)
        _add_offsets(f)
        return
    x, p, h, a, o = f.x, f.p, f.h, sample.axes, sample.place
    x0, x1, x2 = x[0], x[1], x[2]
    p00, p10, p11, p20, p21, p22 = p[0, 0], p[1, 0], p[1, 1], p[2, 0], p[2, 1], p[2, 2]
    d0, d1, d2 = x0 - o[0], x1 - o[1], x2 - o[2]
    for i in range(3):
        x[i] = a[i, 0] * d0 + a[i, 1] * d1 + a[i, 2] * d2
        b0 = a[i, 0] * p00 + a[i, 1] * p10 + a[i, 2] * p20
        b1 = a[i, 0] * p10 + a[i, 1] * p11 + a[i, 2] * p21
        b2 = a[i, 0] * p20 + a[i, 1] * p21 + a[i, 2] * p22
        for j in range(i + 1):
            p[i, j] = b0 * a[j, 0] + b1 * a[j, 1] + b2 * a[j, 2]
    expect(f)
    x[0], x[1], x[2] = x0, x1, x2
    p[0, 0], p[1, 0], p[1, 1], p[2, 0], p[2, 1], p[2, 2] = p00, p10, p11, p20, p21, p22
    for i in range(3):
        h0, h1, h2 = h[i, 0], h[i, 1], h[i, 2]
        for j in range(3):
            h[i, j] = h0 * a[0, j] + h1 * a[1, j] + h2 * a[2, j]


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
            pxz[i, j] = shared(p, h, i, j)


@part
def shared(p: FloatArray, h: FloatArray, i: int, j: int) -> float:
    """The covariance of a number of the state with a component: an element of P H'."""
    v = p[i, 0] * h[j, 0] + p[i, 1] * h[j, 1] + p[i, 2] * h[j, 2]
    if len(p) > OFFSETS:
        v += p[i, OFFSETS + j]
    return float(v)


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
def gain_of(f: Filter) -> None:
    """K = U' L^-1, one row for each number of the state."""
    for i in range(len(f.x)):
        for j in range(3):
            f.gain[i, j] = f.u[0, i] * f.root[0, j] + f.u[1, i] * f.root[1, j] + f.u[2, i] * f.root[2, j]


@part
def _restore_joseph(f: Filter) -> None:
    """Turn P - U'U (already in p) into the Joseph form, which keeps P >= 0 when the prior dwarfs the noise; P_xz is
    that of the prior."""
    p, used, h, c, pxz, gain, rest = f.p, f.used, f.h, f.c, f.pxz, f.gain, f.rest
    gain_of(f)
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
        # (I - K H) P H' is zero in exact arithmetic but for the measurement noise; here its row is still unchanged.
        w0, w1, w2 = -shared(p, h, i, 0), -shared(p, h, i, 1), -shared(p, h, i, 2)
        for k in range(3):
            w0 += gain[i, k] * rest[k, 0]
            w1 += gain[i, k] * rest[k, 1]
            w2 += gain[i, k] * rest[k, 2]
        for j in range(i + 1):
            v = p[i, j] + w0 * gain[j, 0] + w1 * gain[j, 1] + w2 * gain[j, 2]
            p[i, j] = v
            p[j, i] = v
    for i in range(len(f.x)):  # what is left of a variance is not known better than what was taken from it
        taken = gain[i, 0] * pxz[i, 0] + gain[i, 1] * pxz[i, 1] + gain[i, 2] * pxz[i, 2]
        p[i, i] = max(p[i, i], ROUNDING * abs(taken))
