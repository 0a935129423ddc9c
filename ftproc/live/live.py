"""A track while it is flown: push readings as they come, get the rows whose lag has passed."""

from __future__ import annotations

import bisect
import copy
import itertools
import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ftproc.core.components import bounded
from ftproc.core.identification.motions import unseen_motion
from ftproc.core.live.editor import LiveEditor
from ftproc.core.live.rows import Published
from ftproc.core.model import kinematics
from ftproc.core.model.frames import from_cartesian, measurement_sigma
from ftproc.correction.live import LiveCorrection, live_model
from ftproc.correction.model import Model
from ftproc.errors import InputError, UsageError
from ftproc.files import arrow
from ftproc.live.order import Order
from ftproc.long_records import joined
from ftproc.methods import live, registry
from ftproc.methods import scalars as rates_of
from ftproc.methods.estimate import Estimate
from ftproc.methods.height import alone, heights
from ftproc.methods.height.priors import Prior
from ftproc.order_statistics import median
from ftproc.quality import sanity
from ftproc.records import MISSING, FloatArray, IntArray, Trajectory
from ftproc.settings import PACKAGED, FilterSettings

SLACK_S = 0.002  # by the clock, in which the last reading that a row rests on may come after it is due
INTERVALS = 50  # of which the typical one is that of coasted rows


class Live:
    """Live editing and filtering of one track (settings.editing `live` or `forward`), in memory that does not grow:
    where so many rows come in the lag that they would fill it, they are published earlier.

        track = ftproc.Live(FilterSettings(editing="live", lag_s=2.0))
        for row in receiver:
            published = track.push(row.time_s, row.range_m, row.azimuth_rad, row.elevation_rad)

    With lag 0 a row is published at once. With a lag, readings may come late by less than `late_s` and take their
    place: the rows are those that `ftproc filter --editing live --lag S` writes of the same readings in order. So a row
    waits for a reading that is more than the lag and `late_s` later, or, where the times at which readings come are
    given, until its lag has passed by the clock: then `due` publishes it. late: readings that came too late to be used;
    they are counted, not published.
    """

    def __init__(
        self,
        settings: FilterSettings | None = None,
        late_s: float | None = None,
        range_rates: bool = False,
        barometric: bool | None = None,
        model: Model | str | None = PACKAGED,
        prior: Prior | None = None,
    ) -> None:
        """settings: editing `live` (also where they say `two-pass`, the default) or `forward`. late_s: at most the lag;
        None for the lag. range_rates: whether the rows have columns of range rates. barometric: whether the heights
        are that stand for the elevations (by `heights.elevation`); None where these are measured. model:
        the network's correction, as in `ftproc.filter_log`; rows with range, azimuth and elevation alone have one, with
        `live` and lag 0. prior: of the height, where no elevation or height is measured. Raises UsageError,
        ModelError."""
        self.resume(settings or FilterSettings(), model)
        self._correction = LiveCorrection()
        self.late, editor = 0, live.editor(self.settings)
        self._lag_s = editor.lag_s
        self._late_s = self._lag_s if late_s is None else min(late_s, self._lag_s)
        self._order = Order(editor, self._late_s)
        self._time_s: list[float] = []  # of the rows that have not been published, in the order of their times,
        self._row: list[int] = []  # their numbers,
        self._came_s: list[float] = []  # and when each came, or the one after it
        self._taken, self._left_s = 0, -math.inf
        self._rates, self._barometric, self._prior = range_rates, barometric, prior

    def resume(self, settings: FilterSettings, model: Model | str | None) -> None:
        """Go on with these settings and this model, when all else is as it was kept."""
        if settings.editing == "two-pass":
            settings = replace(settings, editing="live")
        sanity.check_settings(settings)
        if settings.method != registry.MAIN or settings.editing == "none" or settings.smooth:
            raise UsageError(f"Live runs {registry.MAIN} with editing live or forward, not smoothed.")
        self.settings, self._model = settings, live_model(model, settings.editing, settings.lag_s)
        self._coasting: LiveEditor | None = None

    @property
    def late_s(self) -> float:
        """By how much less than this a row may be late."""
        return self._late_s

    @property
    def waiting(self) -> int:
        """How many rows have not been published."""
        return len(self._row)

    @property
    def newest_s(self) -> float:
        """The newest time so far."""
        return self._time_s[-1] if self._time_s else self._left_s

    def push(
        self,
        time_s: ArrayLike,
        range_m: ArrayLike,
        azimuth_rad: ArrayLike,
        elevation_rad: ArrayLike,
        row: ArrayLike | None = None,
        came_s: float = math.inf,
        range_rate_mps: ArrayLike = math.nan,
    ) -> Trajectory:
        """Take one reading, or several: numbers or arrays (n,), s, m, rad, rad, m/s; NaN where a component is missing.
        row: their numbers, by which they are published; without, they are counted from 0. came_s: when they came, by
        any clock in seconds that goes on evenly, if `due` is called too. Returns the rows published now, of which there
        may be none. Raises InputError for a time that is not a number or not that of a flight.
        """
        components = (range_m, azimuth_rad, elevation_rad, range_rate_mps)
        readings = np.broadcast_arrays(*(np.atleast_1d(np.asarray(each, float)) for each in components))
        times = np.atleast_1d(np.asarray(time_s, float))
        measurement = bounded(np.stack(readings, 1))
        if times.shape != measurement.shape[:1]:
            raise InputError(f"there are {len(times)} times for {len(measurement)} readings; give as many of each.")
        rows = self._taken + np.arange(len(times)) if row is None else np.atleast_1d(np.asarray(row, np.int64))
        if rows.shape != times.shape:
            raise InputError(f"there are {len(rows)} row numbers for {len(times)} readings; give as many of each.")
        if not (np.abs(times) <= sanity.LATEST_S).all():
            worst = int(np.flatnonzero(~(np.abs(times) <= sanity.LATEST_S))[0])
            raise InputError(f"row {rows[worst]}: the time {times[worst]:g} s is not that of a flight.")
        self._taken += len(times)
        self._coasting = None
        for low, high in self._ordered(times):
            if times[low] < self.newest_s:
                self._insert(float(times[low]), measurement[low], int(rows[low]), came_s)
            else:
                self._append(times[low:high], measurement[low:high], rows[low:high].tolist(), came_s)
        return self._published(self._passed())

    def due(self, now_s: float) -> Trajectory:
        """The rows whose lag has passed by the clock of `came_s`, when no reading has come since."""
        self._order.settle(now_s)
        count = bisect.bisect_right(self._came_s, now_s, key=lambda came_s: came_s + self.wait_s)
        if count > self._order.known - self._order.taken:
            self._order.let_leave(self._time_s[count - 1], now_s)
        return self._published(max(count, self._passed()))

    def work(self) -> bool:
        """Do now what the next push would do first, for when there is time; whether there was anything."""
        return self._order.editor.work()

    @property
    def due_s(self) -> float:
        """When `due` has something to do, by that clock; infinite when nothing waits."""
        row_s = self._came_s[0] + self.wait_s if self._came_s else math.inf
        return min(row_s, self._order.held_until_s)

    def finish(self) -> Trajectory:
        """The rows that wait for their lag, when no more readings come."""
        self._order.finish()
        return self._published(len(self._row))

    @property
    def interval_s(self) -> float:
        """The typical interval of the newest readings; infinite before the track is confirmed."""
        window = self._order.editor.window
        return math.inf if window is None else median(np.diff(window.time_s[-INTERVALS:]))

    def coast(self, after_s: float) -> Trajectory:
        """A row so long after the newest reading, and after those coasted before, as far as nothing more comes: of no
        reading (row -1), with the sigmas of that. It changes nothing that is published of readings."""
        if self._coasting is None:
            self._order.settle(math.inf)
            self._coasting = copy.deepcopy(self._order.editor)
            self._coasting.tick(math.inf)
        time_s = self.newest_s + after_s
        at_s, none = time_s - self._order.begins_s, np.full((1, 4), np.nan)
        found = self._coasting.push(np.array([at_s]), none)
        found += self._coasting.tick(math.nextafter(at_s + self._lag_s, math.inf))
        return self._trajectory(found, np.array([time_s]), np.array([-1]), None)

    @property
    def wait_s(self) -> float:
        """How long a row waits by the clock."""
        return self._lag_s + max(self._order.hold_s, SLACK_S) if self._lag_s > 0 else 0.0

    def _ordered(self, times: FloatArray) -> list[tuple[int, int]]:
        """The runs of rows whose times never decrease, the newest so far included."""
        back = np.flatnonzero(times < np.maximum.accumulate(np.r_[self.newest_s, times[:-1]]))
        edges = sorted({0, len(times), *back.tolist(), *(back + 1).tolist()})
        return list(itertools.pairwise(edges))

    def _append(self, times: FloatArray, measurement: FloatArray, rows: list[int], came_s: float) -> None:
        self._time_s += times.tolist()
        self._row += rows
        self._came_s += [came_s] * len(rows)
        self._order.push(times, measurement, came_s)

    def _insert(self, time_s: float, reading: FloatArray, row: int, came_s: float) -> None:
        if time_s < self._left_s or not self._order.insert(time_s, reading, came_s):
            self.late += 1
            return
        index = bisect.bisect_right(self._time_s, time_s)
        came_s = self._came_s[index] if index < len(self._came_s) else came_s
        self._time_s.insert(index, time_s)
        self._row.insert(index, row)
        self._came_s.insert(index, came_s)

    def _passed(self) -> int:
        """How many rows need not wait any more, whatever comes; or are too many to wait."""
        ready = self._order.known - self._order.taken
        if self._lag_s == 0:
            return ready
        passed = bisect.bisect_left(self._time_s, self.newest_s - self._late_s - self._lag_s)
        return min(max(passed, ready - self._order.editor.pace.sizes.most_waiting), ready)

    def _published(self, count: int) -> Trajectory:
        count = min(count, self._order.known - self._order.taken)
        time_s, row = np.array(self._time_s[:count]), np.array(self._row[:count], np.int64)
        for kept in (self._time_s, self._row, self._came_s):
            del kept[:count]
        if count:
            self._left_s = float(time_s[-1])
        return self._trajectory(self._order.take(count), time_s, row, self._model)

    def _trajectory(
        self, left: Iterable[Published], time_s: FloatArray, row: IntArray, model: Model | None
    ) -> Trajectory:
        """The rows that have left, with these times and numbers (n,), corrected by a model."""
        parts, low = [], 0
        for absent, some in itertools.groupby(left, lambda each: each.absent):
            found = list(some)
            high = low + sum(len(each.rows) for each in found)
            estimate = live.estimate(self._order.editor, found, time_s[low:high])
            correction = np.zeros((high - low, 6))
            if model is not None and not absent and self._barometric is None:
                correction = self._correction.of(estimate.run, model.filter)
            parts.append(
                _trajectory(
                    row[low:high], time_s[low:high], estimate, correction, self._rates, self._barometric, self._prior
                )
            )
            low = high
        return joined(parts) if parts else _trajectory(row[:0], time_s[:0], None, np.empty((0, 6)))


def _trajectory(
    row: IntArray,
    time_s: FloatArray,
    estimate: Estimate | None,
    correction: FloatArray,
    rates: bool = False,
    barometric: bool | None = None,
    prior: Prior | None = None,
) -> Trajectory:
    """The rows of an estimate with their correction (n, 6); none without one. rates, barometric, prior: as in
    `Live`."""
    n = len(row)
    if estimate is None:
        none = np.empty((0, 3))
        nothing = (none, np.empty((0, 9)), np.empty((0, 9)), none, none.astype(np.uint8), np.empty(0), correction)
        return Trajectory("live", row, time_s, *nothing)
    run, label, absent = estimate.run, estimate.label.copy(), list(estimate.absent)
    state = run.state.copy()
    state[:, :6] += correction
    cleaned = from_cartesian(state[:, :3])
    sigma, los_sigma = unseen_motion.widened(run.state, run.sigma, run.los_sigma)
    path_sigma = kinematics.widened(run.state, run.path_sigma, run.sigma, sigma)
    cleaned_sigma = measurement_sigma(cleaned, los_sigma[:, :3])
    columns = dict[str, Any]()
    if rates:
        found = estimate.range_rate.label if estimate.range_rate is not None else np.full(n, MISSING, np.uint8)
        columns = rates_of.columns(state, los_sigma, found)
    if barometric is not None:
        common = heights.Common(None, np.empty(0), barometric=barometric, scale=alone.TEMPERATURE * barometric)
        state, sigma, path_sigma = heights.placed(common, slice(None), state, sigma, path_sigma)
        cleaned_sigma = heights.elevated(common, slice(None), cleaned, cleaned_sigma)
        label, column = heights.labelled(label)
        columns |= column
    if tuple(absent) == heights.ABSENT and prior is not None:
        common = heights.Common(prior, np.zeros(n))
        state, sigma, path_sigma = heights.placed(common, slice(None), state, sigma, path_sigma)
    elif absent:  # the filter ran on stand-ins; what depends on them is not published
        state[:], sigma[:], path_sigma[:] = np.nan, np.nan, np.nan
    if absent:
        label[:, absent] = MISSING
        cleaned[:, absent], cleaned_sigma[:, absent] = np.nan, np.nan
    given = row, time_s, cleaned, state, sigma, cleaned_sigma, label, run.nis, correction
    extra = arrow.table(columns) if columns else None
    return Trajectory("live", *given, extra=extra, path_sigma=path_sigma)
