"""Editing one component alone, as range instruments do it in real time (Yu, Feng, Li and Guo, "range-test
outliers"; Zhang and Zhang, "reliable Kalman filter"): no geometry, no other component.

A component is (n,) readings, NaN where missing; differences of an azimuth are taken the short way round, so values
may leave [-pi, pi). Intervals are the real ones; a threshold holds for one typical interval and grows with it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part
from ftproc.core.model.measurement import wrap_angle
from ftproc.core.signatures import Indices, Matrix, Vector

FloatArray = NDArray[np.float64]

LINE = 4  # readings that the least-squares method extrapolates from
MOST_REJECTED = 3  # in a row: then that method takes the readings for the truth
WINDOW = 10  # readings that a repaired value is extrapolated from
MOST_REPAIRED = 16  # in a row: then the track counts as lost, and is re-initialized
WALK, RELIABLE, RELIABLE_LITERAL = 0, 1, 2
MEMORY, LEAST_NOISE = 0.9, 0.3  # of the regularised reliable filter: forgetting, and the least noise over the given


@part
def _difference(a: float, b: float, angular: bool) -> float:
    return wrap_angle(a - b) if angular else a - b


@part
def _agree(z: FloatArray, time: FloatArray, a: int, b: int, threshold: float, interval: float, angular: bool) -> bool:
    allowed = threshold * max(1.0, (time[b] - time[a]) / interval)
    return bool(abs(_difference(z[b], z[a], angular)) <= allowed)


@kernel
def gate(time: Vector, z: Vector, threshold: float, interval: float, angular: bool, check_first: bool) -> Vector:
    """(n,) 1 for readings that differ from the last accepted one by no more than the threshold, else 0.

    The first reading is accepted blindly; check_first: begin with the first pair of readings that agree, dropping
    pairs that do not.
    """
    weight = np.zeros(len(z))
    last = pending = -1
    for k in range(len(z)):
        if not math.isfinite(z[k]):
            continue
        if last < 0 and not check_first:
            last = k
        elif last < 0 and pending < 0:
            pending = k
            continue
        elif last < 0:
            agreed = _agree(z, time, pending, k, threshold, interval, angular)
            if not agreed:
                pending = -1
                continue
            weight[pending] = 1.0
            last = k
        elif _agree(z, time, last, k, threshold, interval, angular):
            last = k
        else:
            continue
        weight[k] = 1.0
    return weight


@part
def _extrapolate(t: FloatArray, v: FloatArray, count: int, at: float) -> float:
    """The least-squares line through the first `count` values, at time `at`; the mean when all are of one instant."""
    middle, mean = 0.0, 0.0
    for i in range(count):
        middle += t[i] / count
        mean += v[i] / count
    spread, slope = 0.0, 0.0
    for i in range(count):
        spread += (t[i] - middle) ** 2
        slope += (t[i] - middle) * (v[i] - mean)
    return mean + (slope / spread * (at - middle) if spread > 0 else 0.0)


@part
def _push(t: FloatArray, v: FloatArray, count: int, time: float, value: float) -> int:
    """Append to a window, dropping the oldest when it is full; returns the new count."""
    if count == len(t):
        for i in range(count - 1):
            t[i], v[i] = t[i + 1], v[i + 1]
        count -= 1
    t[count], v[count] = time, value
    return count + 1


@kernel
def four_point_line(time: Vector, z: Vector, threshold: float, interval: float, angular: bool) -> tuple[Vector, Vector]:
    """Cleaned values (n,) and weights (n,): a reading further than the threshold from the line through the last four
    values is replaced by the line. The third in a row is believed instead, with the two before it.

    On even intervals the line weighs the last four values -1/2, 0, 1/2, 1, the latest most.
    """
    value, weight = np.full(len(z), np.nan), np.zeros(len(z))
    t, v, count = np.zeros(LINE), np.zeros(LINE), 0
    raw_t, raw_v, rejected = np.zeros(MOST_REJECTED), np.zeros(MOST_REJECTED), 0
    latest = -1
    for k in range(len(z)):
        if not math.isfinite(z[k]):
            continue
        expected = v[count - 1] if count else z[k]
        allowed = math.inf
        if count == LINE:
            expected = _extrapolate(t, v, count, time[k])
            allowed = threshold * max(1.0, (time[k] - time[latest]) / interval)
        off = _difference(z[k], expected, angular)
        latest = k
        if abs(off) <= allowed:
            rejected = 0
            weight[k] = 1.0
            value[k] = expected + off
            count = _push(t, v, count, time[k], value[k])
            continue
        raw_t[rejected], raw_v[rejected] = time[k], expected + off
        rejected += 1
        if rejected < MOST_REJECTED:
            value[k] = expected
            count = _push(t, v, count, time[k], expected)
            continue
        count = 0
        for i in range(MOST_REJECTED):
            raw = raw_v[0] + _difference(raw_v[i], raw_v[0], angular)
            count = _push(t, v, count, raw_t[i], raw)
        value[k], weight[k], rejected = v[count - 1], 1.0, 0
    return value, weight


class Walk(NamedTuple):
    """A random walk in m components. begin (m,): first sample of each. x0, p0 (m,): state and variance one interval
    before. noise (m,): variance of a reading. walk (m,): variance gained in one interval. interval: s."""

    begin: Indices
    x0: Vector
    p0: Vector
    noise: Vector
    walk: Vector
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
    begin, x0, p0, noise, walk, interval = model
    n, m = z.shape
    value, variance = np.full((n, m), np.nan), np.full((n, m), np.nan)
    innovation, sigma = np.full((n, m), np.nan), np.full((n, m), np.nan)
    weight = np.zeros((n, m))
    x, p = x0.copy(), p0.copy()
    for k in range(n):
        any_off = False
        for c in range(m):
            if k < begin[c]:
                continue
            p[c] += walk[c] * ((time[k] - time[k - 1]) / interval if k > begin[c] else 1.0)
            sigma[k, c] = math.sqrt(p[c] + noise[c])
            if math.isfinite(z[k, c]):
                innovation[k, c] = _difference(z[k, c], x[c], m == 3 and c == 1)
                weight[k, c] = 1.0 if abs(innovation[k, c]) <= gate * sigma[k, c] else 0.0
                any_off = any_off or weight[k, c] == 0.0
        for c in range(m):
            if k < begin[c]:
                continue
            if math.isfinite(innovation[k, c]):
                off = weight[k, c] == 0.0 if own_only else any_off
                s = sigma[k, c] ** 2
                gain = p[c] / s * (small_gain if off else 1.0)
                x[c] += gain * innovation[k, c]
                p[c] = p[c] - 2 * gain * p[c] + gain * gain * s
            value[k, c], variance[k, c] = x[c], p[c]
    return value, variance, innovation, sigma, weight


class Repair(NamedTuple):
    """How one component is repaired and filtered. kind: WALK, RELIABLE or RELIABLE_LITERAL. threshold: on the
    innovation. noise: variance of a reading. walk: variance gained in one interval. interval: s. angular: whether it is
    an azimuth."""

    kind: int
    threshold: float
    noise: float
    walk: float
    interval: float
    angular: bool


@kernel
def repaired_walk(time: Vector, z: Vector, how: Repair) -> tuple[Vector, Vector, Vector, Vector, Vector, Vector]:
    """A scalar Kalman filter whose outliers are repaired first: readings whose innovation exceeds the threshold, or
    that are missing, are replaced by the line through up to ten values before them.

    WALK is the Kalman filter of a random walk; RELIABLE_LITERAL has gains from the last differences as published;
    RELIABLE the same regularised. Returns (n,) estimates, variances, innovations, their sigmas, weights and the
    repaired readings; NaN where nothing is known.
    """
    kind, threshold, noise, walk, interval, angular = how
    n = len(z)
    value, variance = np.full(n, np.nan), np.full(n, np.nan)
    innovation, sigma, weight = np.full(n, np.nan), np.full(n, np.nan), np.zeros(n)
    repaired = np.full(n, np.nan)
    t, v, count, lost = np.zeros(WINDOW), np.zeros(WINDOW), 0, 0
    x = p = before = last = own_walk = own_noise = 0.0
    latest = -1
    for k in range(n):
        seen = math.isfinite(z[k])
        if count == 0 and not seen:
            continue
        off = _difference(z[k], x, angular) if seen and count else 0.0
        elapsed = (time[k] - time[latest]) / interval if count else 0.0
        bad = not seen or (count > 0 and abs(off) > threshold * max(1.0, elapsed))
        latest = k
        lost = lost + 1 if bad else 0
        if lost > MOST_REPAIRED and not seen:
            count = 0
            continue
        if count == 0 or lost > MOST_REPAIRED:  # the track begins here
            x = before = last = z[k]
            p = own_walk = own_noise = noise
            count, lost = 0, 0
            off = 0.0
            bad = False
            if kind == RELIABLE_LITERAL:
                p = 0.0
        taken = _extrapolate(t, v, count, time[k]) if bad else x + off
        count = _push(t, v, count, time[k], taken)
        repaired[k] = taken
        weight[k] = 0.0 if bad else 1.0
        if kind == WALK:
            own_walk, own_noise = walk * elapsed, noise
        elif kind == RELIABLE:
            own_walk = MEMORY * own_walk + (1 - MEMORY) * (x - before) ** 2
            own_noise = max(LEAST_NOISE * noise, MEMORY * own_noise + (1 - MEMORY) * (last - x) ** 2)
        else:
            own_walk, own_noise = (x - before) ** 2, (last - x) ** 2
        p += own_walk
        gain = p / (p + own_noise) if own_noise > 0 else 1.0
        innovation[k], sigma[k] = off if seen else math.nan, math.sqrt(p + own_noise)
        before, last = x, taken
        x += gain * (taken - x)
        p *= 1 - gain
        value[k], variance[k] = x, p
    return value, variance, innovation, sigma, weight, repaired
