"""Range rates beside the readings of a log: their sense, their noise, their outliers, and the process noise with them.

The readings are edited without them. What the record then predicts of each rate shows whether they count outward or
inward and which of them are wrong; noise and decisions follow in turn from the leave-one-out residuals, the noise by
maximum likelihood, the outliers by the Markov chain of `outlier_chain`. The jerk profile is then fitted again, with the
rates. Rates that do not help to predict the readings, but hinder it, are left out.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.editing import outlier_chain
from ftproc.core.editing.copies import rounding_step
from ftproc.core.filtering import rates as layout
from ftproc.core.filtering.forward import filter_with_rates
from ftproc.core.filtering.records import Model, Observations, Rates, Start
from ftproc.core.filtering.smoother import rate_residuals
from ftproc.core.identification.profile import ALLOWANCE, fit_profile, with_allowance
from ftproc.methods.preparing import labels
from ftproc.order_statistics import median
from ftproc.records import FlagArray, FloatArray

FEWEST = 16  # rates that tell their noise
ROUNDS, STILL = 8, 0.02  # of deciding, and the change of ln(noise variance) with which they end
SURE = 8.0  # in log-likelihood, by which the other sense must be likelier
TAILS = 4.0  # degrees of freedom of the distribution that tells the sense
FAR = 6.0  # sigmas from what the readings say, of a rate that is not used to begin with
MOST_REJECTED = 0.5  # share of rates that contradict the readings: with more, none is used
CONTRADICTS = 8.0  # in log-likelihood, by which they may make the readings less likely, by chance
LEAST_MPS = 1e-4  # 1-sigma: no instrument is so good
TELLING = 0.02  # variance with which the readings predict rates, of the rates' own: with less, the motion is that which
# the readings tell
USEFUL = 5e-4  # the same: with less, even the forty or so in a memory of the filter make it better by less than 1 %
STEPS = 3  # of the search for a profile
SCALE = 1.4826


class Channel(NamedTuple):
    """What is known of the rates of a log. rates: (n,) outward, with weights and noise. label: (n,). closing: whether
    the log counts inward. innovation, sigma: (n,) of the filter. why: the rates are not used, "" if they are. used:
    those of the last run, where the motion is chosen without them."""

    rates: Rates
    label: FlagArray
    closing: bool = False
    why: str = ""
    used: Rates | None = None
    innovation: FloatArray = np.zeros(0)
    sigma: FloatArray = np.zeros(0)

    def of_rows(self, rows: slice | NDArray[np.int64]) -> Channel:
        """Of some of the samples."""
        own: dict[str, Any] = {name: getattr(self, name)[rows] for name in ("label", "innovation", "sigma")}
        return self._replace(rates=self.rates.part(rows), **own)

    def filtered(self, left: FloatArray) -> Channel:
        """With what a filter leaves of its samples, see `core.filtering.rates`."""
        return self._replace(innovation=left[:, layout.RESIDUAL], sigma=np.sqrt(left[:, layout.SPREAD]))


def fit(
    log: Observations,
    model: Model,
    starts: list[Start],
    value: FloatArray,
    gate: float,
    jerk_fixed: bool,
    accepted: NDArray[np.bool_],
) -> tuple[Observations, Model, Channel]:
    """A log whose readings are edited, with its range rates value (n,) m/s, NaN where missing; the model, and what is
    known of the rates. accepted: (n,) rates that are good by hand."""
    there = np.isfinite(value)
    unused = Rates(value, 1.0, np.zeros(len(value)))
    label = _labels(there.astype(float), value)
    if there.sum() < FEWEST:
        return log, model, Channel(unused, label, why=f"too few range rates ({int(there.sum())}) to test them")
    residual, spread, _ = rate_residuals(log._replace(rates=unused), model, starts)
    vague = np.maximum(spread - 1.0, 0.0)
    expected = value - residual
    closing = _cost(value - expected, vague) > _cost(-value - expected, vague) + SURE
    value = -value if closing else value
    off = np.where(there, value - expected, np.nan)
    floor = max(rounding_step(value) / math.sqrt(12), LEAST_MPS)
    sigma = max(min(SCALE * median(np.abs(off[there])), _scatter(value)), floor)
    weight = np.where(there & (accepted | (np.abs(off) <= FAR * np.sqrt(vague + sigma**2))), 1.0, 0.0)
    found, known = Rates(value, sigma**2, weight), (gate, floor, accepted)
    found = _decided(log, model, starts, found, *known)
    if found.weight.sum() < (1 - MOST_REJECTED) * there.sum():
        return log, model, Channel(unused, label, why="most of the range rates contradict the readings: none is used")
    without = model
    told = median(vague[there]) / found.variance
    if told < TELLING:
        silent = found._replace(weight=np.zeros(len(value)))
        used = silent if told < USEFUL else found
        return log._replace(rates=silent), model, Channel(found, _labels(found.weight, value), closing, used=used)
    if not jerk_fixed:
        fitted = fit_profile(log._replace(rates=found), starts, model._replace(jerk=model.jerk / ALLOWANCE), STEPS)
        model = with_allowance(log, fitted)
        found = _decided(log, model, starts, found, *known)
    both = log._replace(rates=found)
    if _of_readings(both, model, starts) < _of_readings(log, without, starts) - CONTRADICTS:
        why = "the range rates make the readings less likely (biased, late, or not measured): none is used"
        return log, without, Channel(unused, label, why=why)
    return both, model, Channel(found, _labels(found.weight, value), closing)


def _of_readings(log: Observations, model: Model, starts: list[Start]) -> float:
    """The log-likelihood of the readings, each predicted from all earlier ones, and from the rates so far."""
    run, left = filter_with_rates(log, model, starts)
    used = left[:, layout.WEIGHT] > 0
    residual, spread = left[used, layout.RESIDUAL], left[used, layout.SPREAD]
    return run.log_likelihood + 0.5 * float((np.log(spread) + residual**2 / spread).sum())


def columns(state: FloatArray, los_sigma: FloatArray, label: FlagArray) -> dict[str, NDArray[Any]]:
    """The columns of range rates of states (n, 9) whose position and velocity are known along the radial, cross and up
    axes to (n, 6) m, m/s: cleaned, with 1-sigma, and their labels."""
    slant = np.maximum(np.sqrt((state[:, :3] ** 2).sum(1)), layout.NEAREST_M)
    rate = (state[:, :3] * state[:, 3:6]).sum(1) / slant
    across2 = np.maximum((state[:, 3:6] ** 2).sum(1) - rate**2, 0.0)
    sigma = np.sqrt(los_sigma[:, 3] ** 2 + across2 / slant**2 * (los_sigma[:, 1:3] ** 2).max(1))
    return {"range_rate_mps": rate, "sigma_range_rate_mps": sigma, "outlier_range_rate": label}


def _decided(
    log: Observations,
    model: Model,
    starts: list[Start],
    rates: Rates,
    gate: float,
    floor: float,
    accepted: NDArray[np.bool_],
) -> Rates:
    """Noise and weights in turn, until they stand still."""
    chances = np.tile(np.array(outlier_chain.START_RATES), (3, 1))
    n = len(rates.value)
    for _ in range(ROUNDS):
        residual, spread, _ = rate_residuals(log._replace(rates=rates), model, starts)
        used = rates.weight > 0
        ratio = float(((residual / spread) ** 2)[used].sum() / (1 / spread)[used].sum()) if used.any() else 1.0
        variance = max(rates.variance * min(max(ratio, 0.1), 10.0), floor**2)
        alone, wide = np.full((n, 3), np.nan), np.ones((n, 3))
        alone[:, 0], wide[:, 0] = residual, spread - rates.variance + variance
        good = outlier_chain.classify(alone, wide, np.array([variance, 1.0, 1.0]), chances, gate)[:, 0]
        weight = ((good > 0.5) | accepted).astype(float)
        still = (weight == rates.weight).all() and abs(math.log(variance / rates.variance)) < STILL
        rates = rates._replace(variance=variance, weight=weight)
        if still:
            break
    return rates


def _cost(off: FloatArray, vague: FloatArray) -> float:
    """Minus the log-likelihood of differences (n,) from what is predicted with these variances, with noise by their own
    size and with tails."""
    there = np.isfinite(off)
    variance = vague[there] + (SCALE * median(np.abs(off[there]))) ** 2 + LEAST_MPS**2
    each = 0.5 * np.log(variance) + 0.5 * (TAILS + 1) * np.log1p(off[there] ** 2 / (TAILS * variance))
    return float(each.sum())


def _scatter(value: FloatArray) -> float:
    """Noise 1-sigma of single rates, by their second differences."""
    seen = value[np.isfinite(value)]
    return SCALE * median(np.abs(np.diff(seen, 2))) / math.sqrt(6)


def _labels(weight: FloatArray, value: FloatArray) -> FlagArray:
    """(n,) good, isolated, patch or missing."""
    wide, alone = np.ones((len(value), 3)), np.zeros((len(value), 3))
    wide[:, 0], alone[:, 0] = weight, value
    return labels(wide, alone)[:, 0]
