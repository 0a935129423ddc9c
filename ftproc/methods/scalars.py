"""Range rates and heights beside the readings of a log: their noise, their outliers, and the process noise with them.

The readings are edited without them. What the record then predicts of each rate shows whether they count outward or
inward, which of them are wrong, and whether they are late; noise and decisions follow in turn from the leave-one-out
residuals, the noise by maximum likelihood, the outliers by the Markov chain of `outlier_chain`. The jerk profile is
then fitted again, with the rates. Rates that do not help to predict the readings, but hinder it, are left out.

So are heights. They count from another zero than the station, and barometric ones have a scale by the temperature: the
offset, and the scale, are those with which the readings are likeliest.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ftproc.core import beside, impact, odds
from ftproc.core.editing.copies import rounding_step
from ftproc.core.filtering import beside as layout
from ftproc.core.filtering.records import Model, Observations, Scalars, Start
from ftproc.core.filtering.smoother import likelihood_of, residuals_beside, smooth_log
from ftproc.core.identification.profile import ALLOWANCE, fit_profile, with_allowance
from ftproc.core.model.earth import MEAN_RADIUS_M as EARTH_M
from ftproc.methods.height import alone
from ftproc.order_statistics import median
from ftproc.records import FlagArray, FloatArray, Heights

TELLING = 0.02  # variance with which the readings predict rates, of the rates' own: with less, the motion is that which
# the readings tell
STEPS = 3  # of the search for a profile
OFFSET_M = 1000.0  # 1-sigma of the zero of heights: the height of the station, and the pressure of the air,
FARTHEST_OFF = 5.0  # of which so many are too many
OFFSET_ROUNDS, STEP_M = 2, 10.0  # of offset and noise in turn; and by how much the heights are moved at most to find it
LEAST_GAIN = 1.0  # of the variance of a height, that an elevation has as a height: with less, heights gain little, and
# what is not white in their noise, such as rounding, does harm
MOST_WRONG = 0.25  # share of heights that are outliers
CONTRADICT = "many of the heights contradict the readings: none is used"
FEWEST_HEIGHTS = 3  # different ones
NEAR, DITHERED = 33, 3.0  # rows in which those of the same height are counted, and of these so few that noise is why
HELD = 1.5  # steps of the rounding between one height and the next: more are heights that come less often than rows
CENTRE = np.array([0.0, 0.0, -EARTH_M])  # of the earth
LATE_ROUNDS = 3  # of finding out how late they are


def fit(
    log: Observations,
    model: Model,
    starts: list[Start],
    given: tuple[FloatArray, float],
    how: tuple[float, bool],
    accepted: NDArray[np.bool_],
) -> tuple[Observations, Model, beside.Channel]:
    """A log whose readings are edited, with its range rates; the model, and what is known of the rates. given: (n,)
    m/s, NaN where missing, and the interval in which they are ambiguous, or zero. how: the gate, and whether the jerk
    is fixed. accepted: (n,) rates that are good by hand."""
    (value, interval), (gate, _) = given, how
    residuals = _residuals(log, model, starts)

    def understood(value: FloatArray) -> beside.Channel:
        unused = Scalars.rates(value, 1.0, np.zeros(len(value)))
        return beside.understood(unused, residuals, gate, interval, accepted)

    channel = understood(value)
    for _ in range(LATE_ROUNDS if channel.told >= beside.USEFUL else 0):
        late_s, growth = beside.lateness(log._replace(beside=(channel.rates,)), model, starts)
        if late_s == 0:
            break
        late_s += channel.late_s
        channel = understood(value + (-late_s if channel.closing else late_s) * growth)._replace(late_s=late_s)
    if channel.why:
        return log, model, channel
    return _with_profile(log, model, starts, channel, how, accepted)


def fit_heights(
    log: Observations,
    model: Model,
    starts: list[Start],
    heights: Heights,
    how: tuple[float, bool],
    accepted: NDArray[np.bool_],
) -> tuple[Observations, Model, beside.Channel]:
    """The same with heights. how, accepted: as in `fit`."""
    value, times = _read_once(heights.above_m)
    step = rounding_step(value)
    own, good = alone.screened(log.time_s, value, step)
    good |= accepted & np.isfinite(value)
    unused = Scalars(value + EARTH_M, own**2 * times, np.zeros(len(value)), layout.DISTANCE, CENTRE)
    channel = beside.Channel(unused, beside.labels_of(good, value), off=np.zeros(len(value)))
    if len(np.unique(value[good])) < FEWEST_HEIGHTS:
        return log, model, channel.left_out("the heights do not change, or are too few to test them: none is used")
    residual, spread = _residuals(log, model, starts)(unused)
    known = good & np.isfinite(residual)
    first = median(residual[known]) if known.any() else 0.0
    near = known & (accepted | (np.abs(residual - first) <= beside.FAR * np.sqrt(spread)))
    rates = unused._replace(value=unused.value - first, weight=near.astype(float))
    prior = np.array([OFFSET_M, alone.TEMPERATURE])[: 1 + heights.barometric]
    off = np.array([first, 0.0])[: len(prior)]
    for _ in range(OFFSET_ROUNDS):
        basis = _basis(log._replace(beside=(*log.beside, rates)), model, starts)[: len(prior)]
        rates = rates._replace(value=unused.value - off @ basis)
        off, _, rates = _offset(log._replace(beside=(*log.beside, rates)), model, starts, (basis, prior, off))
        rates = beside.decided(rates, _residuals(log, model, starts), how[0], near, step)
    told = median((spread - unused.variance)[known]) / float(rates.variance.min()) if known.any() else 0.0
    channel = channel._replace(rates=rates, label=beside.labels_of(rates.weight, value), told=told)
    if _contradict(rates):
        return log, model, channel.left_out(CONTRADICT)
    ground = np.sqrt((smooth_log(log, model, starts).state[:, :2] ** 2).sum(1))
    if np.mean(ground**2) * model.reading_variance[2] < LEAST_GAIN * np.median(rates.variance):
        return log, model, channel.left_out("the elevations tell the height better than the heights: none is used")
    if abs(off[0]) > FARTHEST_OFF * OFFSET_M:
        why = f"the heights are {abs(off[0]) / 1000:.3g} km off, of another unit, or target: none is used"
        return log, model, channel.left_out(why)
    _, found, channel = _with_profile(log, model, starts, channel, how, accepted, step)
    if channel.why or _contradict(channel.rates):
        return log, model, channel if channel.why else channel.left_out(CONTRADICT)
    measured = log._replace(beside=(*log.beside, channel.rates))
    off, factor, rates = _offset(measured, found, starts, (basis, prior, off))
    used = rates if channel.used is None else channel.used._replace(value=rates.value)
    both = log._replace(beside=(*log.beside, channel.silent))
    return both, model, channel._replace(rates=rates, used=used, off=off @ basis, off_sigma_m=(factor.T @ basis).T)


def _basis(log: Observations, model: Model, starts: list[Start]) -> FloatArray:
    """(2, n) derivatives of heights by their offset and their scale. These are of the track: the noise of the heights
    is none of their scale."""
    above = impact.heights(smooth_log(log, model, starts).state[:, :3])
    return np.stack([np.ones(len(above)), above - median(above)])


def _contradict(heights: Scalars) -> bool:
    """Whether so many are outliers that none is to be used."""
    return bool(heights.weight.sum() < (1 - MOST_WRONG) * np.isfinite(heights.value).sum())


def _read_once(value: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values (n,) of which those that are held count once, and how many times the variance of one each of those has
    that are rounded to the same (n,): all these together are one reading."""
    from scipy.ndimage import uniform_filter1d

    there = np.flatnonzero(np.isfinite(value))
    times = np.ones(len(value))
    if len(there) < beside.FEWEST:
        return value, times
    seen = value[there]
    new = np.r_[True, np.diff(seen) != 0]
    length, step = np.diff(np.r_[np.flatnonzero(new), len(seen)]), rounding_step(value)
    if median(length) > 1 and median(np.abs(np.diff(seen[new]))) > HELD * step:
        held = value.copy()
        held[there[~new]] = np.nan
        return held, times
    own, typical = np.repeat(length, length), 1 / np.maximum(uniform_filter1d(new.astype(float), NEAR), 1 / NEAR)
    times[there] = np.where(own > NEAR, own, np.where(typical > DITHERED, typical, 1.0))
    return value, times


def _residuals(log: Observations, model: Model, starts: list[Start]) -> beside.Residuals:
    def residuals(scalars: Scalars) -> tuple[FloatArray, FloatArray]:
        found = residuals_beside(log._replace(beside=(*log.beside, scalars)), model, starts)[-1]
        return found[:, 0], found[:, 1]

    return residuals


def _with_profile(
    log: Observations,
    model: Model,
    starts: list[Start],
    channel: beside.Channel,
    how: tuple[float, bool],
    accepted: NDArray[np.bool_],
    step: float = 0.0,
) -> tuple[Observations, Model, beside.Channel]:
    """The log with the scalars of a channel beside what it has, and the process noise with them; without, if they
    hinder. how, accepted: as in `fit`. step: to which they were rounded."""
    (gate, jerk_fixed), kind, without = how, len(log.beside), model
    of_heights = channel.rates.kind == layout.DISTANCE

    def with_(scalars: Scalars) -> Observations:
        return log._replace(beside=(*log.beside, scalars))

    if channel.told < TELLING:
        used = channel.silent if channel.told < beside.USEFUL else channel.rates
        return with_(channel.silent), model, channel._replace(used=used)
    if not jerk_fixed:
        model = (upward if of_heights else profile)(with_(channel.rates), model, starts)
        rates = beside.decided(channel.rates, _residuals(log, model, starts), gate, accepted, step)
        channel = channel._replace(rates=rates, label=beside.labels_of(rates.weight, rates.value))
    both = with_(channel.rates)
    of_the_log = likelihood_of(log, without, starts)
    if beside.of_the_rest(both, model, starts, kind) < of_the_log - odds.SURE:
        return log, without, channel.left_out(beside.HINDERS.format("heights" if of_heights else "range rates"))
    return both, model, channel


def profile(log: Observations, model: Model, starts: list[Start]) -> Model:
    """The model with the process noise that a log asks for, from its own on."""
    return with_allowance(log, fit_profile(log, starts, model._replace(jerk=model.jerk / ALLOWANCE), STEPS))


def upward(log: Observations, model: Model, starts: list[Start]) -> Model:
    """The same of the vertical process noise alone, because heights say nothing of the motion over the ground; where
    that makes the log likelier."""
    found = model._replace(jerk=np.column_stack([model.jerk[:, :2], profile(log, model, starts).jerk[:, 2]]))
    gained = likelihood_of(log, found, starts) - likelihood_of(log, model, starts)
    return found if gained > odds.SURE else model


def _offset(
    log: Observations, model: Model, starts: list[Start], known: tuple[FloatArray, FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray, Scalars]:
    """The likeliest offset and scale (k,) of the heights that are the last scalars of a log, a factor (k, k) of their
    covariance, and the heights without them. known: derivatives (k, n) of the heights by them, their prior 1-sigma
    (k,), and what is taken out by now (k,). The log-likelihood is a parabola in them."""
    (basis, prior, off), scalars = known, log.beside[-1]
    size = STEP_M / np.maximum(np.nanmax(np.abs(basis), 1), 1e-9)

    def without(more: FloatArray) -> Scalars:
        return scalars._replace(value=scalars.value - more @ basis)

    def likely(*steps: int) -> float:
        moved = without(np.array(steps[: len(size)]) * size)
        return likelihood_of(log._replace(beside=(*log.beside[:-1], moved)), model, starts)

    here, k = likely(0, 0), len(size)
    ahead, behind = ([likely(*(side * each)) for each in np.eye(2, dtype=int)[:k]] for side in (1, -1))
    slope, bend = np.zeros(k), np.zeros((k, k))
    for i in range(k):
        slope[i], bend[i, i] = (ahead[i] - behind[i]) / 2, ahead[i] + behind[i] - 2 * here
    if k > 1:
        bend[0, 1] = bend[1, 0] = likely(1, 1) - ahead[0] - ahead[1] + here
    known_by = np.diag(1 / prior**2) - bend / np.outer(size, size)
    more = np.linalg.solve(known_by, slope / size - off / prior**2)
    return off + more, np.linalg.cholesky(np.linalg.inv(known_by)), without(more)


def columns(state: FloatArray, los_sigma: FloatArray, label: FlagArray) -> dict[str, NDArray[Any]]:
    """The columns of range rates of states (n, 9) whose position and velocity are known along the radial, cross and up
    axes to (n, 6) m, m/s: cleaned, with 1-sigma, and their labels."""
    slant = np.maximum(np.sqrt((state[:, :3] ** 2).sum(1)), layout.NEAREST_M)
    rate = (state[:, :3] * state[:, 3:6]).sum(1) / slant
    across2 = np.maximum((state[:, 3:6] ** 2).sum(1) - rate**2, 0.0)
    sigma = np.sqrt(los_sigma[:, 3] ** 2 + across2 / slant**2 * (los_sigma[:, 1:3] ** 2).max(1))
    return {"range_rate_mps": rate, "sigma_range_rate_mps": sigma, "outlier_range_rate": label}
