"""What a window keeps of its samples: the readings as they came, what is taken out of them, and what became of them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.records import Observations, Uneven, empty_rows
from ftproc.core.live.beside import WIDTH, Rates
from ftproc.core.live.newest import levels
from ftproc.core.live.readings import Columns
from ftproc.core.model.frames import wrap
from ftproc.records import MISSING, PATCH, FloatArray


class Kept(Columns):
    """Samples by name of what is kept. measurement: readings (n, 3) without their levels, see `levels`."""

    @classmethod
    def nothing(cls) -> Kept:
        """Of no sample."""
        none, ones = np.zeros((0, 3)), np.ones((0, 3))
        return cls(
            time_s=np.empty(0), measurement=none, possible=none > 0, weight=none, times=ones, late=none,
            label=np.zeros((0, WIDTH)), rate=np.empty(0), rate_weight=np.empty(0), rows=empty_rows(0), level=none,
            level_sigma=none,
        )  # fmt: skip

    @property
    def came(self) -> FloatArray:
        """(n, 4) readings as they came, with the range rates."""
        return np.column_stack([_moved(self["measurement"], self["level"]), self["rate"]])

    def take(self, measurement: FloatArray, accepted: NDArray[np.bool_], **new: Any) -> None:
        """Add samples, with readings (n, 3) whose levels are those of the newest sample, up to one that is good by hand
        (n, 3)."""
        n = len(measurement)
        level, sigma = (self[name][-1].copy() if len(self) else np.zeros(3) for name in ("level", "level_sigma"))
        holds = ~np.logical_or.accumulate(accepted)
        level = level * holds
        self.append(
            measurement=_moved(measurement, -level), level=level, level_sigma=sigma * holds,
            weight=np.zeros((n, 3)), label=np.zeros((n, WIDTH)), rows=empty_rows(n), **new,
        )  # fmt: skip

    def shown(self, low: int, high: int) -> tuple[Any, FloatArray]:
        """Copies of the `Row` records and of the labels (m, 4) of some samples; with a level readings are a patch."""
        rows, label = self["rows"][low:high].copy(), self["label"][low:high].copy()
        level, sigma = self["level"][low:high], self["level_sigma"][low:high]
        readings = label[:, :3]
        readings[(level != 0) & (readings != MISSING)] = PATCH
        levels.widen(rows.view(np.recarray), level, sigma)
        return rows, label

    def observed(self, span: slice, side: Rates) -> Observations:
        """Some samples with the decisions on them (copies). side: of the range rates."""
        time_s, measurement, weight, times, late = (
            self[name][span].copy() for name in ("time_s", "measurement", "weight", "times", "late")
        )
        sides = side.scalars(self["rate"][span].copy(), self["rate_weight"][span].copy())
        return Observations(time_s, measurement, weight, Uneven(times, late), beside=sides)


def _moved(readings: FloatArray, by: FloatArray) -> FloatArray:
    """Readings (n, 3) larger by so much."""
    if not by.any():
        return readings.copy()
    moved: FloatArray = readings + by
    moved[:, 1] = wrap(moved[:, 1])
    return moved
