"""From logs to a trained correction: every log is filtered and smoothed, held against its truth, or without one the
filter against the smoother, and the differences are learned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ftproc.core.model.frames import to_cartesian
from ftproc.correction.model import FILTER, SMOOTHER, Model
from ftproc.correction.training import Progress, silent
from ftproc.correction.training.samples import Flight
from ftproc.correction.training.stages import train_model
from ftproc.errors import InputError, UsageError
from ftproc.methods import registry
from ftproc.methods.estimate import Estimate
from ftproc.quality import sanity
from ftproc.records import COMPONENTS, MeasurementLog, Truth
from ftproc.scoring.agreement import doubt
from ftproc.scoring.matching import match
from ftproc.settings import FilterSettings, TrainSettings


def train_flights(
    pairs: Sequence[tuple[MeasurementLog, Truth | None]],
    settings: TrainSettings,
    filtering: FilterSettings | None = None,
    progress: Progress = silent,
    jobs: int = 1,
) -> Model:
    """A correction learned from (log, truth) pairs, or with None for the truths from the smoother.

    filtering: the settings that the correction is made for. Raises InputError when a log cannot be processed or
    shares no time with its truth, UsageError for a method that takes no correction.
    """
    filtering = replace(filtering or FilterSettings(), method=settings.method)
    if registry.named(settings.method).own_model:
        settings = replace(settings, start="random")
    model = train_model(filtered_flights(pairs, filtering, progress), settings, progress, jobs)
    made_for = {
        "teacher": "smoother" if any(truth is None for _, truth in pairs) else "truth",
        "editing": filtering.editing,
        **({"lag_s": filtering.lag_s} if filtering.editing == "live" else {}),
        "noise": filtering.noise or "auto",
        "jerk": filtering.jerk_psd_m2ps5 or "auto",
    }
    return replace(model, settings={**model.settings, **made_for})


def filtered_flights(
    pairs: Sequence[tuple[MeasurementLog, Truth | None]],
    filtering: FilterSettings | None = None,
    progress: Progress = silent,
) -> dict[str, list[Flight]]:
    """Runs with truth by their stage, `filter` or `smoother`. Raises InputError and UsageError as `train_flights`."""
    filtering = filtering or FilterSettings()
    filtering = replace(filtering, smooth=filtering.editing != "live")
    sanity.check_settings(filtering)
    method = registry.named(filtering.method)
    if not method.corrected:
        raise UsageError(f"{method.name} takes no correction, so there is nothing to train for it")
    flights: dict[str, list[Flight]] = {FILTER: [], SMOOTHER: []}
    for number, (log, truth) in enumerate(pairs):
        progress("filtering", number, len(pairs))
        record = sanity.recording(log)
        if record.absent:
            names = " and ".join(COMPONENTS[c] for c in record.absent)
            raise InputError(f"{log.name}: {names} missing throughout; training needs all three components")
        try:
            estimate = method.run(record.whole(), filtering)
        except ValueError as cause:
            raise sanity.no_start(log, cause) from cause
        for stage, flight in _flown(log, truth, estimate, proven=method.editing(filtering) == "two-pass").items():
            flights[stage].append(replace(flight, signal_db=log.signal_db))
    progress("filtering", len(pairs), len(pairs))
    return {stage: found for stage, found in flights.items() if found}


def _flown(log: MeasurementLog, truth: Truth | None, estimate: Estimate, proven: bool) -> dict[str, Flight]:
    """The flight of each stage. proven: whether filtering has a smoother that can prove a correction. Raises
    InputError when truth and log share no time, UsageError where neither truth nor smoother is there to learn from."""
    smoothed = estimate.smoothed
    later = smoothed.state if smoothed is not None and proven else None
    if truth is None:
        if later is None:
            raise UsageError(
                "without --truth the smoother is the teacher: it needs ga-bpnn-ukf with --editing two-pass"
            )
        return {FILTER: Flight(estimate.run, later[:, :3], later[:, 3:6], later)}
    known = match(log.time_s, truth)
    if not np.isfinite(known.position_m).any():
        raise InputError(f"{truth.name}: its times do not overlap those of {log.name}")
    if why := doubt(log.name, log.time_s, to_cartesian(log.measurement), truth):
        raise InputError(f"{why} Nothing is learned from it.")
    found = {FILTER: Flight(estimate.run, known.position_m, known.velocity_mps, later)}
    if smoothed is not None:
        found[SMOOTHER] = Flight(estimate.smoothed_run, known.position_m, known.velocity_mps)
    return found
