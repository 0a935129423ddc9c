"""Rows before there is a track, and rows that leave."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.records import ROW, empty_rows
from ftproc.core.filtering.smoother import SmootherRun
from ftproc.core.live.beside import WIDTH
from ftproc.core.live.window import Window
from ftproc.records import FloatArray

ASSUMED_READING = (10_000.0, 0.0, 0.0)  # m, rad, rad: of what was never seen
FASTEST_MPS = 12_000.0  # of what stays with the earth: a velocity with such a 1-sigma is not known at all
LATELY = 8  # samples whose innovations tell whether the sigmas hold


class Published(NamedTuple):
    """Rows that leave. first: number of the first, from zero. rows: `Row` records (n,), NaN where there is no estimate.
    label: (n, 4) as of `outlier_chain.label_runs`, and of range rates. known: (n,) whether there is an estimate.
    reacquired: (n,) whether a lost track was found again there. absent: components that were never seen by then."""

    first: int
    rows: Any
    label: FloatArray
    known: NDArray[np.bool_]
    reacquired: NDArray[np.bool_]
    absent: tuple[int, ...] = ()

    def part(self, rows: slice) -> Published:
        """Some of them."""
        label, known, again = self.label[rows], self.known[rows], self.reacquired[rows]
        return Published(self.first + (rows.start or 0), self.rows[rows], label, known, again, self.absent)


class Waiting(NamedTuple):
    """Rows before there is a track: time_s (n,), measurement (n, 4)."""

    time_s: FloatArray
    measurement: FloatArray

    @classmethod
    def nothing(cls) -> Waiting:
        return cls(np.empty(0), np.empty((0, WIDTH)))

    def with_rows(self, time_s: FloatArray, measurement: FloatArray) -> Waiting:
        return Waiting(np.concatenate([self.time_s, time_s]), np.concatenate([self.measurement, measurement]))

    def without(self, left: int, kept: int) -> Waiting:
        """Without the first of those that have left; so many in all are kept, and now and then twice as many."""
        drop = min(left, len(self.time_s) - kept)
        return Waiting(self.time_s[drop:], self.measurement[drop:]) if drop > kept else self


class Smoothed(NamedTuple):
    """Rows from this one on, as the smoother has them, with their labels."""

    first: int
    run: SmootherRun
    label: FloatArray


def with_estimate(
    window: Window, first: int, samples: slice, absent: tuple[int, ...], smoothed: Smoothed | None
) -> Published:
    """The rows of some samples of a window. first: the number of the first. smoothed: these rows, if there is a lag."""
    before = min(LATELY - 1, samples.start)
    rows, label = window.shown(samples.start - before, samples.stop)
    rows, label = widened(rows, before), label[before:]
    if smoothed is not None:
        found = slice(first - smoothed.first, first - smoothed.first + len(rows))
        label = smoothed.label[found].copy()
        for name in ("state", "sigma", "los_sigma", "path_sigma"):
            rows[name] = getattr(smoothed.run, name)[found]
    label[:, list(absent)] = 3.0
    again = np.isin(np.arange(samples.start, samples.stop), window.reacquired)
    return Published(first, rows, label, without_what_is_lost(rows), again, absent)


def with_stand_ins(measurement: FloatArray, absent: tuple[int, ...]) -> FloatArray:
    """The readings (n, 4) with constants for components that were never seen; they keep the filter upright, and nothing
    that rests on them is published."""
    readings = measurement.copy()
    for c in absent:
        readings[:, c] = ASSUMED_READING[c]
    return readings


def without_estimate(first: int, measurement: FloatArray) -> Published:
    """Rows of which nothing is known but their readings (n, 3)."""
    rows, nothing = empty_rows(len(measurement)), np.zeros(len(measurement), bool)
    _forget(rows)
    return Published(first, rows, np.where(np.isfinite(measurement), 0.0, 3.0), nothing, nothing)


def _forget(rows: Any) -> None:
    for name in ROW.names or ():
        rows[name] = 0.0 if name in ("weight", "since_start") else np.nan


def without_what_is_lost(rows: Any) -> NDArray[np.bool_]:
    """(n,) whether rows (n,) have an estimate, which is taken out of the others: after a gap of years a covariance may
    hold no variances any more, or say nothing, as of what manoeuvres harder than its readings can follow."""
    known: NDArray[np.bool_] = ((rows["sigma"] > 0) & np.isfinite(rows["sigma"])).all(1)
    known &= np.isfinite(rows["state"]).all(1) & (rows["sigma"][:, 3:6] < FASTEST_MPS).all(1)
    if not known.all():
        lost = rows[~known]
        _forget(lost)
        rows[~known] = lost
    return known


def widened(rows: Any, before: int) -> Any:
    """The rows after so many, their sigmas as much larger as the innovations of the last samples are than expected: a
    filter that has only seen flight without manoeuvres learns of a manoeuvre late."""
    informed = np.isfinite(rows["nis"])
    nis, used = np.where(informed, rows["nis"], 0.0), np.where(informed, (rows["weight"] > 0).sum(1), 0)
    lately = np.ones(LATELY)
    ratio = np.convolve(nis, lately)[: len(rows)] / np.maximum(np.convolve(used, lately)[: len(rows)], 1.0)
    found, times = rows[before:], np.sqrt(np.maximum(ratio[before:], 1.0))[:, None]
    found["sigma"] *= times
    found["los_sigma"] *= times
    found["path_sigma"] *= times
    return found
