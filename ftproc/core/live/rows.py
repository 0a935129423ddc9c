"""Rows before there is a track, and rows that leave."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.records import ROW, empty_rows

FloatArray = NDArray[np.float64]

LATELY = 8  # samples whose innovations tell whether the sigmas hold


class Published(NamedTuple):
    """Rows that leave. first: number of the first, from zero. rows: `Row` records (n,), NaN where there is no estimate.
    label: (n, 3) as of `outlier_chain.label_runs`. known: (n,) whether there is an estimate. reacquired: (n,) whether a
    lost track was found again there."""

    first: int
    rows: Any
    label: FloatArray
    known: NDArray[np.bool_]
    reacquired: NDArray[np.bool_]


class Waiting(NamedTuple):
    """Rows before there is a track."""

    time_s: FloatArray
    measurement: FloatArray

    def with_row(self, time_s: FloatArray, measurement: FloatArray) -> Waiting:
        return Waiting(np.concatenate([self.time_s, time_s]), np.concatenate([self.measurement, measurement]))


def unknown_rows(n: int) -> Any:
    """`Row` records without an estimate."""
    rows = empty_rows(n)
    for name in ROW.names or ():
        rows[name] = 0.0 if name in ("weight", "since_start") else np.nan
    return rows


def widened(rows: Any, before: int) -> Any:
    """The rows after so many, their sigmas as much larger as the innovations of the last samples are than expected: a
    filter that has only seen calm flight learns of a manoeuvre late."""
    informed = np.isfinite(rows["nis"])
    nis, used = np.where(informed, rows["nis"], 0.0), np.where(informed, (rows["weight"] > 0).sum(1), 0)
    lately = np.ones(LATELY)
    ratio = np.convolve(nis, lately)[: len(rows)] / np.maximum(np.convolve(used, lately)[: len(rows)], 1.0)
    found, times = rows[before:], np.sqrt(np.maximum(ratio[before:], 1.0))[:, None]
    found["sigma"] *= times
    found["los_sigma"] *= times
    return found
