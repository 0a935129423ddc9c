"""Fewer points that appear the same: the extremes of every pixel column, and breaks at gaps of the log."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ftproc.quality.statistics import GAP_INTERVALS
from ftproc.records import FloatArray, IntArray

COLUMNS = 1000  # pixel columns of a wide figure; at most two points are drawn in each
MOST_MARKED = 200_000  # flagged readings, of which the page holds all; it is then below 8 MB


@dataclass(frozen=True)
class Timeline:
    """The times of a log, divided into pixel columns.

    time_s: (n,). first: (m,) first sample of each column with samples. stretch: (n,) number of gaps before each
    sample; a line is broken where it changes.
    """

    time_s: FloatArray
    first: IntArray
    stretch: IntArray

    @property
    def thinned(self) -> bool:
        """Whether any column holds more samples than are drawn."""
        return len(self.first) < len(self.time_s)

    @classmethod
    def of(cls, time_s: FloatArray, columns: int = COLUMNS) -> Timeline:
        interval = np.diff(time_s)
        width = float(time_s[-1] - time_s[0]) / columns  # a gap inside a column is invisible
        limit = max(GAP_INTERVALS * float(np.median(interval)), width) if len(interval) else 0.0
        stretch = np.r_[0, np.cumsum((interval > limit) & (limit > 0))]
        if len(time_s) <= 2 * columns:
            return cls(time_s, np.arange(len(time_s)), stretch)
        edges = np.linspace(time_s[0], time_s[-1], columns, endpoint=False)
        return cls(time_s, np.unique(np.searchsorted(time_s, edges)), stretch)

    def extremes(self, *values: FloatArray) -> IntArray:
        """Samples, in order, at which any of the values (n,) is least or greatest in its column; NaN is not."""
        found = np.zeros(len(self.time_s), bool)
        if not self.thinned:
            found |= np.any([np.isfinite(v) for v in values], axis=0)
        else:
            for value in values:
                found[_arguments(np.fmin, value, self.first)] = True
                found[_arguments(np.fmax, value, self.first)] = True
        return np.flatnonzero(found)

    def line(self, value: FloatArray, over_missing: bool = False) -> tuple[FloatArray, FloatArray]:
        """Times and values of a line; NaN where it is broken by a gap or, unless over_missing, by missing values."""
        return self.broken(self.extremes(value), value, over_missing)

    def broken(self, chosen: IntArray, value: FloatArray, over_missing: bool = False) -> tuple[FloatArray, FloatArray]:
        """The line through samples already chosen."""
        stretch = self.stretch if over_missing else self.stretch + np.cumsum(~np.isfinite(value))
        after = np.flatnonzero(np.diff(stretch[chosen])) + 1
        return np.insert(self.time_s[chosen], after, np.nan), np.insert(value[chosen], after, np.nan)

    def means(self, value: FloatArray, intervals: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Middle time, sum and number of the finite values (n,) in each of so many equal intervals."""
        edges = np.linspace(self.time_s[0], self.time_s[-1], intervals + 1)
        which = np.clip(np.searchsorted(edges, self.time_s, side="right") - 1, 0, intervals - 1)
        there = np.isfinite(value)
        total: FloatArray = np.bincount(which[there], value[there], intervals).astype(float)
        count: FloatArray = np.bincount(which[there], minlength=intervals).astype(float)
        middle: FloatArray = (edges[1:] + edges[:-1]) / 2
        return middle, total, count


def _arguments(least: np.ufunc, value: FloatArray, first: IntArray) -> IntArray:
    """The first sample in each column that has the least (greatest) value there."""
    extreme = least.reduceat(value, first)
    column = np.repeat(np.arange(len(first)), np.diff(np.r_[first, len(value)]))
    hits = np.flatnonzero(value == extreme[column])
    return hits[np.unique(column[hits], return_index=True)[1]]
