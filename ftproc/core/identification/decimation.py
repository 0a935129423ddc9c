"""Neighbouring readings merged into one, where a log is far denser than the filter's memory is long.

The mean of the readings within a fraction of the filter's memory (see `scales`) says as much about noise and motion as
they do one by one, at a fraction of the cost.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel
from ftproc.core.components import totals
from ftproc.core.filtering.records import Model, Observations, Scalars, Start, Uneven
from ftproc.core.identification.scales import Scales
from ftproc.core.model.measurement import wrapped
from ftproc.core.signatures import Flags, Indices, Matrix, Vector
from ftproc.order_statistics import quantile, typical

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SHARE = 0.5  # of the filter's memory, that is merged
MOST = 16  # readings in a group
FEWEST, PER_KNOT = 500, 4  # groups of a log, and to a knot of the jerk profile
QUIETER_SHARE = 0.9  # share of the flight with less jerk than the memory is computed for
OFTEN = 0.7  # of the readings of the component that is seen most: else means of few stand at the wrong times
ROUNDING = 0.01  # of a reading: times are rounded, and must not decide where the number comes out even


def how_many(scales: Scales, model: Model, knot_s: float) -> int:
    """Neighbours that may be merged: 1 for a sparse log, and where noise is correlated."""
    if model.coloured:
        return 1
    noise = float(scales.noise_m.min()) ** 2
    jerk_psd = max(quantile(model.jerk[:, 0], QUIETER_SHARE), 1e-300)
    memory = (noise * scales.interval_s / jerk_psd) ** (1 / 6)
    wanted = min(SHARE * memory, knot_s / PER_KNOT, scales.span_s / FEWEST) / scales.interval_s
    return int(np.clip(wanted + ROUNDING, 1, MOST))


def merged(log: Observations, starts: list[Start], count: int) -> tuple[Observations, list[Start]]:
    """The log with `count` neighbours merged, or as it is where some of what is measured is seen far less often than
    the rest, or it has curves through gaps; and its starts."""
    seen = np.r_[totals(log.weight > 0), [np.count_nonzero(_used(each)) for each in log.beside]]
    alike = log.about is None and count > 1 and seen.min() > OFTEN * seen.max()
    return merge(log, starts, count) if alike else (log, starts)


def merge(log: Observations, starts: list[Start], count: int) -> tuple[Observations, list[Start]]:
    """A log of one reading in place of `count`, weighing as many as were used, and its starts."""
    interval = typical(np.diff(log.time_s))
    begins = np.zeros(len(log.time_s), bool)
    begins[[start.sample for start in starts]] = True
    values = np.column_stack([log.measurement, *(each.value for each in log.beside)])
    weight = np.column_stack([log.weight, *map(_used, log.beside)])
    time, z, number, group = _means(log.time_s, values, weight, begins, count, 1.5 * count * interval)
    moved = []
    for start in starts:
        sample = int(group[start.sample])
        late = float(time[sample] - log.time_s[start.sample])
        step = np.kron(np.array([[1.0, late, late**2 / 2], [0.0, 1.0, late], [0.0, 0.0, 1.0]]), np.eye(3))
        moved.append(Start(sample, step @ start.state, step @ start.covariance @ step.T))
    uneven = None
    if log.uneven is not None:
        size = np.bincount(group)[:, None]
        means = (np.stack([np.bincount(group, each[:, c]) for c in range(3)], 1) / size for each in log.uneven)
        uneven = Uneven(*means)
    beside = tuple(
        each._replace(value=z[:, c], variance=np.full(len(time), each.variance[0]), weight=number[:, c])
        for c, each in enumerate(log.beside, 3)
    )
    return Observations(time, z[:, :3].copy(), number[:, :3].copy(), uneven, beside=beside), moved


def _used(scalars: Scalars) -> FloatArray:
    """(n,) weights, zero where nothing is measured."""
    return scalars.weight * np.isfinite(scalars.value)


@kernel
def _means(
    time: Vector, z: Matrix, weight: Matrix, begins: Flags, count: int, longest: float
) -> tuple[Vector, Matrix, Matrix, Indices]:
    """Times (m,), means (m, c) and numbers (m, c) of groups, of values (n, c) of which the second is an angle, and the
    group of each sample (n,)."""
    n, columns = len(time), z.shape[1]
    group = np.zeros(n, np.int64)
    m, first = 0, 0
    for k in range(1, n):
        if k - first >= count or begins[k] or time[k] - time[first] > longest:
            m, first = m + 1, k
        group[k] = m
    m += 1
    t, size = np.zeros(m), np.zeros(m)
    for k in range(n):
        t[group[k]] += time[k]
        size[group[k]] += 1
    t /= size
    mean, number = np.zeros((m, columns)), np.zeros((m, columns))
    late, base = np.zeros((m, columns)), np.zeros((m, columns))
    for k in range(n):
        g = group[k]
        for c in range(columns):
            if weight[k, c] > 0 and math.isfinite(z[k, c]):
                if number[g, c] == 0:
                    base[g, c] = z[k, c]
                mean[g, c] += wrapped(z[k, c] - base[g, c], c == 1)
                late[g, c] += time[k] - t[g]
                number[g, c] += 1
    for g in range(m):
        for c in range(columns):
            if number[g, c] > 0:
                mean[g, c] = base[g, c] + mean[g, c] / number[g, c]
                late[g, c] /= number[g, c]
    merged = mean.copy()
    for g in range(m):
        for c in range(columns):
            if number[g, c] == 0:
                merged[g, c] = math.nan
            elif late[g, c] != 0.0:  # some of the group is missing: its mean is of another time
                a, b = max(g - 1, 0), min(g + 1, m - 1)
                span = t[b] + late[b, c] - t[a] - late[a, c]
                if number[a, c] > 0 and number[b, c] > 0 and span > 0:
                    merged[g, c] -= late[g, c] * wrapped(mean[b, c] - mean[a, c], c == 1) / span
                else:  # nobody knows how far it has gone meanwhile
                    merged[g, c] = math.nan
    return t, merged, number, group
