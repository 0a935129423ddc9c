"""Particle filters whose particles are moved by an ensemble Kalman filter: the three of Shao et al. 2020.

    enpf        the analysis members are a proposal; weights, resampling (the "weighted EnKF" of Papadakis et al. 2010)
    enpf-chi2   the same behind a chi-square gate
    renpf       the posterior sampled by Markov chains that begin at the analysis members; the prior is a sum of
                Gaussians about the predicted members, and fuzzy weights weigh the reading

Equations 18 and 20 and steps 3, 5 and 7 of the paper are not in its text; what stands here is the construction that
its words leave open, after Silverman 1986 (width of the Gaussians), Liu and West 2001 (centres drawn together, so
that the sum keeps the members' covariance) and Roberts et al. 1997 (length of the random walk's steps).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ftproc.core.comparators.ensemble import Analysis, Forecast, corrected, enkf, misfit, root, spread
from ftproc.core.comparators.fuzzy import chi_square_quantile, trust_in_members, trust_in_reading
from ftproc.core.compiled import kernel
from ftproc.core.signatures import Matrix, Vector

FloatArray = NDArray[np.float64]

PER_DIMENSION = 3  # members that a Gaussian fitted to them must have
JITTER = 0.5  # of Silverman's width, on resampled members
COLLAPSED = 0.05  # effective share of the members below which weights mean nothing
GATE = 0.999  # share of good readings that pass the chi-square gate
MOVES = 5  # of each Markov chain; with 15 the mean wanders, and on clean flights the error doubles
STEP = 2.38  # over sqrt(d), in sigmas
WIDER = 2.0  # over the number of members: what the spread does not know of, in variances
FAR = 40.0  # exp(-FAR) is nothing


def silverman(members: int, states: int) -> float:
    """Width of the Gaussians of a density estimate, in sigmas."""
    return float((4 / ((states + 2) * members)) ** (1 / (states + 4)))


def enpf(known: Forecast, rng: Generator, jitter: float = JITTER) -> Analysis:
    """Weigh the analysis members by likelihood times prior over proposal, resample and jitter (in Silverman's widths).

    When almost no member has any weight the proposal has missed the posterior, and members made of copies of that
    one would be far too sure of it: then the ensemble Kalman filter's are kept.
    """
    members = corrected(known, 1.0, rng)
    count, states = members.shape
    factor = root(spread(members))
    log_weight = -0.5 * _squares(misfit(members, known.reading, known.sensor, known.used), _noise_inverse(known))
    if count > PER_DIMENSION * states:
        prior = root(spread(known.members))
        log_weight -= 0.5 * _lengths(members - known.mean, prior)
        log_weight += 0.5 * _lengths(members - members.mean(0), factor)
    weight = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    if 1 / (weight @ weight) < COLLAPSED * count:
        return Analysis(members, members.mean(0), 1.0)
    chosen = resampled(weight, rng)
    moved = jitter * silverman(count, states) * rng.standard_normal(members.shape) @ factor.T
    return Analysis(members[chosen] + moved, weight @ members, 1.0)


def enpf_gated(known: Forecast, rng: Generator, gate: float = GATE, jitter: float = JITTER) -> Analysis:
    """`enpf`, but a reading whose rho is beyond the chi-square gate (a probability) is not used."""
    if known.rho > chi_square_quantile(gate, known.freedom):
        return Analysis(known.members, known.mean, 0.0)
    return enpf(known, rng, jitter)


def renpf(known: Forecast, rng: Generator, moves: int = MOVES) -> Analysis:
    """Fuzzy weights of the reading and of each member, then Markov chains of so many moves to the posterior.

    The mean of n members is itself 1/n of their variance off, and the chains' own randomness moves it as much again at
    every reading. Both accumulate unseen until the filter is too sure of itself and its gate shuts, so the members are
    spread by as much; for the same reason the chains are short.
    """
    gamma = trust_in_reading(known.rho, known.freedom)
    members = corrected(known, gamma, rng)
    trust = np.zeros(len(members))
    if gamma > 0:
        off = misfit(np.vstack([members.mean(0), members]), known.reading, known.sensor, known.used)
        rho = _squares(off, known.inverse)
        trust = trust_in_members(rho[0], rho[1:], known.freedom)
    moved = _walk(known, members, trust, rng, moves)
    mean = moved.mean(0)
    return Analysis(mean + math.sqrt(1 + WIDER / len(moved)) * (moved - mean), mean, gamma)


def _walk(known: Forecast, members: FloatArray, trust: FloatArray, rng: Generator, moves: int) -> FloatArray:
    """Metropolis chains, one from each member, to the density prior(x) likelihood(x)^trust; their last states."""
    count, states = members.shape
    width = silverman(count, states)
    prior_factor = root(spread(known.members))
    whiten = np.linalg.inv(prior_factor).T / width
    centres = np.ascontiguousarray(math.sqrt(1 - width**2) * ((known.members - known.mean) @ whiten).T)
    noise_inverse = _noise_inverse(known)

    def log_density(x: FloatArray) -> FloatArray:
        likelihood = -0.5 * _squares(misfit(x, known.reading, known.sensor, known.used), noise_inverse)
        return log_kernel_sum((x - known.mean) @ whiten, centres) + trust * likelihood

    step = STEP / math.sqrt(states) * root(spread(members)).T
    steps = rng.standard_normal((moves, count, states)) @ step
    threshold = np.log1p(-rng.random((moves, count)))
    density = log_density(members)
    for move, least in zip(steps, threshold, strict=True):
        proposal = members + move
        proposed = log_density(proposal)
        accepted = least < proposed - density
        members = np.where(accepted[:, None], proposal, members)
        density = np.where(accepted, proposed, density)
    return members


@kernel
def log_kernel_sum(points: Matrix, centres: Matrix) -> Vector:
    """(n,) ln sum_j exp(-|point - centre_j|^2 / 2); points (n, d), centres (d, m) with a column each."""
    count, states = points.shape
    out, distance = np.empty(count), np.empty(centres.shape[1])
    for i in range(count):
        distance[:] = 0.0
        for s in range(states):
            here = points[i, s]
            for j in range(len(distance)):
                off = here - centres[s, j]
                distance[j] += off * off
        least = distance.min()
        total = 0.0
        for j in range(len(distance)):
            further = 0.5 * (distance[j] - least)
            if further < FAR:
                total += math.exp(-further)
        out[i] = math.log(total) - 0.5 * least
    return out


def resampled(weight: FloatArray, rng: Generator) -> NDArray[np.intp]:
    """(n,) indices drawn in proportion to the weights (n,), which add up to one, by one systematic comb."""
    count = len(weight)
    comb = (np.arange(count) + rng.random()) / count
    return np.minimum(np.searchsorted(np.cumsum(weight), comb), count - 1)


def _noise_inverse(known: Forecast) -> FloatArray:
    return np.asarray(np.linalg.inv(known.sensor.noise[np.ix_(known.used, known.used)]), np.float64)


def _squares(vectors: FloatArray, inverse: FloatArray) -> FloatArray:
    """(n,) v' A v of the rows."""
    squares: FloatArray = ((vectors @ inverse) * vectors).sum(1)
    return squares


def _lengths(deviation: FloatArray, factor: FloatArray) -> FloatArray:
    """(n,) Mahalanobis lengths squared of the rows, by the covariance's lower factor."""
    lengths: FloatArray = (np.linalg.solve(factor, deviation.T) ** 2).sum(0)
    return lengths


UPDATES: dict[str, Callable[..., Analysis]] = {
    "enkf": enkf,
    "enpf": enpf,
    "enpf-chi2": enpf_gated,
    "renpf": renpf,
}
