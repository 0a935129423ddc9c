"""The outlier patches of a trajectory, the steps that were bridged, and the seconds with most outliers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ftproc.quality import faults
from ftproc.records import COMPONENTS, ISOLATED, MISSING, PATCH
from ftproc.report.style import RESIDUAL_UNIT
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
    """A step that stays, which the estimate bridges. component: one of COMPONENTS, or `clock`. size: with its unit.
    words: what happened, with size and time."""

    component: str
    time_s: float
    size: str
    words: str


def steps(view: View) -> list[Step]:
    """The steps within the times of the view, by their time."""
    times = view.trajectory.time_s
    found = [
        Step(step["component"], step["time_s"], faults.size_in_words(step), faults.step_in_words(step, view.summary))
        for step in view.summary.get("steps", ())
    ]
    return sorted((step for step in found if times[0] <= step.time_s <= times[-1]), key=lambda step: step.time_s)


def patches(view: View) -> list[Patch]:
    """All patches by their time; missing readings inside one do not end it."""
    found = []
    time_s, flags = view.trajectory.time_s, view.trajectory.outlier
    for c, name in enumerate(COMPONENTS):
        there = np.flatnonzero(flags[:, c] != MISSING)
        inside = np.r_[False, flags[there, c] == PATCH, False]
        for first, end in np.flatnonzero(inside[1:] != inside[:-1]).reshape(-1, 2):
            rows = there[first:end]
            size = np.nan
            if view.reading is not None:
                size = float(np.median(view.reading[rows, c] - view.cleaned[rows, c])) * _FACTOR[c]
            start_s, end_s = float(time_s[rows[0]]), float(time_s[rows[-1]])
            found.append(Patch(name, start_s, end_s, len(rows), size, RESIDUAL_UNIT[c].unit))
    return sorted(found, key=lambda patch: (patch.start_s, COMPONENTS.index(patch.component)))


#: From the unit of the readings' figure to that of residuals.
_FACTOR = (1.0, 1e3 * np.pi / 180, 1e3 * np.pi / 180)


def worst(view: View) -> tuple[float, float] | None:
    """The WORST_S seconds with most outliers, from and to; None for a log without any, or not longer than that."""
    time_s, flags = view.trajectory.time_s, view.trajectory.outlier
    outliers = np.isin(flags, (ISOLATED, PATCH)).sum(1)
    if not outliers.any() or time_s[-1] - time_s[0] <= WORST_S:
        return None
    before = np.r_[0, np.cumsum(outliers)]
    within = before[np.searchsorted(time_s, time_s + WORST_S, side="right")] - before[:-1]
    first = int(within.argmax())
    last = int(np.searchsorted(time_s, time_s[first] + WORST_S, side="right")) - 1
    spare = WORST_S - float(time_s[last] - time_s[first])  # half of it before
    start = float(np.clip(time_s[first] - spare / 2, time_s[0], time_s[-1] - WORST_S))
    return start, start + WORST_S
