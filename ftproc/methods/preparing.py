"""What the methods have in common: noise, jerk and first states from the readings, labels, and the plain filter."""

from __future__ import annotations

import contextlib
from typing import NamedTuple

import numpy as np

from ftproc.core.editing import outlier_chain, screened, two_pass
from ftproc.core.filtering import forward
from ftproc.core.filtering.initialization import find_starts
from ftproc.core.filtering.records import FilterRun, Model, Observations, Start, between
from ftproc.core.filtering.smoother import HEADS, PATHS, smooth_log
from ftproc.core.identification.likelihood import Fixed, first_jerk, fit_level
from ftproc.core.identification.motions import motion_models, orbits
from ftproc.core.identification.motions.motion_models import Candidates
from ftproc.core.identification.profile import from_knot, median_level
from ftproc.core.identification.scales import scales_of
from ftproc.core.model.earth import Geodetic
from ftproc.core.model.motion import isotropic
from ftproc.methods.estimate import Estimate, Readings, Recording
from ftproc.records import MISSING, FlagArray, FloatArray
from ftproc.settings import AUTO, FilterSettings

HEAD = 256  # samples at the beginning of a log that are edited with two passes before a recursive filter starts
FEWEST, TO_FORGET = 500, 30.0  # samples after a start that tell its state, and memories of the filter
START_INFLATION = 2.0  # on the covariance of a smoothed state that starts a filter over the same record
LONGEST_ISOLATED = 2  # readings rejected in a row; more make a patch


def unedited(readings: Readings, settings: FilterSettings, extended: bool = False) -> Estimate:
    """The plain UKF (or EKF): every reading is used. Noise and jerk come from the readings that screening trusts."""
    model, starts = prepare(readings, settings)
    log = readings.unedited()
    return finished(Filtered(log, forward.filter_log(log, model, starts, extended), model, starts), settings)


class Filtered(NamedTuple):
    """What a recursive filter found: the log with the weights that it gave, its run, the model and its starts."""

    log: Observations
    run: FilterRun
    model: Model
    starts: list[Start]


def finished(found: Filtered, settings: FilterSettings, kept: FloatArray | None = None) -> Estimate:
    """The estimate of a recursive filter, with the smoother over the same weights if it was asked for.

    kept: (n, 3) zero for the readings that are called outliers, where these are not those of weight zero.
    """
    log, run, model, starts = found
    smoothed = smooth_log(log, model, starts, PATHS) if settings.smooth else None
    label = labels(log.weight if kept is None else kept, log.measurement)
    return Estimate(run, label, model, smoothed, re_initialized(starts))


class Trusted(NamedTuple):
    """weight: (n, 3), zero for readings not to be used before a filter has run. sigma: (3,) noise 1-sigma. start:
    the smoothed first state, where the head of the log gives one."""

    weight: FloatArray
    sigma: FloatArray
    start: Start | None


def trusted(readings: Readings, settings: FilterSettings) -> Trusted:
    """What is known of a log before a filter has run.

    Only the head of the log is edited in two passes, because a recursion cannot repair a wrong start; after it the
    weights are those of the screening, and serve to find noise and jerk.
    """
    time_s, measurement = readings.time_s, readings.measurement
    weight, _, sigma, _ = screened.screen(time_s, measurement, screened.rounding_sigma(measurement))
    known = what_is_known(readings, settings)
    start = None
    with contextlib.suppress(ValueError):  # too few readings in the head: the screening has to do
        uneven = None if known.uneven is None else known.uneven.part(slice(HEAD))
        head = two_pass.edit(time_s[:HEAD], measurement[:HEAD], known._replace(uneven=uneven))
        weight[:HEAD] = head.weight
        start = smoothed_starts(head.log, head.model, head.starts)[0]
        if len(time_s) <= HEAD:
            sigma = np.sqrt(head.model.noise_variance)
    return Trusted(weight, np.where(np.isfinite(known.sigma), known.sigma, sigma), start)


def prepare(readings: Readings, settings: FilterSettings) -> tuple[Model, list[Start]]:
    """Measurement noise, process noise, and starts of a log, without deciding on its outliers. The first start is that
    of two-pass editing, so that all methods have the same."""
    weight, sigma, first = trusted(readings, settings)
    known = what_is_known(readings, settings)
    log = readings.weighted(weight)
    guess = Model(sigma**2, isotropic(known.jerk_psd or first_jerk(log, sigma**2)))
    starts = find_starts(log, guess.noise_variance, float(guess.jerk[0, 0]))
    model = fit_level(log, starts, guess, Fixed(np.isfinite(known.sigma), known.jerk_psd is not None))
    starts = find_starts(log, model.noise_variance, float(model.jerk[0, 0]))
    if first is not None and first.sample <= starts[0].sample:
        starts[0] = first
    return model, starts


def smoothed_starts(log: Observations, model: Model, starts: list[Start]) -> list[Start]:
    """Where the recursive filter starts over a record that has been edited: at the smoothed states, which the readings
    of many memories after each start tell.

    Their covariances are inflated, because the filter will see the same readings once more.
    """
    scales, found = scales_of(log, model.noise_variance), list[Start]()
    enough = max(FEWEST, int(TO_FORGET * scales.memory_samples(float(median_level(model).jerk[0, 0]))))
    for start, stop in between(starts, len(log.time_s)):
        span, own = from_knot(model, log.time_s, slice(start.sample, min(start.sample + enough, stop)))
        begin, own = start._replace(sample=start.sample - span.start), own.of(span)
        (head,) = smooth_log(log.part(span), own, [begin], HEADS).heads
        found.append(Start(start.sample, head.state, START_INFLATION * head.covariance))
    return found


def re_initialized(starts: list[Start]) -> tuple[int, ...]:
    """The samples at which a filter was started again."""
    return tuple(start.sample for start in starts[1:])


def what_is_known(readings: Readings | Recording, settings: FilterSettings) -> two_pass.Known:
    """What need not be found from the log: what the user has specified, else what is assumed."""
    stated = np.array(settings.noise or (None, None, None), float)  # None becomes NaN
    sigma = np.where(np.isnan(stated), readings.assumed_sigma, stated)
    return two_pass.Known(sigma, settings.jerk_psd_m2ps5, settings.gate, readings.accepted, readings.uneven)


def motions(settings: FilterSettings, site: Geodetic | None, north: int = 1) -> Candidates:
    """The models of motion to choose from. A jerk density that the user has specified is that of white jerk. site: of
    the station, where it is known; north: which axis points there."""
    if settings.motion != AUTO:
        names: tuple[str, ...] = (settings.motion,)
    else:
        names = (motion_models.WHITE,) if settings.jerk_psd_m2ps5 is not None else tuple(motion_models.MODELS)
    return Candidates(names, None if site is None else orbits.earth_from(site, north))


def labels(weight: FloatArray, measurement: FloatArray) -> FlagArray:
    """(n, 3) good, isolated, patch or missing from weights (n, 3), zero where rejected."""
    label = outlier_chain.label_runs(weight, measurement, LONGEST_ISOLATED).astype(np.uint8)
    label[~np.isfinite(measurement)] = MISSING
    return label
