"""The smoothed covariance where the filter knows little of what the record knows well: after a start, or a long gap.

There P - P N P loses its digits twice: in the difference, and in N, which comes from samples where P is small. At such
a sample the covariance is carried back from the next one instead (Rauch-Tung-Striebel), in a form in which nothing is
subtracted that is large beside the difference. With Q the process noise and M the inverse of the covariance that the
filter predicts for the next sample,

    C = Phi^-1 (I - Q M)        P^s = C P^s_next C' + C Q Phi'^-1

Where the state is poorly observed M vanishes, and P^s is that of the next sample, carried back in time. Of the offsets,
whose Phi may vanish but whose covariance is never so wide, C has the rows of P Phi' M, and P^s those of P - C Phi P.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import part
from ftproc.core.filtering import backward
from ftproc.core.filtering.backward import Backward
from ftproc.core.filtering.filters import OFFSETS, Filter, Posterior
from ftproc.core.model import forces, motion

FloatArray = NDArray[np.float64]

UNOBSERVED = 1e4  # times the smoothed variance: with less, P - P N P keeps eight of its sixteen digits
LEAST_SHARE = 3e-8  # of a variance: less cannot be told from what a sweep rounds off
SINGULAR = 1e-14  # share of a variance that the others leave of it: less is rounding


@part
def store(memory: Any, f: Filter, samples: Any, profile: motion.Profile, k: int, low: int, b: int) -> None:
    """Keep the smoothed state and the sigmas of sample k, in a block b that begins with sample `low`. f: a filter whose
    state is not needed any more."""
    back, after = memory.back[0], memory.after
    here, first = after[k - low], k == low and b == 0
    backward.estimate(back, here)
    unobserved = back.unobserved > 0
    if unobserved:
        motion.drive(f, profile, samples[k + 1].time_s)
        unobserved = carry(back, f, here, samples[k + 1].time_s - samples[k].time_s, profile.motion, k)
    if first:
        back.unobserved = 1.0
    elif k > low:
        back.unobserved = is_poorly_observed(back, after[k - 1 - low])
    else:
        back.unobserved = is_poorly_observed(back, memory.before[b])
    if back.unobserved > 0:
        if not unobserved:
            complete(back, here)
        for i in range(len(back.cov)):
            for j in range(len(back.cov)):
                back.later[i, j] = back.cov[i, j]
    backward.keep(back, memory.estimates[k])


@part
def is_poorly_observed(back: Backward, earlier: Any) -> float:
    """Whether the filter knew far less at an earlier sample than the record tells in the end: one or zero."""
    found = 0.0
    for i in range(OFFSETS):
        if earlier.p[i, i] > UNOBSERVED * back.cov[i, i]:
            found = 1.0
    return found


@part
def complete(back: Backward, after: Posterior) -> None:
    """All of P - P N P."""
    p, n, pn, cov = after.p, back.n, back.pn, back.cov
    for i in range(len(p)):
        for j in range(len(p)):
            pn[j] = 0.0
            for a in range(len(p)):
                pn[j] += p[i, a] * n[a, j]
        for j in range(i + 1):
            v = p[i, j]
            for a in range(len(p)):
                v -= pn[a] * p[a, j]
            cov[i, j] = v
            cov[j, i] = v


@part
def carry(back: Backward, f: Filter, after: Posterior, interval: float, by: motion.Motion, k: int) -> bool:
    """The smoothed covariance of sample k from that of the next one, an interval later, which `later` holds. f: a
    filter with the process noise in between. False, and nothing done, where the prediction has no inverse.

    Where forces act, the same is done between the two kicks, which have inverses."""
    p, m, c, cov, size = f.p, back.inverse, back.gain, back.cov, len(f.p)
    for i in range(size):
        for j in range(size):
            p[i, j] = after.p[i, j]
    if by.acts and size > OFFSETS:
        return False
    if by.acts:
        forces.linearise(f, by.course[k], by, 0.5 * interval, 0.0)
        forces.orient(f, by.course[k], by.course[k + 1])
        forces.spread(f)
        forces.kick_covariance(p, f.kick, f.slope)
    motion.predict(f, interval)
    if by.acts:
        forces.couple(f)
        forces.linearise(f, by.course[k + 1], by, 0.5 * interval, 0.0)
        forces.unkick_covariance(f, back.later)
    motion.decorrelate(f, interval)
    if not invert(p, m, c, back.pn):
        return False
    _gain(back, f, after, interval, by.acts)
    _not_carried(back, f, after, interval, by.acts)
    for i in range(size):  # C P^s_next C'
        for a in range(size):
            back.pn[a] = 0.0
            for b in range(size):
                back.pn[a] += c[i, b] * back.later[b, a]
        for j in range(i + 1):
            total = cov[i, j]
            for a in range(size):
                total += back.pn[a] * c[j, a]
            cov[i, j] = total
            cov[j, i] = total
    if by.acts:
        forces.linearise(f, by.course[k], by, 0.5 * interval, 0.0)
        forces.unkick_covariance(f, cov)
    return True


@part
def _gain(back: Backward, f: Filter, after: Posterior, interval: float, coupled: bool) -> None:
    """C; the rows of P Phi' that belong to offsets stay in the filter's P."""
    m, c, q, p, size = back.inverse, back.gain, f.q, f.p, len(f.p)
    t, h = interval, 0.5 * interval * interval
    for i in range(3):
        for j in range(size):
            mp, mv, ma = f.jerk[i] * m[i, j], f.jerk[i] * m[3 + i, j], f.jerk[i] * m[6 + i, j]
            if coupled:
                for k in range(3):
                    w = f.cross[i + k - 1] if k != i else 0.0
                    mp, mv, ma = mp + w * m[k, j], mv + w * m[3 + k, j], ma + w * m[6 + k, j]
            gp = -(q[0, 0] * mp + q[0, 1] * mv + q[0, 2] * ma)
            gv = -(q[1, 0] * mp + q[1, 1] * mv + q[1, 2] * ma)
            ga = -(q[2, 0] * mp + q[2, 1] * mv + q[2, 2] * ma)
            gp, gv, ga = gp + (j == i), gv + (j == 3 + i), ga + (j == 6 + i)
            c[i, j], c[3 + i, j], c[6 + i, j] = gp - t * gv + h * ga, gv - t * ga, ga
    for o in range(OFFSETS, size):
        for i in range(3):
            p[o, i] = after.p[o, i] + t * after.p[o, 3 + i] + h * after.p[o, 6 + i]
            p[o, 3 + i] = after.p[o, 3 + i] + t * after.p[o, 6 + i]
            p[o, 6 + i] = after.p[o, 6 + i]
        for i in range(OFFSETS, size):
            p[o, i] = after.p[o, i] * math.exp(-t / f.tau_s[i - OFFSETS])
        for j in range(size):
            c[o, j] = 0.0
            for a in range(size):
                c[o, j] += p[o, a] * m[a, j]


@part
def _not_carried(back: Backward, f: Filter, after: Posterior, interval: float, coupled: bool) -> None:
    """C Q Phi'^-1, and of the offsets P - C Phi P."""
    c, q, cov, size = back.gain, f.q, back.cov, len(f.p)
    t, h = interval, 0.5 * interval * interval
    for i in range(size):
        for j in range(3):
            cp, cv, ca = f.jerk[j] * c[i, j], f.jerk[j] * c[i, 3 + j], f.jerk[j] * c[i, 6 + j]
            if coupled:
                for k in range(3):
                    w = f.cross[j + k - 1] if k != j else 0.0
                    cp, cv, ca = cp + w * c[i, k], cv + w * c[i, 3 + k], ca + w * c[i, 6 + k]
            gp = q[0, 0] * cp + q[0, 1] * cv + q[0, 2] * ca
            gv = q[1, 0] * cp + q[1, 1] * cv + q[1, 2] * ca
            ga = q[2, 0] * cp + q[2, 1] * cv + q[2, 2] * ca
            cov[i, j], cov[i, 3 + j], cov[i, 6 + j] = gp - t * gv + h * ga, gv - t * ga, ga
    for i in range(OFFSETS, size):
        for j in range(OFFSETS, size):
            cov[i, j] = after.p[i, j]
            for a in range(size):
                cov[i, j] -= c[i, a] * f.p[j, a]


@part
def invert(p: FloatArray, inverse: FloatArray, factor: FloatArray, scale: FloatArray) -> bool:
    """The inverse of a covariance, by Cholesky's factor of its correlations; False where it has none. factor, scale:
    memory for these."""
    size = len(p)
    for i in range(size):
        if not (math.isfinite(p[i, i]) and p[i, i] > 0):
            return False
        scale[i] = 1 / math.sqrt(p[i, i])
    for i in range(size):
        for j in range(i + 1):
            total = p[i, j] * scale[i] * scale[j]
            for a in range(j):
                total -= factor[i, a] * factor[j, a]
            if i > j:
                factor[i, j] = total * factor[j, j]
            elif total > SINGULAR:
                factor[i, i] = 1 / math.sqrt(total)  # of the diagonal only the inverse is needed
            else:
                return False
    for j in range(size):  # the factor's inverse takes its place, column by column
        for i in range(j + 1, size):
            total = 0.0
            for a in range(j, i):
                total -= factor[i, a] * factor[a, j]
            factor[i, j] = total * factor[i, i]
    for i in range(size):
        for j in range(i + 1):
            total = 0.0
            for a in range(i, size):
                total += factor[a, i] * factor[a, j]
            inverse[i, j] = total * scale[i] * scale[j]
            inverse[j, i] = inverse[i, j]
    return True


def smoothed_covariance(p: FloatArray, n: FloatArray) -> FloatArray:
    """P - P N P (m, m) as L (I - L' N L) L' with P = L L' and eigenvalues kept positive whatever the rounding; of a run
    that has diverged, P itself."""
    if not (np.isfinite(p).all() and np.isfinite(n).all()):
        return p
    scale = np.sqrt(np.where(np.diag(p) > 0, np.diag(p), 1.0))
    try:
        factor = scale[:, None] * np.linalg.cholesky(p / np.outer(scale, scale) + 1e-12 * np.eye(len(p)))
    except np.linalg.LinAlgError:  # as after a gap of years
        return p
    share, turn = np.linalg.eigh(np.eye(len(p)) - factor.T @ n @ factor)
    half = factor @ turn * np.sqrt(np.maximum(share, LEAST_SHARE))
    return np.asarray(half @ half.T)
