"""What the methods have in common: noise, jerk and first states from the readings, labels, and the plain filter."""

from __future__ import annotations

import contextlib

import numpy as np

from ftproc.core.editing import outlier_chain, two_pass
from ftproc.core.filtering import forward
from ftproc.core.filtering.initialization import begin_all
from ftproc.core.filtering.records import FilterRun, Model, Start
from ftproc.core.filtering.smoother import smooth_log
from ftproc.core.identification import likelihood
from ftproc.core.model.motion import isotropic
from ftproc.methods.estimate import Estimate, Readings, Recording
from ftproc.records import MISSING, FlagArray, FloatArray
from ftproc.settings import FilterSettings

HEAD = 256  # samples at the beginning of a log that a recursive filter is given time to look at
LONGEST_ISOLATED = 2  # readings rejected in a row; more make a patch


def unedited(readings: Readings, settings: FilterSettings, extended: bool = False) -> Estimate:
    """The plain UKF (or EKF): every reading is used. Noise and jerk come from the readings that screening trusts."""
    model, starts, _ = prepare(readings, settings)
    weight = np.isfinite(readings.measurement).astype(float)
    run = forward.filter_log(*readings[:2], weight, model, starts, extended)
    return finished(readings, settings, run, weight, weight, model, starts)


def finished(
    readings: Readings,
    settings: FilterSettings,
    run: FilterRun,
    weight: FloatArray,
    kept: FloatArray,
    model: Model,
    starts: list[Start],
) -> Estimate:
    """What a recursive filter found, with the smoother over the same weights (n, 3) if it was asked for.

    kept: (n, 3) zero for the readings that are called outliers.
    """
    smoothed = smooth_log(*readings[:2], weight, model, starts) if settings.smooth else None
    return Estimate(run, labels(kept, readings.measurement), model, smoothed, anew(starts))


def trusted(readings: Readings, settings: FilterSettings) -> tuple[FloatArray, FloatArray]:
    """(n, 3) weights, zero for readings not to be believed before a filter has run, and (3,) noise 1-sigma.

    Only the head of the log is edited with all of itself in view, because a recursion cannot repair a wrong start;
    further on the weights are those of the screening, and serve to find noise and jerk.
    """
    time_s, measurement, _ = readings
    weight, sigma = two_pass.screen(time_s, measurement)
    given = given_sigma(readings, settings)
    with contextlib.suppress(ValueError):  # too little in the head: the screening has to do
        head = two_pass.edit(time_s[:HEAD], measurement[:HEAD], given, settings.jerk_psd_m2ps5, settings.gate)
        weight[:HEAD] = head.weight
        if len(time_s) <= HEAD:
            sigma = np.sqrt(head.model.noise_variance)
    return weight, np.where(np.isfinite(given), given, sigma)


def prepare(readings: Readings, settings: FilterSettings) -> tuple[Model, list[Start], FloatArray]:
    """Noise and jerk level, starts and weights (n, 3) of a log, without deciding on its outliers."""
    time_s, measurement, _ = readings
    weight, sigma = trusted(readings, settings)
    given = given_sigma(readings, settings)
    guess = Model(sigma**2, isotropic(settings.jerk_psd_m2ps5 or 1.0))
    starts = begin_all(time_s, measurement, weight, guess.noise_variance, settings.jerk_psd_m2ps5)
    fixed = np.isfinite(given)
    model = likelihood.fit_level(time_s, measurement, weight, starts, guess, fixed, settings.jerk_psd_m2ps5 is not None)
    return model, begin_all(time_s, measurement, weight, model.noise_variance, float(model.jerk[0, 0])), weight


def anew(starts: list[Start]) -> tuple[int, ...]:
    """The samples at which a filter began again."""
    return tuple(start.sample for start in starts[1:])


def given_sigma(readings: Readings | Recording, settings: FilterSettings) -> FloatArray:
    """(3,) noise 1-sigma that need not be found: the user's, else what is assumed; NaN where the log tells."""
    stated = np.array(settings.noise or (None, None, None), float)  # None becomes NaN
    return np.where(np.isnan(stated), readings.assumed_sigma, stated)


def labels(weight: FloatArray, measurement: FloatArray) -> FlagArray:
    """(n, 3) good, isolated, patch or missing from weights (n, 3), zero where rejected."""
    label = outlier_chain.label_runs(weight, measurement, LONGEST_ISOLATED).astype(np.uint8)
    label[~np.isfinite(measurement)] = MISSING
    return label
