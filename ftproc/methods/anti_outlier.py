"""The main method's filter: the anti-outlier UKF (Zuo et al. 2021 section 2.3), recursive or in two passes.

The network's correction (section 2.2) works on its output and is added by the pipeline.
"""

from __future__ import annotations

import contextlib

import numpy as np

from ftproc.core import editing, forward, gate, indicators, tuning
from ftproc.core.forward import Model, Start
from ftproc.core.motion import isotropic
from ftproc.core.smoother import SmootherRun, smooth_log
from ftproc.core.start import begin_all
from ftproc.methods.estimate import Estimate, Readings
from ftproc.records import MISSING, FlagArray, FloatArray
from ftproc.settings import FilterSettings

HEAD = 256  # samples at the beginning of a log that a recursive filter is given time to look at
LONGEST_ISOLATED = 2  # readings rejected in a row; more make a patch
DEFAULT_PATCH_S = 4.0
DEFAULT_PATCH_SAMPLES = 32  # the longest patch expected is the longer of the two


def estimate(readings: Readings, settings: FilterSettings) -> Estimate:
    """Filter, edit and (if asked) smooth a log by the way of editing that the settings name."""
    if settings.editing == "two-pass":
        return _two_pass(readings, settings)
    if settings.editing == "forward":
        return _recursive(readings, settings)
    return unedited(readings, settings)


def unedited(readings: Readings, settings: FilterSettings, extended: bool = False) -> Estimate:
    """The plain UKF (or EKF): every reading is used. Noise and jerk come from the readings that screening trusts."""
    model, starts, _ = prepare(readings, settings)
    weight = np.isfinite(readings.measurement).astype(float)
    run = forward.filter_log(*readings[:2], weight, model, starts, extended)
    smoothed = _smoothed(readings, settings, weight, model, starts)
    return Estimate(run, labels(weight, readings), model, smoothed, _anew(starts))


def prepare(readings: Readings, settings: FilterSettings) -> tuple[Model, list[Start], FloatArray]:
    """Noise and jerk level, starts and weights (n, 3) of a log, without deciding on its outliers.

    Only the head of the log is edited with all of itself in view, because a recursion cannot repair a wrong start;
    further on the weights are those of the screening, and serve to find noise and jerk.
    """
    time_s, measurement, _ = readings
    weight, sigma = editing.screen(time_s, measurement)
    given = _given(readings, settings)
    with contextlib.suppress(ValueError):  # too little in the head: the screening has to do
        head = editing.edit(time_s[:HEAD], measurement[:HEAD], given, settings.jerk_psd_m2ps5, settings.gate)
        weight[:HEAD] = head.weight
        if len(time_s) <= HEAD:
            sigma = np.sqrt(head.model.noise_variance)
    guess = Model(np.where(np.isfinite(given), given, sigma) ** 2, isotropic(settings.jerk_psd_m2ps5 or 1.0))
    starts = begin_all(time_s, measurement, weight, guess.noise_variance, settings.jerk_psd_m2ps5)
    fixed = np.isfinite(given)
    model = tuning.fit_level(time_s, measurement, weight, starts, guess, fixed, settings.jerk_psd_m2ps5 is not None)
    return model, begin_all(time_s, measurement, weight, model.noise_variance, float(model.jerk[0, 0])), weight


def _two_pass(readings: Readings, settings: FilterSettings) -> Estimate:
    edited = editing.edit(*readings[:2], _given(readings, settings), settings.jerk_psd_m2ps5, settings.gate)
    starts = editing.smoothed_starts(edited.smoothed)
    run = forward.filter_log(*readings[:2], edited.weight, edited.model, starts)
    smoothed = edited.smoothed if settings.smooth else None
    label = labels(edited.weight, readings)
    return Estimate(run, label, edited.model, smoothed, _anew(starts), edited.settled, edited.slow_noise)


def _anew(starts: list[Start]) -> tuple[int, ...]:
    return tuple(start.sample for start in starts[1:])


def _recursive(readings: Readings, settings: FilterSettings) -> Estimate:
    time_s, measurement, _ = readings
    model, starts, edited = prepare(readings, settings)
    allowed = np.ones_like(measurement)
    allowed[:HEAD] = edited[:HEAD]
    longest = settings.max_patch_s
    if longest is None:
        interval = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0
        longest = max(DEFAULT_PATCH_S, DEFAULT_PATCH_SAMPLES * interval)
    how = gate.GateSettings(settings.gate, longest, settings.gain_form)
    run, begun = gate.filter_and_edit(time_s, measurement, allowed, model, starts, how)
    kept = np.where(run.weight > gate.rejection_weight(settings.gate), 1.0, 0.0)
    smoothed = _smoothed(readings, settings, kept, model, begun)
    return Estimate(run, labels(kept, readings), model, smoothed, _anew(begun))


def _given(readings: Readings, settings: FilterSettings) -> FloatArray:
    """(3,) noise 1-sigma that need not be found: the user's, else what is assumed; NaN where the log tells."""
    return readings.assumed_sigma if settings.noise is None else np.array(settings.noise)


def _smoothed(
    readings: Readings, settings: FilterSettings, weight: FloatArray, model: Model, starts: list[Start]
) -> SmootherRun | None:
    return smooth_log(*readings[:2], weight, model, starts) if settings.smooth else None


def labels(weight: FloatArray, readings: Readings) -> FlagArray:
    """(n, 3) good, isolated, patch or missing from weights (n, 3), zero where rejected."""
    label = indicators.label_runs(weight, readings.measurement, LONGEST_ISOLATED).astype(np.uint8)
    label[~np.isfinite(readings.measurement)] = MISSING
    return label
