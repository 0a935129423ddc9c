"""Sample times: the grid, jitter, gaps and duplicate times."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ftproc.records import FloatArray, IntArray
from ftproc.simulation.outlier_spec import OutlierSpec, Range

MIDDLE = 0.12, 0.88  # of the log: where steps and jumps may begin


def sample_times(duration_s: float, dt_s: float, jitter: float, rng: np.random.Generator) -> FloatArray:
    """(n,) increasing times in s from 0 to the duration, both included.

    jitter: largest shift, a share of dt below 0.5; uniform. Rounded to nanoseconds, so that 3 x 0.1 s
    prints as 0.3.
    """
    time = dt_s * np.arange(row_count(duration_s, dt_s))
    if jitter:
        time = np.clip(time + dt_s * rng.uniform(-jitter, jitter, len(time)), 0.0, duration_s)
    return np.round(time, 9)


def row_count(duration_s: float, dt_s: float) -> int:
    """Samples in a record of a duration, both ends included; a last interval short by rounding counts."""
    return int(np.floor(duration_s / dt_s + 1e-6)) + 1


def one_side(n: int, rng: np.random.Generator) -> slice:
    """From a random sample of n, away from the ends, to the nearer end: most of a log is right."""
    first = int(rng.uniform(*MIDDLE) * n)
    return slice(0, first) if 2 * first < n else slice(first, n)


def jumps(time_s: FloatArray, each: tuple[tuple[int, Range], ...], rng: np.random.Generator) -> FloatArray:
    """(n,) seconds that jump at random times, either way, and stay so to the nearer end.

    each: pairs of count and range of seconds.
    """
    found = np.zeros(len(time_s))
    for count, seconds in each:
        for _ in range(count):
            found[one_side(len(time_s), rng)] += rng.choice([-1.0, 1.0]) * rng.uniform(*seconds)
    return found


def kept_rows(time_s: FloatArray, spec: OutlierSpec, rng: np.random.Generator) -> NDArray[np.bool_]:
    """(n,) False in the gaps, anywhere but in the first and last tenth; a gap too long for that is left out."""
    first, last = time_s[0], time_s[-1]
    low, high = first + 0.1 * (last - first), last - 0.1 * (last - first)
    keep = np.ones(len(time_s), bool)
    for count, seconds in spec.gaps:
        for _ in range(count):
            length, share = rng.uniform(*seconds), rng.random()
            start = low + share * (high - low - length)
            if start >= low:
                keep[(time_s > start) & (time_s < start + length)] = False
    return keep


def with_duplicates(n: int, count: int, rng: np.random.Generator) -> tuple[IntArray, NDArray[np.bool_]]:
    """Row numbers with `count` of them repeated (at most n), and a mask of the fresh readings among the repeats.

    Half of the repeats on average are a second, good reading of the same instant; the others copy the row.
    """
    again = rng.choice(n, min(count, n), replace=False)
    rows = np.concatenate([np.arange(n), again])
    fresh = np.concatenate([np.zeros(n, bool), rng.random(len(again)) < 0.5])
    order = np.argsort(rows, kind="stable")
    return rows[order], fresh[order]
