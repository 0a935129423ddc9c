"""Ticks of time along a track."""

from __future__ import annotations

import numpy as np

from ftproc.files.moments import Moments
from ftproc.records import FloatArray, IntArray

STEPS_S = (*(m * 10.0**k for k in range(-3, 1) for m in (1, 2, 5)), 10, 15, 20, 30, 60, 120, 300, 600, 900, 1800,
           3600, 7200, 10_800, 21_600, 43_200, 86_400)  # fmt: skip
MOST_TICKS = 9
LETTER, LINE = 6.5, 14.0  # CSS pixels of a letter's width, and of a line


def along(moments: Moments, time_s: np.ndarray) -> tuple[IntArray, list[str]]:
    """Rows nearest to round moments, at most MOST_TICKS, and how these are called: clock time, else seconds."""
    span = moments.end_s - moments.start_s
    step = next((each for each in STEPS_S if span / each <= MOST_TICKS), span / MOST_TICKS)
    if not span > 0:
        return np.empty(0, np.int64), []
    zero_ms = moments.zero_ms
    offset = -moments.start_s if zero_ms is None else zero_ms / 1e3  # to clock time, or to seconds since the first row
    first = np.ceil((moments.start_s + offset) / step - 1e-9) * step - offset
    wanted = np.arange(first, moments.end_s + 1e-9 * step, step)
    rows = np.clip(np.searchsorted(time_s, wanted - 1e-9 * step), 0, len(time_s) - 1)
    near = np.abs(time_s[rows] - wanted) < 0.25 * step  # none in a gap
    decimals = max(0, int(np.ceil(-np.log10(step) - 1e-9)))
    said = [_said(moments, float(each), decimals) for each in wanted[near]]
    return rows[near], said


def apart(said: list[str], position: FloatArray) -> list[str]:
    """The names whose box overlaps none before it, "" for the others. position: (n, 2) of them, CSS pixels or NaN."""
    kept: list[int] = []
    for k, name in enumerate(said):
        if np.isnan(position[k]).any():
            continue
        size = np.array([LETTER * len(name), LINE])
        if all((np.abs(position[k] - position[j]) > size).any() for j in kept):
            kept.append(k)
    return [name if k in kept else "" for k, name in enumerate(said)]


def _said(moments: Moments, time_s: float, decimals: int) -> str:
    """Clock time, or seconds since the first row where the log counts from elsewhere, or the time."""
    if moments.utc(time_s) is not None:
        return moments.clock(time_s, decimals)
    return moments.since(time_s, decimals) if moments.counts_from_elsewhere else f"{time_s:,.{decimals}f} s"
