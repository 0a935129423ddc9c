"""Whether readings agree on a track, and when all of the window is edited because its track is in doubt."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ftproc.core.editing.two_pass import Known
from ftproc.core.filtering.initialization import FEWEST_READINGS
from ftproc.core.live.beside import RATE
from ftproc.core.live.pieces import Sizes
from ftproc.core.live.rows import Waiting, with_stand_ins
from ftproc.core.live.window import Window

AGAIN_S, GROWTH = 0.5, 0.2  # between edits: so long, or this share of the time since it is in doubt,
SAMPLES = 3  # and so many samples
NEWEST, AGREE = 8, 0.6  # readings of a component, and share of them that must be good for a track to be confirmed
PATIENCE = 64  # samples after which the noise of a component with few readings is assumed
ASSUMED_SIGMA = (10.0, 1e-3, 1e-3)  # m, rad, rad: of what was seldom seen
LARGEST_SIGMA = 1.0  # times the noise of a single reading, as 1-sigma of the position: then there is no track


def track_of(waiting: Waiting, known: Known, sizes: Sizes, kind: Callable[..., Window]) -> Window | None:
    """The track of some readings, edited, in a window of that kind; None where they do not agree on one."""
    seen = np.isfinite(waiting.measurement[:, :RATE]).sum(0)
    few = seen < FEWEST_READINGS
    if seen.sum() < 2 * FEWEST_READINGS or ((few & (seen > 0)).any() and len(waiting.time_s) < PATIENCE):
        return None
    absent = tuple(np.flatnonzero(seen == 0).tolist())
    sigma = np.where(few & np.isnan(known.sigma), ASSUMED_SIGMA, known.sigma)
    readings = with_stand_ins(waiting.measurement, absent)
    window = kind(waiting.time_s, readings, known._replace(sigma=sigma), sizes, absent)
    try:
        window.edit()
    except ValueError:  # a component has too few readings that agree
        return None
    return window if is_track(window) else None


def is_track(window: Window) -> bool:
    """Whether the newest readings of a window that has been edited agree on a track."""
    return bool((window.used_lately(NEWEST) >= AGREE).all()) and _relative_sigma(window) < LARGEST_SIGMA


def _relative_sigma(window: Window) -> float:
    """1-sigma of the newest position, in units of that of a single reading."""
    ((newest,), _) = window.shown(len(window) - 1, len(window))
    range_m = np.linalg.norm(newest["state"][:3])
    noise_m = np.sqrt(window.model.reading_variance) * np.array([1.0, range_m, range_m])
    return float(np.linalg.norm(newest["sigma"][:3]) / np.linalg.norm(noise_m))


class Doubt(NamedTuple):
    """When all of the window is edited for a track in doubt: not before this row and this time. since_s: when it first
    was and stayed in doubt; NaN where it is not."""

    row: int = 0
    time_s: float = -math.inf
    since_s: float = math.nan

    def is_due(self, window: Window, row: int) -> bool:
        """Whether an edit for a track in doubt is due."""
        return row >= self.row and float(window.time_s[-1]) >= self.time_s

    def after_edit(self, window: Window, row: int) -> Doubt:
        now_s = float(window.time_s[-1])
        if not window.in_doubt():
            return Doubt(row + SAMPLES, now_s + AGAIN_S)
        since_s = now_s if math.isnan(self.since_s) else self.since_s
        return Doubt(row + SAMPLES, now_s + max(AGAIN_S, GROWTH * (now_s - since_s)), since_s)
