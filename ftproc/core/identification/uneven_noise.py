"""Noise that is not the same for all readings of a component: late time stamps, drifting variance, coarse rounding.

What is found is how many times the variance of a component's noise that of each reading is. Time stamps that are off by
sigma_t add (sigma_t dz/dt)^2, the same sigma_t for the three components; a few stamps may be off by far more. The
variance may drift with elevation, range or signal, so slowly that the residuals of a stretch show it; and a reading
that repeats the one before, because the target has not moved by a rounding step, says nothing new.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ftproc.core import odds, pacing
from ftproc.core.filtering.records import Model, Observations, Uneven
from ftproc.core.filtering.smoother import SmootherRun
from ftproc.core.identification import optimizer
from ftproc.order_statistics import median, medians
from ftproc.records import FloatArray

TAILS = 4.0  # degrees of freedom of the distribution that outliers move little
SHARE = 0.07  # in log-likelihood, for each sample, for late stamps to be accepted
STAMP_TAILS, STAMP_ROUNDS = 2.0, 100  # degrees of freedom of how late the stamps are: a few, by very much
STAMP_SCALES = np.logspace(-2, 8, 101)  # of the usual variance of a stamp, for integrals over it
STEPS = 30
WINDOW, SHORTEST_WINDOW = 60, 24  # readings from which a variance is taken, of a long log and of a short one
FEWEST_WINDOWS = 6
CHI2_MEDIAN, MEDIAN_SPREAD = 0.45494, 2.66  # of chi-square with one degree, and sqrt(n) sigma of its log's estimate
SMALLEST = 1e-6  # square of a residual, in sigmas: a component that is computed from others has none
LEAST_DRIFT = 0.15  # 1-sigma of ln(variance) over the windows, beyond chance
LARGEST_DRIFT = 6.0  # of ln(variance)
GOES_BACK = 0.2  # share of the changes of a rounded reading that go back to the value before: more of them is noise
SURELY_CHANCE, MOST_REPEATS = 0.05, 0.98  # expected number of longer runs that noise makes; share of repeats


def rates(state: FloatArray) -> FloatArray:
    """(n, 3) rates of range m/s, azimuth and elevation rad/s of states (n, 9)."""
    (x, y, z), (vx, vy, vz) = state[:, :3].T, state[:, 3:6].T
    ground = np.maximum(np.hypot(x, y), 1e-300)
    slant = np.hypot(ground, z)
    outward = (x * vx + y * vy) / ground
    found: FloatArray = np.stack(
        [(x * vx + y * vy + z * vz) / slant, (x * vy - y * vx) / ground**2, (ground * vz - z * outward) / slant**2], 1
    )
    return found


def stamp_variance(log: Observations, smoothed: SmootherRun, model: Model) -> tuple[FloatArray, float]:
    """(3,) variances of the noise, and that of the time stamps, s^2; zero if the residuals show none.

    By maximum likelihood of the leave-one-out residuals of all readings, with Student's distribution, because the
    readings that are taken for outliers may be late ones.
    """
    used = np.isfinite(smoothed.residual) & np.isfinite(smoothed.residual_variance)
    uneven = log.uneven or Uneven.none(len(log.time_s))
    noise = model.noise_variance * uneven.times + uneven.late**2
    square = np.where(used, smoothed.residual, 0.0) ** 2
    predicted = np.where(used, np.maximum(smoothed.residual_variance - noise, 0.0), 1.0)
    speed2 = rates(smoothed.state) ** 2
    typical = median(model.noise_variance / np.maximum(np.mean(speed2, 0), 1e-300))

    def cost(theta: FloatArray) -> optimizer.Point:
        pacing.swept(len(used))
        white, stamps = np.exp(theta[:3]), math.exp(theta[3])
        variance = predicted + white + stamps * speed2
        ratio = square / (TAILS * variance)
        each = np.where(used, 0.5 * np.log(variance) + 0.5 * (TAILS + 1) * np.log1p(ratio), 0.0)
        slope = np.where(used, 0.5 - 0.5 * (TAILS + 1) * ratio / (1 + ratio), 0.0) / variance
        slopes = np.r_[(slope * white).sum(0), (slope * stamps * speed2).sum()]
        return optimizer.Point(float(each.sum()), slopes, curvature)

    first = np.log(np.r_[model.noise_variance, typical])
    reach = np.r_[np.full(3, 12.0), 12.0]
    curvature = np.r_[used.sum(0) / 4 + 1.0, used.sum() / 8 + 1.0]

    def likeliest(start: FloatArray, low: FloatArray) -> tuple[float, FloatArray]:
        found = optimizer.minimise(cost, start, low, first + reach, STEPS, 0.01)
        return cost(found).value, found

    without = first - np.r_[0.0, 0.0, 0.0, 35.0]
    plain, _ = likeliest(without, np.r_[first[:3] - 12.0, without[3]])
    tries = [likeliest(first - np.r_[0.0, 0.0, 0.0, less], first - 35.0) for less in (0.0, 4.0)]
    best, found = min(tries, key=lambda each: each[0])
    late = plain - best > max(odds.MANY, SHARE * len(used))
    late = late and math.exp(found[3]) < median(np.diff(log.time_s)) ** 2  # else they would not be in order
    return np.exp(found[:3]), math.exp(found[3]) if late else 0.0


class Stamps(NamedTuple):
    """How far time stamps are off. variance: (n,) of each, s^2. log_probability: of the stamps being off by anything
    that Student's distribution allows, against that of these variances."""

    variance: FloatArray
    log_probability: float


def each_stamp(log: Observations, smoothed: SmootherRun, model: Model, typical: float) -> Stamps:
    """The variance of each time stamp, if how far they are off has Student's distribution. typical: the usual one to
    begin with, s^2.

    By expectation and maximisation: what the readings of a sample together say of its stamp, beside what is usual.
    """
    uneven = log.uneven or Uneven.none(len(log.time_s))
    used = np.isfinite(smoothed.residual) & np.isfinite(smoothed.residual_variance)
    reading = model.noise_variance * uneven.times + uneven.late**2
    on_time = np.where(used, np.maximum(smoothed.residual_variance - reading, 0.0) + model.noise_variance, 1.0)
    speed = np.where(used, rates(smoothed.state), 0.0)
    error = 1 / np.maximum((speed**2 / on_time).sum(1), 1e-300)
    off2 = (error * (speed * np.where(used, smoothed.residual, 0.0) / on_time).sum(1)) ** 2
    each = np.full(len(speed), typical)
    for _ in range(STAMP_ROUNDS):
        known = each / (each + error)
        each = (STAMP_TAILS * typical + known * error + known**2 * off2) / (STAMP_TAILS + 1)
        typical = 1 / float(np.mean(1 / each))
    # Student's distribution is a mixture of normal ones, whose variances have an inverse gamma distribution.
    share = STAMP_SCALES ** (-0.5 * STAMP_TAILS) * np.exp(-0.5 * STAMP_TAILS / STAMP_SCALES)
    mixed = np.full_like(off2, -np.inf)
    for weight, scale in zip(np.log(share / share.sum()), STAMP_SCALES, strict=True):
        mixed = np.logaddexp(mixed, weight + _normal(off2, scale * typical + error))
    return Stamps(each, float((mixed - _normal(off2, each + error)).sum()))


def _normal(square: FloatArray, variance: FloatArray) -> FloatArray:
    """ln(density) of normal distributions of mean zero, without a constant."""
    return -0.5 * (np.log(variance) + square / variance)


def drift(
    log: Observations, residual: FloatArray, variance: FloatArray, by_neighbours: bool = False
) -> FloatArray | None:
    """(n, 3) how many times the variance of a component that of each reading is, where it drifts; None if in none.

    residual, variance: (n, 3) leave-one-out, of the smoother. by_neighbours: it grows only where the differences of
    neighbours do; where a track diverges beside a jump, the residuals grow together."""
    found = np.ones_like(log.weight)
    for c in range(3):
        seen = np.flatnonzero((log.weight[:, c] > 0) & np.isfinite(variance[:, c]))
        size = min(WINDOW, len(seen) // FEWEST_WINDOWS)
        if size < SHORTEST_WINDOW:
            continue
        count = len(seen) // size
        r, v = residual[seen, c], variance[seen, c]
        level = _levels(r**2 / v, count)
        if by_neighbours:
            beside = _levels(np.diff(r, prepend=r[:1]) ** 2 / (v + np.r_[v[:1], v[:-1]]), count)
            level = np.minimum(level, beside + median(level) - median(beside))
        chance = MEDIAN_SPREAD**2 / size
        drifting = float(np.var(level)) - chance
        if drifting < max(LEAST_DRIFT**2, 3 * chance * math.sqrt(2 / count)):
            continue
        even = np.convolve(np.pad(level, 1, mode="edge"), [0.25, 0.5, 0.25], "valid")
        even = np.clip(even - median(even), -LARGEST_DRIFT, LARGEST_DRIFT) * drifting / (drifting + 0.375 * chance)
        middle = _of_windows(log.time_s[seen], count, lambda rows: rows.mean(1))
        # It goes on as far again beyond the ends, where readings may be missing because the noise has grown.
        middle, even = (np.pad(each, 1, mode="reflect", reflect_type="odd") for each in (middle, even))
        found[:, c] = np.exp(np.interp(log.time_s, middle, even))
    return found if (found != 1).any() else None


def drifted(uneven: Uneven | None, drifting: FloatArray | None) -> Uneven | None:
    """Noise of readings that differs so many times (n, 3) in variance from what is known already."""
    if drifting is None:
        return uneven
    known = uneven or Uneven.none(len(drifting))
    return Uneven(known.times * drifting, known.late * np.sqrt(drifting))


def _levels(square: FloatArray, count: int) -> FloatArray:
    """(count,) ln(variance) of windows of normalised squares (n,)."""
    return np.log(np.maximum(_of_windows(square, count, lambda rows: medians(rows.T)), SMALLEST) / CHI2_MEDIAN)


def _of_windows(values: FloatArray, count: int, what: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """(count,) mean or median of each window of values (n,), which are about as long."""
    size, longer = divmod(len(values), count)
    edge = longer * (size + 1)
    parts = values[:edge].reshape(longer, size + 1), values[edge:].reshape(count - longer, size)
    return np.concatenate([what(part) for part in parts])


def repeated(measurement: FloatArray, step: FloatArray) -> Uneven | None:
    """As many times the variance as the run of equal readings is long that a reading belongs to, where it is longer
    than chance makes it; None if nowhere. step (3,): of rounding, zero for none."""
    uneven = Uneven.none(len(measurement))
    found = uneven.times
    for c in np.flatnonzero(step > 0):
        seen = np.flatnonzero(np.isfinite(measurement[:, c]))
        values = measurement[seen, c]
        begins = np.flatnonzero(np.r_[True, np.abs(np.diff(values)) > 0.5 * step[c]])
        length, levels = np.diff(np.r_[begins, len(values)]), values[begins]
        back = np.mean(np.abs(levels[2:] - levels[:-2]) < 0.5 * step[c]) if len(levels) > 2 else 1.0
        chance = 1.0
        if back > GOES_BACK:  # noise decides between two values
            share = min(max(1 - len(begins) / len(values), 1e-3), MOST_REPEATS)
            chance += math.log(SURELY_CHANCE / len(values)) / math.log(share)
        found[seen, c] = np.repeat(np.where(length > chance, length, 1), length)
    return uneven if (found != 1).any() else None
