"""Leap seconds, by which UTC differs from clocks that count every second."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ftproc.records import FloatArray, IntArray

#: The first day after each leap second since the GPS epoch, in days since 1970.
_DAYS = np.array(
    [
        *("1981-07-01", "1982-07-01", "1983-07-01", "1985-07-01", "1988-01-01", "1990-01-01", "1991-01-01"),
        *("1992-07-01", "1993-07-01", "1994-07-01", "1996-01-01", "1997-07-01", "1999-01-01", "2006-01-01"),
        *("2009-01-01", "2012-07-01", "2015-07-01", "2017-01-01"),
    ],
    "datetime64[D]",
).astype(np.int64)
GPS_EPOCH_DAY = int(np.datetime64("1980-01-06", "D").astype(np.int64))
_DAY_S = 86400


def before(day: IntArray) -> IntArray:
    """The number of leap seconds from the GPS epoch to 00:00 UTC of each day (days since 1970), of any shape."""
    return np.searchsorted(_DAYS, day, side="right")


def ends_with_one(day: IntArray) -> NDArray[np.bool_]:
    """Whether the last minute of each day has 61 seconds."""
    return np.isin(np.asarray(day) + 1, _DAYS)


def utc(epoch: str, time_s: FloatArray, first_s: float) -> NDArray[np.datetime64]:
    """UTC as (n,) datetime64[us] of (n,) seconds since `epoch`; it counts from 00:00 again after a leap second.

    first_s: the time of the log's first row, up to which `epoch` is right.
    """
    start = np.datetime64(epoch.removesuffix("Z"), "us")
    known = np.nan_to_num(np.asarray(time_s, float))
    moment = start + np.round(known * 1e6).astype("timedelta64[us]")
    first_day = int((start + np.timedelta64(round(first_s * 1e6), "us")).astype("datetime64[D]").astype(np.int64))
    past = before((moment - np.timedelta64(1, "s")).astype("datetime64[D]").astype(np.int64)) - before(
        np.array(first_day)
    )
    return np.where(np.isnan(time_s), np.datetime64("NaT"), moment - past.astype("timedelta64[s]"))


def gps_epoch(week: int) -> str:
    """The instant (UTC) at which a GPS week begins, such as 2024-05-25T23:59:42Z."""
    day = GPS_EPOCH_DAY + 7 * week
    start = np.datetime64(day * _DAY_S - int(before(np.array(day))), "s")
    return f"{start}Z"
