"""From a log to a trajectory: the only place that knows the order of the steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ftproc.core.model.frames import from_cartesian
from ftproc.errors import InputError, UsageError
from ftproc.methods import registry
from ftproc.methods.estimate import Estimate, Part, Recording
from ftproc.quality import provenance, sanity
from ftproc.quality.statistics import Tally
from ftproc.records import COMPONENTS, MISSING, Diagnostics, FloatArray, MeasurementLog, Trajectory, Truth, joined
from ftproc.settings import FilterSettings, TrainSettings

if TYPE_CHECKING:
    from ftproc.core.filtering.records import FilterRun
    from ftproc.core.filtering.smoother import SmootherRun
    from ftproc.correction.model import Model
    from ftproc.correction.training.samples import Flight

EDITING = ("two-pass", "forward", "none")
ASSUMED_SIGMA = (10.0, 1e-3, 1e-3)  # m, rad, rad: of a component that the log says too little about
SMALLEST = 1e-30  # of what is given for noise, jerk level, gate: its square and its inverse can be reckoned with
FEWEST_PARTICLES = 20
FEWEST_READINGS = 8  # of a component, for its noise to be found from them


def filter_log(log: MeasurementLog, settings: FilterSettings | None = None, model: Model | None = None) -> Trajectory:
    """Clean one log: edit its outliers, filter (and smooth), correct, and say how good the result is.

    model: the network's correction; None for none. Sigmas, labels and everything else are in the Trajectory.
    Raises InputError when the log cannot be processed, UsageError for settings that make no sense.
    """
    filtering = Filtering(log, settings or FilterSettings(), model)
    parts = list(filtering.parts())
    return replace(joined(parts), metadata=filtering.metadata())


class Filtering:
    """One log on its way through the filter. `parts` makes its trajectory, a stretch at a time; `metadata` is what
    holds for all of it, and is known when the last part is. Errors as in `filter_log`."""

    def __init__(self, log: MeasurementLog, settings: FilterSettings, model: Model | None) -> None:
        self.log, self.settings, self.model = log, settings, model
        self.method = registry.named(settings.method)
        _check(settings)
        if (
            why := registry.obstacle(self.method, settings.smooth, None if model is None else model.made_for)
        ) is not None:
            raise UsageError(why)
        self.record = _record(log)
        self.tally = Tally(log, self.record.absent)
        self._metadata: dict[str, Any] = {}

    def parts(self) -> Iterator[Trajectory]:
        """The rows of the log in their order, in stretches; of the metadata they have only the frame."""
        parts = self.method.parts(self.record, self.settings)
        while True:
            try:
                part = next(parts)
            except StopIteration:
                return
            except ValueError as cause:
                raise InputError(_no_start(self.log, cause)) from cause
            yield self._trajectory(part)

    def metadata(self) -> dict[str, Any]:
        """Settings, noise, model and summary: everything needed to make the trajectory again, and to judge it."""
        if self._metadata:
            return self._metadata
        summary = self.tally.figures()
        summary["correction_lost_by_smoothing"] = bool(
            self.model
            and self.method.corrected
            and self.settings.smooth
            and self.model.filter.helps
            and self.model.smoother is None
        )
        self._metadata = provenance.describe(self.log, self.method, self.settings, self.tally, self.model, summary)
        return self._metadata

    def _trajectory(self, part: Part) -> Trajectory:
        """What is meant of a part as a trajectory, and counted."""
        absent = list(self.record.absent)
        correction, outside = np.zeros((len(part.estimate.label), 6)), 0.0
        if self.model is not None and self.method.corrected and not absent:
            correction, outside = _corrected(part.estimate, self.model)
        correction, estimate = correction[part.low : part.high], part.estimate.rows(part.low, part.high)
        rows = slice(part.first + part.low, part.first + part.high)
        best = estimate.run if estimate.smoothed is None else estimate.smoothed
        state, sigma = best.state.copy(), best.sigma[:, :6].copy()
        state[:, :6] += correction
        cleaned = from_cartesian(state[:, :3]) if estimate.cleaned is None else estimate.cleaned
        if absent:  # the stand-in made the filter run; what rests on it must not leave the house
            state[:], sigma[:] = np.nan, np.nan
            cleaned[:, absent] = np.nan
            estimate.label[:, absent] = MISSING
        elif np.isinf(state).any() or (estimate.cleaned is None and np.isnan(state).any()):
            name = self.method.name
            raise InputError(f"{self.log.name}: {name} diverged; give --noise and --jerk, or check the log's units")
        log = self.log.stretch(rows)
        self.tally.add(log.time_s, estimate, correction, outside)
        return Trajectory(
            log.name, log.row, log.time_s, cleaned, state, sigma, estimate.label, best.nis, correction,
            metadata={"frame": log.frame}, extra=log.extra, diagnostics=_diagnostics(log.measurement, estimate),
        )  # fmt: skip


def _corrected(estimate: Estimate, model: Model) -> tuple[FloatArray, float]:
    """(n, 6) what the network of the stage adds, and the share of samples outside its training."""
    from ftproc.correction.apply import correct

    if estimate.smoothed is None:
        return correct(estimate.run, model.filter)
    if model.smoother is None:
        return np.zeros((len(estimate.run.time_s), 6)), 0.0
    return correct(_smoothed(estimate.run, estimate.smoothed), model.smoother)


def _smoothed(run: FilterRun, smoothed: SmootherRun) -> FilterRun:
    """The run with the smoother's state and sigmas in place of the filter's."""
    return run._replace(state=smoothed.state, sigma=smoothed.sigma, los_sigma=smoothed.los_sigma)


def _diagnostics(reading: FloatArray, estimate: Estimate) -> Diagnostics:
    missing = ~np.isfinite(reading)  # also what a stand-in was filtered for
    if estimate.smoothed is None:
        residual, sigma = estimate.run.innovation, estimate.run.innovation_sigma
        return Diagnostics(reading, np.where(missing, np.nan, residual), sigma, "innovation")
    residual, sigma = estimate.smoothed.residual, np.sqrt(estimate.smoothed.residual_variance)
    return Diagnostics(reading, np.where(missing, np.nan, residual), sigma, "leave-one-out residual")


def _check(settings: FilterSettings) -> None:
    if settings.editing not in EDITING:
        raise UsageError(f"editing is one of {', '.join(EDITING)}, not {settings.editing!r}")
    if settings.particles < FEWEST_PARTICLES:
        raise UsageError(f"particles must be {FEWEST_PARTICLES} or more, not {settings.particles}")
    numbers: list[tuple[str, float | None]] = [("noise", v) for v in settings.noise or ()]
    numbers += [("jerk", settings.jerk_psd_m2ps5), ("gate", settings.gate), ("max-patch", settings.max_patch_s)]
    for name, value in numbers:
        if value is not None and not SMALLEST <= value <= 1 / SMALLEST:
            raise UsageError(f"{name} must be a positive number, from {SMALLEST:g} to {1 / SMALLEST:g}, not {value}")


def _record(log: MeasurementLog) -> Recording:
    """What the methods see."""
    count = sanity.check(log)
    assumed = np.where(count < FEWEST_READINGS, ASSUMED_SIGMA, np.nan)
    return Recording(log.time_s, log.measurement, assumed, tuple(np.flatnonzero(count == 0).tolist()))


def _no_start(log: MeasurementLog, cause: ValueError) -> str:
    component = cause.args[0] if cause.args and isinstance(cause.args[0], int) else None
    if component is None:
        return f"{log.name}: {cause}"
    return (
        f"{log.name}: no {COMPONENTS[component]} reading agrees with its neighbours, so there is no first state; "
        f"check the column and its unit, or leave it out"
    )


def train_flights(
    pairs: Sequence[tuple[MeasurementLog, Truth]],
    settings: TrainSettings,
    progress: Callable[[str, int, int], None] | None = None,
    filtering: FilterSettings | None = None,
    jobs: int = 1,
) -> Model:
    """Filter and smooth every log, hold it against its truth, and train a correction on the difference.

    filtering: the settings that the correction is made for. Raises InputError when a log cannot be processed or
    shares no time with its truth, UsageError for a method that takes no correction.
    """
    from ftproc.correction.training.stages import train_model

    told = replace(filtering or FilterSettings(), method=settings.method)
    if registry.named(settings.method).own_model:
        settings = replace(settings, start="random")
    model = train_model(known_flights(pairs, told, progress), settings, progress, jobs)
    made_for = {"editing": told.editing, "noise": told.noise or "auto", "jerk": told.jerk_psd_m2ps5 or "auto"}
    return replace(model, settings={**model.settings, **made_for})


def known_flights(
    pairs: Sequence[tuple[MeasurementLog, Truth]],
    filtering: FilterSettings | None = None,
    progress: Callable[[str, int, int], None] | None = None,
) -> dict[str, list[Flight]]:
    """Runs with truth, by the stage (`filter`, `smoother`) they come from. Raises InputError as `train_flights`."""
    from ftproc.correction.training.samples import Flight
    from ftproc.scoring.matching import match

    settings = replace(filtering or FilterSettings(), smooth=True)
    _check(settings)
    method = registry.named(settings.method)
    if not method.corrected:
        raise UsageError(f"{method.name} takes no correction, so there is nothing to train for it")
    flights: dict[str, list[Flight]] = {"filter": [], "smoother": []}
    for number, (log, truth) in enumerate(pairs):
        if progress:
            progress("filtering", number, len(pairs))
        record = _record(log)
        if record.absent:
            names = " and ".join(COMPONENTS[c] for c in record.absent)
            raise InputError(f"{log.name}: {names} missing throughout; training needs all three components")
        try:
            estimate = method.run(record.whole(), settings)
        except ValueError as cause:
            raise InputError(_no_start(log, cause)) from cause
        known = match(log.time_s, truth)
        if not np.isfinite(known.position_m).any():
            raise InputError(f"{truth.name}: its times do not overlap those of {log.name}")
        runs = {"filter": estimate.run}
        if estimate.smoothed is not None:
            runs["smoother"] = _smoothed(estimate.run, estimate.smoothed)
        for stage, run in runs.items():
            flights[stage].append(Flight(run, known.position_m, known.velocity_mps))
    if progress:
        progress("filtering", len(pairs), len(pairs))
    return {stage: found for stage, found in flights.items() if found}
