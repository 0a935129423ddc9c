"""Kalman filters of random walks, component by component (Yu, Feng, Li and Guo; Zhang and Zhang; see `channels`).

The walk is about a short polynomial through the readings before, which moves the state from one reading to the next: a
known input, as in Zhang and Zhang's eq. 1. Degree 0 is the papers' plain random walk.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ftproc.core.comparators.channels import FloatArray, Predictor, allowed, difference, extrapolate, push
from ftproc.core.compiled import kernel, part
from ftproc.core.signatures import Indices, Matrix, Vector

WALK, RELIABLE, RELIABLE_LITERAL = 0, 1, 2


@part
def _gain(t: FloatArray, v: FloatArray, count: int, order: int, low: float, high: float) -> float:
    """What the polynomial through the first `count` values gains from time `low` to time `high`."""
    return extrapolate(t, v, count, order, high) - extrapolate(t, v, count, order, low)


class Walk(NamedTuple):
    """A random walk in m components, about polynomials of degree `order` through the last `window` good readings. begin
    (m,): first sample of each. x0, p0 (m,): state and variance one interval before. noise (m,): variance of a reading.
    walk (m,): variance gained in one interval. order, window (m,). longest: so many readings in a row that are rejected
    are the track. interval: s."""

    begin: Indices
    x0: Vector
    p0: Vector
    noise: Vector
    walk: Vector
    order: Indices
    window: Indices
    longest: int
    interval: float


@kernel
def outlier_kalman(
    time: Vector, z: Matrix, model: Walk, gate: float, small_gain: float, own_only: bool
) -> tuple[Matrix, Matrix, Matrix, Matrix, Matrix]:
    """The anti-outlier Kalman filter of a random walk in m components: when an innovation exceeds `gate` sigmas, the
    gain is multiplied by `small_gain`, of all components, or (own_only) of the one that is off.

    z (n, m), the second an azimuth if m is 3. Returns values, variances, innovations, their sigmas and weights, all
    (n, m); NaN before the first sample.
    """
    begin, x0, p0, noise, walk, order, window, longest, interval = model
    n, m = z.shape
    value, variance = np.full((n, m), np.nan), np.full((n, m), np.nan)
    innovation, sigma = np.full((n, m), np.nan), np.full((n, m), np.nan)
    weight = np.zeros((n, m))
    t, v, count = np.zeros((m, window.max())), np.zeros((m, window.max())), np.zeros(m, np.int64)
    x, p, good, rejected = x0.copy(), p0.copy(), np.zeros(m), np.zeros(m, np.int64)
    for k in range(n):
        any_off = False
        for c in range(m):
            if k < begin[c]:
                continue
            elapsed = (time[k] - time[k - 1]) / interval if k > begin[c] else 1.0
            since = (time[k - 1] - good[c]) / interval if k > begin[c] else 0.0
            p[c] += walk[c] * _growth(order[c] if count[c] > order[c] else 0, since, elapsed)
            if count[c] > order[c] > 0:
                x[c] += _gain(t[c], v[c], count[c], order[c], time[k - 1], time[k])
            sigma[k, c] = math.sqrt(p[c] + noise[c])
            if math.isfinite(z[k, c]):
                innovation[k, c] = difference(z[k, c], x[c], m == 3 and c == 1)
                if 0 < count[c] <= order[c]:  # not yet known where it goes
                    p[c] = max(p[c], innovation[k, c] ** 2)
                    sigma[k, c] = math.sqrt(p[c] + noise[c])
                weight[k, c] = 1.0 if abs(innovation[k, c]) <= gate * sigma[k, c] else 0.0
                rejected[c] = 0 if weight[k, c] > 0 else rejected[c] + 1
                if rejected[c] == longest:
                    x[c], p[c], count[c], rejected[c] = x[c] + innovation[k, c], p0[c], 0, 0
                    innovation[k, c], weight[k, c] = 0.0, 1.0
                any_off = any_off or weight[k, c] == 0.0
            if weight[k, c] > 0 or k == begin[c]:
                good[c] = time[k]
        for c in range(m):
            if k < begin[c]:
                continue
            if math.isfinite(innovation[k, c]):
                off = weight[k, c] == 0.0 if own_only else any_off
                if weight[k, c] > 0:
                    reading = x[c] + innovation[k, c]
                    count[c] = push(t[c, : window[c]], v[c, : window[c]], count[c], time[k], reading)
                gain = p[c] / (p[c] + noise[c]) * (small_gain if off else 1.0)
                x[c] += gain * innovation[k, c]
                p[c] = (1 - gain) ** 2 * p[c] + gain * gain * noise[c]
            value[k, c], variance[k, c] = x[c], p[c]
    return value, variance, innovation, sigma, weight


@part
def _growth(order: int, since: float, elapsed: float) -> float:
    """How many intervals' variance is gained in `elapsed` intervals, `since` intervals after the last good reading: an
    error of the polynomial lasts, and grows with time by the power of its degree."""
    if order == 0:
        return elapsed
    return (since + elapsed) ** (2 * order) - since ** (2 * order)


class Repair(NamedTuple):
    """How one component is repaired and filtered. kind: WALK, RELIABLE or RELIABLE_LITERAL. noise: variance of a
    reading. walk: variance gained in one interval. memory, least_noise: of RELIABLE, forgetting, and the least noise
    over the given."""

    kind: int
    noise: float
    walk: float
    memory: float
    least_noise: float


@kernel
def repaired_walk(
    time: Vector, z: Vector, how: Repair, expected: Predictor
) -> tuple[Vector, Vector, Vector, Vector, Vector, Vector]:
    """A scalar Kalman filter whose outliers are repaired first: readings whose innovation exceeds the threshold, or
    that are missing, are replaced by the line (or the polynomial) through the values before them.

    WALK is the Kalman filter of a random walk about the polynomial; RELIABLE_LITERAL has gains from the last
    differences as published; RELIABLE the same regularised. Returns (n,) estimates, variances, innovations, their
    sigmas, weights and the repaired readings; NaN where nothing is known.
    """
    kind, noise, walk, memory, least_noise = how
    order, window, interval, angular = expected.order, expected.window, expected.interval, expected.angular
    n = len(z)
    value, variance = np.full(n, np.nan), np.full(n, np.nan)
    innovation, sigma, weight = np.full(n, np.nan), np.full(n, np.nan), np.zeros(n)
    repaired = np.full(n, np.nan)
    t, v, count, lost = np.zeros(window), np.zeros(window), 0, 0
    x = p = before = last = own_walk = own_noise = 0.0
    latest = good = -1
    for k in range(n):
        seen = math.isfinite(z[k])
        if count == 0 and not seen:
            continue
        ahead, blind = x, count <= order and order > 0  # not yet known where it goes
        if count > order > 0:
            ahead += _gain(t, v, count, order, time[latest], time[k])
        off = difference(z[k], ahead, angular) if seen and count else 0.0
        elapsed = (time[k] - time[latest]) / interval if count else 0.0
        since = time[k] - time[good if order else latest] if count else 0.0
        bad = not seen or abs(off) > allowed(expected, count, since)
        latest = k
        lost = lost + 1 if bad else 0
        if lost > expected.longest and not seen:
            count = 0
            continue
        if count == 0 or lost > expected.longest:  # the track begins here
            x = before = last = ahead = z[k]
            p = own_walk = own_noise = noise
            count, lost = 0, 0
            off = 0.0
            bad = False
            if kind == RELIABLE_LITERAL:
                p = 0.0
        if not bad:
            good = k
        taken = extrapolate(t, v, count, max(order, 1), time[k]) if bad else ahead + off
        if not bad or order == 0:  # a polynomial through what it repaired itself would bend with the next good reading
            count = push(t, v, count, time[k], taken)
        repaired[k] = taken
        weight[k] = 0.0 if bad else 1.0
        if kind == WALK:
            own_walk, own_noise = walk * elapsed, noise
        elif kind == RELIABLE:
            own_walk = memory * own_walk + (1 - memory) * (x - before) ** 2
            own_noise = max(least_noise * noise, memory * own_noise + (1 - memory) * (last - x) ** 2)
        else:
            own_walk, own_noise = (x - before) ** 2, (last - x) ** 2
        p += own_walk
        gain = p / (p + own_noise) if own_noise > 0 and not blind else 1.0
        innovation[k], sigma[k] = off if seen else math.nan, math.sqrt(p + own_noise)
        before, last = ahead, taken
        x = ahead + gain * (taken - ahead)
        p = noise if blind else (1 - gain) * p
        value[k], variance[k] = x, p
    return value, variance, innovation, sigma, weight, repaired
