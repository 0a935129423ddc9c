"""Times that a program wrote in whole seconds, though several rows stand in each: spread where the motion shows it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ftproc.records import COMPONENTS, FloatArray

_FEWEST = 5  # seconds
_ALIKE = 0.8  # of the seconds hold the usual number of rows, or one more or less
_NOISE = 2.0  # times the step from row to row, for a way that shows
_EVEN = (0.6, 1.4)  # of the way that evenly sampled rows go within a second


def spread(quantities: Mapping[str, FloatArray]) -> tuple[FloatArray, tuple[str, ...]]:
    """(n,) times with the rows of each second spread over it, if all times are whole and the target moves on within a
    second as it does from one to the next; else the times as they are. And a note."""
    time = quantities["time"]
    if not len(time) or not np.isfinite(time).all() or (time[1:] < time[:-1]).any() or (time != np.round(time)).any():
        return time, ()
    second, first, count = np.unique(time, return_index=True, return_counts=True)
    usual = int(np.median(count))
    if len(second) < _FEWEST or usual < 2 or np.mean(np.abs(count[1:-1] - usual) <= 1) < _ALIKE:
        return time, ()
    ways = [way for q in COMPONENTS if q in quantities and (way := _way(quantities[q], first)) is not None]
    if not ways:
        return time, ()
    _, inside = max(ways)
    if not _EVEN[0] <= inside * usual / (usual - 1) <= _EVEN[1]:
        return time, ()
    size = count.copy()
    size[[0, -1]] = np.maximum(size[[0, -1]], usual)  # the log begins and ends within a second
    place = np.arange(len(time)) - np.repeat(first, count)
    place[: count[0]] += size[0] - count[0]
    note = f"the times are whole seconds with {usual} rows in each, which are spread evenly"
    return time + place / np.repeat(size, count), (note,)


def _way(values: FloatArray, first: NDArray[np.intp]) -> tuple[float, float] | None:
    """How clearly a reading moves from second to second, and which share of that way its rows go within one."""
    last = np.r_[first[1:], len(values)] - 1
    on = np.diff(values[first])
    within = (values[last] - values[first])[:-1]
    known = np.isfinite(on) & np.isfinite(within)
    step = np.nanmedian(np.abs(np.diff(values)))
    if known.sum() < _FEWEST or not step:
        return None
    typical = float(np.median(np.abs(on[known])))
    if typical < _NOISE * float(step):
        return None
    return typical / float(step), float(np.median(within[known] * np.sign(on[known])) / typical)
