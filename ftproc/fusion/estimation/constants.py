"""Biases, tilts and clock offsets of the stations: what the flight says of them, with their priors.

The likelihood is quadratic about the biases it was linearised at (Friedland's columns, `core.filtering.biases`). A
common shift of all clocks is the same flight a little later: the likelihood is flat along it, but not the linearised
one, which takes the shift for jerk; so its information along that direction is taken out. Other directions of which
the readings say next to nothing are left to the prior. Barometric heights are those of one transponder: their offset
and scale, which are common to all stations that hear it, are those of the first; heights that are others' (APART_M)
have their own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.biases import PARAMETERS, Biased, Directions
from ftproc.fusion.estimation.events import APART_M, CLOCK, OFFSET
from ftproc.records import FloatArray, IntArray

NAMES = (
    *("range_m", "azimuth_rad", "elevation_rad", "tilt_east_rad", "tilt_north_rad", "clock_s"),
    *("height_m", "height_scale"),
)
WORDS = (
    *("range bias", "azimuth zero", "elevation zero", "tilt about east", "tilt about north", "clock offset"),
    *("height offset", "height scale"),
)
ALLOWANCE = 1.95  # on the variance that the readings leave: manoeuvres are not white jerk, noise is not quite white
LEAST_SEEN = 0.05  # of the prior's information: less in a direction says nothing
OBSERVED = 0.9  # of the prior's 1-sigma: a parameter that stays above it is not observable
IMPROBABLE = 4.0  # prior sigmas of a bias, from which its range file is in doubt
FARTHEST = 6.0  # prior sigmas that a bias may be off: more of it is a wrong place, clock or target


class Likelihood(NamedTuple):
    """What readings say of the biases in units of the prior, b (k,): their log-likelihood is, but for a constant,
    pull' b - b' information b / 2. pull (k,), information (k, k), k = m * PARAMETERS."""

    pull: FloatArray
    information: FloatArray

    @classmethod
    def nothing(cls, k: int) -> Likelihood:
        """By no reading."""
        return cls(np.zeros(k), np.zeros((k, k)))

    def with_(self, other: Likelihood) -> Likelihood:
        """What both say."""
        return Likelihood(self.pull + other.pull, self.information + other.information)

    def share(self, part: float) -> Likelihood:
        """What so large a part of the readings says."""
        return Likelihood(part * self.pull, part * self.information)

    def of(self, some: IntArray) -> Likelihood:
        """What it says of some biases alone, whatever the others are."""
        covariance = np.linalg.inv(self.information + np.eye(len(self.pull)))
        inverse = np.linalg.inv(covariance[np.ix_(some, some)])
        return Likelihood(inverse @ (covariance @ self.pull)[some], inverse - np.eye(len(some)))

    def among(self, some: IntArray, k: int) -> Likelihood:
        """The same as said of k biases, of which it knows some."""
        found = Likelihood.nothing(k)
        found.pull[some] = self.pull
        found.information[np.ix_(some, some)] = self.information
        return found


class Constants(NamedTuple):
    """estimate (m, PARAMETERS) and covariance (m * PARAMETERS, m * PARAMETERS) of all biases, prior (m, PARAMETERS)
    their 1-sigma before; known: what other readings of the flight have said. moved: the largest step of the last
    update, in its sigmas. shared: places of the biases of heights (k, 2) that are those of the first."""

    estimate: FloatArray
    covariance: FloatArray
    prior: FloatArray
    known: Likelihood
    moved: float = np.inf
    shared: IntArray = np.zeros((0, 2), np.int64)

    @classmethod
    def before(cls, prior: FloatArray, known: Likelihood | None = None) -> Constants:
        """Before any reading, or with what others say."""
        known = Likelihood.nothing(prior.size) if known is None else known
        prior = prior.copy()
        heard = np.flatnonzero((prior[:, OFFSET] > 0) & (prior[:, OFFSET] != APART_M))
        shared: IntArray = parameters(heard.tolist()).reshape(-1, PARAMETERS)[:, OFFSET:]
        prior.ravel()[shared[1:]] = 0.0
        return cls(*_posterior(prior, known, shared), prior, known, shared=shared)

    @property
    def sigma(self) -> FloatArray:
        """(m, PARAMETERS) 1-sigma."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0)).reshape(self.prior.shape)

    @property
    def observable(self) -> NDArray[np.bool_]:
        """(m, PARAMETERS) whether the flight shows more of it than was known."""
        observed: NDArray[np.bool_] = self.sigma < OBSERVED * self.prior
        return observed

    @property
    def farthest(self) -> float:
        """The largest bias, in its 1-sigma before."""
        free = self.prior > 0
        return float((np.abs(self.estimate[free]) / self.prior[free]).max(initial=0.0))

    def columns(self) -> FloatArray:
        """Directions for `core.filtering.biases`: a root of the covariance."""
        free = np.flatnonzero(self.prior.ravel() > 0)
        found = np.zeros((self.prior.size, len(free)))
        if len(free):
            scale = self.prior.ravel()[free]
            size, turn = np.linalg.eigh(self.covariance[np.ix_(free, free)] / np.outer(scale, scale))
            found[free] = scale[:, None] * turn * np.sqrt(np.maximum(size, 1e-14))
        found[self.shared[1:]] = found[self.shared[:1]]
        return found

    def of(self, stations: list[int]) -> Constants:
        """Those of some of the stations."""
        some = parameters(stations)
        own = np.flatnonzero(np.isin(some, self.shared))
        first = some.copy()
        first[own[:2]] = self.shared[:1].ravel()
        return Constants(
            self.estimate[stations], self.covariance[np.ix_(first, first)],
            self.prior.ravel()[first].reshape(-1, PARAMETERS), self.known.of(some), shared=own.reshape(-1, 2),
        )  # fmt: skip


def parameters(stations: list[int]) -> IntArray:
    """Places of all biases of some stations among those of all."""
    return (PARAMETERS * np.array(stations, np.int64)[:, None] + np.arange(PARAMETERS)).ravel()


def update(constants: Constants, found: Biased, directions: Directions) -> Constants:
    """The posterior from a run that was linearised at the constants."""
    known = constants.known.with_(likelihood(constants, found, directions))
    estimate, covariance = _posterior(constants.prior, known, constants.shared)
    sigma = np.sqrt(np.diag(covariance)).reshape(estimate.shape)
    step = np.abs(estimate - constants.estimate)[constants.prior > 0] / sigma[constants.prior > 0]
    moved = float(step.max(initial=0.0))
    return constants._replace(estimate=estimate, covariance=covariance, moved=moved)


def likelihood(constants: Constants, found: Biased, directions: Directions) -> Likelihood:
    """What a run that was linearised at the constants says of them."""
    prior = constants.prior.ravel()
    free = np.flatnonzero(prior > 0)
    into = np.linalg.inv(directions.columns[free] / prior[free, None])
    information, score = into.T @ found.info @ into / ALLOWANCE, into.T @ found.score / ALLOWANCE
    information, score = _without_common_clock(constants.prior, free, information, score)
    here = constants.estimate.ravel()[free] / prior[free]
    return Likelihood(score + information @ here, information).among(free, len(prior))


def _posterior(prior: FloatArray, known: Likelihood, shared: IntArray) -> tuple[FloatArray, FloatArray]:
    """Estimate (m, PARAMETERS) and covariance with the prior; of directions of which next to nothing is said, the
    prior's."""
    scale = prior.ravel()
    free = np.flatnonzero(scale > 0)
    block = np.ix_(free, free)
    size, turn = np.linalg.eigh(0.5 * (known.information + known.information.T)[block])
    seen = size > LEAST_SEEN
    size, along = np.where(seen, size, 0.0), np.where(seen, turn.T @ known.pull[free], 0.0)
    estimate, covariance = np.zeros(len(scale)), np.zeros((len(scale), len(scale)))
    estimate[free] = scale[free] * np.clip(turn @ (along / (1 + size)), -FARTHEST, FARTHEST)
    estimate[shared[1:]] = estimate[shared[:1]]
    covariance[block] = np.outer(scale[free], scale[free]) * ((turn / (1 + size)) @ turn.T)
    return estimate.reshape(prior.shape), covariance


def _without_common_clock(
    prior: FloatArray, free: IntArray, information: FloatArray, score: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Information and score without what they say of a common shift of all clocks."""
    if not no_reference(prior):
        return information, score
    clock = free % PARAMETERS == CLOCK
    common = np.where(clock, 1 / prior.ravel()[free], 0.0)
    common /= np.linalg.norm(common)
    pull, size = information @ common, float(common @ information @ common)
    if size <= 0:
        return information, score
    return information - np.outer(pull, pull) / size, score - pull * float(common @ score) / size


def no_reference(prior: FloatArray) -> bool:
    """Whether no clock is known to be right: then a shift of all of them does not show."""
    return bool((prior[:, CLOCK] > 0).all())


def not_observable(constants: Constants, names: list[str]) -> list[str]:
    """In words: the common clock, and parameters that stay as they were."""
    common = no_reference(constants.prior)
    found = ["common clock"] if common else []
    sigma, prior = constants.sigma, constants.prior
    for parameter, word in enumerate(WORDS):
        unknown = [
            n
            for n, s, p in zip(names, sigma[:, parameter], prior[:, parameter], strict=True)
            if p > 0 and s >= OBSERVED * p
        ]
        if not unknown or (parameter == CLOCK and common):
            continue
        if len(unknown) > 1 and len(unknown) == int((prior[:, parameter] > 0).sum()):
            found.append(f"common {word}")
        else:
            found.append(f"{word} of {', '.join(unknown)}")
    return found
