"""When all of the window is looked at because its track is in doubt."""

from __future__ import annotations

import math
from typing import NamedTuple

from ftproc.core.live.window import Window

AGAIN_S, GROWTH, SAMPLES = 0.5, 0.2, 3  # between looks: so long, or this share of the time since it is in doubt, and so
# many samples


class Doubt(NamedTuple):
    """When a track in doubt is looked at: not before this row and this time. since_s: since when it is in doubt."""

    row: int = 0
    time_s: float = -math.inf
    since_s: float = 0.0

    def is_due(self, window: Window, row: int) -> bool:
        return row >= self.row and float(window.time_s[-1]) >= self.time_s and window.in_doubt()

    def after_edit(self, window: Window, row: int) -> Doubt:
        now_s = float(window.time_s[-1])
        since_s = self.since_s if window.in_doubt() else now_s
        return Doubt(row + SAMPLES, now_s + max(AGAIN_S, GROWTH * (now_s - since_s)), since_s)
