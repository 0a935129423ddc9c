"""Readings that are one measurement: many that share a stamp, and the plots of one turn of an antenna.

An instrument that reads faster than its clock counts, or sees its target many times in a rotation, gives hundreds of
rows of one time. The windows in which noise, motion and outliers are sought are counted in readings: with a few
instants in each they would show no motion at all. Each component's are one reading, their mean without those far off.

A ship is seen by its bow and its stern: a radar gives some plots of it in each turn, at one stamp or within the time in
which the beam passes. One by one they are two targets, of which an editor may choose one. Those that agree are one
reading, their mean, with as many times less variance; an outlier and its neighbours stay alone, for the editor.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.records import Uneven
from ftproc.core.model.frames import wrap
from ftproc.methods.estimate import Part, Recording
from ftproc.order_statistics import median
from ftproc.records import GOOD, ISOLATED, MISSING, FloatArray, IntArray

MOST = (
    5  # readings at once, typically: with more, the 11 samples of the shortest window are of less than three instants
)
CUT = 4.5  # sigmas of the scatter about the medians beyond which a reading is no part of the mean, as in screening
SIGMA = 1.4826  # of a normal scatter, in medians of its absolute values
TURN_S, DWELL = 1.0, 0.05  # of an antenna the shortest turn, and the share of it in which the beam passes a target
SEVERAL, BETWEEN = 0.1, 0.02  # of the gaps: shorter than that at least, and neither so short nor of a turn at most
WITHIN, QUANTILE = 0.8, 1.2816  # share of plots that are no outliers, and its quantile of a normal scatter's size


class Simultaneous(NamedTuple):
    """first: (m + 1,) the rows of the log with which its m stamps begin, and their number. measurement: (m, 3) means.
    off: (n, 3) readings that are far from those of the same stamp; missing: (n, 3). time_s: (m,) mean stamps. times:
    (m, 3) how many times the variance of a single reading each mean has, where that is known."""

    first: IntArray
    measurement: FloatArray
    off: NDArray[np.bool_]
    missing: NDArray[np.bool_]
    time_s: FloatArray
    times: FloatArray | None = None

    @property
    def plots(self) -> int:
        """Rows that are one reading with the row before, of an antenna that turns."""
        return 0 if self.times is None else len(self.off) - len(self.times)

    def of_stamps(self, recording: Recording) -> Recording:
        """The recording of a reading a stamp."""
        uneven = None if recording.uneven is None else recording.uneven.part(self.first[:-1])
        if self.times is not None:
            uneven = uneven or Uneven.none(len(self.times))
            uneven = uneven._replace(times=uneven.times * self.times)
        first, heights = self.first[:-1], recording.heights
        rate = None if recording.range_rate is None else recording.range_rate[first]
        heights = heights and heights._replace(above_m=heights.above_m[first])
        return replace(
            recording, time_s=self.time_s, measurement=self.measurement, rejected=None, uneven=uneven, range_rate=rate,
            heights=heights,
        )  # fmt: skip

    def of_rows(self, part: Part) -> Part:
        """The estimate of all rows from one of the stamps. All rows of a stamp have its state; its first one has its
        innovation, and the weight of it."""
        here = self.first[part.first : part.first + len(part.estimate.label) + 1]
        stamp = np.repeat(np.arange(len(here) - 1), np.diff(here))
        begin, low, high = (int(here[k]) for k in (0, part.low, part.high))
        rows, estimate = slice(begin, int(here[-1])), part.estimate.at(stamp, here - begin)
        label = np.where(self.off[rows], ISOLATED, estimate.label)
        label = np.where((label == MISSING) & ~self.missing[rows], GOOD, label)
        label = np.where(self.missing[rows], MISSING, label).astype(np.uint8)
        return Part(estimate._replace(label=label), begin, low - begin, high - begin)


def together(time_s: FloatArray, measurement: FloatArray) -> Simultaneous | None:
    """What is read at once, of (n,) non-decreasing times and readings (n, 3); None where that is little."""
    new = np.r_[True, time_s[1:] != time_s[:-1]]
    start, group = np.flatnonzero(new), np.cumsum(new) - 1
    if len(time_s) <= MOST * len(start) or median(np.bincount(group)) <= MOST:
        return None
    merged, off = np.full((len(start), measurement.shape[1]), np.nan), np.zeros(measurement.shape, bool)
    for c in range(measurement.shape[1]):
        seen = np.flatnonzero(np.isfinite(measurement[:, c]))
        if len(seen):
            mean, off[seen, c] = _means(measurement[seen, c], group[seen], c == 1)
            merged[np.unique(group[seen]), c] = mean
    return Simultaneous(np.r_[start, len(time_s)], merged, off, ~np.isfinite(measurement), time_s[start])


def _means(values: FloatArray, group: IntArray, angular: bool) -> tuple[FloatArray, NDArray[np.bool_]]:
    """The mean of each group of (m,) values, without those far from its median; and (m,) which these are. group: (m,)
    numbers that do not decrease."""
    _, opening, own, count = np.unique(group, return_index=True, return_inverse=True, return_counts=True)
    first = values[opening]
    away = wrap(values - first[own]) if angular else values - first[own]
    middle = away[np.lexsort((away, own))][opening + count // 2]
    scatter = np.abs(away - middle[own])
    several = scatter[count[own] > 2]
    used = scatter <= (CUT * SIGMA * median(several) if len(several) else np.inf)
    return first + np.bincount(own, np.where(used, away, 0.0)) / np.bincount(own, used), ~used


def plots(time_s: FloatArray, measurement: FloatArray) -> Simultaneous | None:
    """The plots of each turn of an antenna, of (n,) non-decreasing times and readings (n, 3); None of a log that is not
    such a radar's."""
    new = _of_another_turn(time_s)
    if new is None:
        return None
    _, away, count = _grouped(new, measurement)
    several, alone = np.repeat(count > 1, count), np.zeros(len(new), bool)
    for c in np.flatnonzero(np.isfinite(measurement).any(0)):
        size = np.abs(away[:, c])
        seen = size[several & np.isfinite(size)]
        scatter = np.quantile(seen, WITHIN) / QUANTILE if len(seen) else 0.0
        if scatter == 0:  # copies
            return None
        alone |= several & ~(size <= CUT * scatter)
    start = np.flatnonzero(new)
    new |= np.repeat(np.logical_or.reduceat(alone, start), count)
    merged, _, count = _grouped(new, measurement)
    stamp, _, _ = _grouped(new, time_s[:, None] - time_s[0])
    first, times = np.r_[np.flatnonzero(new), len(new)], np.repeat(1 / count[:, None], 3, 1)
    missing, off = ~np.isfinite(measurement), np.zeros(measurement.shape, bool)
    return Simultaneous(first, merged, off, missing, time_s[0] + stamp[:, 0], times)


def _of_another_turn(time_s: FloatArray) -> NDArray[np.bool_] | None:
    """(n,) which rows are of another turn than those before; None without turns of several rows."""
    gap = np.diff(time_s)
    long = gap[gap > gap.mean()] if len(gap) else gap
    turn_s = median(long) if len(long) else 0.0
    new = np.r_[True, gap >= DWELL * turn_s]
    between = (new[1:] & (gap < turn_s / 2)).sum()
    if turn_s < TURN_S or between > BETWEEN * len(gap) or (~new).sum() < SEVERAL * len(gap):
        return None
    start = np.flatnonzero(new)
    span_s = time_s[np.r_[start[1:], len(new)] - 1] - time_s[start]
    rare = span_s.max() < DWELL * turn_s and median(np.diff(np.r_[start, len(new)])) <= MOST
    return new if rare else None


def _grouped(new: NDArray[np.bool_], values: FloatArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """The means (m, c) of values (n, c) of each group, of which the second, if there is one, is an angle; (n, c) how
    far each is from them; and how many there are in each. new: (n,) where a group begins."""
    start, group = np.flatnonzero(new), np.cumsum(new) - 1
    count = np.bincount(group)
    away = values - values[start][group]
    away[:, 1:2] = wrap(away[:, 1:2])
    mean = np.add.reduceat(away, start) / count[:, None]
    return values[start] + mean, away - mean[group], count


def of(recording: Recording) -> Simultaneous | None:
    """What is one measurement in a recording, without the readings that are not to be used."""
    measurement = recording.measurement
    if recording.rejected is not None:
        measurement = np.where(recording.rejected, np.nan, measurement)
    found = together(recording.time_s, measurement)
    return plots(np.asarray(recording.time_s), measurement) if found is None and not recording.accepted.times else found
