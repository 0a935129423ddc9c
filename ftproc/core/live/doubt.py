"""When all of the window is looked at because its track is in doubt."""

from __future__ import annotations

import math
from typing import NamedTuple

from ftproc.core.live.window import Window

AGAIN_S, GROWTH = 0.5, 0.2  # between looks: so long, or this share of the time since it is in doubt,
SAMPLES = 3  # and so many samples


class Doubt(NamedTuple):
    """When a track in doubt is looked at: not before this row and this time. since_s: when it was first looked at and
    stayed in doubt; NaN where it is not."""

    row: int = 0
    time_s: float = -math.inf
    since_s: float = math.nan

    def is_due(self, window: Window, row: int) -> bool:
        """Whether it is time to look at a track that is in doubt."""
        return row >= self.row and float(window.time_s[-1]) >= self.time_s

    def after_edit(self, window: Window, row: int) -> Doubt:
        now_s = float(window.time_s[-1])
        if not window.in_doubt():
            return Doubt(row + SAMPLES, now_s + AGAIN_S)
        since_s = now_s if math.isnan(self.since_s) else self.since_s
        return Doubt(row + SAMPLES, now_s + max(AGAIN_S, GROWTH * (now_s - since_s)), since_s)
