"""From a log to a trajectory: the only place that knows the order of the steps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ftproc.core.identification.motions import unseen_motion
from ftproc.core.model import kinematics
from ftproc.core.model.frames import from_cartesian, measurement_sigma
from ftproc.derived import impact
from ftproc.errors import InputError, UsageError
from ftproc.long_records import joined
from ftproc.methods import registry, scalars, simultaneous
from ftproc.methods.estimate import Estimate, Part
from ftproc.methods.height import heights
from ftproc.quality import beside, by_hand, next_steps, provenance, sanity
from ftproc.quality.next_steps import Step
from ftproc.quality.statistics import RunStatistics
from ftproc.records import COMPONENTS, MISSING, Beside, Diagnostics, FloatArray, MeasurementLog, Trajectory
from ftproc.settings import FilterSettings

if TYPE_CHECKING:
    import pyarrow as pa

    from ftproc.correction.apply import Correction
    from ftproc.correction.live import LiveCorrection
    from ftproc.correction.model import Model, Stage


def filter_log(log: MeasurementLog, settings: FilterSettings | None = None, model: Model | None = None) -> Trajectory:
    """Clean one log: edit its outliers, filter (and smooth), correct, and judge the result.

    model: the network's correction; None for none. Sigmas, labels and everything else are in the Trajectory.
    Raises InputError when the log cannot be processed, UsageError for settings that make no sense.
    """
    filtering = Filtering(log, settings or FilterSettings(), model)
    parts = list(filtering.parts())
    return replace(joined(parts), metadata=filtering.metadata)


class Filtering:
    """One log on its way through the filter: `parts` yields its trajectory in parts; `metadata` is valid for all of it,
    and known after the last part. Errors as in `filter_log`."""

    def __init__(
        self, log: MeasurementLog, settings: FilterSettings, model: Model | None, before: Filtering | None = None
    ) -> None:
        """before: the same log filtered with other settings. What it was edited to holds if only smoothing differs."""
        self.log, self.settings, self.model = log, settings, model
        self.method = registry.named(settings.method)
        sanity.check_settings(settings)
        registry.check_parameters(settings)
        why = registry.obstacle(self.method, settings.smooth, None if model is None else model.made_for)
        if why is not None:
            raise UsageError(why)
        self.record, self.height = heights.stand_in(sanity.recording(log), log, settings)
        self.at_once = simultaneous.of(self.record) if settings.editing == "two-pass" else None
        if self.at_once is not None:
            self.record = self.at_once.of_stamps(self.record)
        if before is not None and replace(settings, smooth=before.settings.smooth) == before.settings:
            self.record = replace(self.record, edited=before.record.edited)
        self.statistics = RunStatistics(log, self.record.absent, self.height)
        self.why_not = ""  # nothing is corrected
        self.live: LiveCorrection | None = None  # of the rows so far, if each is corrected by what is known by it
        self.effects = by_hand.Effects(None if log.by_hand is None else log.by_hand.decisions, settings.gate)

    def parts(self) -> Iterator[Trajectory]:
        """The rows of the log in their order, in parts; their only metadata is the frame."""
        parts = self.method.parts(self.record, self.settings)
        while True:
            try:
                part = next(parts)
            except StopIteration:
                return
            except ValueError as cause:
                raise sanity.no_start(self.log, cause) from cause
            if len(part.estimate.label) == len(self.record):
                self.record = replace(self.record, edited=part.estimate.edited)
            yield self._trajectory(part if self.at_once is None else self.at_once.of_rows(part))

    @cached_property
    def metadata(self) -> dict[str, Any]:
        """Settings, noise, model and summary: everything needed to reproduce the trajectory, and to judge it."""
        model, stage = self.model if self.method.corrected else None, self._stage
        summary = self.statistics.summary(
            {
                "specified_noise": [
                    name for name, sigma in zip(COMPONENTS, self.settings.noise or (), strict=False) if sigma
                ],
                "network": self._network() if self.method.corrected else None,
                "at_once": self.at_once is not None,
                "plots_at_once": 0 if self.at_once is None else self.at_once.plots,
                "correction_linear": None if stage is None else stage.linear,
                "correction_missing": self._missing() if stage is not None and not stage.features.proven else "",
                "correction_lost_by_smoothing": model is not None and stage is None and model.filter.lost_by_smoothing,
                **self.effects.summary(),
            }
        )
        here = {"frame": self.log.frame, "settings": {"site": self.settings.site}}
        seen = self.statistics
        summary |= impact.of_flight(seen.last, seen.model, seen.lowest_m, float(self.log.time_s[-1]), here)
        summary = next_steps.added(summary, [step.as_dict() for step in self._steps(summary)])
        found = provenance.describe(self.log, self.method, self.settings, self.statistics, self.model, summary)
        return {**found, **self.effects.metadata()}

    @property
    def next_steps(self) -> list[Step]:
        """What to do next where the verdict is not consistent, best first; none has been tried."""
        return self._steps(self.metadata["summary"])

    def _steps(self, summary: Mapping[str, Any]) -> list[Step]:
        doubtful = self._stage is not None and not self._stage.features.proven
        return next_steps.steps(summary, self.settings, doubtful)

    @property
    def _stage(self) -> Stage | None:
        """The network that corrects what is published, if there is one."""
        if self.model is None or not self.method.corrected:
            return None
        return self.model.smoother if self.settings.smooth else self.model.filter

    def _network(self) -> str:
        """What the learned correction did, in words."""
        if self.model is None:
            return "none: no correction applied"
        stage = self._stage
        if stage is None or not stage.helps:
            return "gain 0: no correction applied"
        if why_not := self._missing():
            return f"gain {stage.gain.max():.2g}, but {why_not}: no correction applied"
        size = f"{self.statistics.largest_m:.3g} m, {self.statistics.largest_sigma:.2g} sigma"
        by = "innovations" if self.live is not None else "smoother"
        proven = f", proven by the {by} of this run" if stage.features.proven else ""
        return f"gain {stage.gain.max():.2g}: corrections of up to {size}{proven}"

    def _missing(self) -> str:
        """Why a network with a gain has corrected nothing, or ""."""
        nothing = self.statistics.largest_m == 0 and self._stage is not None and self._stage.helps
        return (self.why_not or "no sample is like those it was trained on") if nothing else ""

    def _corrected(self, part: Part, model: Model) -> Correction:
        """What the network of the stage adds."""
        from ftproc.correction.apply import Correction, correct
        from ftproc.correction.live import LiveCorrection, corrects

        estimate, signal_db = part.estimate, self.log.signal_db
        if signal_db is not None:
            signal_db = signal_db[part.first : part.first + len(estimate.label)]
        if corrects(model.filter, self.method.editing(self.settings), self.settings.lag_s):
            self.live = self.live or LiveCorrection()
            values = np.zeros((len(estimate.label), 6))
            values[part.low : part.high] = self.live.of(estimate.run.rows(part.low, part.high), model.filter)
            return Correction(values, 0.0)
        if estimate.smoothed is None:
            return correct(estimate.run, model.filter, estimate.hindsight, signal_db)
        if model.smoother is None:
            return Correction(np.zeros((len(estimate.run.time_s), 6)), 0.0)
        return correct(estimate.smoothed_run, model.smoother, signal_db=signal_db)

    def _trajectory(self, part: Part) -> Trajectory:
        """The rows of a part that count, corrected, and added to the statistics."""
        absent = list(part.estimate.absent if part.estimate.known is not None else self.record.absent)
        correction, outside = np.zeros((len(part.estimate.label), 6)), 0.0
        plain = not absent and self.height is None  # as what the network was taught, but for range rates
        if self.model is not None and self.method.corrected and plain:
            correction, outside, self.why_not = self._corrected(part, self.model)
        correction, estimate = correction[part.low : part.high], part.estimate.rows(part.low, part.high)
        rows = slice(part.first + part.low, part.first + part.high)
        best = estimate.run if estimate.smoothed is None else estimate.smoothed
        falls = estimate.motion is not None and estimate.motion.model.motion.pressed > 0
        sigma, los_sigma = unseen_motion.widened(best.state, best.sigma, best.los_sigma, falls)
        state = best.state.copy()
        path_sigma = kinematics.widened(best.state, best.path_sigma, best.sigma, sigma)
        state[:, :6] += correction
        known = slice(None) if estimate.known is None else estimate.known
        cleaned = from_cartesian(state[:, :3]) if estimate.cleaned is None else estimate.cleaned
        cleaned_sigma = measurement_sigma(cleaned, los_sigma[:, :3])
        log, channels = self.log.stretch(rows), dict[str, Beside]()
        columns: dict[str, Any] = {}
        if log.range_rate is not None:
            channel, labels = estimate.range_rate, np.full(len(state), MISSING, np.uint8)
            if channel is not None:
                labels = by_hand.labelled(channel.label, log.by_hand, "range_rate")
                estimate = estimate._replace(range_rate=channel._replace(label=labels))
            columns = scalars.columns(state, los_sigma, labels)
            if estimate.range_rate is not None:
                rate, spread, _ = columns.values()
                channels["range_rate"] = beside.of_rates(log, estimate.range_rate, rate, spread)
        beside_elevation = log.heights is not None and self.height is None
        if beside_elevation:
            channel, columns["outlier_height"] = estimate.height, np.full(len(state), MISSING, np.uint8)
            if channel is not None:
                columns["outlier_height"] = by_hand.labelled(channel.label, log.by_hand, "height")
                estimate = estimate._replace(height=channel._replace(label=columns["outlier_height"]))
        common = heights.at(self.height, tuple(absent), self.log, self.settings)
        if common is not None and tuple(absent) in ((), heights.ABSENT):
            state, sigma, path_sigma = heights.placed(common, rows, state, sigma, path_sigma)
            cleaned_sigma = heights.elevated(common, rows, cleaned, cleaned_sigma)
        elif absent:
            state[:], sigma[:], path_sigma[:] = np.nan, np.nan, np.nan
        if absent:  # the filter ran on a stand-in; what depends on it is not published
            cleaned[:, absent], cleaned_sigma[:, absent] = np.nan, np.nan
            estimate.label[:, absent] = MISSING
        elif np.isinf(state).any() or (estimate.cleaned is None and np.isnan(state[known]).any()):
            name = self.method.name
            raise InputError(f"{self.log.name}: {name} diverged; give --noise and --jerk, or check the log's units")
        if beside_elevation and estimate.height is not None:
            channels["height"] = beside.of_heights_beside(log, estimate.height, state, sigma)
        estimate = estimate._replace(label=by_hand.labelled(estimate.label, log.by_hand))
        label, variance = estimate.label, cleaned_sigma**2 + estimate.model.reading_variance
        if self.height is not None and self.height.prior is None:
            label = heights.relabelled(self.height, rows, label)
            label[:, 2] = by_hand.labelled(label[:, 2], log.by_hand, "height")
            estimate = estimate._replace(label=label)
            stand_in, own = self.record.measurement[rows], np.sqrt(variance[:, 2])
            residuals = _diagnostics(stand_in, estimate)
            channels["height"] = beside.of_heights(log, self.height, residuals, cleaned, own, label[:, 2])
            label, column = heights.labelled(label)
            columns |= column
        shown = by_hand.with_rejected(_diagnostics(log.measurement, estimate), label, cleaned, variance)
        shown = replace(shown, beside=channels)
        self.effects.add(log.by_hand, *beside.stacked(shown))
        self.statistics.add(log.time_s, estimate, cleaned, correction, outside)
        return Trajectory(
            log.name, log.row, log.time_s, cleaned, state, sigma, cleaned_sigma, label, best.nis, correction,
            metadata={"frame": log.frame}, extra=_beside(log.extra, columns), diagnostics=shown, path_sigma=path_sigma,
        )  # fmt: skip


def _beside(extra: pa.Table | None, columns: Mapping[str, Any]) -> pa.Table | None:
    """The log's other columns with these."""
    if not columns:
        return extra
    from ftproc.files import arrow
    from ftproc.files.writing import tables

    own = arrow.table(columns)
    return own if extra is None else tables.with_extra(extra, own)


def _diagnostics(reading: FloatArray, estimate: Estimate) -> Diagnostics:
    """Residuals of the readings (n, 3); none of what stands in for a component."""
    missing = ~np.isfinite(reading)
    if estimate.smoothed is None:
        residual, sigma = estimate.run.innovation, estimate.run.innovation_sigma
        return Diagnostics(reading, np.where(missing, np.nan, residual), sigma, "innovation")
    residual, sigma = estimate.smoothed.residual, np.sqrt(estimate.smoothed.residual_variance)
    return Diagnostics(reading, np.where(missing, np.nan, residual), sigma, "leave-one-out residual")
