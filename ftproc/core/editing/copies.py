"""Readings that were not measured: held from the sample before, drawn on a line between two others, or computed.

An instrument that is slower than its log, or that has nothing new to say, repeats the reading before; a
program that brings several instruments to one clock interpolates. Used as readings, such copies make the noise
seem correlated, and what they say is counted several times. They are distinguished from chance by exact agreement: the
readings of a moving target change by many steps of their rounding, and very seldom by none. A coarse instrument that
sees a slow target repeats its readings too, but then goes on by single steps.

A tracker that has lost its target coasts: it computes where the target should be, and the noise is gone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ftproc.core.editing.screening import stuck
from ftproc.core.identification.stretches import runs_of
from ftproc.core.model.frames import unwrap, wrap
from ftproc.order_statistics import distinct, quantile, typical
from ftproc.records import FloatArray

KindArray = NDArray[np.uint8]

MEASURED, HELD, INTERPOLATED, COMPUTED = 0, 1, 2, 3
ON_GRID, MOSTLY_ON_GRID = 0.05, 0.95  # of a rounding step that a value may be off a multiple, and share that is not
SOME, SOME_ON_GRID = 4000, 0.5  # readings, or steps, that stand for many more; share that is on a grid, or else few are
FEWEST = 20  # readings that must be left
MANY = 6.0  # steps of rounding by which a reading changes typically, or else it is coarse
NEAR = 4.0  # steps within which changes are counted, to know how many are none by chance
LEAST, SHARE, TIMES_CHANCE = 8, 0.03, 3.0  # copies, of all readings, and of those that chance makes, to count
LEAST_ON_LINES = 0.15  # share of a component's readings
NEARLY = 0.2  # of the median that the nearest twentieth of those off the lines are off: more shows rounding that is
# coarse, whatever its step
BENDS = 3  # in a row, which readings that are off make, and no lines from knot to knot
ROUNDING = 1e-12  # of a number
QUIET, IN_A_ROW = 0.05, 14  # of the noise, third differences that have none, and so many of them
NOISE_SHARE, OF_NORMAL = 0.2, 0.2533  # share of third differences that gives the noise, and their limit in its 1-sigma
BEYOND, ALTERNATE = 5.0, -0.3  # times the noise that count, and correlation of third differences that noise has at most
TELLS = 0.2  # of the noise: coarser rounding hides whether there is any
MOVED = 10.0  # times the noise that readings of a target that moves change meanwhile
PRECISION, COARSER, DIFFERENCES = 1e-11, 10.0, 24  # of the typical reading, from which two differ; times that, for a
# step to be one; and differences between neighbouring values, the smallest, from which it is found


def without_copies(
    time_s: FloatArray, measurement: FloatArray, genuine: NDArray[np.bool_] | None = None
) -> tuple[FloatArray, KindArray]:
    """The readings (n, 3), missing where they were not measured, and (n, 3) HELD, INTERPOLATED or COMPUTED there, else
    MEASURED.

    time_s (n,), measurement (n, 3). Repeats of a component that is stuck now and then are outliers, not copies.
    genuine: (n, 3) readings that are no copies whatever they resemble.
    """
    z, kind = measurement.copy(), np.zeros(measurement.shape, np.uint8)
    quiet, moving = np.zeros(z.shape, bool), np.zeros(len(z), bool)
    for c in range(3):
        channel = measurement[:, c]
        there = np.isfinite(channel)
        step = _step(channel[there])
        seen = np.flatnonzero(there & ~stuck(channel, _scatter(channel[there])))
        held = _held(channel[seen], step)
        kind[seen[held], c] = HELD
        seen = seen[~held]
        on_lines, values = _on_lines(time_s[seen], channel[seen], step, c == 1)
        kind[seen[on_lines], c], z[seen, c] = INTERPOLATED, values
        seen = seen[~on_lines]
        quiet[seen, c], moves = _without_noise(time_s[seen], unwrap(channel[seen]) if c == 1 else channel[seen], step)
        moving[seen] |= moves
    kind[quiet & moving[:, None]] = COMPUTED  # a target that rests may be seen without any noise
    z[kind > 0] = np.nan
    if genuine is not None:
        z[genuine], kind[genuine] = measurement[genuine], MEASURED
    return z, kind


def rounding_step(channel: FloatArray) -> float:
    """The step to which the readings (n,) of a component are rounded, NaN where missing; zero if to none that shows.

    The largest of a few differences between neighbouring values of which nearly all values are whole multiples.
    """
    readings = channel[np.isfinite(channel)]
    return _grid(readings, distinct(readings))


def _grid(readings: FloatArray, levels: FloatArray) -> float:
    """The same of readings (m,) that are there; levels: their values in order, each once."""
    steps = np.diff(levels)
    steps = steps[steps > ROUNDING * typical(np.abs(levels))] if len(steps) else steps
    if not len(steps):
        return 0.0
    chosen, level = steps[:: 1 + len(steps) // SOME], float(levels[len(levels) // 2])
    indices = [int(share * (len(chosen) - 1)) for share in (0.5, 0.2, 0.05)]
    some = readings[:: 1 + len(readings) // SOME]
    for step in [*map(float, np.partition(chosen, indices)[indices]), float(steps.min())]:
        if _on_grid(some, level, step) > SOME_ON_GRID and _on_grid(readings, level, step) >= MOSTLY_ON_GRID:
            return step
    return 0.0


def _on_grid(readings: FloatArray, level: float, step: float) -> float:
    """Share of the readings (m,) that are whole steps away from a level."""
    multiple = (readings - level) / step
    return float(np.mean(np.abs(multiple - np.round(multiple)) < ON_GRID))


def _step(values: FloatArray) -> float:
    """The step to which readings (m,) are rounded; zero if to none that shows. In a short log no two of them need lie a
    single step apart, so it is the greatest common divisor of small differences."""
    levels = distinct(values)
    step, differences = _grid(values, levels), np.diff(levels)
    least = PRECISION * typical(np.abs(values)) if len(values) else 0.0
    differences = differences[differences > least]
    if step > 0 or not len(differences):
        return step
    smallest = min(DIFFERENCES, len(differences))
    differences = np.sort(np.partition(differences, smallest - 1)[:smallest])
    step = float(differences[0])
    for other in differences[1:].tolist():
        while other > least:
            step, other = other, abs(step - round(step / other) * other)
    return step if step > COARSER * least and _on_grid(values, values[0], step) >= MOSTLY_ON_GRID else 0.0


def _scatter(values: FloatArray) -> float:
    """1-sigma of the noise of readings (m,), copies left out, by their second differences; NaN if there is none."""
    fresh = values[np.r_[True, np.diff(values) != 0]] if len(values) else values
    sigma = typical(np.abs(np.diff(fresh, 2))) / (0.6745 * np.sqrt(6)) if len(fresh) > 2 else 0.0
    return sigma or np.nan


def _held(values: FloatArray, step: float) -> NDArray[np.bool_]:
    """(m,) readings that repeat the one before, if they are so many that they were not measured."""
    none = np.zeros(len(values), bool)
    change = np.abs(np.diff(values))
    moved = change[change > 0]
    if len(moved) < FEWEST or typical(moved) < MANY * step:
        return none
    begins = np.flatnonzero(np.r_[True, change > 0])
    length = np.diff(np.r_[begins, len(values)])
    onward = np.r_[change[begins[1:] - 1], np.inf]  # the change that ends each run
    resting = (length > 2) & (onward <= 2 * step)  # a target that stands
    found = np.repeat(~resting, length)
    found[begins] = False
    return found if _are_many(int(found.sum()), moved, step, len(values)) else none


def _are_many(count: int, off: FloatArray, step: float, readings: int) -> bool:
    """Whether so many agreements are no chance, by how many of those that do not agree (m,) are off by little."""
    chance = float(np.sum(off <= NEAR * step)) / (2 * NEAR)
    return bool(count > max(LEAST, SHARE * readings, TIMES_CHANCE * chance + LEAST * np.sqrt(chance)))


def _on_lines(
    time_s: FloatArray, values: FloatArray, step: float, angular: bool
) -> tuple[NDArray[np.bool_], FloatArray]:
    """(m,) readings on the lines between others, if they are so many that they were not measured; and (m,) the values,
    of which those about a knot are what was measured there."""
    on, interval = np.zeros(len(values), bool), np.diff(time_s)
    if len(values) < FEWEST or not (interval > 0).all():
        return on, values
    rise = wrap(np.diff(values)) if angular else np.diff(values)
    slope = rise / interval
    off = np.abs(np.diff(slope)) * interval[:-1] * interval[1:] / (interval[:-1] + interval[1:])
    limit = 1.01 * step + ROUNDING * float(np.abs(values).max())
    flat = off <= limit
    knots = ~flat
    for begin, end in runs_of(knots, BENDS):
        knots[begin:end] = False
    others = off[knots]
    if len(others) < FEWEST or typical(others) < MANY * limit or flat.sum() < LEAST_ON_LINES * len(values):
        return on, values
    if quantile(others, 0.05) > NEARLY * typical(others):
        return on, values
    if not _are_many(int(flat.sum()), others, limit, len(values)):
        return on, values
    on[1:-1] = flat
    values = values.copy()
    for begin, end in runs_of(~on):
        kept = begin
        if end - begin == 2 and begin > 0 and end < len(values):  # the knot lies between the two, where the lines meet
            bend = slope[end - 1] - slope[begin - 1]
            late = (slope[begin] - slope[begin - 1]) / bend if bend != 0 else 0.0
            late = interval[begin] * (1 - float(np.clip(late, 0.0, 1.0)))  # from the first of the two
            kept = begin + (late > 0.5 * interval[begin])
            away = -late if kept == begin else interval[begin] - late
            values[kept] -= 0.5 * bend * abs(away)  # from its line to the curve through the knots
        on[begin:end] = True
        on[kept:end:2] = False
    on[[0, -1]] = False
    return on, values


@np.errstate(over="ignore", invalid="ignore")  # of times 1e-300 s apart
def _without_noise(time_s: FloatArray, values: FloatArray, step: float) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(m,) readings of a stretch without noise, by their third divided differences, and those that move meanwhile."""
    found, moving = np.zeros(len(values), bool), np.zeros(len(values), bool)
    if len(values) < FEWEST + IN_A_ROW or not (np.diff(time_s) > 0).all():
        return found, moving
    a, b, c = (np.diff(time_s)[k : len(time_s) - 3 + k] for k in range(3))
    share = 1 / np.stack([a * (a + b) * (a + b + c), a * b * (b + c), (a + b) * b * c, (a + b + c) * (b + c) * c])
    first = np.diff(values) / np.diff(time_s)
    second = np.diff(first) / (time_s[2:] - time_s[:-2])
    third = np.diff(second) / (time_s[3:] - time_s[:-3]) / np.sqrt((share**2).sum(0))
    off = np.abs(third)
    noise = quantile(off, NOISE_SHARE) / OF_NORMAL
    third, limit = np.clip(third, -BEYOND * noise, BEYOND * noise), max(QUIET * noise, step)
    if limit < TELLS * noise and (third[1:] * third[:-1]).sum() < ALTERNATE * (third**2).sum():
        for begin, end in runs_of(off <= limit, IN_A_ROW):
            found[begin : end + 3] = True
            moving[begin : end + 3] = np.ptp(values[begin : end + 3]) > MOVED * noise
    return found, moving
