"""What the methods share that clean range, azimuth and elevation one by one: what they know of the log, and how their
values become a trajectory."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ftproc.core.filtering.records import FilterRun, Model
from ftproc.core.model.frames import line_of_sight_axes, to_cartesian, wrap
from ftproc.methods.estimate import Estimate, Readings
from ftproc.methods.preparing import labels, trusted
from ftproc.records import FloatArray
from ftproc.settings import FilterSettings

MARGIN = 1.5  # on the largest changes that trusted readings show
SHARE = 0.99  # of them that must be smaller
AZIMUTH = 1


class Log(NamedTuple):
    """interval_s: the typical one. sigma: (3,) 1-sigma of the noise, m, rad, rad. trusted: (n, 3) readings that
    screening trusts, NaN for the others. change, elapsed_s: for each component, differences (m,) of neighbours among
    these, and the time between them."""

    interval_s: float
    sigma: FloatArray
    trusted: FloatArray
    change: list[FloatArray]
    elapsed_s: list[FloatArray]


class Cleaned(NamedTuple):
    """What a channel method found, all (n, 3) in m, rad, rad, NaN where it does not say: values; weight, zero where
    rejected; innovations and their sigmas; 1-sigma of the values; their rates per second."""

    value: FloatArray
    weight: FloatArray
    innovation: FloatArray | None = None
    innovation_sigma: FloatArray | None = None
    sigma: FloatArray | None = None
    rate: FloatArray | None = None


def look(readings: Readings, settings: FilterSettings) -> Log:
    """What is known of a log before it is filtered: these papers leave their thresholds to the engineer."""
    time_s, measurement, _ = readings
    weight, sigma = trusted(readings, settings)
    steps = np.diff(time_s)
    interval = float(np.median(steps[steps > 0])) if (steps > 0).any() else 1.0
    change, elapsed = [], []
    for c in range(3):
        rows = np.flatnonzero(weight[:, c] > 0)
        difference = np.diff(measurement[rows, c])
        change.append(wrap(difference) if c == AZIMUTH else difference)
        elapsed.append(np.diff(time_s[rows]))
    return Log(interval, sigma, np.where(weight > 0, measurement, np.nan), change, elapsed)


def largest_change(log: Log, c: int, gate: float) -> float:
    """By how much a good reading of component c may differ from the one before: what the log's own trusted readings
    show, and at least what noise alone does, `gate` sigmas of a difference."""
    near = log.elapsed_s[c] <= 1.5 * log.interval_s
    usual = float(np.quantile(np.abs(log.change[c][near]), SHARE)) if near.any() else 0.0
    return max(gate * math.sqrt(2) * float(log.sigma[c]), MARGIN * usual)


def walk_variance(log: Log, c: int) -> float:
    """What a random walk must gain in variance per interval for the fastest changes of component c to be within its
    sigma; at least three times the noise variance, the ratio that Yu et al. give."""
    noise = float(log.sigma[c]) ** 2
    moving = log.elapsed_s[c] > 0
    if not moving.any():
        return 3 * noise
    rate = np.abs(log.change[c][moving]) / log.elapsed_s[c][moving]
    return max(3 * noise, (float(np.quantile(rate, SHARE)) * log.interval_s) ** 2)


def estimate(readings: Readings, log: Log, found: Cleaned) -> Estimate:
    """Positions from cleaned readings, velocities from their rates; the rest is not estimated."""
    n = len(readings.time_s)
    nothing = np.full((n, 3), np.nan)
    cleaned = found.value.copy()
    cleaned[:, AZIMUTH] = wrap(cleaned[:, AZIMUTH])
    state, sigma, los_sigma = np.full((n, 9), np.nan), np.full((n, 9), np.nan), np.full((n, 6), np.nan)
    state[:, :3] = to_cartesian(cleaned)
    axes = line_of_sight_axes(state[:, :3])
    scale = np.stack([np.ones(n), cleaned[:, 0] * np.cos(cleaned[:, 2]), cleaned[:, 0]], 1)  # m per m, rad, rad
    if found.sigma is not None:
        los_sigma[:, :3] = scale * found.sigma
        sigma[:, :3] = np.sqrt(np.einsum("nia,ni->na", axes**2, los_sigma[:, :3] ** 2))
    if found.rate is not None:
        state[:, 3:6] = np.einsum("nia,ni->na", axes, scale * found.rate)
    run = FilterRun(
        readings.time_s, state, np.full((n, 9), np.nan), sigma,
        nothing if found.innovation is None else found.innovation,
        nothing if found.innovation_sigma is None else found.innovation_sigma,
        found.weight, np.full(n, np.nan), los_sigma, np.arange(n), np.nan,
    )  # fmt: skip
    model = Model(log.sigma**2, np.full((1, 6), np.nan))
    return Estimate(run, labels(found.weight, readings.measurement), model, cleaned=cleaned)
