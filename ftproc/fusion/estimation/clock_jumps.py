"""The clock of a station that jumps, as the track of the other stations shows it.

Where all stations take part, such a clock bends the track, and its own readings count as noise. Beside the track of the
others it is a step of the lateness of all of them at once; their constant biases are fitted with it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ftproc.core.editing.lasting import curves
from ftproc.core.editing.lasting.curves import Curve, Setting
from ftproc.core.editing.lasting.weighing import late_of
from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.model import stations as geometry
from ftproc.core.model.moving import moved_to
from ftproc.fusion.estimation.events import Events, Seen
from ftproc.records import FloatArray, IntArray

PLACES, FINER = 61, 13  # in which a jump is looked for in a log, and about the best of them
FEWEST = 10  # readings on either side of it
ROUNDS, FAR = 6, 3.0  # of a robust fit, and residuals, in their scale, that count less


class Jump(NamedTuple):
    """From a row of its log on the times of a station are larger by size_s. gain: about, in log-likelihood."""

    row: int
    size_s: float
    gain: float

    def taken_out(self, station: Seen) -> Seen:
        """The station without it."""
        time_s = station.time_s.copy()
        time_s[self.row :] -= self.size_s
        return station._replace(time_s=time_s)


class _Fit(NamedTuple):
    """Residuals (n, 3) in sigmas, beside a track, NaN where there is none; late (n, 3) by which they grow with the
    lateness, per s."""

    off: FloatArray
    late: FloatArray

    def at(self, row: int, most_s: float = np.inf) -> tuple[float, float]:
        """The robust sum of squares with a jump before a row, and the jump, s, at most so large; of none with the row
        0."""
        n, seen = len(self.off), np.isfinite(self.off)
        columns = [np.where(np.arange(3) == c, 1.0, np.zeros((n, 3))) for c in range(3) if seen[:, c].any()]
        columns.append(self.late)
        if row > 0:
            columns.append(self.late * (np.arange(n) >= row)[:, None])
        a, b = np.stack([column[seen] for column in columns], 1), self.off[seen]
        size, scale = np.max(np.abs(a), 0) + 1e-300, 1.0
        a, weight = a / size, np.ones(len(b))
        for _ in range(ROUNDS):
            normal = (a * weight[:, None]).T @ a + 1e-9 * np.eye(a.shape[1])
            found = np.linalg.solve(normal, (a * weight[:, None]).T @ b)
            rest = b - a @ found
            scale = max(1.4826 * float(np.median(np.abs(rest))), 1.0)
            weight = 1 / (1 + (rest / (FAR * scale)) ** 2)
        jump_s = float(found[-1] / size[-1])
        if row > 0 and jump_s > most_s:
            later = self.late * (np.arange(n) >= row)[:, None]
            return self._replace(off=self.off - most_s * later).at(0)[0], most_s
        return float(0.5 * FAR**2 * np.log1p((rest / FAR) ** 2).sum()), jump_s


def propose(station: Seen, sigma: FloatArray, time_s: FloatArray, state: FloatArray) -> Jump | None:
    """The likeliest jump of a station's clock beside states (k, 9) at times (k,) of which it says nothing; sigma (3,):
    of its noise. A clock that jumps forward leaves as long a gap between its readings."""
    n, s = len(station.time_s), moved_to(time_s, state, station.time_s)
    if n < 2 * FEWEST:
        return None
    expected = geometry.measured(s[:, :3], station.place, station.axes)
    late = geometry.design(s, np.tile(station.place, (n, 1)), np.tile(station.axes, (n, 1, 1)))[:, :, 2]
    fit = _Fit(geometry.innovation(station.measurement, expected) / sigma, late / sigma)
    gap_s = np.diff(station.time_s, prepend=station.time_s[0])

    def best(rows: IntArray) -> tuple[float, int, float]:
        tried = [(*fit.at(int(row), gap_s[row]), int(row)) for row in np.unique(np.clip(rows, FEWEST, n - FEWEST))]
        return max((-loss, row, float(size_s)) for loss, size_s, row in tried)

    everywhere = np.linspace(0, n, PLACES).astype(np.int64)
    loss, row, size_s = max(best(np.argsort(gap_s)[-PLACES:]), best(everywhere))
    within = int(everywhere[1]) if size_s < 0 else 0
    while within:  # a clock that jumps back leaves no gap
        loss, row, size_s = max(
            (loss, row, size_s), best(np.linspace(row - within, row + within, FINER).astype(np.int64))
        )
        within //= FINER // 2
    return Jump(row, size_s, fit.at(0)[0] + loss)


def rest_of(
    jump: Jump, s: int, events: Events, log: Observations, model: Model, start: Start, state: FloatArray
) -> float:
    """How much larger the jump of station s is, s, in events in which it was taken out, with the constant offsets of
    all that the station measures."""
    n, at = len(events.time_s), np.flatnonzero(events.station == s)
    begin = int(at[np.searchsorted(events.row[at], jump.row)])
    whole = [Curve(c, 0, n, (0.0,), s) for c in (*np.flatnonzero((log.weight[at] > 0).any(0)).tolist(), curves.CLOCK)]
    setting = Setting(events.time_s, late_of(log, state), events.station)
    found = curves.fitted(log, model, [start], setting, [*whole, Curve(curves.CLOCK, begin, n, (0.0,), s)])
    return float(found.curves[-1].size[0])
