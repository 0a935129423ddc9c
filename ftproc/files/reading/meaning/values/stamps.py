"""Times of a clock whose steps are coarse beside the time from row to row, such as whole seconds at 10 Hz: spread where
the rows are regular and the motion shows it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.errors import InputError
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.meaning.questions import listed
from ftproc.files.reading.meaning.schema import Column
from ftproc.order_statistics import median
from ftproc.records import COMPONENTS, FloatArray

_ROWS = 5000  # by which the clock is judged
_STEPS = (1e-6, 100.0)  # of clocks, s
_LATEST = 1e12  # s
_FEWEST_OF_ONE = 10  # rows of one time that say nothing of when each was taken
_FEWEST = 5  # steps of the clock
_COARSE = 0.5  # of the time from row to row, for a step that counts
_ALIKE = 0.99  # of the times are a few whole steps apart
_TOLERANCE = (0.02, 0.2)  # of the step of the clock, of the time from row to row
_LOST = (9, 3, 1)  # times what phases alone make longer
_RUN = 20  # rows without a lost one, on average
_CLEARLY = 3.0  # standard errors
_BLOCKS = 20  # of rows, by whose differences the standard error is judged


class _Clock(NamedTuple):
    """step: of the clock, s. period: from row to row, s."""

    step: float
    period: float

    def tolerance(self) -> float:
        return min(share * size for share, size in zip(_TOLERANCE, self, strict=True))


class _Runs(NamedTuple):
    """first: the first row of each run of regular rows. low, high: where row 0 of each would be, s, at the earliest and
    at the latest, if the times are cut off; half a step before, if they are rounded."""

    first: NDArray[np.int64]
    low: FloatArray
    high: FloatArray


def spread(quantities: Mapping[str, FloatArray]) -> tuple[FloatArray, tuple[str, ...]]:
    """(n,) times, in regular steps where the clock shows coarse ones and the target moves on from row to row all the
    same; else the times as they are. And a note."""
    time = quantities["time"]
    if not np.isfinite(time).all() or (time[1:] < time[:-1]).any() or (clock := coarse(time)) is None:
        return time, ()
    tolerance = clock.tolerance()
    found = _runs(time, clock, -tolerance)
    rounded = _is_rounded(time, clock, found)
    if not rounded:
        found = _runs(time, clock, tolerance)  # a time that is cut off is before the next step
    if len(found.first) > 1 + len(time) / _RUN or not _moves_evenly(quantities, clock):
        return time, ()
    shift = clock.step / 2 if rounded else 0.0
    low, high = found.low - shift, found.high - shift
    begin = float(time[0]) if low[0] - tolerance <= time[0] <= high[0] + tolerance else 0.0
    on_grid = begin + clock.period * np.ceil((low - tolerance - begin) / clock.period)
    start = np.where(on_grid <= high + tolerance, on_grid, (low + high) / 2)
    each = np.searchsorted(found.first, np.arange(len(time)), side="right") - 1
    return np.maximum.accumulate(start[each] + np.arange(len(time)) * clock.period), (_note(clock, rounded),)


def refuse_one(header: TableHeader, column: Column, time: FloatArray) -> None:
    """Ask for the time where that of all rows is the same: a date alone, or a number that was cut."""
    known = time[np.isfinite(time)]
    if known.size >= _FEWEST_OF_ONE and (known == known[0]).all():
        others = [name for index, name in enumerate(header.names) if index not in column.positions]
        raise InputError(
            f'{header.source}: all {known.size} rows have the same time in "{column.name}", so it does not say when '
            f"each was taken. If another column does, say --columns time=NAME, or time='{column.name}+NAME' for a date "
            f"and a time of day; the others are: {listed(others)}."
        )


def coarse(time: FloatArray) -> _Clock | None:
    """The clock of (n,) non-decreasing times, by the first of them, if its steps are coarse beside the time from row to
    row and the rows are regular; else None."""
    time = time[:_ROWS]
    if len(time) <= _FEWEST or not np.abs(time[[0, -1]]).max() < _LATEST:
        return None
    every = np.diff(time)
    gaps = every[every > 0]
    least = float(gaps.min(initial=math.inf))
    if len(gaps) < _FEWEST or not _STEPS[0] < least < _STEPS[1]:
        return None
    step = round(median(gaps[gaps < 1.5 * least]), 9)
    near = gaps[gaps < 10 * step] / step
    period = (time[-1] - time[0]) / (len(time) - 1)
    on_grid, as_shown = np.abs(near - np.round(near)) < _TOLERANCE[0], np.abs(every / step - 1) < _TOLERANCE[0]
    if step < _COARSE * period or on_grid.mean() < _ALIKE or as_shown.mean() > _ALIKE:
        return None
    clock = min((_Clock(step, each) for each in _periods(time, step, float(period))), key=partial(_count, time))
    whole = clock.period / step
    if step < _COARSE * clock.period or (whole > 0.5 and abs(whole - round(whole)) < _TOLERANCE[0] / _RUN):
        return None
    return clock if _count(time, clock) <= 1 + len(time) / _RUN else None


def _count(time: FloatArray, clock: _Clock) -> int:
    return len(_runs(time, clock, -clock.tolerance()).first)


def _periods(time: FloatArray, step: float, about: float) -> list[float]:
    """The simplest times from row to row, in s, that the clock allows, where no, few or some rows are lost: these only
    make the time longer."""
    longest, best, lag_of_best = int(0.8 * len(time)), math.inf, 1
    widest = step * (1 + _TOLERANCE[0])
    phases = min(2 + 2 * math.ceil(step / about), 200)
    while longest > 1:
        for lag in range(max(1, longest - phases), longest + 1):
            most = (float((time[lag:] - time[:-lag]).min()) + widest) / lag
            if most < best:
                best, lag_of_best = most, lag
        longest //= 2
    slack = (best + widest - step) / lag_of_best
    return [float(_simplest(Fraction(max(best - lost * slack, best / 2)), Fraction(best))) for lost in _LOST]


def _simplest(low: Fraction, high: Fraction) -> Fraction:
    """The fraction of the smallest denominator between two."""
    whole = math.ceil(low)
    if whole <= high:
        return Fraction(whole)
    below = whole - 1
    return below + 1 / _simplest(1 / (high - below), 1 / (low - below))


def _runs(time: FloatArray, clock: _Clock, margin: float) -> _Runs:
    """The runs of rows that one regular clock can have given, with at least this margin between earliest and latest."""
    first, lows, highs = [0], [], []
    low, high = -math.inf, math.inf
    for row, earliest in enumerate((time - np.arange(len(time)) * clock.period).tolist()):
        latest = earliest + clock.step
        if max(low, earliest) > min(high, latest) - margin:
            first.append(row)
            lows.append(low)
            highs.append(high)
            low, high = earliest, latest
        low, high = max(low, earliest), min(high, latest)
    return _Runs(np.array(first), np.array([*lows, low]), np.array([*highs, high]))


def _is_rounded(time: FloatArray, clock: _Clock, runs: _Runs) -> bool:
    """Whether the times are rounded rather than cut off: a log begins at a step of its clock, more often than not; else
    whole seconds are cut off, and other numbers rounded."""
    tolerance, half = clock.tolerance(), clock.step / 2
    cut, rounded = (
        low - tolerance <= time[0] <= high + tolerance
        for low, high in ((runs.low[0], runs.high[0]), (runs.low[0] - half, runs.high[0] - half))
    )
    return bool(rounded) if cut != rounded else clock.step != 1.0


def _moves_evenly(quantities: Mapping[str, FloatArray], clock: _Clock) -> bool:
    """Whether the readings move on as far where the clock shows little or no time as where it shows much."""
    evidence = [_evidence(quantities[q], quantities["time"], clock) for q in COMPONENTS if q in quantities]
    return max(evidence, key=abs, default=0.0) > _CLEARLY


def _evidence(values: FloatArray, time: FloatArray, clock: _Clock) -> float:
    """How many standard errors the share of the way that lies in short intervals is above the middle between their
    share of the rows and their share of the time; negative where the times are right, or the way is something else."""
    around = 2 * math.ceil(clock.step / clock.period) + 1
    if len(values) < 4 * around:
        return 0.0
    direction = np.sign(values[2 * around + 1 :] - values[: -2 * around - 1])
    way, elapsed = (np.diff(column)[around:-around] for column in (values, time))
    most = 5 * np.nanmedian(np.abs(way)) if np.isfinite(way).any() else 0.0
    way = np.nan_to_num(np.clip(way, -most, most) * direction)
    short = elapsed < clock.period
    of_rows, of_time = float(short.mean()), float(elapsed[short].sum() / elapsed.sum())
    middle = (of_rows + of_time) / 2
    above = np.array([each.sum() for each in np.array_split(np.where(short, way, 0.0) - middle * way, _BLOCKS)])
    error = float(above.std()) / len(above) ** 0.5
    evidence = float(above.mean()) / error if error else 0.0
    total = float(way.sum())
    usual = total > 0 and way[short].sum() / total < of_rows + (of_rows - of_time) / 2
    return evidence if usual else -abs(evidence)


def _note(clock: _Clock, rounded: bool) -> str:
    steps = "whole seconds" if clock.step == 1.0 else f"multiples of {clock.step:.4g} s"
    rows = clock.step / clock.period
    rate = f"with {rows:.3g} rows in each" if rows > 1 else f"though rows come every {clock.period:.4g} s"
    return f"the times are {'rounded to ' * rounded}{steps} {rate}, which are spread evenly"
