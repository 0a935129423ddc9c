"""Alternative hypotheses: is it another reading, or another station, that is wrong?

One patch that is accepted makes the good readings of the other stations look bad, and the decisions stand still there,
because each supports the others. Where readings are rejected for a while, the decisions are made again over the
neighbourhood alone: from those of now, from the screening, with each component and each station wrong in turn, from
few components only, and by continuing the flight into the interval from both ends; the likeliest outcome is kept. The
biases stay.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core import odds
from ftproc.core.editing import outlier_chain, patch_likelihood
from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.filtering.smoother import RESIDUALS, smooth_log
from ftproc.fusion.estimation.intervals import Channel, Search
from ftproc.records import FloatArray, IntArray

TENSION, TENSION_S = 3.5, 2.0  # standard deviations of the sum of squares of so long a stretch, that are explained
ROUNDS, FINALISTS = 3, 3  # of decisions; hypotheses that get them
IDLE = 6  # of decisions on the same readings, while a flight is continued
RATES = np.array([0.03, 0.001, 0.93])  # isolated outlier; patch begins; goes on
MOST_LIVE = 10  # components whose pairs and triples are tried; of more the majority decides
LOST, FEWEST = 0.35, 12  # share rejected of a component, to be called lost; readings that a hypothesis leaves
FREE = (50.0, 20.0, 20.0)  # m, m/s, m/s2: 1-sigma of the state where a neighbourhood begins
MANOEUVRES = (16.0, 256.0)  # times the typical level: of manoeuvres that explain the decisions of now
ABOVE_TYPICAL = 4.0  # times the typical level: the jerk may be so much more in an interval


class Neighbourhood(NamedTuple):
    """A stretch of the events and what decides in it. log: with the weights of now. possible, trusted (n, 3). sigma
    (stations, 3). inside (n,): the interval itself; together: as of `Interval`. start: a state at the first event.
    levels: models to try. gate, in sigmas. reach_s: over which readings tell what comes next."""

    log: Observations
    possible: FloatArray
    trusted: FloatArray
    sigma: FloatArray
    inside: NDArray[np.bool_]
    together: bool
    start: Start
    levels: tuple[Model, ...]
    gate: float
    reach_s: float

    @property
    def station(self) -> IntArray:
        assert self.log.sites is not None
        return self.log.sites.station


class Outcome(NamedTuple):
    """Weights (n, 3) and their log-probability."""

    weight: FloatArray
    likelihood: float


def typical_levels(model: Model, here: slice, time_s: FloatArray) -> tuple[Model, ...]:
    """The model with the flight's typical jerk, and with that of the neighbourhood where it is much higher."""
    jerk = model.jerk
    typical = np.median(jerk, 0)
    found = [typical]
    if len(jerk) > 1 and math.isfinite(model.knot_s):
        knots = np.clip(((time_s[here] - time_s[0]) / model.knot_s).astype(int), 0, len(jerk) - 1)
        around = np.quantile(jerk[np.unique(knots)], 0.35, axis=0)
        if around[0] > ABOVE_TYPICAL * typical[0]:
            found.append(around)
    else:
        found.append(typical / 10)
    return tuple(model._replace(jerk=level[None, :].copy(), knot_s=math.inf) for level in found)


class Steps:
    """Decisions in a neighbourhood with one model: how likely they are, and those that follow from them. Each is worked
    out once, and taken from the work of the search."""

    def __init__(self, near: Neighbourhood, model: Model, search: Search) -> None:
        self.near, self.model, self.search = near, model, search
        self.known: dict[bytes, tuple[Outcome, FloatArray]] = {}

    def of(self, weight: FloatArray) -> tuple[Outcome, FloatArray]:
        """The outcome of decisions (n, 3), and those that follow."""
        key = weight.tobytes()
        if key not in self.known:
            self.search.work -= len(weight)
            self.known[key] = _step(self.near, weight, self.model)
        return self.known[key]

    def settled(self, weight: FloatArray) -> Outcome:
        """The likeliest decisions on the way from the first ones until they stand still."""
        best, following = self.of(weight)
        for _ in range(ROUNDS):
            if (following == weight).all() or following.sum() < FEWEST:
                break
            weight = following
            found, following = self.of(weight)
            if found.likelihood > best.likelihood:
                best = found
        return best


def likeliest(near: Neighbourhood, search: Search) -> FloatArray | None:
    """Weights (n, 3) of the likeliest hypothesis; None if that is the one of now, be it with a manoeuvre. Takes its
    work from the search."""
    now = near.log.weight
    ways = [Steps(near, model, search) for model in near.levels]
    few = len(_live(near)) <= MOST_LIVE
    if not (near.together and few) and not _tense(near, ways[0].model):
        return None
    hypotheses = itertools.chain(_hypotheses(near), (_continued(near, way) for way in ways))
    tried = [way for way in (ways[0].of(each) for each in hypotheses) if math.isfinite(way[0].likelihood)]
    tried.sort(key=lambda each: -each[0].likelihood)
    leading = {following.tobytes(): first.weight for first, following in reversed(tried)}
    finalists = [now, *list(reversed(leading.values()))[:FINALISTS]]
    best = max((ways[0].settled(each) for each in finalists), key=lambda each: each.likelihood)
    best = max((way.settled(best.weight) for way in ways), key=lambda each: each.likelihood)
    typical = ways[0].model
    ways += [Steps(near, typical._replace(jerk=times * typical.jerk), search) for times in MANOEUVRES]
    standing = max(way.of(now)[0].likelihood for way in ways)
    return best.weight if best.likelihood > standing - odds.FAULT else None


def _tense(near: Neighbourhood, typical: Model) -> bool:
    """Whether the readings that are used now do not fit a flight at the typical level somewhere about the interval."""
    run = smooth_log(near.log, typical, [near.start], RESIDUALS)
    squares = np.where(near.log.weight > 0, run.residual**2 / run.residual_variance, 0.0).sum(1)
    count = ((near.log.weight > 0) & np.isfinite(run.residual)).sum(1)
    time_s = near.log.time_s
    around = (time_s >= time_s[near.inside][0] - TENSION_S) & (time_s <= time_s[near.inside][-1] + TENSION_S)
    for half in (0.0, 0.5):
        piece = ((time_s[around] - time_s[around][0]) / TENSION_S + half).astype(int)
        total, number = np.bincount(piece, squares[around]), np.bincount(piece, count[around])
        if (total - number > TENSION * np.sqrt(2 * np.maximum(number, 1))).any():
            return True
    return False


def _hypotheses(near: Neighbourhood) -> Iterator[FloatArray]:
    """First decisions (n, 3) to begin with."""
    weight, inside = near.log.weight, near.inside
    base = np.where(inside[:, None], near.trusted, weight) * near.possible
    yield base
    live = _live(near)
    wrong: list[tuple[Channel, ...]] = [(each,) for each in live]
    for s in range(len(near.sigma)):
        own = tuple(each for each in live if each[0] == s)
        if len(own) > 1:
            wrong.append(own)
    lost = [each for each in live if _share_lost(near, each) > LOST]
    some_agree = len(lost) > 1 and len(live) <= MOST_LIVE
    if some_agree:
        wrong += [pair for pair in itertools.combinations(live, 2) if pair[0][0] != pair[1][0]]
    for channels in wrong:
        yield _without(near, base, channels)
    for channels in itertools.combinations(live, 3) if some_agree and len(live) > 3 else ():
        yield _without(near, base, tuple(each for each in live if each not in channels))


def _live(near: Neighbourhood) -> list[Channel]:
    """The channels that have readings in the interval."""
    return [
        (s, c)
        for s, c in itertools.product(range(len(near.sigma)), range(3))
        if (near.possible[near.inside & (near.station == s), c] > 0).any()
    ]


def _continued(near: Neighbourhood, way: Steps) -> FloatArray:
    """Decisions (n, 3) that continue the flight into the interval from both of its ends, a few seconds at a time, but
    not through seconds in which nothing comes and nothing changes, or has not stopped to change for long."""
    time_s, inside = near.log.time_s, near.inside
    first, last = time_s[inside][0], time_s[inside][-1]
    depth_s, weight, idle = 0.0, np.where(inside[:, None], 0.0, near.log.weight), 0
    depths_s = np.minimum(time_s - first, last - time_s)  # of the readings in the interval
    while first + depth_s < last - depth_s:
        new = inside & (depths_s >= depth_s) & (depths_s < depth_s + near.reach_s)
        depth_s += near.reach_s
        reached = inside & ((time_s < first + depth_s) | (time_s > last - depth_s))
        before, weight = weight, np.where(reached[:, None], way.of(weight)[1], weight)
        idle = 0 if new.any() else idle + 1
        if idle > IDLE or (weight == before).all():
            ahead_s = float(np.min(depths_s[inside & ~reached], initial=last - first)) - depth_s
            depth_s += max(ahead_s // near.reach_s, 0.0) * near.reach_s
    return weight


def _without(near: Neighbourhood, weight: FloatArray, channels: tuple[Channel, ...]) -> FloatArray:
    found = weight.copy()
    for s, c in channels:
        found[near.inside & (near.station == s), c] = 0.0
    return found


def _share_lost(near: Neighbourhood, channel: Channel) -> float:
    s, c = channel
    rows = near.inside & (near.station == s) & (near.possible[:, c] > 0)
    return float((near.log.weight[rows, c] <= 0).mean())


def _step(near: Neighbourhood, weight: FloatArray, model: Model) -> tuple[Outcome, FloatArray]:
    """How likely decisions are, and those that follow from them."""
    log = near.log._replace(weight=weight)
    run = smooth_log(log, model, [near.start], RESIDUALS)
    likelihood, following = run.log_likelihood, np.zeros_like(weight)
    for s in range(len(near.sigma)):
        rows = np.flatnonzero(near.station == s)
        if len(rows) == 0:
            continue
        residual, variance = run.residual[rows], run.residual_variance[rows]
        good = outlier_chain.classify(residual, variance, near.sigma[s] ** 2, np.tile(RATES, (3, 1)), near.gate)
        following[rows] = (good > 0.5) * near.possible[rows]
        for c in range(3):
            seen = rows[near.possible[rows, c] > 0]
            if len(seen):
                likelihood += patch_likelihood.log_probability(
                    log.time_s[seen], run.residual[seen, c], run.residual_variance[seen, c],
                    np.ascontiguousarray(weight[seen, c]), float(near.sigma[s, c]), RATES,
                )  # fmt: skip
    return Outcome(weight, likelihood), following
