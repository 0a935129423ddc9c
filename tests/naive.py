"""Slow references in plain numpy, one matrix at a time and as the textbooks write them: the kernels must agree.

States are (9,) x y z vx vy vz ax ay az; measurements (3,) range, azimuth, elevation; jerk densities (3,) along x,
y and z. A weight m > 0 uses a reading at the noise variance R / m, zero or NaN leaves it out.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from scipy.integrate import quad
from scipy.linalg import block_diag, expm


def wrapped(angle):
    return (angle + np.pi) % (2 * np.pi) - np.pi


# --- motion -----------------------------------------------------------------------------------------------------


def transition(t):
    return np.kron([[1, t, t * t / 2], [0, 1, t], [0, 0, 1]], np.eye(3))


def process_noise(t, jerk):
    """Integral of g(s) g(s)' over 0..|t|, where g(s) is what a jerk does at a distance of s from it in time."""

    def along(s):
        return s * s / 2, np.copysign(s, t), 1.0

    q = [[quad(lambda s, i=i, j=j: along(s)[i] * along(s)[j], 0, abs(t))[0] for j in range(3)] for i in range(3)]
    return np.kron(q, np.diag(jerk))


def van_loan(t, jerk):
    """Q from one matrix exponential (Van Loan 1978), for t >= 0."""
    a = np.kron(np.eye(3, k=1), np.eye(3))
    g = np.vstack([np.zeros((6, 3)), np.eye(3)])
    power = expm(np.block([[-a, g @ np.diag(jerk) @ g.T], [np.zeros((9, 9)), a.T]]) * t)
    return power[9:, 9:].T @ power[:9, 9:]


# --- measurement ------------------------------------------------------------------------------------------------


def measure(x):
    ground = np.hypot(x[0], x[1])
    return np.array([max(np.hypot(ground, x[2]), 1.0), np.arctan2(x[1], x[0]), np.arctan2(x[2], ground)])


def difference(a, b):
    d = a - b
    d[1] = wrapped(d[1])
    return d


def jacobian(x):
    """(3, 9) by central differences."""
    h = np.zeros((3, 9))
    for j in range(3):
        step = np.zeros(9)
        step[j] = 1e-6 * np.linalg.norm(x[:3])
        h[:, j] = difference(measure(x + step), measure(x - step)) / (2 * step[j])
    return h


def unscented(x, p, spread=3.0):
    """z^, C and P_xz of the scaled transform with all 2n + 1 points; n + lambda = spread^2, beta = 0, kappa = 0."""
    n = len(x)
    alpha2 = spread**2 / n
    mean_weight = np.full(2 * n + 1, 1 / (2 * spread**2))
    mean_weight[0] = 1 - n / spread**2
    weight = mean_weight.copy()
    weight[0] += 1 - alpha2
    root = np.linalg.cholesky(p) * spread
    points = np.vstack([x, x + root.T, x - root.T])
    d = np.array([difference(measure(point), measure(x)) for point in points])
    mean = mean_weight @ d
    d_mean = d - mean
    c = (weight[:, None] * d_mean).T @ d_mean
    return measure(x) + mean, c, (weight[:, None] * (points - x)).T @ d_mean


def extended(x, p):
    h = jacobian(x)
    return measure(x), h @ p @ h.T, p @ h.T


def update(x, p, transform, z, noise, weight):
    """x+, P+, NIS, log-likelihood from the sub-vector of components that are used."""
    z_hat, c, pxz = transform
    used = np.flatnonzero((np.asarray(weight) > 0) & np.isfinite(z))
    if len(used) == 0:
        return x, p, np.nan, 0.0
    e = difference(z, z_hat)[used]
    s = (c + np.diag(noise))[np.ix_(used, used)]
    s[np.diag_indices(len(used))] += noise[used] / weight[used] - noise[used]
    gain = pxz[:, used] @ np.linalg.inv(s)
    nis = e @ np.linalg.inv(s) @ e
    return x + gain @ e, p - gain @ s @ gain.T, nis, -0.5 * (nis + np.log(np.linalg.det(s)))


# --- filter and smoother ----------------------------------------------------------------------------------------


class Step(NamedTuple):
    """phi, q lead from the step before to this one; x0, p0 before and x, p after the update; h (3, 9) is the
    statistical linearisation P_xz' P^-1."""

    phi: np.ndarray
    q: np.ndarray
    x0: np.ndarray
    p0: np.ndarray
    z_hat: np.ndarray
    c: np.ndarray
    h: np.ndarray
    x: np.ndarray
    p: np.ndarray
    nis: float
    likelihood: float


def run(time, z, weight, model, x, p, transform=unscented):
    """The recursive filter; `model` as in ftproc.core.filtering.records."""
    steps = []
    for k in range(len(time)):
        phi, q = np.eye(9), np.zeros((9, 9))
        if k:
            piece = int(np.clip((time[k] - time[0]) / model.knot_s, 0, len(model.jerk) - 1))
            t = time[k] - time[k - 1]
            phi, q = transition(t), process_noise(t, model.jerk[piece])
        x0, p0 = phi @ x, phi @ p @ phi.T + q
        found = transform(x0, p0)
        x, p, nis, likelihood = update(x0, p0, found, z[k], model.noise_variance, weight[k])
        p = (p + p.T) / 2
        h = np.linalg.solve(p0, found[2]).T
        steps.append(Step(phi, q, x0, p0, found[0], found[1], h, x, p, nis, likelihood))
    return steps


def smooth(steps):
    """Rauch-Tung-Striebel: (n, 9) states and (n, 9, 9) covariances."""
    x, p = [steps[-1].x], [steps[-1].p]
    for now, later in zip(steps[-2::-1], steps[:0:-1], strict=True):
        g = now.p @ later.phi.T @ np.linalg.inv(later.p0)
        x.insert(0, now.x + g @ (x[0] - later.x0))
        p.insert(0, now.p + g @ (p[0] - later.p0) @ g.T)
    return np.array(x), np.array(p)


def leave_one_out(steps, z, weight, noise):
    """(n, 3) residuals and their variances at full weight, by taking each reading out of one joint Gaussian.

    The measurements are those of the linearised steps; all their covariances are laid out in full.
    """
    n = len(steps)
    mean, covariance = [steps[0].x0], np.zeros((9 * n, 9 * n))
    covariance[:9, :9] = steps[0].p0
    for k in range(1, n):
        now, before = slice(9 * k, 9 * k + 9), slice(9 * k - 9, 9 * k)
        mean.append(steps[k].phi @ mean[-1])
        covariance[now, : 9 * k] = steps[k].phi @ covariance[before, : 9 * k]
        covariance[: 9 * k, now] = covariance[now, : 9 * k].T
        covariance[now, now] = steps[k].phi @ covariance[before, before] @ steps[k].phi.T + steps[k].q
    h = block_diag(*[s.h for s in steps])
    bend = block_diag(*[s.c - s.h @ s.p0 @ s.h.T for s in steps])
    d = np.concatenate(
        [difference(reading, s.z_hat) + s.h @ (s.x0 - m) for reading, s, m in zip(z, steps, mean, strict=True)]
    )
    w, noise = weight.ravel(), np.tile(noise, n)
    full = h @ covariance @ h.T + bend + np.diag(noise / np.where(w > 0, w, 1.0))
    residual, variance = np.full(3 * n, np.nan), np.full(3 * n, np.nan)
    for i in np.flatnonzero(np.isfinite(d)):
        others = np.flatnonzero((w > 0) & np.isfinite(d) & (np.arange(3 * n) != i))
        share = np.linalg.solve(full[np.ix_(others, others)], full[others, i])
        residual[i] = d[i] - share @ d[others]
        variance[i] = full[i, i] - share @ full[others, i] + (noise[i] * (1 - 1 / w[i]) if w[i] > 0 else 0.0)
    return residual.reshape(n, 3), variance.reshape(n, 3)


# --- outliers ---------------------------------------------------------------------------------------------------


def least_median_parabola(t, z):
    """Median absolute residual of the best parabola through any three samples, the upper one of an even number."""
    best = np.inf
    for triple in itertools.combinations(range(len(t)), 3):
        residual = np.abs(z - np.polyval(np.polyfit(t[list(triple)], z[list(triple)], 2), t))
        best = min(best, np.sort(residual)[len(t) // 2])
    return best


def chain(good_density, bad_density, step):
    """Markov chain of good / isolated / patch after a good sample: (n,) P(good) and (3, 3) expected transitions, by
    the probability of each of the 3^n sequences."""
    n = len(good_density)
    density = np.stack([good_density, bad_density, bad_density], 1)
    good, counts, total = np.zeros(n), np.zeros((3, 3)), 0.0
    for sequence in itertools.product(range(3), repeat=n):
        before = (0, *sequence[:-1])
        p = np.prod([step[i, j] * density[k, j] for k, (i, j) in enumerate(zip(before, sequence, strict=True))])
        total += p
        good += p * (np.array(sequence) == 0)
        for i, j in itertools.pairwise(sequence):
            counts[i, j] += p
    return good / total, counts / total
