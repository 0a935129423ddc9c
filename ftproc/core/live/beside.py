"""Range rates beside the readings of a window: their sense and their noise, from what has come so far."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ftproc.core import beside, odds
from ftproc.core.filtering.beside import GATE
from ftproc.core.filtering.records import Model, Observations, Scalars, Start
from ftproc.core.filtering.smoother import residuals_beside
from ftproc.records import FloatArray

WIDTH, RATE = 4, 3  # columns of what comes: range, azimuth, elevation, range rate; and which is the last


class Rates(NamedTuple):
    """sign: by which they count outward. sigma_mps: noise. used: whether they are used at all."""

    sign: float = 1.0
    sigma_mps: float = 1.0
    used: bool = False

    def scalars(self, rate: FloatArray, weight: FloatArray) -> tuple[Scalars, ...]:
        """As a log has them, with weights (n,); none where they are not used."""
        return (Scalars.rates(self.sign * rate, self.sigma_mps**2, weight),) if self.used else ()


def widened(measurement: FloatArray) -> FloatArray:
    """(n, WIDTH) of readings (n, 3), with no range rates, or as they are."""
    if measurement.shape[1] == WIDTH:
        return measurement
    return np.column_stack([measurement, np.full(len(measurement), np.nan)])


def learned(log: Observations, model: Model, starts: list[Start], rate: FloatArray) -> tuple[Rates, FloatArray]:
    """What a log that is edited shows of its range rates (n,), and their weights (n,)."""

    def residuals(rates: Scalars) -> tuple[FloatArray, FloatArray]:
        found = residuals_beside(log._replace(beside=(rates,)), model, starts)[0]
        return found[:, 0], found[:, 1]

    channel = beside.understood(Scalars.rates(rate, 1.0, np.zeros(len(rate))), residuals, GATE)
    if channel.why or channel.told < beside.USEFUL:
        return Rates(), np.zeros(len(rate))
    both = log._replace(beside=(channel.rates,))
    hinder = beside.of_the_rest(both, model, starts) < beside.of_the_rest(log, model, starts) - odds.SURE
    if hinder or beside.lateness(both, model, starts)[0] != 0:
        return Rates(), np.zeros(len(rate))
    return Rates(-1.0 if channel.closing else 1.0, channel.noise, True), channel.rates.weight


def decided(log: Observations, model: Model, start: Start) -> Observations:
    """The log with its range rates decided on again."""
    if not log.beside:
        return log
    residual, spread = residuals_beside(log, model, [start])[0].T
    weight = beside.good(residual, spread, float(log.beside[0].variance[0]), GATE)
    return log._replace(beside=(log.beside[0]._replace(weight=weight),))


def without(log: Observations, sample: int) -> Observations:
    """The log, of which no reading of a sample is used any more (in place)."""
    log.weight[sample] = 0.0
    for each in log.beside:
        each.weight[sample] = 0.0
    return log
