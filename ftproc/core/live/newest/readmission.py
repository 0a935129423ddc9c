"""The decisions on the newest part, made again; and where its newest readings are rejected: is it a patch, or the track
that is wrong?

Each rejected reading alone lies off a prediction whose 1-sigma has grown since, and all of them lie off it together.
But if the last of them are good, each makes the next one likely. So the log-probability of all readings of the newest
part is compared between the decisions as they are and those in which the last few of the run, or half of it, or all are
good.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core import odds
from ftproc.core.editing import outlier_chain, patch_likelihood
from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.filtering.smoother import RESIDUALS, smooth_log
from ftproc.core.identification.profile import fit_profile, roughness, with_allowance
from ftproc.core.identification.scales import Scales
from ftproc.records import FloatArray

KEPT = ("possible", "level", "level_sigma")
ROUNDS = 3  # of smoothing and deciding
MOVES_STEPS, FEWER = 6, 3  # of the search for the process noise of a target that begins to move; fewer for each of
# several that may


class Open(NamedTuple):
    """What is open: the log with the decisions (n, 3) so far, the model, the start, the rates (3, 3) of outliers; which
    of its readings are good by hand, which are possible, what is taken out of them and its 1-sigma, (n, 3) each, the
    last three by the names of KEPT."""

    log: Observations
    model: Model
    start: Start
    rates: FloatArray
    accepted: NDArray[np.bool_]
    possible: NDArray[np.bool_]
    level: FloatArray
    level_sigma: FloatArray


class Other(NamedTuple):
    """Another case, the process noise for it without its allowance, and the gain in log-probability."""

    case: Open
    profile: Model
    gain: float


def settled(case: Open, gate: float) -> Open:
    """Smooth and decide by turns until the decisions stand still; gate: in sigmas."""
    for _ in range(ROUNDS):
        smoothed = smooth_log(case.log, case.model, [case.start], RESIDUALS)
        good = outlier_chain.classify(
            smoothed.residual, smoothed.residual_variance, case.model.reading_variance, case.rates.copy(), gate
        )
        weight = (((good > 0.5) & case.possible) | case.accepted).astype(float)
        if (weight == case.log.weight).all():
            break
        case = case._replace(log=case.log._replace(weight=weight))
    return case


def readmitted(case: Open, profile: Model, scales: Scales | None) -> Other | None:
    """Other decisions, the likeliest, and the process noise for them: as it is, or, if scales are given, that by
    which the target has begun to move; a turn that begins is off any track with the jerk of a straight leg."""
    runs = {c: run for c in range(3) if len(run := rejected(case, c)) >= patch_likelihood.SHORTEST_RUN}
    if not runs:
        return None
    tried = [case.log.weight, *_others(case.log.weight, runs)]
    found = [log_probability(case, weight) for weight in tried]
    best = int(np.argmax(found))
    other = Other(case._replace(log=case.log._replace(weight=tried[best])), profile, found[best] - found[0])
    if other.gain > odds.LIKELIER or scales is None:
        return other
    weight = case.log.weight.copy()
    for c, run in runs.items():
        weight[run, c] = 1.0
    moves = case._replace(log=case.log._replace(weight=weight))
    rival = moving(moves, profile, scales, found[0] - roughness(case.model))
    return rival if rival.gain > other.gain else other


def moving(case: Open, profile: Model, scales: Scales, now: float, steps: int = MOVES_STEPS) -> Other:
    """A case with the process noise by which its target begins to move. now: the penalised log-probability of what
    it is an alternative to."""
    profile = fit_profile(case.log, [case.start], profile, steps, scales)
    moves = case._replace(model=with_allowance(case.log, profile, scales))
    return Other(moves, profile, log_probability(moves, case.log.weight) - roughness(moves.model) - now)


def _others(weight: FloatArray, runs: dict[int, NDArray[np.int64]]) -> Iterator[FloatArray]:
    """The decisions with the last readings of one run good, or of all runs."""
    longest = max(map(len, runs.values()))
    for components in {tuple(runs), *((c,) for c in runs)}:
        for last in sorted({patch_likelihood.SHORTEST_RUN, longest // 2, longest} - {0, 1, 2}):
            other = weight.copy()
            for c in components:
                other[runs[c][-last:], c] = 1.0
            yield other


def rejected(case: Open, c: int) -> NDArray[np.int64]:
    """The samples whose readings of a component are rejected, after the last one that is good."""
    seen = np.flatnonzero(case.possible[:, c])
    good = np.flatnonzero(case.log.weight[seen, c] > 0)
    return seen[good[-1] + 1 if len(good) else 0 :]


def log_probability(case: Open, weight: FloatArray) -> float:
    """Log-probability of all readings with these decisions."""
    log = case.log._replace(weight=weight)
    smoothed = smooth_log(log, case.model, [case.start], RESIDUALS)
    return smoothed.log_likelihood + patch_likelihood.log_probability_of_all(
        log.time_s, smoothed.residual, smoothed.residual_variance, weight, case.possible, case.model.reading_variance,
        case.rates,
    )  # fmt: skip
