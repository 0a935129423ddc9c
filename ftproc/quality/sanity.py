"""Whole logs that cannot be a flight. Single wild readings are no matter: they are for the editing."""

from __future__ import annotations

import numpy as np

from ftproc.errors import InputError, row_named
from ftproc.records import FloatArray, IntArray, MeasurementLog, chunks, forget, thinned

FARTHEST_M = 1e12  # half of all ranges beyond: a mistaken column or unit
SHORTEST_S = 1e-6  # a log of several times that lasts less: a mistaken unit
MOST_RANGES = 250_000  # of a longer log only every so many are looked at
LATEST_S = 1e11  # 3000 years: what is beyond counts no seconds, and its differences would lose their fractions


def check(log: MeasurementLog) -> IntArray:
    """(3,) readings of each component. Raises InputError for a log without any, or with times or ranges that are
    none."""
    if len(log) == 0:
        raise InputError(f"{log.name}: no row has a time, so there is nothing to filter; check the time column.")
    count = np.zeros(3, np.int64)
    for rows in chunks(len(log)):
        count += np.isfinite(log.measurement[rows]).sum(0)
        forget(log.measurement)
    if not count.any():
        raise InputError(
            f"{log.name}: range, azimuth and elevation are missing in every row; check the columns and their names."
        )
    _check_times(log)
    _check_ranges(log.name, thinned(log.measurement[:, 0], MOST_RANGES))
    return count


def _check_times(log: MeasurementLog) -> None:
    for k in (0, -1):  # they are in order
        if not abs(log.time_s[k]) <= LATEST_S:
            raise InputError(
                f"{log.name}: {row_named(int(log.row[k]))}: the time {log.time_s[k]:g} s is none of a flight; correct "
                "it, or name its unit (--units time=ms or time=us)."
            )
    lasts = float(log.time_s[-1] - log.time_s[0])
    if 0 < lasts < SHORTEST_S:
        raise InputError(f"{log.name}: the whole log lasts {lasts:.3g} s; check the time column and its unit.")


def _check_ranges(name: str, ranges: FloatArray) -> None:
    known = ranges[np.isfinite(ranges)]
    within = np.clip(known, -2 * FARTHEST_M, 2 * FARTHEST_M)  # the middle of two huge ones would overflow
    typical = float(np.median(within)) if known.size else 1.0
    if 0 < typical <= FARTHEST_M:
        return
    what = "zero" if typical == 0 else "negative" if typical < 0 else f"beyond {FARTHEST_M:g} m"
    raise InputError(
        f"{name}: half of the ranges are {what}, which is no slant range; check the column and its unit, or leave it "
        "out with --columns range=none."
    )
