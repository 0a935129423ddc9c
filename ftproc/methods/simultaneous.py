"""Readings that share a stamp, many at once: each component's are one reading, their mean without those far off.

An instrument that reads faster than its clock counts, or sees its target many times in a rotation, gives hundreds of
rows of one time. The windows in which noise, motion and outliers are sought are counted in readings: with a few
instants in each they would show no motion at all.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.model.frames import wrap
from ftproc.methods.estimate import Part, Recording
from ftproc.order_statistics import median
from ftproc.records import GOOD, ISOLATED, MISSING, FloatArray, IntArray

MOST = (
    5  # readings at once, typically: with more, the 11 samples of the shortest window are of less than three instants
)
CUT = 4.5  # sigmas of the scatter about the medians beyond which a reading is no part of the mean, as in screening
SIGMA = 1.4826  # of a normal scatter, in medians of its absolute values


class Simultaneous(NamedTuple):
    """first: (m + 1,) the rows of the log with which its m stamps begin, and their number. measurement: (m, 3) means.
    off: (n, 3) readings that are far from those of the same stamp; missing: (n, 3)."""

    first: IntArray
    measurement: FloatArray
    off: NDArray[np.bool_]
    missing: NDArray[np.bool_]

    def of_stamps(self, recording: Recording) -> Recording:
        """The recording of a reading a stamp."""
        time_s = np.asarray(recording.time_s)[self.first[:-1]]
        uneven = None if recording.uneven is None else recording.uneven.part(self.first[:-1])
        rate = None if recording.range_rate is None else recording.range_rate[self.first[:-1]]
        return replace(
            recording, time_s=time_s, measurement=self.measurement, rejected=None, uneven=uneven, range_rate=rate
        )

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
    return Simultaneous(np.r_[start, len(time_s)], merged, off, ~np.isfinite(measurement))


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


def of(recording: Recording) -> Simultaneous | None:
    """The same of a recording, without the readings that are not to be used."""
    measurement = recording.measurement
    if recording.rejected is not None:
        measurement = np.where(recording.rejected, np.nan, measurement)
    return together(recording.time_s, measurement)
