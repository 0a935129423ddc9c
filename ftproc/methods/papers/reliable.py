"""Outliers repaired by a line through a sliding window, then a scalar Kalman filter or the "reliable" one, whose
noises are the last differences themselves (Zhang and Zhang, Beijing). Channel by channel, as there.

The paper's readings stand almost still; here the walk is about a short polynomial through the readings before.

Taken to the letter the reliable filter gives back its input: it begins at the first reading, so the measurement
noise is zero then, the gain one, and so on. `reliable(literal=True)` keeps that; else both noises are smoothed and
kept from vanishing.
"""

from __future__ import annotations

import numpy as np

from ftproc.core.comparators import walks
from ftproc.methods import channels
from ftproc.methods.channels import POLYNOMIAL, Cleaned
from ftproc.methods.estimate import Estimate, Readings
from ftproc.methods.parameters import Parameter, of_component, per_component
from ftproc.settings import FilterSettings

MEMORY, LEAST_NOISE = 0.9, 0.3  # of the regularised reliable filter

REPAIR_PARAMETERS = (
    *POLYNOMIAL,
    *per_component("F", "threshold on the innovation, the paper's 300 kPa", "from the log"),
)
WALK_PARAMETERS = (
    *REPAIR_PARAMETERS,
    *per_component("Q", "variance that the state gains in an interval, the paper's 0.55", "from the log", 2),
    *per_component("R", "variance of a reading, the paper's 9", "from the log, or --noise", 2),
)
RELIABLE_PARAMETERS = (
    *REPAIR_PARAMETERS,
    Parameter("memory", "how much of the noises before is kept; 0 is the paper's", str(MEMORY), 0, 0.999),
    Parameter(
        "least_noise", "least variance of a reading, over that of the log; 0 is the paper's", str(LEAST_NOISE), 0, 10
    ),
    *per_component("R", "variance of a reading", "from the log, or --noise", 2),
)


def window_kalman(readings: Readings, settings: FilterSettings) -> Estimate:
    """The Kalman filter of a random walk on repaired readings."""
    return _run(readings, settings, walks.WALK)


def reliable(readings: Readings, settings: FilterSettings, literal: bool = False) -> Estimate:
    """The reliable Kalman filter on repaired readings."""
    return _run(readings, settings, walks.RELIABLE_LITERAL if literal else walks.RELIABLE)


def _run(readings: Readings, settings: FilterSettings, kind: int) -> Estimate:
    log = channels.prepare(readings, settings)
    memory, least = (settings.parameter(name) for name in ("memory", "least_noise"))
    found = []
    for c in range(3):
        expected = channels.expect(log, c, settings)
        how = walks.Repair(
            kind,
            of_component(settings, "R", c, float(log.sigma[c]) ** 2, 2),
            of_component(settings, "Q", c, expected.walk, 2),
            MEMORY if memory is None else memory,
            LEAST_NOISE if least is None else least,
        )
        held = channels.predictor(log, c, expected, settings, "F")
        found.append(walks.repaired_walk(log.time_s, log.of(c), how, held))
    value, variance, innovation, sigma, weight, _ = (np.stack(part, 1) for part in zip(*found, strict=True))
    honest = kind == walks.WALK  # the others' error E_k says nothing about the noise of the readings
    return channels.estimate(
        readings,
        log,
        Cleaned(value, weight, innovation, sigma if honest else None, np.sqrt(variance) if honest else None),
    )
