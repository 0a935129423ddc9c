"""Screening of each component alone, before any filter exists: which readings fit no local parabola?

Least median of squares (Rousseeuw 1984) in overlapping windows: parabolas through random triples of samples, the
one with the smallest median residual wins. It needs no start value, no noise level and no motion model, and half of
a window may be bad. Short windows follow manoeuvres; long ones see through long patches.

In a long log some windows tell what scale is typical. In most others nearly all readings lie near one least-squares
parabola, by that scale: then there is nothing to search for.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part
from ftproc.core.model.measurement import wrapped
from ftproc.core.signatures import Vector
from ftproc.order_statistics import distinct

FloatArray = NDArray[np.float64]

TRIALS = 32  # triples per window: one is clean with probability 0.9996 when 40 % of the samples are bad
FIRST_TRIALS = 20  # are enough where all of the window lies near the best parabola
CUT = 4.5  # sigmas from the parabola
SEARCHED = 64  # windows, or up to twice as many, that are searched in any case
LEAST_SCALE, WIDEST = 0.7, 2.0  # of the typical scale
MOST = 0.75  # of a window that must lie near a parabola to know that it is the best
JUMP_VOTES = 0.2  # share of short windows that must find a reading off, at a jump
APART = 64  # numbers between scratch arrays: where they might overlap, compiled loops round otherwise
SOME = 4000  # readings that tell nearly as much as many more
SHORTEST_STUCK = 3  # equal readings in a row
STUCK_ODDS = 1e-3  # expected number of chance runs in a log that would be called stuck
MOST_STUCK = 0.2  # share of a component


@part
def median(values: FloatArray, n: int) -> float:
    """Upper median of the first n values, which are reordered (Hoare's selection)."""
    k = n // 2
    low, high = 0, n - 1
    while low < high:
        pivot = values[(low + high) // 2]
        i, j = low, high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if k <= j:
            high = j
        elif k >= i:
            low = i
        else:
            break
    return float(values[k])


@part
def _failing(
    t: FloatArray, z: FloatArray, n: int, parabola: tuple[float, float, float, float], angular: bool, best: float,
    work: FloatArray,
) -> int:  # fmt: skip
    """Distances of n samples from a parabola, into work; how many are not below the best median. A loop without
    branches, which becomes vector instructions."""
    origin, base, v, q = parabola
    failing = turned = 0
    for i in range(n):
        d = t[i] - origin
        off = abs(z[i] - base - d * (v + q * d))
        work[i] = off
        failing += off >= best
        turned += off > math.pi
    if angular and turned > 0:
        failing = 0
        for i in range(n):
            work[i] = abs(wrapped(work[i], True))
            failing += work[i] >= best
    return failing


@part
def _best_parabola(
    t: FloatArray, z: FloatArray, n: int, angular: bool, seed: int, residual: FloatArray, work: FloatArray
) -> float:
    """Residuals of the n samples about the least-median parabola; returns its scale (1-sigma of the inliers)."""
    state = (seed * 7919 + 12345) & 0x7FFFFFFF
    best = math.inf
    slope = bend = origin = base = 0.0
    unbiased = 1.4826 * (1 + 5 / (n - 3))
    for trial in range(TRIALS):
        if trial == FIRST_TRIALS and best < math.inf:
            parabola = (origin, base, slope, bend)
            if _failing(t, z, n, parabola, angular, CUT * unbiased * best, work) == 0:
                break
        a = b = c = 0
        for _attempt in range(8):
            state = (state * 1103515245 + 12345) & 0x7FFFFFFF
            a = (state >> 8) % n
            state = (state * 1103515245 + 12345) & 0x7FFFFFFF
            b = (state >> 8) % n
            state = (state * 1103515245 + 12345) & 0x7FFFFFFF
            c = (state >> 8) % n
            if t[a] != t[b] and t[b] != t[c] and t[a] != t[c]:
                break
        if t[a] == t[b] or t[b] == t[c] or t[a] == t[c]:
            continue
        zb = wrapped(z[b] - z[a], angular)
        zc = wrapped(z[c] - z[a], angular)
        tb, tc = t[b] - t[a], t[c] - t[a]
        q = (zc / tc - zb / tb) / (tc - tb)
        v = zb / tb - q * tb
        # A median below the best needs more than half of the residuals below it: most trials end here.
        if _failing(t, z, n, (t[a], z[a], v, q), angular, best, work) < n - n // 2:
            best = median(work, n)
            slope, bend, origin, base = v, q, t[a], z[a]
    if best == math.inf:  # readings of one or two instants: a constant
        for i in range(n):
            work[i] = wrapped(z[i] - z[0], angular)
        base = z[0] + median(work, n)
        for i in range(n):
            work[i] = abs(wrapped(z[i] - base, angular))
        best = median(work, n)
    for i in range(n):
        d = t[i] - origin
        residual[i] = wrapped(z[i] - base - d * (slope + bend * d), angular)
    return unbiased * best


@part
def _near_most(
    t: FloatArray, z: FloatArray, n: int, angular: bool, scale: float, residual: FloatArray, work: FloatArray
) -> float:
    """Residuals of the n samples about a least-squares parabola near which most of them lie, by a scale: the farthest
    are left out again and again. Returns its own scale, infinite if there is none.

    work (2 n,): heights, and weights of one for what is left.
    """
    origin, base, span = t[n // 2], z[n // 2], t[n - 1] - t[0]
    if not span > 0:
        return math.inf
    per_span = 1 / span
    for i in range(n):
        work[i], work[n + i] = wrapped(z[i] - base, angular), 1.0
    while True:
        s0 = s1 = s2 = s3 = s4 = y0 = y1 = y2 = 0.0
        for i in range(n):
            d, m = (t[i] - origin) * per_span, work[n + i]
            d1, d2, y = d * m, d * d * m, work[i]
            s0, s1, s2, s3, s4 = s0 + m, s1 + d1, s2 + d2, s3 + d * d2, s4 + d2 * d2
            y0, y1, y2 = y0 + y * m, y1 + d1 * y, y2 + d2 * y
        if s0 < MOST * n:
            return math.inf
        c2, c3, c4 = s2 - s1 * s1 / s0, s3 - s1 * s2 / s0, s4 - s2 * s2 / s0
        y1, y2 = y1 - s1 * y0 / s0, y2 - s2 * y0 / s0
        determinant = c2 * c4 - c3 * c3
        if not determinant > 1e-6 * c2 * c4:  # of too few instants
            return math.inf
        bend = (c2 * y2 - c3 * y1) / determinant
        slope = (y1 - c3 * bend) / c2
        level = (y0 - s1 * slope - s2 * bend) / s0
        squares = largest = 0.0
        for i in range(n):
            d = (t[i] - origin) * per_span
            off = work[i] - level - d * (slope + bend * d)
            residual[i], off = off, abs(off) * work[n + i]
            squares, largest = squares + off * off, max(largest, off)
        own = math.sqrt(squares / (s0 - 3))
        if largest <= CUT * scale:
            return own if own < WIDEST * scale else math.inf
        if not largest > 0:
            return math.inf
        for i in range(n):
            if abs(residual[i]) > 0.5 * largest:
                work[n + i] = 0.0


@kernel
def screen_component(time: Vector, z: Vector, window: int, angular: bool, least_sigma: float) -> tuple[Vector, Vector]:
    """(n,) share of windows in which each sample lies off the parabola, and (windows,) scale of each window.

    time (n,) s, z (n,) reading with NaN where missing, window: samples per window; windows overlap three-fold.
    least_sigma: that the noise has at least.
    """
    seen = np.flatnonzero(np.isfinite(z))
    m = len(seen)
    votes, looks = np.zeros(len(z)), np.zeros(len(z))
    window = min(window, m)
    stride = max(window // 3, 1)
    if window < 5:
        return votes, np.zeros(0)
    count = (m - window + stride - 1) // stride + 1
    scales = np.empty(count)
    t, y, work = np.empty(window + APART), np.empty(window + APART), np.empty(2 * window + APART)
    margin = APART // window + 1
    residuals = np.empty((margin + count + margin, window))
    every = max(count // SEARCHED, 1)
    typical = 0.0
    for searched in (True, False):
        for w in range(count):
            if (w % every == 0) != searched:
                continue
            low, scales[w] = min(w * stride, m - window), math.inf
            for i in range(window):
                t[i], y[i] = time[seen[low + i]], z[seen[low + i]]
            if not searched:
                scales[w] = _near_most(t, y, window, angular, typical, residuals[margin + w], work)
            if scales[w] == math.inf:
                scales[w] = _best_parabola(t, y, window, angular, w + 1, residuals[margin + w], work)
        typical = np.median(scales[::every] if searched else scales)
    for w in range(count):
        low = min(w * stride, m - window)
        limit = CUT * max(scales[w], LEAST_SCALE * typical, least_sigma)
        for i in range(window):
            looks[seen[low + i]] += 1
            if abs(residuals[margin + w, i]) > limit:
                votes[seen[low + i]] += 1
    for k in range(len(z)):
        if looks[k] > 0:
            votes[k] /= looks[k]
    return votes, scales


def stuck(channel: FloatArray, sigma: float) -> NDArray[np.bool_]:
    """(n,) true where a reading repeats the one before it for so long that noise cannot explain it.

    channel: (n,) one component, NaN where missing; sigma: its noise. Two neighbours of a reading rounded to steps of
    D agree by chance with probability about D / (2 sqrt(pi) sigma), and while the target stands in the middle of a step
    as often as the log shows, so a coarse instrument is allowed long runs and a fine one almost none. The first reading
    of a run is good. A component of which a fifth is repeats is one that is sampled faster than it measures, not stuck.
    """
    found = np.zeros(len(channel), bool)
    seen = np.flatnonzero(np.isfinite(channel))
    if len(seen) < SHORTEST_STUCK:
        return found
    values = channel[seen]
    repeats = values[1:] == values[:-1]
    if not repeats.any():
        return found
    chance, per_sigma = float(np.mean(repeats)), 1 / (2 * np.sqrt(np.pi))
    for some in (values[:: 1 + len(values) // SOME], values):  # few steps tell already that the smallest is too small
        step = _smallest_step(some)
        if not sigma > 0 or per_sigma * step <= chance * sigma:
            break
    chance = max(chance, per_sigma * step / sigma if 0 < sigma < np.inf else np.inf)
    if chance >= 1:
        return found
    repeats_needed = max(np.log(STUCK_ODDS / len(seen)) / np.log(max(chance, 1e-300)), SHORTEST_STUCK - 1)
    begins = np.flatnonzero(np.r_[True, ~repeats])
    ends = np.r_[begins[1:], len(seen)]
    for run in np.flatnonzero(ends - begins - 1 >= repeats_needed):
        found[seen[begins[run] + 1 : ends[run]]] = True
    if found.sum() > MOST_STUCK * len(seen):
        found[:] = False
    return found


def _smallest_step(values: FloatArray) -> float:
    """The smallest difference between two values (n,); infinite if there is none."""
    steps = np.diff(distinct(values))
    steps = steps[steps > 1e-12 * np.abs(values).max()]
    return float(steps.min()) if len(steps) else np.inf


@kernel
def bar_runs(channel: Vector, votes: Vector, near: Vector, weight: Vector) -> None:
    """Set the weights (n,) of outvoted readings to zero, if their run begins or ends with a jump; missing readings (NaN
    in the channel) neither end a run nor belong to it.

    votes: (n,) shares of a long window, near: of a short one, which sees jumps but follows every curve. A long run
    without a jump at either end is a curve that the parabola of the long window cannot follow.
    """
    seen = np.flatnonzero(np.isfinite(channel))
    n = len(seen)
    begin = 0
    while begin < n:
        if not votes[seen[begin]] > 0.5:
            begin += 1
            continue
        end = begin
        while end < n and votes[seen[end]] > 0.5:
            end += 1
        sharp = end - begin <= 2
        for edge in (begin, end):
            for k in range(max(edge - 2, 0), min(edge + 2, n)):
                sharp = sharp or near[seen[k]] > JUMP_VOTES
        if sharp:
            for k in range(begin, end):
                weight[seen[k]] = 0.0
        begin = end
