"""Outliers repaired by a line through a sliding window, then a scalar Kalman filter or the "reliable" one, whose
noises are the last differences themselves (Zhang and Zhang, Beijing). Channel by channel, as there.

Taken to the letter the reliable filter gives back its input: it begins at the first reading, so the measurement
noise is zero then, the gain one, and so on. `reliable(literal=True)` keeps that; else both noises are smoothed and
kept from vanishing.
"""

from __future__ import annotations

import numpy as np

from ftproc.core.comparators import channels as kernels
from ftproc.methods import channels
from ftproc.methods.channels import AZIMUTH, Cleaned
from ftproc.methods.estimate import Estimate, Readings
from ftproc.settings import FilterSettings


def window_kalman(readings: Readings, settings: FilterSettings) -> Estimate:
    """The Kalman filter of a random walk on repaired readings."""
    return _run(readings, settings, kernels.WALK)


def reliable(readings: Readings, settings: FilterSettings, literal: bool = False) -> Estimate:
    """The reliable Kalman filter on repaired readings."""
    return _run(readings, settings, kernels.RELIABLE_LITERAL if literal else kernels.RELIABLE)


def _run(readings: Readings, settings: FilterSettings, kind: int) -> Estimate:
    log = channels.look(readings, settings)
    found = [
        kernels.repaired_walk(
            readings.time_s,
            np.ascontiguousarray(readings.measurement[:, c]),
            kernels.Repair(
                kind, channels.largest_change(log, c, settings.gate), float(log.sigma[c]) ** 2,
                channels.walk_variance(log, c), log.interval_s, c == AZIMUTH,
            ),
        )
        for c in range(3)
    ]  # fmt: skip
    value, variance, innovation, sigma, weight, _ = (np.stack(part, 1) for part in zip(*found, strict=True))
    honest = kind == kernels.WALK  # the others' error E_k says nothing about the noise of the readings
    return channels.estimate(
        readings,
        log,
        Cleaned(value, weight, innovation, sigma if honest else None, np.sqrt(variance) if honest else None),
    )
