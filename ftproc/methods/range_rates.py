"""Range rates beside the readings of a log: their sense, their noise, their outliers, and the process noise with them.

The readings are edited without them. What the record then predicts of each rate shows whether they count outward or
inward, which of them are wrong, and whether they are late; noise and decisions follow in turn from the leave-one-out
residuals, the noise by maximum likelihood, the outliers by the Markov chain of `outlier_chain`. The jerk profile is
then fitted again, with the rates. Rates that do not help to predict the readings, but hinder it, are left out.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ftproc.core import beside
from ftproc.core.filtering import beside as layout
from ftproc.core.filtering.records import Model, Observations, Scalars, Start
from ftproc.core.filtering.smoother import residuals_beside
from ftproc.core.identification.profile import ALLOWANCE, fit_profile, with_allowance
from ftproc.records import FlagArray, FloatArray

TELLING = 0.02  # variance with which the readings predict rates, of the rates' own: with less, the motion is that which
# the readings tell
STEPS = 3  # of the search for a profile
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
    (value, interval), (gate, jerk_fixed) = given, how

    def residuals(rates: Scalars) -> tuple[FloatArray, FloatArray]:
        found = residuals_beside(log._replace(beside=(rates,)), model, starts)[0]
        return found[:, 0], found[:, 1]

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
    if channel.told < TELLING:
        used = channel.silent if channel.told < beside.USEFUL else channel.rates
        return log._replace(beside=(channel.silent,)), model, channel._replace(used=used)
    without = model
    if not jerk_fixed:
        both = log._replace(beside=(channel.rates,))
        fitted = fit_profile(both, starts, model._replace(jerk=model.jerk / ALLOWANCE), STEPS)
        model = with_allowance(log, fitted)
        rates = beside.decided(channel.rates, residuals, gate, accepted)
        channel = channel._replace(rates=rates, label=beside.labels_of(rates.weight, rates.value))
    both = log._replace(beside=(channel.rates,))
    if beside.of_the_rest(both, model, starts) < beside.of_the_rest(log, without, starts) - beside.CONTRADICTS:
        return log, without, channel.left_out(beside.HINDERS)
    return both, model, channel


def columns(state: FloatArray, los_sigma: FloatArray, label: FlagArray) -> dict[str, NDArray[Any]]:
    """The columns of range rates of states (n, 9) whose position and velocity are known along the radial, cross and up
    axes to (n, 6) m, m/s: cleaned, with 1-sigma, and their labels."""
    slant = np.maximum(np.sqrt((state[:, :3] ** 2).sum(1)), layout.NEAREST_M)
    rate = (state[:, :3] * state[:, 3:6]).sum(1) / slant
    across2 = np.maximum((state[:, 3:6] ** 2).sum(1) - rate**2, 0.0)
    sigma = np.sqrt(los_sigma[:, 3] ** 2 + across2 / slant**2 * (los_sigma[:, 1:3] ** 2).max(1))
    return {"range_rate_mps": rate, "sigma_range_rate_mps": sigma, "outlier_range_rate": label}
