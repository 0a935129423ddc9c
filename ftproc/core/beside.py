"""Scalars beside the readings of a record that is edited, such as range rates: their sense, noise and outliers.

What the record predicts of each shows whether they count outward or inward and which of them are wrong; noise and
decisions follow in turn from the leave-one-out residuals, the noise by maximum likelihood, the outliers by the Markov
chain of `outlier_chain`. Scalars that do not help to predict the readings, but hinder it, are left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core import odds
from ftproc.core.editing import outlier_chain
from ftproc.core.editing.copies import rounding_step
from ftproc.core.filtering import beside as layout
from ftproc.core.filtering.forward import filter_with_beside
from ftproc.core.filtering.records import Model, Observations, Scalars, Start
from ftproc.core.filtering.smoother import smooth_log
from ftproc.order_statistics import median, typical
from ftproc.records import FloatArray

Labels = NDArray[np.uint8]

FEWEST = 16  # scalars that tell their noise
ROUNDS, STILL = 8, 0.02  # of deciding, and the change of ln(noise variance) with which they end
LEAST_LATE = 0.05  # of an interval, by which they must be late
TAILS = 4.0  # degrees of freedom of the distribution that tells the sense
FAR = 6.0  # sigmas from what the readings say, of a scalar that is not used to begin with
MOST_REJECTED = 0.5  # share of those that contradict the readings: with more, none is used
HINDERS = "the {} make the readings less likely (biased, late, or not measured): none is used"
TURN = 0.1  # of the interval, 1-sigma, up to which the readings tell the turn of an ambiguous range rate
LEAST = 1e-4  # m/s or m, 1-sigma: no instrument is so good
USEFUL = 5e-4  # variance with which the readings predict a scalar, of its own: with less, even the forty or so in a
# memory of the filter make it better by less than 1 %
LONGEST_ISOLATED = 2  # rejected in a row; more make a patch
SCALE = 1.4826
NONE = np.zeros(1, bool)  # is good by hand


class Channel(NamedTuple):
    """What is known of the rates of a log. rates: (n,) outward, with weights and noise. label: (n,). closing: whether
    the log counts inward. late_s: by which they are late, and corrected. told: variance with which the readings
    predict them, of their own. why: they are not used, "" if they are. used: those of the last run, where the motion
    is chosen without them. off: (n,) that was taken out of heights, m; off_sigma_m: (n, k) what k independent unknowns
    in it may be off by, 1-sigma. innovation, sigma: (n,) of the filter."""

    rates: Scalars
    label: Labels
    closing: bool = False
    late_s: float = 0.0
    told: float = 0.0
    why: str = ""
    used: Scalars | None = None
    off: FloatArray = np.zeros(0)
    off_sigma_m: FloatArray = np.zeros((0, 0))
    innovation: FloatArray = np.zeros(0)
    sigma: FloatArray = np.zeros(0)

    @property
    def noise(self) -> float:
        """1-sigma of their noise, m/s or m; of the best of them."""
        return math.sqrt(float(self.rates.variance.min()))

    @property
    def silent(self) -> Scalars:
        """Those of which none is used."""
        return self.rates._replace(weight=np.zeros(len(self.label)))

    def of_rows(self, rows: slice | NDArray[np.int64]) -> Channel:
        """Of some of the samples."""
        names = [name for name in ("label", "innovation", "sigma", "off") if len(getattr(self, name))]
        own: dict[str, Any] = {name: getattr(self, name)[rows] for name in names}
        return self._replace(rates=self.rates.part(rows), **own)

    def filtered(self, left: FloatArray) -> Channel:
        """With what a filter leaves of its samples, see `core.filtering.beside`."""
        return self._replace(innovation=left[:, layout.RESIDUAL], sigma=np.sqrt(left[:, layout.SPREAD]))

    def left_out(self, why: str) -> Channel:
        """The same, none of which is used."""
        return self._replace(
            rates=self.silent, label=labels_of(np.isfinite(self.rates.value), self.rates.value), why=why
        )


#: Leave-one-out residuals (n,) of rates, and their variances, in a record that has these beside its readings.
Residuals = Callable[[Scalars], tuple[FloatArray, FloatArray]]


def understood(
    unused: Scalars, residuals: Residuals, gate: float, interval: float = 0.0, accepted: NDArray[np.bool_] = NONE
) -> Channel:
    """What a record whose readings are edited shows of range rates, none of which is used yet, with variance 1.
    interval: in which they are ambiguous, m/s; zero if they are not. accepted: (n,) that are good by hand."""
    value, there = unused.value, np.isfinite(unused.value)
    channel = Channel(unused, labels_of(there, value))
    if there.sum() < FEWEST:
        return channel.left_out(f"too few range rates ({int(there.sum())}) to test them")
    residual, spread = residuals(unused)
    predicted = np.maximum(spread - 1.0, 0.0)
    expected = value - residual
    if interval > 0:  # where the readings tell the turn
        there &= predicted < (TURN * interval) ** 2
        value, unused = np.where(there, value, np.nan), unused._replace(weight=unused.weight * there)
    outward, inward = (_nearest(each - expected, interval) for each in (value, -value))
    closing = _cost(outward, predicted) > _cost(inward, predicted) + odds.SURE
    off = np.where(there, inward if closing else outward, np.nan)
    value = expected + off if interval > 0 else -value if closing else value
    sigma = max(min(SCALE * median(np.abs(off[there])), _scatter(value)), _least(value))
    weight = np.where(there & (accepted | (np.abs(off) <= FAR * np.sqrt(predicted + sigma**2))), 1.0, 0.0)
    rates = unused._replace(value=value, variance=np.full(len(value), sigma**2), weight=weight)
    rates = decided(rates, residuals, gate, accepted & there)
    if rates.weight.sum() < (1 - MOST_REJECTED) * there.sum():
        return channel.left_out("most of the range rates contradict the readings: none is used")
    told = median(predicted[there]) / float(rates.variance[0])
    return Channel(rates, labels_of(rates.weight, value), closing, told=told)


def of_the_rest(log: Observations, model: Model, starts: list[Start], kind: int = 0) -> float:
    """The log-likelihood of all but one kind of scalars beside the readings, each predicted from all before it."""
    run, left = filter_with_beside(log, model, starts)
    if not len(left):
        return run.log_likelihood
    used = np.flatnonzero(np.isfinite(left[kind, :, layout.SPREAD]) & (left[kind, :, layout.WEIGHT] > 0))
    residual, spread = left[kind, used, layout.RESIDUAL], left[kind, used, layout.SPREAD]
    return run.log_likelihood + 0.5 * float((np.log(spread) + residual**2 / spread).sum())


def lateness(log: Observations, model: Model, starts: list[Start]) -> tuple[float, FloatArray]:
    """By how many seconds the range rates beside a log are late, zero if they do not tell, and how they grow, (n,)
    m/s2. A rate that is late by T is off by T times its growth, so the log-likelihood is a parabola in T."""
    state = smooth_log(log, model, starts).state
    slant = np.maximum(np.sqrt((state[:, :3] ** 2).sum(1)), layout.NEAREST_M)
    rate = (state[:, :3] * state[:, 3:6]).sum(1) / slant
    growth = ((state[:, 3:6] ** 2).sum(1) + (state[:, :3] * state[:, 6:]).sum(1) - rate**2) / slant
    (rates,) = log.beside
    step = typical(np.diff(log.time_s))

    def likely(late_s: float) -> float:
        moved = rates._replace(value=rates.value + late_s * growth)
        return filter_with_beside(log._replace(beside=(moved,)), model, starts)[0].log_likelihood

    low, here, high = map(likely, (-step, 0.0, step))
    rise, bend = (high - low) / 2, 2 * here - low - high
    if not (bend > 0 and rise**2 / (2 * bend) > odds.SURE):
        return 0.0, growth
    late_s = step * rise / bend
    return (late_s if abs(late_s) > LEAST_LATE * step else 0.0), growth


def decided(
    rates: Scalars, residuals: Residuals, gate: float, accepted: NDArray[np.bool_] = NONE, step: float = 0.0
) -> Scalars:
    """Noise and weights in turn, until they stand still; the noise of one is as many times that of another as before.
    accepted: (n,) that are good by hand. step: to which they were rounded, where their values show it no more."""
    chances = np.tile(np.array(outlier_chain.START_RATES), (3, 1))
    least = max(_least(rates.value), step / math.sqrt(12)) ** 2
    for _ in range(ROUNDS):
        residual, spread = residuals(rates)
        used, before = rates.weight > 0, float(rates.variance.min())
        times = rates.variance / before
        share = times / spread
        ratio = float((share * residual**2 / spread)[used].sum() / share[used].sum()) if used.any() else 1.0
        variance = max(before * min(max(ratio, 0.1), 10.0), least)
        wide = spread + (variance - before) * times
        weight = np.where(accepted, 1.0, good(residual, wide, variance, gate, chances))
        still = (weight == rates.weight).all() and abs(math.log(variance / before)) < STILL
        rates = rates._replace(variance=variance * times, weight=weight)
        if still:
            break
    return rates


def good(
    residual: FloatArray, spread: FloatArray, variance: float, gate: float, chances: FloatArray | None = None
) -> FloatArray:
    """(n,) weights by leave-one-out residuals and their variances, where that of the noise is known. chances: of
    outliers, which follow."""
    n = len(residual)
    chances = np.tile(np.array(outlier_chain.START_RATES), (3, 1)) if chances is None else chances
    alone, wide = np.full((n, 3), np.nan), np.ones((n, 3))
    alone[:, 0], wide[:, 0] = residual, spread
    found = outlier_chain.classify(alone, wide, np.array([variance, 1.0, 1.0]), chances, gate)
    return (found[:, 0] > 0.5).astype(float)


def _least(value: FloatArray) -> float:
    """1-sigma of the noise: that of rounding, or more."""
    return max(rounding_step(value) / math.sqrt(12), LEAST)


def _nearest(off: FloatArray, interval: float) -> FloatArray:
    """(n,) differences without the whole turns in them."""
    return off - interval * np.round(off / interval) if interval > 0 else off


def _cost(off: FloatArray, predicted: FloatArray) -> float:
    """Minus the log-likelihood of differences (n,) from what is predicted with these variances, with noise by their own
    size and with tails."""
    there = np.isfinite(off)
    variance = predicted[there] + (SCALE * median(np.abs(off[there]))) ** 2 + LEAST**2
    each = 0.5 * np.log(variance) + 0.5 * (TAILS + 1) * np.log1p(off[there] ** 2 / (TAILS * variance))
    return float(each.sum())


def _scatter(value: FloatArray) -> float:
    """Noise 1-sigma of single rates, by their second differences."""
    seen = value[np.isfinite(value)]
    return SCALE * median(np.abs(np.diff(seen, 2))) / math.sqrt(6)


def labels_of(weight: NDArray[Any], value: FloatArray) -> Labels:
    """(n,) good, isolated, patch or missing."""
    wide, alone = np.ones((len(value), 3)), np.zeros((len(value), 3))
    wide[:, 0], alone[:, 0] = weight, value
    return outlier_chain.label_runs(wide, alone, LONGEST_ISOLATED)[:, 0].astype(np.uint8)
