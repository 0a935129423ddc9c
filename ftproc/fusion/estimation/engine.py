"""The fused flight: smoother, biases, noise, process noise and decisions in turn, until they stand still.

Each round smooths the events of all stations with the readings that are accepted (`core.filtering.biases`), moves the
biases to their posterior, the noise of each station to what its leave-one-out residuals show, the process noise to its
likelihood's maximum, and decides again, station by station and component by component, which readings are outliers: by
the same hidden Markov chain as for a single log, on residuals in which all other stations take part.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ftproc.core.editing import outlier_chain
from ftproc.core.filtering.biases import Biased, Directions, smooth_biased
from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.identification.likelihood import fit_jerk
from ftproc.core.identification.motions.motion_models import WHITE, Candidates
from ftproc.core.identification.profile import fit_profile, median_level, with_allowance
from ftproc.core.identification.scales import scales_of
from ftproc.core.model.motion import isotropic
from ftproc.core.model.moving import moved_to
from ftproc.fusion.estimation import alternatives, beside, first_track, intervals, lasting, motions, screening
from ftproc.fusion.estimation import constants as posterior
from ftproc.fusion.estimation.constants import Constants, Likelihood
from ftproc.fusion.estimation.events import Events, Seen, merge
from ftproc.records import FloatArray

FIRST_ROUNDS, MOST_ROUNDS, REASSESSMENTS = 4, 18, 8
PROFILE_STEPS, LAST_STEPS = 2, 4
READMITTED = 0.8  # probability of being good from which a rejected reading is used again after the first rounds
STILL, UNMOVED = 1e-4, 0.1  # share of readings, and sigmas of the biases, that may still change
NOISE_STEP = 4.0  # times its variance that the noise of a component moves in a round
START_SIGMA, START_INFLATION = (30.0, 10.0, 20.0), 25.0  # m, m/s, m/s2: at least, at the start; on its variance
FIRST_MEMORIES = (5.0, 20.0, 80.0)  # intervals of the densest station: of the filters that begin the search
SHARES = (1.0, 0.25, 0.06, 0.0)  # of what is unknown of the readings, which is taken for noise at first: ever less
FEWEST_KEPT = 0.5  # of what screening trusts, in each component of a station


class Current(NamedTuple):
    """What is accepted now. events, weight (rows, 3) of each station; sigma (m, 3) noise; constants; model; start;
    found: the smoother's run that the rest belongs to; own (m, 3): the noise that each component shows alone;
    rounds, settled: of the decisions; unexamined: intervals where no work was left to look for other hypotheses; steps:
    that were taken out of the readings; motion: of the model; white: the model with white jerk, where others were
    tried, see `last`."""

    stations: list[Seen]
    events: Events
    weight: list[FloatArray]
    possible: list[FloatArray]
    sigma: FloatArray
    constants: Constants
    model: Model
    start: Start
    found: Biased
    rates: FloatArray
    own: FloatArray
    rounds: int = 0
    settled: bool = False
    unexamined: int = 0
    steps: tuple[lasting.Step, ...] = ()
    motion: motions.Motive = motions.Motive()
    white: Model | None = None

    @property
    def log(self) -> Observations:
        """The events with the weights of the readings."""
        return self.events.weighted(self.weight)


class Alone(Exception):
    """The readings of the stations determine no first track, or none that fits all of them."""


def settled(
    readings: lasting.Readings, gate: float, jerk_psd: float | None, known: Likelihood, progress: Callable[[int], None]
) -> Current:
    """The flight of readings without faults that last, when the decisions stand still. Raises Alone."""
    stations = readings.stations
    screened = [screening.screen(station, banned) for station, banned in zip(*readings[:2], strict=True)]
    sigma = np.stack([each.sigma for each in screened])
    track = first_track.find(*beside.with_elevations(stations, [each.trusted for each in screened], sigma))
    if track is None:
        raise Alone
    trusted = [screening.agreeing(s, each, track) for s, each in zip(stations, screened, strict=True)]
    prior = np.stack([station.prior for station in stations])
    current = _begin(stations, screened, trusted, track, Constants.before(prior, known), gate, jerk_psd)
    reassessed, search = 0, intervals.Search(sum(len(s.time_s) for s in stations))
    for number in range(MOST_ROUNDS):
        progress(number)
        level = number if number < FIRST_ROUNDS else None
        current = _round(current, trusted, gate, jerk_psd, level)
        if not np.isfinite(current.found.run.state[current.start.sample :]).all():
            raise Alone  # they contradict each other so much that the smoother diverges
        if number >= FIRST_ROUNDS - 1 and reassessed < REASSESSMENTS and (current.settled or number % 2):
            reassessed += 1
            current, changed = _reassessed(current, trusted, gate, search)
            if not changed and current.settled:
                break
    return current._replace(unexamined=len(search.unexamined - search.tried))


def _begin(
    stations: list[Seen], screened: list[screening.Screened], weight: list[FloatArray], track: first_track.Track,
    constants: Constants, gate: float, jerk_psd: float | None,
) -> Current:  # fmt: skip
    """The first smoother run, along the first track."""
    sigma = np.stack([each.sigma for each in screened])
    range_m = np.array([np.median(np.linalg.norm(track.state[:, :3] - s.place, axis=1)) for s in stations])
    events = merge(stations, constants.estimate, range_m)
    state = track.at(events.time_s)
    first = min(int(np.searchsorted(events.time_s, track.time_s[0])), len(events.time_s) - 1)
    spread = max(float(track.sigma[0]), START_SIGMA[0])
    start = Start(first, state[first], np.diag(np.repeat([spread, 100.0, 50.0], 3) ** 2))
    log = events.weighted(weight)
    wide = screening.with_biases(events, stations, state, sigma)
    possible = [each.possible for each in screened]
    scales, interval_s = scales_of(log, wide**2), screening.interval(stations)
    levels = [jerk_psd] if jerk_psd else [scales.jerk_psd(memory * interval_s) for memory in FIRST_MEMORIES]
    whole = alternatives.Neighbourhood(
        log, events.gathered(possible), log.weight, wide, np.ones(len(state), bool), True, start,
        tuple(Model(wide**2, isotropic(level)) for level in levels), gate, math.inf,
    )  # fmt: skip
    model, decided = screening.first_decisions(whole)
    weight = [events.of(s, decided) for s in range(len(stations))]
    found = smooth_biased(log._replace(weight=decided), model, start, _directions(events, state, constants))
    rates = np.tile(np.array(outlier_chain.START_RATES), (len(stations), 3, 1))
    current = Current(stations, events, weight, possible, sigma, constants, model, start, found, rates, sigma)
    for share in SHARES:
        noise = np.maximum(sigma, share * wide) ** 2
        current = _smoothed(current._replace(model=model._replace(noise_variance=noise)))
    return current


def _directions(events: Events, state: FloatArray, constants: Constants) -> Directions:
    return Directions(screening.design(events, state), constants.columns(), beside.design(events, state))


def _round(
    current: Current, trusted: list[FloatArray], gate: float, jerk_psd: float | None, first: int | None
) -> Current:
    """Decide, tune, move the biases, and smooth again."""
    now = _decided(current, trusted, gate, first)
    now = _tuned(now, jerk_psd, first)
    return _smoothed(now)


def _reassessed(
    current: Current, trusted: list[FloatArray], gate: float, search: intervals.Search
) -> tuple[Current, bool]:
    """The decisions replaced by likelier ones where another hypothesis explains an interval better; whether any was."""
    events, log = current.events, current.log
    possible, accepted, weight = events.gathered(current.possible), events.gathered(trusted), log.weight.copy()
    state = current.found.run.state
    memory_s = scales_of(log, current.model.noise_variance).memory_s(float(np.median(current.model.jerk[:, 0])))
    margin = intervals.margin_s(events.time_s, memory_s)
    changed = False
    search.begin(float(np.median(current.model.jerk[:, 0])))
    for interval in intervals.find(log, possible):
        if not search.take(interval):
            continue
        ends = np.searchsorted(events.time_s, [interval.first_s - margin, interval.last_s + margin])
        here = slice(max(int(ends[0]), current.start.sample), int(ends[1]))
        inside = (events.time_s[here] >= interval.first_s - intervals.EDGE_S) & (
            events.time_s[here] <= interval.last_s + intervals.EDGE_S
        )
        if not inside.any():
            continue
        start = Start(0, state[here.start], np.diag(np.repeat(alternatives.FREE, 3) ** 2))
        near = alternatives.Neighbourhood(
            log.part(here)._replace(weight=weight[here]), possible[here], accepted[here], current.sigma, inside,
            interval.together, start, alternatives.typical_levels(current.model, here, events.time_s), gate,
            margin / intervals.MARGIN_MEMORIES,
        )  # fmt: skip
        found = alternatives.likeliest(near, search)
        if found is not None:
            weight[here][inside] = found[inside]
            changed = True
    if not changed:
        return current, False
    by_station = [np.where(each.accepted, 1.0, events.of(s, weight)) for s, each in enumerate(current.stations)]
    at_median = median_level(current.model) if math.isfinite(current.model.knot_s) else current.model
    return _smoothed(current._replace(weight=by_station, model=at_median, settled=False)), True


def _decided(current: Current, trusted: list[FloatArray], gate: float, first: int | None) -> Current:
    """Which readings are outliers; settled if few of those from the start on are decided otherwise."""
    run, weight, changed, total = current.found.run, [], 0, 0
    started = (np.arange(len(current.events.time_s)) >= current.start.sample).astype(float)
    for s, before in enumerate(current.weight):
        residual = np.ascontiguousarray(current.events.of(s, run.residual))
        variance = np.ascontiguousarray(current.events.of(s, run.residual_variance))
        good = outlier_chain.classify(residual, variance, current.sigma[s] ** 2, current.rates[s], gate)
        sure = np.where((before > 0) | (first is not None), 0.5, READMITTED)
        decided = ((good > sure) & (current.possible[s] > 0)).astype(float)
        lost = decided.sum(0) < FEWEST_KEPT * trusted[s].sum(0)
        decided = np.where(current.stations[s].accepted, 1.0, np.where(lost, trusted[s], decided))
        changed += int((decided != before)[current.events.of(s, started) > 0].sum())
        total += int((current.possible[s] > 0).sum())
        weight.append(decided)
    settled = changed <= STILL * total and current.constants.moved < UNMOVED
    return current._replace(weight=weight, rounds=current.rounds + 1, settled=settled)


def _tuned(current: Current, jerk_psd: float | None, first: int | None) -> Current:
    """Noise by one step, the process noise by a few."""
    run, sigma = current.found.run, current.sigma.copy()
    used = current.events.gathered(current.weight) > 0
    for s, station in enumerate(current.stations):
        here = current.events.station == s
        for c in station.components:
            rows = here & used[:, c]
            if rows.sum() < screening.FEWEST or np.isfinite(station.known[c]):
                continue
            r, v = run.residual[rows, c], run.residual_variance[rows, c]
            growth = np.clip(((r / v) ** 2).sum() / (1 / v).sum(), 1 / NOISE_STEP, NOISE_STEP)
            sigma[s, c] = max(sigma[s, c] * math.sqrt(growth), screening.LEAST_NOISE[c])
    model = current.model._replace(noise_variance=sigma**2)
    starts = [current.start]
    if jerk_psd is None:
        log = current.log
        if first is not None:
            model = fit_jerk(log, starts, model)
        else:
            model = fit_profile(log, starts, motions.on_knots(log, model), PROFILE_STEPS)
    return current._replace(sigma=sigma, model=model)


def _smoothed(current: Current) -> Current:
    """Smooth at the biases' posterior of the run before, with the weights and the model of now."""
    return at(current, posterior.update(current.constants, current.found, _directions_of(current)))


def likelihood(current: Current) -> Likelihood:
    """What the readings say of the biases."""
    return posterior.likelihood(current.constants, current.found, _directions_of(current))


def _directions_of(current: Current) -> Directions:
    return _directions(current.events, current.found.run.state, current.constants)


def at(current: Current, constants: Constants) -> Current:
    """The same smoothed with these biases."""
    old = current.events
    events = merge(current.stations, constants.estimate, old.sites.range_m)
    state = moved_to(old.time_s, current.found.run.state, events.time_s)
    head = current.found.run.heads[0]
    first = min(head.sample, len(events.time_s) - 1)
    start = Start(first, state[first], START_INFLATION * head.covariance + np.diag(np.repeat(START_SIGMA, 3) ** 2))
    log = events.weighted(current.weight)
    found = motions.smoothed(log, current.model, start, _directions(events, state, constants), state)
    return current._replace(events=events, constants=constants, start=start, found=found)


def last(current: Current, among: Candidates) -> Current:
    """The run to publish: with a little more process noise than is likeliest, and the likeliest motion. among: the
    models of motion to choose from."""
    if math.isfinite(current.model.knot_s):
        log, begun = current.log, motions.on_knots(current.log, current.model)
        current = current._replace(model=with_allowance(log, fit_profile(log, [current.start], begun, LAST_STEPS)))
    current = _smoothed(_smoothed(current))
    known = np.any([np.isfinite(station.known) for station in current.stations], 0)
    motion, model = motions.choose(current.log, current.start, current.model, among, known)
    current = current._replace(motion=motion, model=model, white=current.model if WHITE in among.names else None)
    return _smoothed(_smoothed(current)) if model.motion.acts or motion.abrupt_s else current


def as_filtered(current: Current) -> Current:
    """The same with white jerk, if a filter, which knows no course but its own estimate, follows that better."""
    motion, white = current.motion, current.white
    if white is None or not current.model.motion.acts:
        return current
    there = current.start, current.found.run.state
    by_motion, by_white = (
        motions.filtered(current.log, model, *there).log_likelihood for model in (current.model, white)
    )
    if by_white <= by_motion:
        return current
    return current._replace(model=white, motion=motions.Motive(gain=motion.gain))
