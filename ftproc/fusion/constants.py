"""Biases, tilts and clock offsets of the stations: what the flight says of them, with their priors.

The likelihood is quadratic about the biases it was linearised at (Friedland's columns, `core.filtering.biases`). A
common shift of all clocks is the same flight a little later: the likelihood is flat along it, but not the linearised
one, which takes the shift for jerk; so its information along that direction is taken out. Other directions of which
the readings say next to nothing are left to the prior.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.biases import PARAMETERS, Biased, Directions
from ftproc.fusion.events import CLOCK
from ftproc.records import FloatArray, IntArray

NAMES = ("range_m", "azimuth_rad", "elevation_rad", "tilt_east_rad", "tilt_north_rad", "clock_s")
WORDS = ("range bias", "azimuth zero", "elevation zero", "tilt about east", "tilt about north", "clock offset")
ALLOWANCE = 1.7  # on the variance that the readings leave: manoeuvres are not white jerk, noise is not quite white
LEAST_SEEN = 0.05  # of the prior's information: less in a direction says nothing
OBSERVED = 0.9  # of the prior's 1-sigma: a parameter that stays above it is not observable
FARTHEST = 6.0  # prior sigmas that a bias may be off: more of it is a wrong place, clock or target


class Constants(NamedTuple):
    """estimate (m, PARAMETERS) and covariance (m * PARAMETERS, m * PARAMETERS) of all biases, prior (m, PARAMETERS)
    their 1-sigma before; directions (k, m * PARAMETERS), in units of the prior, of which the readings say nothing.
    moved: the largest step of the last update, in its sigmas."""

    estimate: FloatArray
    covariance: FloatArray
    prior: FloatArray
    unobserved: FloatArray
    moved: float = np.inf

    @classmethod
    def unknown(cls, prior: FloatArray) -> Constants:
        """Before any reading."""
        return cls(np.zeros_like(prior), np.diag(prior.ravel() ** 2), prior, np.zeros((0, prior.size)))

    @property
    def sigma(self) -> FloatArray:
        """(m, PARAMETERS) 1-sigma."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0)).reshape(self.prior.shape)

    @property
    def observable(self) -> NDArray[np.bool_]:
        """(m, PARAMETERS) whether the flight shows more of it than was known."""
        observed: NDArray[np.bool_] = self.sigma < OBSERVED * self.prior
        return observed

    def columns(self) -> FloatArray:
        """Directions for `core.filtering.biases`: a root of the covariance."""
        free = np.flatnonzero(self.prior.ravel() > 0)
        found = np.zeros((self.prior.size, len(free)))
        if len(free):
            scale = self.prior.ravel()[free]
            size, turn = np.linalg.eigh(self.covariance[np.ix_(free, free)] / np.outer(scale, scale))
            found[free] = scale[:, None] * turn * np.sqrt(np.maximum(size, 1e-14))
        return found


def update(constants: Constants, found: Biased, directions: Directions) -> Constants:
    """The posterior from a run that was linearised at the constants."""
    prior = constants.prior.ravel()
    free = np.flatnonzero(prior > 0)
    if not len(free):
        return constants._replace(moved=0.0)
    into = np.linalg.inv(directions.columns[free] / prior[free, None])
    information, score = into.T @ found.info @ into, into.T @ found.score  # in units of the prior
    information, score = information / ALLOWANCE, score / ALLOWANCE
    information, score, unobserved = _without_common_clock(constants.prior, free, information, score)
    size, turn = np.linalg.eigh(0.5 * (information + information.T))
    seen = size > LEAST_SEEN
    size, along = np.where(seen, size, 0.0), np.where(seen, turn.T @ score, 0.0)
    here = constants.estimate.ravel()[free] / prior[free]
    step = turn @ ((along - turn.T @ here) / (1 + size))
    covariance = np.zeros((len(prior), len(prior)))
    covariance[np.ix_(free, free)] = np.outer(prior[free], prior[free]) * ((turn / (1 + size)) @ turn.T)
    estimate = constants.estimate.copy().ravel()
    estimate[free] = np.clip(estimate[free] + prior[free] * step, -FARTHEST * prior[free], FARTHEST * prior[free])
    vague = np.zeros((0, len(prior)))
    moved = float(np.max(np.abs(step) * prior[free] / np.sqrt(np.diag(covariance)[free])))
    if unobserved is not None:
        vague = np.zeros((1, len(prior)))
        vague[0, free] = unobserved
    return Constants(estimate.reshape(constants.prior.shape), covariance, constants.prior, vague, moved)


def _without_common_clock(
    prior: FloatArray, free: IntArray, information: FloatArray, score: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray | None]:
    """Information and score without what they say of a common shift of all clocks, and that direction (unit length)."""
    if not (prior[:, CLOCK] > 0).all():
        return information, score, None
    clock = free % PARAMETERS == CLOCK
    common = np.where(clock, 1 / prior.ravel()[free], 0.0)
    common /= np.linalg.norm(common)
    pull, size = information @ common, float(common @ information @ common)
    if size <= 0:
        return information, score, common
    return information - np.outer(pull, pull) / size, score - pull * float(common @ score) / size, common


def not_observable(constants: Constants, names: list[str]) -> list[str]:
    """In words: the common clock, and parameters that stay as they were."""
    found = ["common clock"] if len(constants.unobserved) else []
    sigma, prior = constants.sigma, constants.prior
    for parameter, word in enumerate(WORDS):
        vague = [
            n
            for n, s, p in zip(names, sigma[:, parameter], prior[:, parameter], strict=True)
            if p > 0 and s >= OBSERVED * p
        ]
        if not vague or (parameter == CLOCK and len(constants.unobserved)):
            continue
        if len(vague) > 1 and len(vague) == int((prior[:, parameter] > 0).sum()):
            found.append(f"common {word}")
        else:
            found.append(f"{word} of {', '.join(vague)}")
    return found
