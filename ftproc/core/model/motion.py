"""Constant acceleration driven by white jerk, for any sample interval; the dynamics are linear and exact.

Per axis and interval T (Zuo et al. 2021 eq. 1, with the continuous-time noise in place of the piecewise one):

    Phi = [[1, T, T^2/2], [0, 1, T], [0, 0, 1]]
    Q   = q [[T^5/20, T^4/8, T^3/6], [T^4/8, T^3/3, T^2/2], [T^3/6, T^2/2, T]]

q is the spectral density of white jerk, m^2/s^5: it means the same at any rate, and Q(T1 + T2) composes exactly
from Q(T1) and Q(T2), so gaps and jittered times need no special case. Each axis has a q of its own (aircraft turn
harder than they pitch), held piecewise constant between knots `knot_s` apart.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import part
from ftproc.core.signatures import Cube, Matrix, Vector

FloatArray = NDArray[np.float64]

FOREVER_S = 1e300  # correlation time of an offset that stays as it is
EARTH_M = 6371008.8  # radius of a round earth
STILL = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -EARTH_M]])  # an earth below a station of which no more is known


class Moving(Protocol):
    """x (9,) and P (9, 9) of a record, the density of the jerk along each axis (3,), and memory for Q's coefficients:
    q (3, 3)."""

    x: FloatArray
    p: FloatArray
    jerk: FloatArray
    q: FloatArray


class Adjoint(Protocol):
    """r (9,) and N (9, 9) of the backward recursion; with the offsets, (12,) and (12, 12)."""

    r: FloatArray
    n: FloatArray


def isotropic(jerk_psd: float) -> FloatArray:
    """(1, 3) jerk of the same density (m^2/s^5) along every axis, for the whole log."""
    return np.full((1, 3), float(jerk_psd))


class Motion(NamedTuple):
    """A model of motion, whose formulas are in `forces`. acts: whether there are forces at all; without, the densities
    of the jerk are along x, y and z, else along the path, across it, and upward. turns, pressed: shares of the force
    that turns with the velocity, and that grows with the pressure of the air. fades: share of the rate, gravity by
    speed, at which the acceleration along the path may fade. earth: its rotation, rad/s, zero where it is not known,
    and its centre, m. wind: that of the air through which the target flies, m/s. course: (n, 9) the states of the
    samples about which it is linearised; without rows, about the estimate itself."""

    acts: bool = False
    turns: float = 0.0
    pressed: float = 0.0
    fades: float = 0.0
    earth: Matrix = STILL
    wind: Vector = np.zeros(3)
    course: Matrix = np.zeros((0, 9))

    def about(self, course: FloatArray) -> Motion:
        """The same linearised about other states (n, 9)."""
        return self._replace(course=np.ascontiguousarray(course)) if self.acts else self

    @property
    def causal(self) -> Motion:
        """The same linearised about the estimate itself."""
        return self.about(np.zeros((0, 9)))


WHITE_JERK = Motion()


class Profile(NamedTuple):
    """The process noise of a log: jerk (m, 3) densities along x, y and z, each row holding for knot_s
    seconds from first_s on, but the last rows, one for each time of jolt_s (j,), only up to the sample of that time;
    the motion that it drives; and the scalars (kinds, n, ...) that its samples have beside their readings, of no kind
    if they have none, see `filtering.beside`."""

    jerk: Matrix
    knot_s: float
    first_s: float
    motion: Motion = WHITE_JERK
    beside: Cube = np.zeros((0, 0, 32))
    jolt_s: Vector = np.zeros(0)


class Jolts(NamedTuple):
    """Abrupt changes of the acceleration: time_s (j,), in order, before which a sample is the first one after it, and
    the variance (j,) m^2/s^4 of each axis. What is not known of its time is shared out among several."""

    time_s: FloatArray
    variance: FloatArray

    def __add__(self, other: Jolts) -> Jolts:  # type: ignore[override]
        """Those of both."""
        time_s, which = np.unique(np.append(self.time_s, other.time_s), return_inverse=True)
        return Jolts(time_s, np.bincount(which, np.append(self.variance, other.variance)).astype(float))

    def into(self, profile: Profile, time_s: FloatArray) -> Profile:
        """The process noise of a log with these times, with those that lie between its samples."""
        if not len(self.time_s):  # each sweep asks
            return profile
        inside = (self.time_s > time_s[0]) & (self.time_s <= time_s[-1])
        if not inside.any():
            return profile
        sample = np.searchsorted(time_s, self.time_s[inside])
        density = self.variance[inside] / (time_s[sample] - time_s[sample - 1])
        jerk = np.append(profile.jerk, np.repeat(density[:, None], 3, 1), 0)
        return profile._replace(jerk=jerk, jolt_s=time_s[sample])

    def changes_s(self, apart_s: float) -> list[float]:
        """The time of each change, of those that are farther apart than this."""
        if not len(self.time_s):
            return []
        change = np.append(0, np.cumsum(np.diff(self.time_s) > apart_s))
        moment, size = np.bincount(change, self.variance * self.time_s), np.bincount(change, self.variance)
        return [float(each) for each in moment / size]


NO_JOLTS = Jolts(np.zeros(0), np.zeros(0))


@part
def knot_index(time_s: float, profile: Profile) -> int:
    """The piece of the jerk profile that holds up to a sample of this time."""
    jolts = len(profile.jolt_s)
    for j in range(jolts):
        if profile.jolt_s[j] == time_s:
            return len(profile.jerk) - jolts + j
    index = int((time_s - profile.first_s) / profile.knot_s)
    return max(min(index, len(profile.jerk) - jolts - 1), 0)


@part
def drive(f: Moving, profile: Profile, time_s: float) -> None:
    """Take the densities that hold at a time. (A row of the profile as an array of its own would be counted in and out
    for each sample.)"""
    piece = knot_index(time_s, profile)
    for i in range(3):
        f.jerk[i] = profile.jerk[piece, i]


@part
def noise_coefficients(interval: float, out: FloatArray) -> None:
    """The 3 x 3 matrix of Q per unit of jerk density; a negative interval goes back in time."""
    t = interval
    sign = 1.0 if t >= 0 else -1.0
    t2 = t * t
    t3 = sign * t2 * t
    out[0, 0] = t3 * t2 * (1 / 20)
    out[0, 1] = out[1, 0] = t3 * t * (1 / 8)
    out[0, 2] = out[2, 0] = t3 * (1 / 6)
    out[1, 1] = t3 * (1 / 3)
    out[1, 2] = out[2, 1] = sign * t2 * 0.5
    out[2, 2] = sign * t


@part
def predict(f: Moving, interval: float) -> None:
    """x <- Phi x and P <- Phi P Phi' + Q in place.

    Phi mixes position, velocity and acceleration of the same axis only, so each pair of axes (i, j) is a 3 x 3
    problem of its own, written out here.
    """
    x, p, c = f.x, f.p, f.q
    t = interval
    h = 0.5 * t * t
    for i in range(3):
        x[i] += t * x[i + 3] + h * x[i + 6]
        x[i + 3] += t * x[i + 6]
        for j in range(9, len(x)):
            p[i, j] += t * p[i + 3, j] + h * p[i + 6, j]
            p[i + 3, j] += t * p[i + 6, j]
            p[j, i], p[j, i + 3] = p[i, j], p[i + 3, j]
    noise_coefficients(t, c)
    for i in range(3):
        for j in range(i, 3):
            pa = p[i, 6 + j] + t * p[3 + i, 6 + j] + h * p[6 + i, 6 + j]
            pv = p[i, 3 + j] + t * p[3 + i, 3 + j] + h * p[6 + i, 3 + j]
            pp = p[i, j] + t * p[3 + i, j] + h * p[6 + i, j]
            va = p[3 + i, 6 + j] + t * p[6 + i, 6 + j]
            vv = p[3 + i, 3 + j] + t * p[6 + i, 3 + j]
            vp = p[3 + i, j] + t * p[6 + i, j]
            aa, av, ap = p[6 + i, 6 + j], p[6 + i, 3 + j], p[6 + i, j]
            if i != j:
                p[3 + i, j] = p[j, 3 + i] = vp + t * vv + h * va
                p[6 + i, j] = p[j, 6 + i] = ap + t * av + h * aa
                p[6 + i, 3 + j] = p[3 + j, 6 + i] = av + t * aa
            pp, pv, vv = pp + t * pv + h * pa, pv + t * pa, vv + t * va
            if i == j:
                q = f.jerk[i]
                pp, pv, pa = pp + q * c[0, 0], pv + q * c[0, 1], pa + q * c[0, 2]
                vv, va, aa = vv + q * c[1, 1], va + q * c[1, 2], aa + q * c[2, 2]
            p[i, j] = p[j, i] = pp
            p[i, 3 + j] = p[3 + j, i] = pv
            p[i, 6 + j] = p[6 + j, i] = pa
            p[3 + i, 3 + j] = p[3 + j, 3 + i] = vv
            p[3 + i, 6 + j] = p[6 + j, 3 + i] = va
            p[6 + i, 6 + j] = p[6 + j, 6 + i] = aa


class GaussMarkov(Protocol):
    """x and P of a record whose state ends with three Gauss-Markov offsets, their variances and correlation times."""

    x: FloatArray
    p: FloatArray
    markov: FloatArray
    tau_s: FloatArray


@part
def decorrelate(f: GaussMarkov, interval: float) -> None:
    """The offsets b of the measurements after an interval, in place, and their covariances with the motion:
    b <- exp(-|T| / tau) b + w, where the variance of w keeps that of b (Gauss-Markov)."""
    n = len(f.x)
    for i in range(9, n):
        kept = math.exp(-abs(interval) / f.tau_s[i - 9])
        f.x[i] *= kept
        for j in range(n):
            if j != i:
                f.p[i, j] *= kept
                f.p[j, i] = f.p[i, j]
        f.p[i, i] = kept * kept * f.p[i, i] + (1 - kept * kept) * f.markov[i - 9]


@part
def decorrelate_back(b: Adjoint, interval: float, tau_s: FloatArray) -> None:
    """The backward counterpart of `decorrelate` for r and N."""
    n = len(b.r)
    for i in range(9, n):
        if tau_s[i - 9] >= FOREVER_S:
            continue
        kept = math.exp(-abs(interval) / tau_s[i - 9])
        b.r[i] *= kept
        for j in range(n):
            if j != i:
                b.n[i, j] *= kept
                b.n[j, i] = b.n[i, j]
        b.n[i, i] *= kept * kept


@part
def adjoint(b: Adjoint, interval: float) -> None:
    """r <- Phi' r and N <- Phi' N Phi in place: the backward counterpart of `predict`."""
    r, n = b.r, b.n
    t = interval
    h = 0.5 * t * t
    for i in range(3):
        r[i + 6] += t * r[i + 3] + h * r[i]
        r[i + 3] += t * r[i]
        for j in range(9, len(r)):
            n[i + 6, j] += t * n[i + 3, j] + h * n[i, j]
            n[i + 3, j] += t * n[i, j]
            n[j, i + 6], n[j, i + 3] = n[i + 6, j], n[i + 3, j]
    for i in range(3):
        for j in range(3):
            pp, vp, ap = n[i, j], n[3 + i, j], n[6 + i, j]
            pv = n[i, 3 + j] + t * pp
            vv = n[3 + i, 3 + j] + t * vp
            av = n[6 + i, 3 + j] + t * ap
            pa = n[i, 6 + j] + t * n[i, 3 + j] + h * pp
            va = n[3 + i, 6 + j] + t * n[3 + i, 3 + j] + h * vp
            aa = n[6 + i, 6 + j] + t * n[6 + i, 3 + j] + h * ap
            n[i, 3 + j], n[i, 6 + j] = pv, pa
            n[3 + i, j], n[3 + i, 3 + j], n[3 + i, 6 + j] = vp + t * pp, vv + t * pv, va + t * pa
            n[6 + i, j] = ap + t * vp + h * pp
            n[6 + i, 3 + j] = av + t * vv + h * pv
            n[6 + i, 6 + j] = aa + t * va + h * pa
