"""What a log says of unknown numbers on which its readings and its states depend linearly, beside the filter.

The separate-bias form of Friedland (1969), forward only. The unknown numbers b are faults of the readings (an offset
from here to there) and jolts of the target (a step of its velocity or acceleration). The filter runs as if they were
zero; what it would do otherwise is linear in them, with D = d(reading)/db, U and L of `ukf`:

    S <- Phi S + jolts      C = L^-1 (D + H S)      S <- S - U' C
    information += C' C     score += C' y

for the scalars beside the readings, with D = 0, and then for the readings,

so that ln p(readings | b) = ln p(readings | 0) + score' b - b' information b / 2, with the trajectory integrated out.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part, zeros
from ftproc.core.filtering import beside
from ftproc.core.filtering.filters import FILTER, Filter, Filters
from ftproc.core.filtering.forward import Span, advance
from ftproc.core.filtering.memory import scratch
from ftproc.core.filtering.records import SAMPLE, Model, Observations, Samples, Start, between
from ftproc.core.filtering.smoother import take_in
from ftproc.core.model import motion
from ftproc.core.signatures import Cube, Indices, Matrix, Vector

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FORGOTTEN, QUIET = 1e-5, 8  # of its largest effect on a whitened reading, and samples: what is left of a column, and
# for how long, to be followed no further


class Columns(NamedTuple):
    """m unknown numbers, in the order in which they begin. design: (n, 3, m) derivative of each reading by them, or
    (n, 3, w) where that of column c is the one of c + w, as with cells that begin and end one after the other. begin,
    end: (m,) samples from which and up to which they act on readings. jolt: (m,) the element of the state to which a
    column adds its number at `begin`, -1 for none."""

    design: FloatArray
    begin: IntArray
    end: IntArray
    jolt: IntArray


class Said(NamedTuple):
    """What a log says of m unknown numbers b: its log-likelihood is log_likelihood + score' b - b' information b / 2,
    with score (m,) and information (m, m)."""

    log_likelihood: float
    score: FloatArray
    information: FloatArray


class _Sums(NamedTuple):
    """Of m columns, see `Columns`: design, begin, end, jolt; state (9, m) S, white (3, m) C, largest (m,) of it so far,
    quiet (m,) samples since it was not forgotten, score (m,), information (m, m)."""

    design: Cube
    begin: Indices
    end: Indices
    jolt: Indices
    state: Matrix
    white: Matrix
    largest: Vector
    quiet: Indices
    score: Vector
    information: Matrix


@part
def _carry_over(row: FloatArray, low: int, high: int, sums: Any) -> None:
    """Take the columns [low, high) over a scalar beside the readings; see `beside`."""
    if not (math.isfinite(row[beside.VALUE]) and row[beside.WEIGHT] > 0):
        return
    s, white, score, information = sums.state, sums.white, sums.score, sums.information
    for c in range(low, high):
        total = 0.0
        for j in range(6):
            total += row[beside.G + j] * s[j, c]
        white[0, c] = total
        score[c] += total * row[beside.Y]
        for e in range(low, c + 1):
            information[c, e] += total * white[0, e]
    for i in range(9):
        for c in range(low, high):
            s[i, c] -= row[beside.U + i] * white[0, c]


@part
def _carry(f: Filter, k: int, interval: float, low: int, high: int, scalars: Cube, sums: Any) -> None:
    """Take the columns [low, high) over an interval and an update, with the scalars beside the readings."""
    s, white, g, u, root, y = sums.state, sums.white, f.g, f.u, f.root, f.y
    score, information, h, width = sums.score, sums.information, 0.5 * interval * interval, sums.design.shape[2]
    for i in range(3):
        for c in range(low, high):
            s[i, c] += interval * s[i + 3, c] + h * s[i + 6, c]
            s[i + 3, c] += interval * s[i + 6, c]
    for kind in range(len(scalars)):
        _carry_over(scalars[kind, k], low, high, sums)
    for c in range(low, high):
        d0 = d1 = d2 = 0.0
        if sums.begin[c] <= k < sums.end[c]:
            own = c % width
            d0, d1, d2 = sums.design[k, 0, own], sums.design[k, 1, own], sums.design[k, 2, own]
        for i in range(3):
            direct = root[i, 0] * d0 + root[i, 1] * d1 + root[i, 2] * d2
            white[i, c] = direct + (g[i, 0] * s[0, c] + g[i, 1] * s[1, c] + g[i, 2] * s[2, c])
    for i in range(9):
        u0, u1, u2 = u[0, i], u[1, i], u[2, i]
        for c in range(low, high):
            s[i, c] -= u0 * white[0, c] + u1 * white[1, c] + u2 * white[2, c]
    for c in range(low, high):
        w0, w1, w2 = white[0, c], white[1, c], white[2, c]
        score[c] += w0 * y[0] + w1 * y[1] + w2 * y[2]
        sums.largest[c] = max(sums.largest[c], abs(w0), abs(w1), abs(w2))
        for e in range(low, c + 1):
            information[c, e] += w0 * white[0, e] + w1 * white[1, e] + w2 * white[2, e]


@part
def _acts(f: Filter, sums: Any, c: int, k: int) -> bool:
    """Whether a column has an effect after a sample."""
    if k < sums.end[c]:
        return True
    most = max(abs(sums.white[0, c]), abs(sums.white[1, c]), abs(sums.white[2, c]))
    if most > FORGOTTEN * sums.largest[c]:
        sums.quiet[c] = 0
    elif f.used[0] > 0 or f.used[1] > 0 or f.used[2] > 0:
        sums.quiet[c] += 1
    return bool(sums.quiet[c] < QUIET)


@kernel
def _sweep_columns(span: Span, samples: Samples, profile: motion.Profile, filters: Filters, sums: _Sums) -> float:
    """The forward sweep over a span with the columns beside it; the log-likelihood. Adds to the sums."""
    f, likelihood, low, high, m = filters[0], 0.0, 0, 0, len(sums.score)
    for k in range(span.first, span.last):
        interval = samples[k].time_s - samples[max(k - 1, span.first)].time_s
        if k > span.first:
            advance(f, samples, k, profile)
        while high < m and sums.begin[high] <= k:
            high += 1
        while low < high and not _acts(f, sums, low, k):
            low += 1
        if len(profile.beside) > 0:
            likelihood += beside.take(f.x, f.p, profile.beside, k)
        _, gained = take_in(f, samples[k])
        likelihood += gained
        for c in range(low, high):
            if sums.begin[c] == k and sums.jolt[c] >= 0:
                sums.state[sums.jolt[c], c] += 1.0
        _carry(f, k, interval, low, high, profile.beside, sums)
    return likelihood


def said_of(log: Observations, model: Model, starts: list[Start], columns: Columns) -> Said:
    """What a log says of the columns with a model of white noise; each start forgets what was before it."""
    n, m = len(log.time_s), len(columns.begin)
    score, information, likelihood = np.zeros(m), np.zeros((m, m)), 0.0
    samples, profile = log.samples(model.reading_variance, scratch(SAMPLE, n)), model.profile_of(log)
    for start, stop in between(starts, n):
        quiet = np.zeros(m, np.int64)
        sums = _Sums(*columns, np.zeros((9, m)), np.zeros((3, m)), np.zeros(m), quiet, score, information)
        first = zeros(FILTER)
        first["x"][0], first["p"][0], first["tau_s"] = start.state, start.covariance, motion.FOREVER_S
        likelihood += _sweep_columns(Span(start.sample, stop, start.sample), samples, profile, first, sums)
    return Said(likelihood, score, information + np.tril(information, -1).T)
