"""The window of the paper's recursive editing: every reading is decided on once, when it comes, by the gate of
`core.editing.gate`, and the filter is never run again. Noise and process noise are those that the live editor finds
from the readings so far, unless the user has specified them. Beside it runs a filter whose force turns with the
velocity, over the same decisions, see `turning`."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ftproc.core.editing import gate, two_pass
from ftproc.core.editing.track import REACQUIRE_SAMPLES, GatedRecursion, Track
from ftproc.core.filtering.forward import Span
from ftproc.core.filtering.records import Model, Observations, Start, empty_rows
from ftproc.core.live import beside
from ftproc.core.live.pieces import Sizes
from ftproc.core.live.readings import Columns, Labels
from ftproc.core.live.turning import Second
from ftproc.core.live.window import Window
from ftproc.order_statistics import median
from ftproc.records import FloatArray, IntArray

PATCH_S, PATCH_SAMPLES = 1.5, 12  # the longest patch expected is the longer of the two


class Gating(NamedTuple):
    """The gate, where the user has specified it. longest_patch_s: None for that of PATCH_S and PATCH_SAMPLES."""

    gate: float
    longest_patch_s: float | None = None
    gain_form: bool = False

    def window(
        self, time_s: FloatArray, measurement: FloatArray, known: two_pass.Known, sizes: Sizes,
        stand_ins: tuple[int, ...] = (),
    ) -> GatedWindow:  # fmt: skip
        """A window that edits with it."""
        times = np.diff(time_s)
        interval_s = median(times[times > 0]) if (times > 0).any() else 1.0
        longest_s = self.longest_patch_s or max(PATCH_S, PATCH_SAMPLES * interval_s)
        window = GatedWindow(time_s, measurement, known, sizes, stand_ins)
        window.how = gate.GateSettings(self.gate, longest_s, self.gain_form)
        return window


class GatedWindow(Window):
    """A track that is edited recursively."""

    refresh_every = 5  # fewer than where decisions depend on them
    how: gate.GateSettings
    track: Track | None = None
    second: Second
    white = True

    @property
    def learns(self) -> bool:
        """Whether noise or process noise are yet to be found."""
        return self.track is None or not (np.isfinite(self.known.sigma).all() and self.known.jerk_psd is not None)

    def begin(self) -> None:
        if self.learns:
            super().begin()
        else:
            self.refresh()

    def _adopt(self, found: two_pass.Edited, samples: IntArray) -> None:
        super()._adopt(found, samples)
        if self.track is None:
            rows, label = super().shown(0, len(self))
            self.gated, self.gated_labels = Columns(rows=rows, label=label), Labels()
            self.gated_labels.reset(self.kept["weight"], self.measurement)
            self.track, self.second = Track(0, self.filters.copy(), gate.gate_of(self.how)), Second()
            self.second.filters = self.filters.copy()
            self._accompany(self.track)

    def expect_gap(self, next_s: float) -> bool:
        super().expect_gap(next_s)
        return False  # the paper's filter goes on

    def _take(self, time_s: FloatArray, measurement: FloatArray) -> list[tuple[IntArray, int]]:
        return super()._take(time_s, beside.widened(measurement[:, : beside.RATE]))  # the paper has no range rates

    def refresh(self) -> None:
        if self.learns:
            super().refresh()
        else:
            self.near = max(len(self) - self.sizes.near, 0)
        if self.track is not None:
            self._accompany(self.track)

    def _accompany(self, track: Track) -> None:
        """The second filter goes on with the newest process noise; it begins again where that of white jerk is, after
        a run in which it was worse."""
        if not self.turning.acts:
            return
        latest, second = self.turning.second.model, self.second
        second.model = Model(self.model.noise_variance, latest.jerk[-1:], motion=latest.motion)
        if second.run < 0:
            second.begin(second.model, track.filters.copy())

    def append(self, time_s: FloatArray, measurement: FloatArray) -> None:
        n = len(self)
        if self.learns:
            super().append(time_s, measurement)
        else:
            self._bar(self._take(time_s, measurement))
        low = max(n - REACQUIRE_SAMPLES, 0)
        readings = self.kept["time_s"][low:].copy(), self.measurement[low:].copy()
        log = Observations(*readings, self._gateable(low))
        model = Model(self.model.noise_variance, self.allowed.jerk[-1:])
        rows = empty_rows(len(log.time_s))
        recursion = GatedRecursion(log, model, self.how, rows)
        assert self.track is not None
        self.track = recursion.run(self.track.shifted(low), n - low, []).shifted(-low)
        if self.turning.acts:
            self._mix(log, recursion.starts, n - low, rows)
        new = rows[n - low :]
        kept = np.where(new["weight"] > gate.rejection_weight(self.how.gate), 1.0, 0.0)
        label = self.gated_labels.add(kept, measurement)
        self.gated.append(rows=new, label=np.column_stack([label, np.full(len(label), 3.0)]))
        self.reacquired += [low + start.sample for start in recursion.starts]

    def _mix(self, log: Observations, starts: list[Start], first: int, rows: Any) -> None:
        """Run the second filter from a sample on, from stretch to stretch as the track did, and mix its rows in; but
        not where a reading is rejected: whether that is an outlier or a manoeuvre, neither filter knows."""
        rejected = (np.isfinite(log.measurement) & (rows["weight"] <= 0)).any(1)
        alone, second = rows[rejected].copy(), self.second
        edges = [first, *(start.sample for start in starts), len(rows)]
        for start, low, high in zip([None, *starts], edges[:-1], edges[1:], strict=True):
            if start is not None:
                second.begin(second.model, second.model.filter(start))
            second.append(log, Span(low, high, low - (start is None)), rows, math.nan)
        rows[rejected] = alone

    def _gateable(self, low: int) -> FloatArray:
        """(m, 3) one for the readings from a sample on that the gate may take, BY_HAND for those that it must."""
        readings = self.measurement[low:]
        found = np.isfinite(readings)
        found[:, 0] &= readings[:, 0] > 0
        accepted = self.known.accepted.of(self.time_s[low:], readings)
        return np.where(accepted, gate.BY_HAND, found.astype(float))

    def in_doubt(self) -> bool:
        return self.learns and super().in_doubt()

    def trim(self) -> int:
        drop = super().trim()
        if self.track is not None:
            self.gated.forget(drop)
            self.track = self.track.shifted(drop)
        return drop

    def shown(self, low: int, high: int) -> tuple[Any, FloatArray]:
        return self.gated["rows"][low:high].copy(), self.gated["label"][low:high].copy()
