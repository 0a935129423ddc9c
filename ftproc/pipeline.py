"""From a log to a trajectory: the only place that knows the order of the steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ftproc import __version__, plausible
from ftproc.core.geometry import from_cartesian
from ftproc.errors import InputError, UsageError
from ftproc.files.conventions import CONVENTION, in_words
from ftproc.methods import registry
from ftproc.methods.estimate import Estimate, Readings
from ftproc.records import COMPONENTS, MISSING, Diagnostics, FloatArray, MeasurementLog, Trajectory, Truth
from ftproc.settings import FilterSettings, TrainSettings
from ftproc.summary import summarise

if TYPE_CHECKING:
    from ftproc.core.forward import FilterRun
    from ftproc.core.smoother import SmootherRun
    from ftproc.correction.model import Model
    from ftproc.correction.samples import Flight
    from ftproc.methods.registry import Method

EDITING = ("two-pass", "forward", "none")
ASSUMED_SIGMA = (10.0, 1e-3, 1e-3)  # m, rad, rad: of a component that the log says too little about
ASSUMED_READING = (10_000.0, 0.0, 0.0)  # stands in for a component that is missing throughout
FARTHEST = 1e12  # m, rad: a wilder reading is no more of an outlier, but its square would overflow
FEWEST_PARTICLES = 20
FEWEST_READINGS = 8  # of a component, for its noise to be found from them
PACKAGED_MODEL = Path(__file__).parent / "correction" / "default.safetensors"


@cache
def default_model() -> Model:
    """The correction that comes with the package. Raises ModelError if its file is damaged."""
    from ftproc.correction.model_file import load

    return load(PACKAGED_MODEL)


def filter_log(log: MeasurementLog, settings: FilterSettings | None = None, model: Model | None = None) -> Trajectory:
    """Clean one log: edit its outliers, filter (and smooth), correct, and say how good the result is.

    model: the network's correction; None for none. Sigmas, labels and everything else are in the Trajectory.
    Raises InputError when the log cannot be processed, UsageError for settings that make no sense.
    """
    settings = settings or FilterSettings()
    method = registry.named(settings.method)
    _check(settings)
    if (why := registry.obstacle(method, settings.smooth, None if model is None else model.made_for)) is not None:
        raise UsageError(why)
    readings, absent = _readings(log)
    try:
        estimate = method.run(readings, settings)
    except ValueError as cause:
        raise InputError(_no_start(log, cause)) from cause
    best = estimate.run if estimate.smoothed is None else estimate.smoothed
    state, sigma = best.state.copy(), best.sigma[:, :6].copy()
    correction, outside = np.zeros((len(log), 6)), 0.0
    if model is not None and method.corrected and not absent:
        correction, outside = _corrected(estimate, model)
        state[:, :6] += correction
    cleaned = from_cartesian(state[:, :3]) if estimate.cleaned is None else estimate.cleaned
    if absent:  # the stand-in made the filter run; what rests on it must not leave the house
        state[:], sigma[:] = np.nan, np.nan
        cleaned[:, absent] = np.nan
        estimate.label[:, absent] = MISSING
    elif np.isinf(state).any() or (estimate.cleaned is None and np.isnan(state).any()):
        raise InputError(f"{log.name}: {method.name} diverged; give --noise and --jerk, or check the log's units")
    summary = summarise(log, estimate, absent, correction, outside)
    summary["correction_lost_by_smoothing"] = bool(
        model and method.corrected and settings.smooth and model.filter.helps and model.smoother is None
    )
    return Trajectory(
        log.name, log.row, log.time_s, cleaned, state, sigma, estimate.label, best.nis, correction,
        _provenance(log, method, settings, estimate, model, summary), log.extra, _diagnostics(log, estimate),
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


def _diagnostics(log: MeasurementLog, estimate: Estimate) -> Diagnostics:
    missing = ~np.isfinite(log.measurement)  # also what a stand-in was filtered for
    if estimate.smoothed is None:
        residual, sigma = estimate.run.innovation, estimate.run.innovation_sigma
        return Diagnostics(log.measurement, np.where(missing, np.nan, residual), sigma, "innovation")
    residual, sigma = estimate.smoothed.residual, np.sqrt(estimate.smoothed.residual_variance)
    return Diagnostics(log.measurement, np.where(missing, np.nan, residual), sigma, "leave-one-out residual")


def _check(settings: FilterSettings) -> None:
    if settings.editing not in EDITING:
        raise UsageError(f"editing is one of {', '.join(EDITING)}, not {settings.editing!r}")
    if settings.particles < FEWEST_PARTICLES:
        raise UsageError(f"particles must be {FEWEST_PARTICLES} or more, not {settings.particles}")
    numbers: list[tuple[str, float | None]] = [("noise", v) for v in settings.noise or ()]
    numbers += [("jerk", settings.jerk_psd_m2ps5), ("gate", settings.gate), ("max-patch", settings.max_patch_s)]
    for name, value in numbers:
        if value is not None and not (np.isfinite(value) and value > 0):
            raise UsageError(f"{name} must be a positive number, not {value}")


def _readings(log: MeasurementLog) -> tuple[Readings, list[int]]:
    """What the methods see, and the components that are missing throughout (a constant stands in for those)."""
    plausible.check(log)
    measurement = np.clip(log.measurement, -FARTHEST, FARTHEST)
    count = np.isfinite(measurement).sum(0)
    absent = [c for c in range(3) if count[c] == 0]
    assumed = np.where(count < FEWEST_READINGS, ASSUMED_SIGMA, np.nan)
    for c in absent:
        measurement[:, c] = ASSUMED_READING[c]
    return Readings(log.time_s - log.time_s[0], np.ascontiguousarray(measurement), assumed), absent


def _no_start(log: MeasurementLog, cause: ValueError) -> str:
    component = cause.args[0] if cause.args and isinstance(cause.args[0], int) else None
    if component is None:
        return f"{log.name}: {cause}"
    return (
        f"{log.name}: no {COMPONENTS[component]} reading agrees with its neighbours, so there is no first state; "
        f"check the column and its unit, or leave it out"
    )


def _provenance(
    log: MeasurementLog,
    method: Method,
    settings: FilterSettings,
    estimate: Estimate,
    model: Model | None,
    summary: Mapping[str, Any],
) -> dict[str, Any]:
    """Everything needed to make the trajectory again."""
    from ftproc.correction.model_file import sha256

    sigma = np.sqrt(estimate.model.reading_variance)
    motion = estimate.model.jerk if np.isfinite(estimate.model.jerk).all() else None
    return {
        "program": "ftproc",
        "version": __version__,
        "method": method.name,
        "sees": method.sees(settings),
        "log": log.name,
        "frame": log.frame,
        "convention": CONVENTION[log.frame],
        "station": {**asdict(log.station), "in_words": in_words(log.station)},
        "epoch": log.epoch,
        "settings": {
            "editing": method.editing(settings),
            "smooth": settings.smooth,
            "gate": settings.gate,
            "max_patch_s": settings.max_patch_s,
            "gain_form": settings.gain_form,
            "site": settings.site,
            "geoid_m": settings.geoid_m,
            "ecef": settings.ecef,
            "noise_given": settings.noise is not None and None not in settings.noise,
            **({"particles": settings.particles, "seed": settings.seed} if method.random else {}),
            "jerk_given": settings.jerk_psd_m2ps5 is not None,
            "noise_range_m": float(sigma[0]),
            "noise_azimuth_rad": float(sigma[1]),
            "noise_elevation_rad": float(sigma[2]),
            "noise_correlation": [float(r) for r in estimate.model.correlation],
            "jerk_psd_m2ps5": None if motion is None else [float(q) for q in motion[:, 0]],
            "jerk_vertical_ratio": None if motion is None else float(motion[0, 5] / motion[0, 0]),
            "jerk_knot_s": float(estimate.model.knot_s) if motion is not None and len(motion) > 1 else None,
        },
        "model_sha256": None if model is None else sha256(model),
        "summary": dict(summary),
    }


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
    from ftproc.correction.stages import train_model

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
    from ftproc.correction.samples import Flight
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
        readings, absent = _readings(log)
        if absent:
            names = " and ".join(COMPONENTS[c] for c in absent)
            raise InputError(f"{log.name}: {names} missing throughout; training needs all three components")
        try:
            estimate = method.run(readings, settings)
        except ValueError as cause:
            raise InputError(_no_start(log, cause)) from cause
        known = match(log.time_s, truth)
        if not np.isfinite(known.position_m).any():
            raise InputError(f"{truth.name}: its times do not overlap those of {log.name}")
        runs = {"filter": estimate.run}
        if estimate.smoothed is not None:
            runs["smoother"] = _smoothed(estimate.run, estimate.smoothed)
        for stage, run in runs.items():
            flights[stage].append(Flight(run, known.position_m, known.velocity_mps, log.name))
    if progress:
        progress("filtering", len(pairs), len(pairs))
    return {stage: found for stage, found in flights.items() if found}
