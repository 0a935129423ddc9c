"""Alternative hypotheses: is it another reading, or another station, that is wrong?

One patch that is believed makes the good readings of the other stations look bad, and the decisions stand still there,
because each supports the others. Where readings are rejected for a while, the decisions are made again over the
neighbourhood alone: from those of now, from the screening, with each component and each station wrong in turn, and from
few components only; the likeliest outcome is kept. The biases stay.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.editing import outlier_chain, patch_likelihood
from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.filtering.smoother import smooth_log
from ftproc.records import FloatArray, IntArray

SHORTEST, SHORTEST_S, BRIDGED = 3, 1.0, 2  # readings, or s, of a run; readings between two rejected ones of it
TOGETHER_S, LONGEST_S = 1.0, 45.0  # seconds between runs of one place, and of a place
ISLAND, ISLAND_S = 48, 6.0  # readings and seconds between two runs of a component that may belong to one patch
MARGIN_MEMORIES, MARGIN_S, MARGIN_INTERVALS = 8.0, (2.0, 20.0), 60.0  # on each side, whose likelihood is compared
TENSION, TENSION_S = 3.5, 2.0  # standard deviations of the sum of squares of so long a stretch, that are explained
EDGE_S = 0.3  # by which a hypothesis reaches beyond the place
ROUNDS, FINALISTS, BETTER = 3, 3, 6.0  # of decisions; hypotheses that get them; in log-probability, to be taken
RATES = np.array([0.03, 0.001, 0.93])  # isolated outlier; patch begins; goes on
LOST, FEWEST = 0.35, 12  # share rejected of a component, to be called lost; readings that a hypothesis leaves
FREE = (50.0, 20.0, 20.0)  # m, m/s, m/s2: 1-sigma of the state where a neighbourhood begins
OTHER_LEVEL = 2.0  # times the jerk level at which a place was examined, before it is examined again
WORK, WORK_PER_SAMPLE = 250_000, 250  # samples that one search may smooth, and for each of the events
MANOEUVRES = (16.0, 256.0)  # times the calm level: of manoeuvres that explain the decisions of now
CALMER = 4.0  # times the calm level: the jerk may be so much more in a place

Channel = tuple[int, int]  # station, component


class Neighbourhood(NamedTuple):
    """A stretch of the events and what decides in it. log: with the weights of now. possible, trusted (n, 3). sigma
    (stations, 3). inside (n,): the place itself; together: as of `Place`. start: a state at the first event. levels:
    models to try. gate, in sigmas."""

    log: Observations
    possible: FloatArray
    trusted: FloatArray
    sigma: FloatArray
    inside: NDArray[np.bool_]
    together: bool
    start: Start
    levels: tuple[Model, ...]
    gate: float

    @property
    def station(self) -> IntArray:
        assert self.log.sites is not None
        return self.log.sites.station


class Place(NamedTuple):
    """Where readings are rejected: from, to (s), and the channels. together: more than one of them at a time."""

    first_s: float
    last_s: float
    channels: frozenset[Channel]
    together: bool = False

    def is_like(self, other: Place) -> bool:
        """Whether it is the same place; the clocks move it a little."""
        moved = max(abs(self.first_s - other.first_s), abs(self.last_s - other.last_s))
        return moved < EDGE_S and self.channels == other.channels


class Search:
    """The places that were examined; they are examined again once the calm level of the jerk is another. unexamined:
    those that no work was left for; work is counted in samples that are smoothed, so that a result does not depend on
    the machine."""

    def __init__(self, samples: int) -> None:
        self.tried: set[Place] = set()
        self.unexamined: set[Place] = set()
        self.work = WORK + WORK_PER_SAMPLE * samples
        self.level = math.inf

    def begin(self, level: float) -> None:
        """Look again, at this jerk level, m^2/s^5."""
        if not self.level / OTHER_LEVEL < level < self.level * OTHER_LEVEL:
            self.level = level
            self.tried.clear()

    def take(self, place: Place) -> bool:
        """Whether a place is yet to be examined, and work is left for it."""
        if any(place.is_like(other) for other in self.tried):
            return False
        if self.work <= 0:
            self.unexamined.add(place)
            return False
        self.tried.add(place)
        return True


class Outcome(NamedTuple):
    """Weights (n, 3) and their log-probability."""

    weight: FloatArray
    likelihood: float


def places(log: Observations, possible: FloatArray) -> list[Place]:
    """Where to look, in the order of time."""
    assert log.sites is not None
    found: list[Place] = []
    for s, c in itertools.product(range(len(log.sites.range_m)), range(3)):
        rows = np.flatnonzero((log.sites.station == s) & (possible[:, c] > 0))
        if len(rows) == 0:
            continue
        rejected = np.flatnonzero(log.weight[rows, c] <= 0)
        runs = []
        for run in np.split(rejected, np.flatnonzero(np.diff(rejected) > BRIDGED + 1) + 1):
            if len(run) == 0:
                continue
            first, last = float(log.time_s[rows[run[0]]]), float(log.time_s[rows[run[-1]]])
            if len(run) >= SHORTEST or last - first > SHORTEST_S:
                runs.append((int(run[0]), int(run[-1]), first, last))
        found += _bridged(runs, frozenset([(s, c)]))
    merged: list[Place] = []
    for place in sorted(found):
        one = merged[-1] if merged else None
        if one and place.first_s <= one.last_s + TOGETHER_S and place.last_s - one.first_s < LONGEST_S:
            together = one.together or place.first_s <= one.last_s
            merged[-1] = Place(one.first_s, max(one.last_s, place.last_s), one.channels | place.channels, together)
        else:
            merged.append(place)
    return merged


def _bridged(runs: list[tuple[int, int, float, float]], channel: frozenset[Channel]) -> list[Place]:
    """The runs of a component, joined where few readings between two of them are believed."""
    found: list[Place] = []
    before = None
    for begin, end, first, last in runs:
        near = before is not None and begin - before <= ISLAND and first - found[-1].last_s <= ISLAND_S
        if near and last - found[-1].first_s < LONGEST_S:
            found[-1] = found[-1]._replace(last_s=last)
        else:
            found.append(Place(first, last, channel))
        before = end
    return found


def margin_s(time_s: FloatArray, memory_s: float) -> float:
    """Seconds on each side of a place that the comparison looks at. memory_s: of the filter."""
    wanted = float(np.clip(MARGIN_MEMORIES * memory_s, *MARGIN_S))
    return max(wanted, MARGIN_INTERVALS * float(np.median(np.diff(time_s))))


def calm_levels(model: Model, here: slice, time_s: FloatArray) -> tuple[Model, ...]:
    """The model with the flight's calm jerk, and with that of the neighbourhood where it is much higher."""
    jerk = model.jerk
    calm = np.median(jerk, 0)
    found = [calm]
    if len(jerk) > 1 and math.isfinite(model.knot_s):
        knots = np.clip(((time_s[here] - time_s[0]) / model.knot_s).astype(int), 0, len(jerk) - 1)
        around = np.quantile(jerk[np.unique(knots)], 0.35, axis=0)
        if around[0] > CALMER * calm[0]:
            found.append(around)
    else:
        found.append(calm / 10)
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
    if not near.together and not _tense(near, ways[0].model):
        return None
    tried = [way for way in (ways[0].of(each) for each in _hypotheses(near)) if math.isfinite(way[0].likelihood)]
    tried.sort(key=lambda each: -each[0].likelihood)
    leading = {following.tobytes(): first.weight for first, following in reversed(tried)}
    finalists = [now, *list(reversed(leading.values()))[:FINALISTS]]
    best = max((ways[0].settled(each) for each in finalists), key=lambda each: each.likelihood)
    best = max((way.settled(best.weight) for way in ways), key=lambda each: each.likelihood)
    calm = ways[0].model
    ways += [Steps(near, calm._replace(jerk=times * calm.jerk), search) for times in MANOEUVRES]
    standing = max(way.of(now)[0].likelihood for way in ways)
    return best.weight if best.likelihood > standing + BETTER else None


def _tense(near: Neighbourhood, calm: Model) -> bool:
    """Whether the readings that are used now do not fit a calm flight somewhere about the place."""
    run = smooth_log(near.log, calm, [near.start], residuals_only=True)
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
    weight, inside, station = near.log.weight, near.inside, near.station
    base = np.where(inside[:, None], near.trusted, weight) * near.possible
    yield base
    live = [
        (s, c)
        for s, c in itertools.product(range(len(near.sigma)), range(3))
        if (near.possible[inside & (station == s), c] > 0).any()
    ]
    wrong: list[tuple[Channel, ...]] = [(each,) for each in live]
    for s in range(len(near.sigma)):
        own = tuple(each for each in live if each[0] == s)
        if len(own) > 1:
            wrong.append(own)
    lost = [each for each in live if _share_lost(near, each) > LOST]
    if len(lost) > 1:
        wrong += [pair for pair in itertools.combinations(live, 2) if pair[0][0] != pair[1][0]]
    for channels in wrong:
        yield _without(near, base, channels)
    if len(lost) > 1 and len(live) > 3:
        nothing = np.where(inside[:, None], 0.0, weight)
        for channels in itertools.combinations(live, 3):
            some = nothing.copy()
            for s, c in channels:
                rows = inside & (station == s)
                some[rows, c] = base[rows, c]
            yield some


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
    run = smooth_log(log, model, [near.start], residuals_only=True)
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
