"""A track while it is flown: push readings as they come, get the rows whose lag has passed."""

from __future__ import annotations

import bisect
import itertools
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ftproc.core.identification import unseen_motion
from ftproc.core.live.rows import Published
from ftproc.core.model.frames import from_cartesian, measurement_sigma
from ftproc.errors import InputError, UsageError
from ftproc.methods import live, registry
from ftproc.methods.estimate import FARTHEST, Estimate
from ftproc.quality import sanity
from ftproc.records import MISSING, FloatArray, IntArray, Trajectory
from ftproc.settings import FilterSettings


class Live:
    """Live editing and filtering of one track (settings.editing `live` or `forward`), in memory that does not grow:
    where so many rows come in the lag that they would fill it, they are published earlier.

        track = ftproc.Live(FilterSettings(editing="live", lag_s=2.0))
        for row in receiver:
            published = track.push(row.time_s, row.range_m, row.azimuth_rad, row.elevation_rad)

    A row is published as soon as a reading comes that is more than the lag later; with lag 0, at once. The rows are
    those that `ftproc filter --editing live --lag S` writes of the same readings. late: readings that came too late to
    be used, or twice the same time after it was published; they are counted, not published.
    """

    def __init__(self, settings: FilterSettings | None = None) -> None:
        """settings: editing `live` (also where they say `two-pass`, the default) or `forward`. Raises UsageError."""
        settings = settings or FilterSettings()
        if settings.editing == "two-pass":
            settings = replace(settings, editing="live")
        sanity.check_settings(settings)
        if settings.method != registry.MAIN or settings.editing == "none" or settings.smooth:
            raise UsageError(f"Live runs {registry.MAIN} with editing live or forward, not smoothed.")
        self.settings, self.late = settings, 0
        self._editor = live.editor(settings)
        self._begins_s: float | None = None
        self._time_s: list[float] = []  # of the rows that have not left, in the order of their times,
        self._row: list[int] = []  # and their numbers
        self._taken, self._left_s = 0, -np.inf
        self.latest: Estimate | None = None

    @property
    def waiting(self) -> int:
        """How many rows have not been published."""
        return len(self._row)

    def push(
        self,
        time_s: ArrayLike,
        range_m: ArrayLike,
        azimuth_rad: ArrayLike,
        elevation_rad: ArrayLike,
        row: ArrayLike | None = None,
    ) -> Trajectory:
        """Take one reading, or several: numbers or arrays (n,), s, m, rad, rad; NaN where a component is missing. A row
        may come out of time order by less than the lag. row: their numbers, by which they are published; without,
        they are counted from 0. Returns the rows published now, of which there may be none. Raises InputError for a
        time that is not a number or not that of a flight.
        """
        components = (range_m, azimuth_rad, elevation_rad)
        readings = np.broadcast_arrays(*(np.atleast_1d(np.asarray(each, float)) for each in components))
        times = np.atleast_1d(np.asarray(time_s, float))
        measurement = np.clip(np.stack(readings, 1), -FARTHEST, FARTHEST)
        if times.shape != measurement.shape[:1]:
            raise InputError(f"there are {len(times)} times for {len(measurement)} readings; give as many of each.")
        rows = self._taken + np.arange(len(times)) if row is None else np.atleast_1d(np.asarray(row, np.int64))
        if rows.shape != times.shape:
            raise InputError(f"there are {len(rows)} row numbers for {len(times)} readings; give as many of each.")
        if not (np.abs(times) <= sanity.LATEST_S).all():
            worst = int(np.flatnonzero(~(np.abs(times) <= sanity.LATEST_S))[0])
            raise InputError(f"row {rows[worst]}: the time {times[worst]:g} s is not that of a flight.")
        self._taken += len(times)
        found = []
        for low, high in self._ordered(times):
            found += self._push(times[low:high], measurement[low:high], rows[low:high].tolist())
        return self._published(found)

    def finish(self) -> Trajectory:
        """The rows that wait for their lag, when no more readings come."""
        return self._published(self._editor.finish())

    def _ordered(self, times: FloatArray) -> list[tuple[int, int]]:
        """The runs of rows whose times never decrease, the newest so far included."""
        newest = self.newest_s
        back = np.flatnonzero(times < np.maximum.accumulate(np.r_[newest, times[:-1]]))
        edges = sorted({0, len(times), *back.tolist(), *(back + 1).tolist()})
        return list(itertools.pairwise(edges))

    @property
    def newest_s(self) -> float:
        """The newest time so far."""
        return self._time_s[-1] if self._time_s else self._left_s

    def _push(self, times: FloatArray, measurement: FloatArray, rows: list[int]) -> list[Published]:
        if self._begins_s is None:
            self._begins_s = float(times[0])
        if times[0] < self.newest_s:
            if not self._editor.insert(float(times[0]) - self._begins_s, measurement[:1]):
                self.late += 1
                return []
            place = bisect.bisect_right(self._time_s, float(times[0]))
            self._time_s.insert(place, float(times[0]))
            self._row.insert(place, rows[0])
            return []
        self._time_s += times.tolist()
        self._row += rows
        return self._editor.push(times - self._begins_s, measurement)

    def _published(self, found: list[Published]) -> Trajectory:
        count = sum(len(each.rows) for each in found)
        time_s, row = np.array(self._time_s[:count]), np.array(self._row[:count], np.int64)
        del self._time_s[:count], self._row[:count]
        if not count:
            return _trajectory(row, time_s, None)
        self._left_s = float(time_s[-1])
        self.latest = live.estimate(self._editor, found, time_s)
        return _trajectory(row, time_s, self.latest)


def _trajectory(row: IntArray, time_s: FloatArray, estimate: Estimate | None) -> Trajectory:
    """The rows of an estimate; none without one."""
    n = len(row)
    if estimate is None:
        none = np.empty((0, 3))
        nothing = (none, np.empty((0, 9)), np.empty((0, 9)), none, none.astype(np.uint8), np.empty(0), np.empty((0, 6)))
        return Trajectory("live", row, time_s, *nothing)
    run, label, absent = estimate.run, estimate.label.copy(), list(estimate.absent)
    state, cleaned = run.state.copy(), from_cartesian(run.state[:, :3])
    sigma, los_sigma = unseen_motion.widened(run.state, run.sigma, run.los_sigma)
    cleaned_sigma = measurement_sigma(cleaned, los_sigma[:, :3])
    if absent:  # the filter ran on stand-ins; what depends on them is not published
        state[:], sigma[:], label[:, absent] = np.nan, np.nan, MISSING
        cleaned[:, absent], cleaned_sigma[:, absent] = np.nan, np.nan
    return Trajectory("live", row, time_s, cleaned, state, sigma, cleaned_sigma, label, run.nis, np.zeros((n, 6)))
