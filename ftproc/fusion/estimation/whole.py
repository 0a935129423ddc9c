"""A fused flight of any length: in one piece, or stretch by stretch where it has many rows.

What a stretch says of the biases is known to those after it. When all have been decided on, each is smoothed once more,
with the biases as all together have shown them. Stretches overlap, so that each sees what lies beside it.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from ftproc.core import impact
from ftproc.core.filtering.records import FilterRun, Model, Start
from ftproc.core.filtering.smoother import SmootherRun
from ftproc.core.identification.motions.motion_models import ONLY_WHITE, Candidates
from ftproc.core.model import kinematics
from ftproc.core.model.stations import levelled
from ftproc.fusion.estimation import engine, flight_faults, lasting, motions
from ftproc.fusion.estimation.beside import ASSUMED, Aside, above_ground, expected
from ftproc.fusion.estimation.constants import FARTHEST, Constants, Likelihood, parameters
from ftproc.fusion.estimation.engine import Current
from ftproc.fusion.estimation.events import CLOCK, Seen, Side
from ftproc.fusion.estimation.lasting import Step
from ftproc.fusion.estimation.motions import Motive
from ftproc.records import FloatArray, IntArray

MOST = 200_000  # rows of a stretch
BESIDE = 10_000  # rows on either side that are smoothed with it


class Track(NamedTuple):
    """What is published: time_s (n,) true time, distinct; state (n, 9) and sigma (n, 9); path_sigma (n, 6) as in
    FilterRun; nis (n,) of all readings of a time, NaN where none was used."""

    time_s: FloatArray
    state: FloatArray
    sigma: FloatArray
    path_sigma: FloatArray
    nis: FloatArray


class Fused(NamedTuple):
    """By station, row for row with its log: weight and possible (rows, 3), leave-one-out residual and residual_variance
    (rows, 3), position (rows, 3) of the track in m. noise (m, 3) 1-sigma, own (m, 3) the noise that each component
    shows alone; axes (m, 3, 3) with the tilts; jerk (k, 3) each for knot_s seconds; rounds, settled: of the decisions;
    unexamined: intervals for which no work was left; steps: that were taken out; beside: of each station by name, what
    it measures beside its readings; motions: of each stretch the motion that was chosen, its gain there, and for how
    many rows; last: the last state of a ballistic motion, with its model."""

    stations: list[Seen]
    weight: list[FloatArray]
    possible: list[FloatArray]
    residual: list[FloatArray]
    residual_variance: list[FloatArray]
    position: list[FloatArray]
    track: Track
    noise: FloatArray
    own: FloatArray
    constants: Constants
    axes: FloatArray
    jerk: FloatArray
    knot_s: float
    rounds: int
    settled: bool
    unexamined: int
    steps: tuple[Step, ...] = ()
    beside: tuple[dict[str, Aside], ...] = ()
    motions: tuple[tuple[Motive, int], ...] = ()
    last: tuple[Start, Model] | None = None


class Stretch(NamedTuple):
    """A part of the flight as it has been decided on. rows: of each station, with those beside. seen: the stations that
    have any. likelihood: of the biases of all, by the part without those beside."""

    first_s: float
    stop_s: float
    rows: list[slice]
    seen: list[int]
    current: Current
    likelihood: Likelihood


def fuse(
    stations: list[Seen], gate: float, jerk_psd: float | None, smooth: bool, progress: Callable[[int, int], None],
    among: Candidates = ONLY_WHITE,
) -> Fused:  # fmt: skip
    """The fused flight of two or more stations. smooth: whether the track is smoothed, or filtered with the decisions
    and the biases of the whole flight. progress is called with the rounds that are done, and the most there may be.
    among: the models of motion to choose from. Raises engine.Alone."""
    run = functools.partial(_fused, gate=gate, jerk_psd=jerk_psd, smooth=smooth, progress=progress, among=among)
    fused = run(stations)
    if (others := lasting.with_biases(stations, fused.steps)) is not None:
        fused = run(others)
    others = above_ground(fused.stations, fused.track.state, fused.track.sigma)
    return fused if others is None else run(others)


def _fused(
    stations: list[Seen], gate: float, jerk_psd: float | None, smooth: bool, progress: Callable[[int, int], None],
    among: Candidates,
) -> Fused:  # fmt: skip
    """The same, of what the range file says."""
    prior = np.stack([station.prior for station in stations])
    times = np.sort(np.concatenate([station.time_s for station in stations]))
    pieces = -(-len(times) // MOST)
    edges = [-np.inf, *times[len(times) * np.arange(1, pieces) // pieces], np.inf]
    found: list[Stretch] = []
    while len(found) < len(edges) - 1:
        k = len(found)
        rows = _rows(stations, times, edges[k], edges[k + 1])
        seen = [s for s, part in enumerate(rows) if part.stop > part.start]
        there = [_part(stations[s], rows[s]) for s in seen]
        known = _likelihood(found, prior.size)
        say = functools.partial(_say, progress, k * engine.MOST_ROUNDS, (len(edges) - 1) * engine.MOST_ROUNDS)
        try:
            said = known.of(parameters(seen))
            current = flight_faults.fuse(there, gate, jerk_psd, among, said, say, stretch=len(edges) > 2)
        except engine.Alone:
            if len(edges) == 2:
                raise
            del found[len(edges) - 3 :]  # the last joins the one before it, others the next
            del edges[min(k + 1, len(edges) - 2)]
            continue
        inside = np.diff(np.searchsorted(current.events.time_s, edges[k : k + 2]))[0] / len(current.events.time_s)
        likelihood = engine.likelihood(current).share(float(inside)).among(parameters(seen), prior.size)
        kept = current if len(edges) == 2 else without_run(current)
        found.append(Stretch(edges[k], edges[k + 1], rows, seen, kept, likelihood))
    constants = found[0].current.constants
    if len(found) > 1:
        constants = Constants.before(prior, _likelihood(found, prior.size))
    return _joined(stations, found, constants, smooth)


def _rows(stations: list[Seen], times: FloatArray, first_s: float, stop_s: float) -> list[slice]:
    """Of each station from one time until another, and those beside them."""
    aside = FARTHEST * max(float(station.prior[CLOCK]) for station in stations)
    low, high = np.searchsorted(times, [first_s, stop_s]) + np.array([-BESIDE, BESIDE])
    low_s, high_s = times[max(low, 0)] - aside, times[min(high, len(times)) - 1] + aside
    return [
        slice(int(np.searchsorted(s.time_s, low_s)), int(np.searchsorted(s.time_s, high_s, side="right")))
        for s in stations
    ]


def _part(station: Seen, rows: slice) -> Seen:
    return station._replace(
        time_s=station.time_s[rows],
        measurement=station.measurement[rows],
        accepted=station.accepted[rows],
        beside=tuple(side.part(rows) for side in station.beside),
        times=None if station.times is None else station.times[rows],
    )


def _likelihood(found: list[Stretch], k: int) -> Likelihood:
    return functools.reduce(Likelihood.with_, (each.likelihood for each in found), Likelihood.nothing(k))


def _say(progress: Callable[[int, int], None], before: int, most: int, number: int) -> None:
    progress(before + number, most)


def _joined(stations: list[Seen], found: list[Stretch], constants: Constants, smooth: bool) -> Fused:
    """The stretches one after the other; smoothed with these biases if they are several."""
    if not smooth:
        found = [each._replace(current=engine.as_filtered(each.current)) for each in found]
    sizes = [len(station.time_s) for station in stations]
    weight, possible, residual, variance, position = ([np.full((n, 3), np.nan) for n in sizes] for _ in range(5))
    beside = tuple({side.name: Aside.before(side) for side in _measured(station)} for station in stations)
    chosen, tracks = list[tuple[Motive, int]](), list[Track]()
    noise, own = np.zeros((len(stations), 3)), np.full((len(stations), 3), np.inf)
    for each in found:
        current = each.current
        if len(found) > 1:
            current = engine.at(current, constants.of(each.seen))
        events, run = current.events, current.found.run
        best = published(current, smooth)
        here = slice(*np.searchsorted(events.time_s, [each.first_s, each.stop_s]))
        for k, s in enumerate(each.seen):
            at = here.start + np.flatnonzero(events.station[here] == k)
            near, rows = events.row[at], events.row[at] + each.rows[s].start
            weight[s][rows], possible[s][rows] = current.weight[k][near], current.possible[k][near]
            residual[s][rows], variance[s][rows] = run.residual[at], run.residual_variance[at]
            position[s][rows] = best.state[at, :3]
            for side in _measured(current.stations[k]):
                left = current.found.beside[events.names.index(side.name), at]
                cleaned = expected(side, best.state[at], current.constants.estimate[k])
                beside[s][side.name] = beside[s][side.name].with_(rows, side, near, left, cleaned)
            noise[s] += len(rows) / sizes[s] * current.sigma[k] ** 2
            own[s] = np.minimum(own[s], current.own[k])
        last = here.start + distinct(events.time_s[here])
        count = int(here.stop - here.start)
        motion = current.motion.share(count / len(events.time_s), each.first_s, each.stop_s)
        chosen.append((motion, count))
        nis = _together(best.nis[here], last - here.start)
        tracks.append(Track(events.time_s[last], best.state[last], best.sigma[last], best.path_sigma[last], nis))
    track = Track(*map(np.concatenate, zip(*tracks, strict=True)))
    jerk, knot_s = _profile(found, track.time_s)
    return Fused(
        stations, weight, possible, residual, variance, position, track, np.sqrt(noise), own, constants,
        levelled(np.stack([each.axes for each in stations]), constants.estimate[:, 3:CLOCK]), jerk, knot_s,
        max(each.current.rounds for each in found), all(each.current.settled for each in found),
        sum(each.current.unexamined for each in found),
        tuple(step for each in found for step in each.current.steps), beside, tuple(chosen),
        _last(current, best),
    )  # fmt: skip


def _measured(station: Seen) -> Iterator[Side]:
    """What a station measures beside its readings."""
    return (side for side in station.beside if side.name != ASSUMED)


def _last(current: Current, best: FilterRun | SmootherRun) -> tuple[Start, Model] | None:
    """The last state of a ballistic motion, and the model."""
    if not current.model.motion.pressed:
        return None
    published = best.state[-1], best.sigma[-1]
    return impact.end_of(current.log, current.model, [current.start], *published), current.model


def _profile(found: list[Stretch], time_s: FloatArray) -> tuple[FloatArray, float]:
    """The jerk (k, 3) of all stretches, and for how many seconds each of them holds."""
    if len(found) == 1:
        return found[0].current.model.jerk, found[0].current.model.knot_s
    span_s = float(time_s[-1] - time_s[0])
    knot_s = min(span_s / len(found), *(each.current.model.knot_s for each in found))
    middle_s = time_s[0] + (np.arange(max(math.ceil(span_s / knot_s), 1)) + 0.5) * knot_s
    jerk = []
    for each in found:
        model, here = each.current.model, middle_s[(middle_s >= each.first_s) & (middle_s < each.stop_s)]
        knot = ((here - each.current.events.time_s[0]) / model.knot_s).astype(int)
        jerk.append(model.jerk[np.clip(knot, 0, len(model.jerk) - 1)])
    return np.concatenate(jerk), knot_s


def distinct(time_s: FloatArray) -> IntArray:
    """The last of the events of each time, (m,) places."""
    found: IntArray = np.flatnonzero(np.r_[time_s[1:] > time_s[:-1], True])
    return found


def _together(nis: FloatArray, last: IntArray) -> FloatArray:
    """(m,) NIS of all events of one time together; NaN where none was used."""
    first = np.r_[0, last[:-1] + 1]
    total = np.add.reduceat(np.nan_to_num(nis), first)
    known = np.add.reduceat(np.isfinite(nis).astype(float), first)
    found: FloatArray = np.where(known > 0, total, np.nan)
    return found


def without_run(current: Current) -> Current:
    """The same, of whose smoother run nothing is kept but what `at` needs."""
    run = current.found.run
    slim = SmootherRun._make([run.state.copy(), *(each[:0].copy() for each in run[1:7]), *run[7:]])
    return current._replace(
        found=current.found._replace(run=slim, spread=run.state[:0].copy(), beside=current.found.beside[:0])
    )


def published(current: Current, smooth: bool) -> FilterRun | SmootherRun:
    """The run over the events: smoothed, or by the causal filter with the decisions and the biases of the whole flight.
    Sigmas include those of the biases."""
    if smooth:
        return current.found.run
    run = motions.filtered(current.log, current.model, current.start, current.found.run.state)
    sigma = np.sqrt(run.sigma**2 + current.found.spread)
    return run._replace(sigma=sigma, path_sigma=kinematics.widened(run.state, run.path_sigma, run.sigma, sigma))
