"""A channel of a station that jumps, or its clock, as the track of the other stations shows it.

Where all stations take part, such a station bends the track, and its own readings count as noise. Beside the track of
the others a clock that jumps is a step of the lateness of all readings at once, and an encoder that slips one of its
own; their constant biases are fitted with it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ftproc.core.editing.lasting import curves
from ftproc.core.editing.lasting.curves import CLOCK, Curve, Setting
from ftproc.core.editing.lasting.weighing import late_of
from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.model import stations as geometry
from ftproc.core.model.frames import wrap
from ftproc.core.model.moving import moved_to
from ftproc.fusion.estimation.events import Events, Seen
from ftproc.records import FloatArray, IntArray

PLACES, FINER = 61, 13  # in which a jump is looked for in a log, and about the best of them
FEWEST = 10  # readings on either side of it
ROUNDS, FAR = 6, 3.0  # of a robust fit, and residuals, in their scale, that count less


class Jump(NamedTuple):
    """From a row of its log on the readings of a channel (range, azimuth, elevation) of a station are larger by a size,
    m, rad, rad, or, where it is CLOCK, their times, s. gain: about, in log-likelihood. later: whether it is those
    readings that are wrong, not those before."""

    channel: int
    row: int
    size: float
    gain: float
    later: bool = True

    def sides(self) -> list[Jump]:
        """It, and, where that is not the same to the other stations, with the readings before it wrong."""
        return [self] if self.channel == CLOCK else [self, self._replace(later=False)]

    def taken_out(self, station: Seen) -> Seen:
        """The station without it."""
        time_s, z = station.time_s.copy(), station.measurement.copy()
        rows, size = (slice(self.row, None), self.size) if self.later else (slice(self.row), -self.size)
        if self.channel == CLOCK:
            time_s[rows] -= size
        else:
            z[rows, self.channel] -= size
        z[:, 1] = wrap(z[:, 1])
        return station._replace(time_s=time_s, measurement=z)


class _Fit(NamedTuple):
    """Residuals (n, 3) in sigmas, beside a track, NaN where there is none; late (n, 3) by which they grow with the
    lateness, per s."""

    off: FloatArray
    late: FloatArray

    def of(self, channel: int) -> FloatArray:
        """(n, 3) by which residuals grow with a channel: in its sigmas, or s."""
        return self.late if channel == CLOCK else np.tile(np.arange(3) == channel, (len(self.off), 1)).astype(float)

    def at(self, row: int, channel: int = CLOCK, most: float = np.inf) -> tuple[float, float]:
        """The robust sum of squares with a jump of a channel before a row, and the jump, in sigmas or s, at most so
        large; of none with the row 0."""
        n, seen = len(self.off), np.isfinite(self.off)
        columns = [self.of(c) for c in (*np.flatnonzero(seen.any(0)).tolist(), CLOCK)]
        later = self.of(channel) * (np.arange(n) >= row)[:, None]
        if row > 0:
            columns.append(later)
        a, b = np.stack([column[seen] for column in columns], 1), self.off[seen]
        size, scale = np.max(np.abs(a), 0) + 1e-300, 1.0
        a, weight = a / size, np.ones(len(b))
        for _ in range(ROUNDS):
            normal = (a * weight[:, None]).T @ a + 1e-9 * np.eye(a.shape[1])
            found = np.linalg.solve(normal, (a * weight[:, None]).T @ b)
            rest = b - a @ found
            scale = max(1.4826 * float(np.median(np.abs(rest))), 1.0)
            weight = 1 / (1 + (rest / (FAR * scale)) ** 2)
        jump = float(found[-1] / size[-1])
        if row > 0 and jump > most:
            return self._replace(off=self.off - most * later).at(0)[0], most
        return float(0.5 * FAR**2 * np.log1p((rest / FAR) ** 2).sum()), jump


def propose(station: Seen, sigma: FloatArray, time_s: FloatArray, state: FloatArray) -> list[Jump]:
    """The likeliest jump of each channel of a station beside states (k, 9) at times (k,) of which it says nothing;
    sigma (3,): of its noise. A clock that jumps forward leaves as long a gap between its readings."""
    n, s = len(station.time_s), moved_to(time_s, state, station.time_s)
    if n < 2 * FEWEST:
        return []
    expected = geometry.measured(s[:, :3], station.place, station.axes)
    late = geometry.design(s, np.tile(station.place, (n, 1)), np.tile(station.axes, (n, 1, 1)))[:, :, 2]
    fit = _Fit(geometry.innovation(station.measurement, expected) / sigma, late / sigma)
    gap_s, none = np.diff(station.time_s, prepend=station.time_s[0]), fit.at(0)[0]
    longest, everywhere = np.argsort(gap_s)[-PLACES:], np.linspace(0, n, PLACES).astype(np.int64)

    def likeliest(channel: int) -> Jump:
        most = gap_s if channel == CLOCK else np.full(n, np.inf)

        def best(rows: IntArray) -> tuple[float, int, float]:
            own = np.unique(np.clip(rows, FEWEST, n - FEWEST)).tolist()
            tried = [(*fit.at(row, channel, most[row]), row) for row in own]
            return max((-loss, row, float(size)) for loss, size, row in tried)

        loss, row, size = max(best(longest), best(everywhere))
        within = 0 if channel == CLOCK and size > 0 else int(everywhere[1])
        while within:  # a clock that jumps back leaves no gap, nor does an encoder
            about = np.linspace(row - within, row + within, FINER).astype(np.int64)
            loss, row, size = max((loss, row, size), best(about))
            within //= FINER // 2
        return Jump(channel, row, size * (1.0 if channel == CLOCK else float(sigma[channel])), none + loss)

    channels = np.flatnonzero(np.isfinite(fit.off).any(0)).tolist()
    return [likeliest(channel) for channel in (*channels, CLOCK)]


def rest_of(
    jump: Jump, s: int, events: Events, log: Observations, model: Model, start: Start, state: FloatArray
) -> float:
    """How much larger the jump of station s is in events in which it was taken out, with the constant offsets of all
    that the station measures."""
    n, at = len(events.time_s), np.flatnonzero(events.station == s)
    begin = int(at[np.searchsorted(events.row[at], jump.row)])
    whole = [Curve(c, 0, n, (0.0,), s) for c in (*np.flatnonzero((log.weight[at] > 0).any(0)).tolist(), CLOCK)]
    setting = Setting(events.time_s, late_of(log, state), events.station)
    found = curves.fitted(log, model, [start], setting, [*whole, Curve(jump.channel, begin, n, (0.0,), s)])
    return float(found.curves[-1].size[0])
