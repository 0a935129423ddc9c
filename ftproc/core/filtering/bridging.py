"""Steps that are known, taken out of the readings: their sizes as all the record tells them, and what their uncertainty
adds to that of the positions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.initialization import find_starts, first_state
from ftproc.core.filtering.records import Model, Observations
from ftproc.core.filtering.shifts import shifts
from ftproc.core.filtering.smoother import smooth_log
from ftproc.core.model.frames import from_cartesian, line_of_sight_axes, wrap
from ftproc.order_statistics import medians

FloatArray = NDArray[np.float64]

CLOCK = 3  # in place of a component


class Step(NamedTuple):
    """From a sample on the readings of a component (range, azimuth, elevation) are larger by `size` m, rad, rad, or,
    where it is CLOCK, their times by so many seconds. sigma: 1-sigma of the size. The longer side is kept. sure: that
    it is no patch."""

    component: int
    sample: int
    size: float
    sigma: float
    sure: bool = True

    def moved(self, samples: int) -> tuple[slice, float]:
        """Which of so many samples are moved to the other side, and the sign of what is taken out of them."""
        if 0 < self.sample < samples / 2:
            return slice(0, self.sample), -1.0
        return slice(self.sample, samples), 1.0


def refined(log: Observations, model: Model, steps: Sequence[Step]) -> tuple[Observations, list[Step]]:
    """The log and the steps with the sizes that all the record tells. log: with the steps bridged as they are."""
    if not steps:
        return log, []
    score, information, _ = shifts(log, model, find_starts(log, model.noise_variance, float(model.jerk[0, 0])))
    rest, found = [], []
    for step in steps:
        at = step.sample - 1, step.component
        if information[at] > 0:
            more = float(score[at] / information[at]) * (-1 if step.component == CLOCK else 1)
            rest.append(step._replace(size=more))
            step = step._replace(size=step.size + more, sigma=1 / math.sqrt(information[at]))
        found.append(step)
    return log._replace(measurement=bridged(log, model, rest)), found


def bridged(log: Observations, model: Model, steps: Sequence[Step]) -> FloatArray:
    """The readings (n, 3) as they would be without the steps: those of the shorter side moved to the other."""
    z = log.measurement.copy()
    for step in steps:
        rows, sign = step.moved(len(z))
        if step.component == CLOCK:
            z[rows] -= _way(log.part(rows)._replace(measurement=z[rows]), model, sign * step.size)
        else:
            z[rows, step.component] -= sign * step.size
    z[:, 1] = wrap(z[:, 1])
    return z


def _way(log: Observations, model: Model, late_s: float) -> FloatArray:
    """(n, 3) by how much readings are larger than those of the target so many seconds later, which these readings alone
    tell."""
    try:
        start = first_state(log, model.noise_variance, 0, slice(0, len(log.time_s)))
    except ValueError:  # a component has no reading there, so nobody knows the way
        return np.zeros_like(log.measurement)
    level = model._replace(jerk=medians(model.jerk)[None], knot_s=np.inf)
    state = smooth_log(log, level, [start]).state
    position, velocity, acceleration = state[:, :3], state[:, 3:6], state[:, 6:]
    further = position + late_s * (velocity + 0.5 * late_s * acceleration)
    way: FloatArray = from_cartesian(position) - from_cartesian(further)
    way[:, 1] = wrap(way[:, 1])
    return way


def spread(state: FloatArray, steps: Sequence[Step]) -> tuple[FloatArray, FloatArray]:
    """(n, 3) variances, m2, that the uncertain sizes of the steps add to the positions of the states (n, 9) that were
    moved: along x, y, z, and along the radial, cross and up axes."""
    axes, lines = np.zeros((len(state), 3)), np.zeros((len(state), 3))
    for step in steps:
        rows, _ = step.moved(len(state))
        position, velocity = state[rows, :3], state[rows, 3:6]
        sight = line_of_sight_axes(position)
        slant = np.linalg.norm(position, axis=1)[:, None]
        ground = np.hypot(position[:, 0], position[:, 1])[:, None]
        moves = (sight[:, 0], sight[:, 1] * ground, sight[:, 2] * slant, velocity)[step.component]
        axes[rows] += (moves * step.sigma) ** 2
        lines[rows] += (np.einsum("kij,kj->ki", sight, moves) * step.sigma) ** 2
    return axes, lines
