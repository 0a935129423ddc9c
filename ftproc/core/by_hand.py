"""Readings that the engineer accepts, as the editors know them: by their times."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.records import FloatArray


class Accepted(NamedTuple):
    """times: those of the readings of each component, and of the range rates and the heights behind them, that are good
    whatever an editor finds, (m,) s each; nothing if there are none."""

    times: tuple[FloatArray, ...] = ()

    def of(self, time_s: FloatArray, measurement: FloatArray) -> NDArray[np.bool_]:
        """(n, 3) which of some readings these are. time_s (n,), measurement (n, 3)."""
        found = np.isfinite(measurement)
        for c in range(3):
            found[:, c] &= np.isin(time_s, self.times[c]) if self.times else False
        return found

    def rates(self, time_s: FloatArray) -> NDArray[np.bool_]:
        """(n,) which of the range rates at some times (n,) these are."""
        return self._beside(3, time_s)

    def heights(self, time_s: FloatArray) -> NDArray[np.bool_]:
        """The same of heights beside elevations."""
        return self._beside(4, time_s)

    def _beside(self, c: int, time_s: FloatArray) -> NDArray[np.bool_]:
        return np.isin(time_s, self.times[c]) if len(self.times) > c else np.zeros(len(time_s), bool)


NOTHING = Accepted()
