"""The outlier patches of a trajectory, the steps that were taken out, and the seconds with most outliers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ftproc.quality import faults
from ftproc.records import ISOLATED, MISSING, PATCH, FloatArray
from ftproc.report.view import View

WORST_S = 10.0  # length of the stretch that is shown at once


class Patch(NamedTuple):
    """Readings of a component, from the first to the last of the patch. size: median of reading minus estimate, m or
    mrad; NaN where the raw readings are not known."""

    component: str
    start_s: float
    end_s: float
    readings: int
    size: float
    unit: str


class Step(NamedTuple):
    """A step that stays, which the estimate takes out. component: of the channels, or `clock`. size: with its unit.
    words: what happened, with size and time."""

    component: str
    time_s: float
    size: str
    words: str


def steps(view: View, times: FloatArray | None = None) -> list[Step]:
    """The steps within some times (n,) s, or those of the view, by their time."""
    times = view.trajectory.time_s if times is None else times
    found = [
        Step(step["component"], step["time_s"], faults.size_in_words(step), faults.step_in_words(step, view.summary))
        for step in view.summary.get("steps", ())
    ]
    return sorted((step for step in found if times[0] <= step.time_s <= times[-1]), key=lambda step: step.time_s)


def patches(view: View) -> list[Patch]:
    """All patches by their time; missing readings inside one do not end it."""
    found = []
    time_s = view.trajectory.time_s
    for channel in view.channels:
        there = np.flatnonzero(channel.flags != MISSING)
        inside = np.r_[False, channel.flags[there] == PATCH, False]
        for first, end in np.flatnonzero(inside[1:] != inside[:-1]).reshape(-1, 2):
            rows = there[first:end]
            size = np.nan
            if channel.reading is not None:
                size = float(np.median(channel.reading[rows] - channel.cleaned[rows])) * channel.size.factor
            start_s, end_s = float(time_s[rows[0]]), float(time_s[rows[-1]])
            found.append(Patch(channel.name, start_s, end_s, len(rows), size, channel.size.unit))
    order = [channel.name for channel in view.channels]
    return sorted(found, key=lambda patch: (patch.start_s, order.index(patch.component)))


def worst(view: View) -> tuple[float, float] | None:
    """The WORST_S seconds with most outliers, from and to; None for a log without any, or not longer than that."""
    time_s = view.trajectory.time_s
    outliers = np.isin([channel.flags for channel in view.channels], (ISOLATED, PATCH)).sum(0)
    if not outliers.any() or time_s[-1] - time_s[0] <= WORST_S:
        return None
    before = np.r_[0, np.cumsum(outliers)]
    within = before[np.searchsorted(time_s, time_s + WORST_S, side="right")] - before[:-1]
    first = int(within.argmax())
    last = int(np.searchsorted(time_s, time_s[first] + WORST_S, side="right")) - 1
    spare = WORST_S - float(time_s[last] - time_s[first])  # half of it before
    start = float(np.clip(time_s[first] - spare / 2, time_s[0], time_s[-1] - WORST_S))
    return start, start + WORST_S
