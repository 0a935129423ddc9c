"""Small random problems for the kernels, and flights that obey the filter's own model to the letter."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.core.model.motion import isotropic
from tests import naive

PATTERNS = [(r, a, e) for r in (0, 1) for a in (0, 1) for e in (0, 1)]
SIGMA = np.array([3.0, 2e-4, 3e-4])


class Problem(NamedTuple):
    """Arguments of the passes over a log; truth (n, 9) where there is one."""

    time: np.ndarray
    z: np.ndarray
    weight: np.ndarray
    model: Model
    starts: list[Start]
    truth: np.ndarray

    @property
    def log(self):
        return Observations(self.time, self.z, self.weight)

    def part(self, rows, starts):
        """Some of the samples, with their own starts."""
        return Problem(self.time[rows], self.z[rows], self.weight[rows], self.model, starts, self.truth[rows])


def covariance(rng, sigmas):
    """(9, 9) with the given 1-sigmas and random correlations."""
    root = rng.standard_normal((9, 12))
    p = root @ root.T
    scale = np.asarray(sigmas) / np.sqrt(np.diag(p))
    return p * np.outer(scale, scale)


def random_jerk(rng, pieces=1, level=1.0):
    """(pieces, 3) densities along the axes."""
    return level * rng.chisquare(5, (pieces, 3)) / 5


def matched(seed, n, dt=0.1, q=1.0, sigma=SIGMA, distance=5000.0, irregular=False, missing=0.0, pieces=1):
    """A flight drawn from the filter's own model: white jerk, white noise, a first state drawn from its covariance."""
    rng = np.random.default_rng(seed)
    step = dt * (rng.choice([0.3, 1.0, 2.5], n) if irregular else np.ones(n))
    time = np.cumsum(step) - step[0]
    jerk = random_jerk(rng, pieces, q) if pieces > 1 else isotropic(q)
    model = Model(sigma**2, jerk, time[-1] / pieces * 1.01 if pieces > 1 else np.inf)
    mean = np.r_[distance * np.array([0.6, -0.5, 0.3]), rng.normal(0, 80, 3), rng.normal(0, 3, 3)]
    p = covariance(rng, np.repeat([4.0, 5.0, 2.0], 3))
    x = rng.multivariate_normal(mean, p)
    truth = [x]
    for k in range(1, n):
        piece = int(np.clip(time[k] / model.knot_s, 0, len(jerk) - 1))
        x = naive.transition(step[k]) @ x + _root(step[k], tuple(jerk[piece])) @ rng.standard_normal(9)
        truth.append(x)
    z = from_cartesian(np.array(truth)[:, :3]) + sigma * rng.standard_normal((n, 3))
    z[:, 1] = wrap(z[:, 1])
    z[rng.random((n, 3)) < missing] = np.nan
    weight = np.isfinite(z).astype(float)
    return Problem(time, z, weight, model, [Start(0, mean, p)], np.array(truth))


@cache
def _root(interval, jerk):
    return np.linalg.cholesky(naive.van_loan(interval, jerk))


def position_error(state, truth):
    """(n,) m."""
    return np.linalg.norm(state[:, :3] - truth[:, :3], axis=1)
