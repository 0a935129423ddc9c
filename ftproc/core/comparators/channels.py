"""Editing one component alone, as range instruments do it in real time (Yu, Feng, Li and Guo, "range-test
outliers"; Zhang and Zhang, "reliable Kalman filter"): no geometry, no other component.

A component is (n,) readings, NaN where missing; differences of an azimuth are taken the short way round, so values
may leave [-pi, pi). Intervals are the real ones; a threshold holds for one typical interval and grows with it.

What a reading is held against is a short polynomial through the values before it. The papers' own targets move little
from reading to reading: degree 0 through one value is their rule to the letter, degree 1 or 2 is the same rule for a
target that flies.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part
from ftproc.core.model.measurement import wrap_angle
from ftproc.core.signatures import Vector

FloatArray = NDArray[np.float64]


class Predictor(NamedTuple):
    """The polynomial of degree `order` through the last `window` values (more than `order`), and how far from it a
    reading may be. longest: so many readings in a row that are further off are the track, and begin anew. interval: s.
    angular: whether it is an azimuth."""

    order: int
    window: int
    threshold: float
    longest: int
    interval: float
    angular: bool


@part
def difference(a: float, b: float, angular: bool) -> float:
    return wrap_angle(a - b) if angular else a - b


@part
def extrapolate(t: FloatArray, v: FloatArray, count: int, order: int, at: float) -> float:
    """The least-squares polynomial through the first `count` values, at time `at`; of a lower degree than `order` where
    there are not as many instants. Orthogonal polynomials (Forsythe 1957)."""
    instants = 1
    for i in range(1, count):
        instants += t[i] > t[i - 1]
    value, before, now, norm = 0.0, 0.0, 1.0, 1.0
    previous, current = np.zeros(count), np.ones(count)
    for degree in range(min(order, instants - 1) + 1):
        square, middle, product = 0.0, 0.0, 0.0
        for i in range(count):
            square += current[i] * current[i]
            middle += (t[i] - t[0]) * current[i] * current[i]
            product += v[i] * current[i]
        value += product / square * now
        middle /= square
        ratio = square / norm if degree else 0.0
        norm = square
        for i in range(count):
            following = (t[i] - t[0] - middle) * current[i] - ratio * previous[i]
            previous[i], current[i] = current[i], following
        before, now = now, (at - t[0] - middle) * now - ratio * before
    return value


@part
def push(t: FloatArray, v: FloatArray, count: int, time: float, value: float) -> int:
    """Append to a window, dropping the oldest when it is full; returns the new count."""
    if count == len(t):
        for i in range(count - 1):
            t[i], v[i] = t[i + 1], v[i + 1]
        count -= 1
    t[count], v[count] = time, value
    return count + 1


@part
def allowed(how: Predictor, count: int, elapsed: float) -> float:
    """How far from the polynomial through `count` values a reading may be, so long after the last of them."""
    if count <= how.order:
        return math.inf
    return how.threshold * max(1.0, elapsed / how.interval)


@kernel
def residuals(time: Vector, z: Vector, how: Predictor) -> tuple[Vector, Vector]:
    """(n,) by how much each reading differs from the polynomial through the `window` before it, and from the reading
    before it plus what the polynomial gains in between; NaN without so many before it, or after more than 1.5
    intervals."""
    off, gained = np.full(len(z), np.nan), np.full(len(z), np.nan)
    t, v, count = np.zeros(how.window), np.zeros(how.window), 0
    for k in range(len(z)):
        if not math.isfinite(z[k]):
            continue
        expected = extrapolate(t, v, count, how.order, time[k]) if count else z[k]
        value = expected + difference(z[k], expected, how.angular)
        if count == how.window and time[k] - t[count - 1] <= 1.5 * how.interval:
            off[k] = value - expected
            gained[k] = value - v[count - 1] - (expected - extrapolate(t, v, count, how.order, t[count - 1]))
        count = push(t, v, count, time[k], value)
    return off, gained


@kernel
def gate(time: Vector, z: Vector, how: Predictor, check_first: bool) -> Vector:
    """(n,) 1 for readings that differ from the polynomial through the last accepted ones by no more than the threshold,
    else 0.

    As many readings as the polynomial needs are accepted blindly at first. check_first: begin with as many and one more
    that agree, dropping the first of those that do not (of a pair, for degree 0, both).
    """
    weight = np.zeros(len(z))
    t, v, count = np.zeros(how.window), np.zeros(how.window), 0
    pending, started, rejected = np.zeros(how.order + 1, np.int64), not check_first, 0
    for k in range(len(z)):
        if not math.isfinite(z[k]):
            continue
        expected = extrapolate(t, v, count, how.order, time[k]) if count else z[k]
        off = difference(z[k], expected, how.angular)
        agreed = abs(off) <= allowed(how, count, time[k] - t[count - 1] if count else 0.0)
        if started and not agreed:
            rejected += 1
            if rejected < how.longest:
                continue
            started, count, expected, off = not check_first, 0, z[k], 0.0
        rejected = 0
        if started:
            weight[k] = 1.0
        elif agreed and count > how.order:
            started = True
            for i in range(len(pending)):
                weight[pending[i]] = 1.0
            weight[k] = 1.0
        else:
            if not agreed and how.order == 0:
                count = 0
                continue
            if not agreed:
                for i in range(how.order):
                    t[i], v[i], pending[i] = t[i + 1], v[i + 1], pending[i + 1]
                count -= 1
            pending[count] = k
        count = push(t, v, count, time[k], expected + off)
    return weight


@kernel
def least_squares(time: Vector, z: Vector, how: Predictor) -> tuple[Vector, Vector]:
    """Cleaned values (n,) and weights (n,): a reading further than the threshold from the polynomial through the last
    values is replaced by it, once there are as many as its window holds. When `longest` in a row are, the last of them
    are used instead.

    On even intervals the line through four values weighs them -1/2, 0, 1/2, 1, the latest most.
    """
    value, weight = np.full(len(z), np.nan), np.zeros(len(z))
    t, v, count = np.zeros(how.window), np.zeros(how.window), 0
    raw_t, raw_v, rejected = np.zeros(how.longest), np.zeros(how.longest), 0
    latest = -1
    for k in range(len(z)):
        if not math.isfinite(z[k]):
            continue
        expected = z[k]
        if count:
            expected = extrapolate(t, v, count, how.order if count == how.window else 0, time[k])
        bound = allowed(how, count, time[k] - time[latest]) if count == how.window else math.inf
        off = difference(z[k], expected, how.angular)
        latest = k
        if abs(off) <= bound:
            rejected = 0
            weight[k] = 1.0
            value[k] = expected + off
            count = push(t, v, count, time[k], value[k])
            continue
        raw_t[rejected], raw_v[rejected] = time[k], expected + off
        rejected += 1
        if rejected < how.longest:
            value[k] = expected
            count = push(t, v, count, time[k], expected)
            continue
        count = 0
        for i in range(how.longest):
            raw = raw_v[0] + difference(raw_v[i], raw_v[0], how.angular)
            count = push(t, v, count, raw_t[i], raw)
        value[k], weight[k], rejected = v[count - 1], 1.0, 0
    return value, weight
