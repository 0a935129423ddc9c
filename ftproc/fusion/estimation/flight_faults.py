"""The flight of several stations, and what is wrong with one of them: settled, faults proposed, settled without them.

Where a settled flight has more noise than its components show alone, or rejects many readings, each station is left
out, and the likeliest jump of its clock, or of a channel, is proposed by the track of the others, if these agree. The
likeliest flight without one is kept, if it is likelier than the flight with it. If it still contradicts itself, as by a
station at a wrong place, and all agree without one station only, that one is left out. All other faults that last are
weighed on the settled flight (`lasting`).
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ftproc.core import odds
from ftproc.core.editing.lasting.curves import CLOCK
from ftproc.core.editing.patch_likelihood import log_probability_of_all
from ftproc.core.identification.motions.motion_models import ONLY_WHITE, WHITE, Candidates
from ftproc.core.identification.profile import roughness
from ftproc.core.work import for_lasting_faults
from ftproc.fusion.estimation import beside, engine, jumps_beside, lasting
from ftproc.fusion.estimation.constants import IMPROBABLE, Likelihood
from ftproc.fusion.estimation.engine import Alone, Current
from ftproc.fusion.estimation.events import APART_M, OFFSET, Seen
from ftproc.fusion.estimation.jumps_beside import Jump
from ftproc.fusion.estimation.lasting import Readings

DETERMINED = 3  # components that a place takes: more show whether they agree
LASTING_ROUNDS = 3  # of the search for faults that last: where one is taken out, another may show
NOISIER, REJECTED, TOGETHER = 2.0, 0.2, 0.1  # times the noise that a component shows alone, and shares of its readings
# that are rejected in all and in one stretch: more is a fault of its station, or of another
Settle = Callable[[Readings], Current]


def fuse(
    stations: list[Seen], gate: float, jerk_psd: float | None, among: Candidates, known: Likelihood,
    progress: Callable[[int], None], stretch: bool = False,
) -> Current:  # fmt: skip
    """The fused flight, or a stretch of a longer one, in all of which the biases have one prior. among: the models
    of motion to choose from. known: what others have said. progress: takes each round. Raises Alone."""
    settle = partial(engine.settled, gate=gate, jerk_psd=jerk_psd, known=known, progress=progress)
    readings, current = _explained(Readings.of(stations), settle, stretch)
    work = for_lasting_faults(len(current.events.time_s), len(stations))
    for _ in range(LASTING_ROUNDS):
        if current.unexamined or lasting.contradicted(current.stations, current.weight):
            break  # the work that a flight may cost is spent, or the stations disagree throughout
        run, possible = current.found.run, current.events.gathered(current.possible)
        track = run.state, run.sigma, run.residual
        decided = lasting.Decided(current.events, current.log, possible, current.model, *track, current.rates)
        if not (found := lasting.find(decided, gate, jerk_psd is not None, work)):
            break
        readings = lasting.taken_out(readings, current.events, found)
        without = settle(readings)
        if lasting.contradicted(without.stations, without.weight):
            break
        current = without._replace(steps=readings.steps)
    if WHITE in among.names and _contradict(current):
        among = ONLY_WHITE  # no motion can be told
    current = engine.last(beside.fitted(current, gate, lambda each: engine.at(each, each.constants)), among)
    return current._replace(unexamined=current.unexamined + work.passed)


def _explained(readings: Readings, settle: Settle, stretch: bool) -> tuple[Readings, Current]:
    """The readings without what is wrong with a station as a whole, and their flight."""
    begun = (readings, settle(readings)) if stretch else _with_own_heights(readings, settle)
    return _without_largest_jumps(*begun, settle)


def _with_own_heights(readings: Readings, settle: Settle) -> tuple[Readings, Current]:
    """The readings, and their flight; if it contradicts itself, with heights of one station that are not those of the
    transponder that the others hear, where that is likelier."""
    first = current = settle(readings)
    hears = [any(side.name == beside.HEIGHT for side in station.beside) for station in readings.stations]
    heard = [s for s, station in enumerate(readings.stations) if hears[s] and station.prior[OFFSET] > 0]
    if len(heard) < 2 or (first.settled and not _contradict(first) and not _rejects_many(first)):
        return readings, first
    for s in heard:
        stations, prior = list(readings.stations), readings.stations[s].prior.copy()
        prior[OFFSET] = APART_M
        stations[s] = stations[s]._replace(prior=prior)
        with contextlib.suppress(Alone):
            found = settle(readings._replace(stations=stations))
            if score(found) > score(current) + (odds.SURE if current is first else 0.0):
                current = found
    return readings._replace(stations=current.stations), current


def _without_largest_jumps(readings: Readings, current: Current, settle: Settle) -> tuple[Readings, Current]:
    """The readings without the jumps that are likelier than none, or without those of a station that is at a wrong
    place, and their flight."""
    for _ in range(LASTING_ROUNDS):
        if not (_contradict(current) or _rejects_many(current) or _surprise(current) > odds.SURE):
            break
        least = score(current) + odds.SURE - odds.FAULT + math.log(len(current.events.time_s))
        agree = _others_that_agree(readings, settle)
        alone, misplaced = _left_out(readings, agree), _misplaced(readings, current, agree)
        tried = _without_jumps(readings, current, agree, settle)
        s, jump, first = max(tried, key=lambda each: score(each[2]), default=(0, None, current))
        if jump is not None and score(first) >= least:
            found, flight = _as_all_tell(readings, s, jump, first, settle)
            probable = misplaced is None or (s == misplaced[0] and _surprise(flight) < odds.SURE)
            if probable and not (_contradict(flight) and alone):
                readings, current = found, flight
                continue
        if (out := misplaced or (alone if _contradict(current) else None)) is not None:
            s, current = out
            readings = readings._replace(banned=_banned(readings, s))
        break
    return readings, current


def _surprise(current: Current) -> float:
    """By how much less likely its biases are than biases are in the mean, in log-probability."""
    constants = current.constants
    free = constants.prior > 0
    return 0.5 * float(((constants.estimate[free] / constants.prior[free]) ** 2 - 1.0).sum())


def _misplaced(readings: Readings, current: Current, agree: dict[int, Current]) -> tuple[int, Current] | None:
    """The one station without which the biases of all others are probable, and their flight: a wrong place looks like
    biases of all stations."""
    gain = {s: _surprise(current) - _surprise(agree[s]) for s in agree if _others_tell(readings, s)}
    order = sorted(gain, key=lambda s: -gain[s])
    if not order or gain[order[0]] < odds.SURE - odds.FAULT:
        return None
    alike = len(order) > 1 and gain[order[0]] < gain[order[1]] + odds.LIKELIER
    return None if alike else (order[0], agree[order[0]])


def _others_that_agree(readings: Readings, settle: Settle) -> dict[int, Current]:
    """The flights of all stations but one, by that, as far as they do not contradict each other."""
    found = {}
    for s in range(len(readings.stations)):
        with contextlib.suppress(Alone):
            others = settle(readings._replace(banned=_banned(readings, s)))
            if not _contradict(others):
                found[s] = others
    return found


def _left_out(readings: Readings, agree: dict[int, Current]) -> tuple[int, Current] | None:
    """The one station without which all others agree, by probable biases, if these would show that they do not, and
    their flight."""
    found = None
    for s, flight in agree.items():
        if not _others_tell(readings, s) or flight.constants.farthest > IMPROBABLE:
            continue
        if found is not None:
            return None
        found = s, flight
    return found


def _others_tell(readings: Readings, s: int) -> bool:
    """Whether stations but one would show that they do not agree."""
    others = [len(each.components) for k, each in enumerate(readings.stations) if k != s]
    return len(others) > 1 and sum(others) > DETERMINED


def _banned(readings: Readings, s: int) -> list[NDArray[np.bool_]]:
    """Readings that are not used, if none of station s are."""
    return [np.ones_like(each) if k == s else each for k, each in enumerate(readings.banned)]


def _contradict(current: Current) -> bool:
    """Whether the stations that take part contradict each other more than their noise explains."""
    noisier = bool((current.sigma > NOISIER * current.own).any())
    taking_part = [s for s, each in enumerate(current.possible) if each.any()]
    stations, weight = [current.stations[s] for s in taking_part], [current.weight[s] for s in taking_part]
    return bool(current.unexamined) or noisier or lasting.contradicted(stations, weight)


def _rejects_many(current: Current) -> bool:
    """Whether many readings of some component are rejected, and of these enough in one stretch, as behind a jump; those
    between that are used count against it. Outliers scattered over the flight are none."""
    for possible, weight in zip(current.possible, current.weight, strict=True):
        rejected = (possible > 0) & (weight <= 0)
        beyond = np.cumsum(np.where(possible > 0, np.where(rejected, 1.0, -1.0), 0.0), axis=0)
        before = np.minimum.accumulate(np.vstack([np.zeros(3), beyond[:-1]]), axis=0)
        longest = np.max(beyond - before, axis=0, initial=0.0)
        if ((rejected.sum(0) > REJECTED * possible.sum(0)) & (longest > TOGETHER * possible.sum(0))).any():
            return True
    return False


def _without_jumps(
    readings: Readings, current: Current, agree: dict[int, Current], settle: Settle
) -> Iterator[tuple[int, Jump, Current]]:
    """The likeliest jump of each station, as the track of the others, if these agree, tells it, and the flights without
    it."""
    for s, others in agree.items():
        station = readings.stations[s]
        with contextlib.suppress(Alone):
            jumps = jumps_beside.propose(station, current.own[s], others.events.time_s, others.found.run.state)
            likeliest = max(jumps, key=lambda jump: jump.gain, default=None)
            if likeliest is not None and likeliest.gain > odds.SURE:
                for jump in likeliest.sides():
                    yield s, jump, settle(_without(readings, s, jump))


def _as_all_tell(readings: Readings, s: int, jump: Jump, first: Current, settle: Settle) -> tuple[Readings, Current]:
    """The readings without a jump of station s of the size that all stations tell, and their flight. first: the flight
    without the jump as the others told it."""
    run = first.found.run
    more = jumps_beside.rest_of(jump, s, first.events, first.log, first.model, first.start, run.state)
    gap_s = float(np.diff(readings.stations[s].time_s)[jump.row - 1])
    most = gap_s if jump.channel == CLOCK else math.inf
    found = _without(readings, s, jump._replace(size=min(jump.size + more, most)))
    with contextlib.suppress(Alone):
        if score(flight := settle(found)) > score(first):
            return found, flight._replace(steps=found.steps)
    found = _without(readings, s, jump)
    return found, first._replace(steps=found.steps)


def _without(readings: Readings, s: int, jump: Jump) -> Readings:
    stations = [jump.taken_out(each) if k == s else each for k, each in enumerate(readings.stations)]
    at_s, size = readings.stations[s].time_s[jump.row], jump.size if jump.later else -jump.size
    step = lasting.Step(stations[s].name, jump.channel, float(at_s), size)
    return readings._replace(stations=stations, steps=(*readings.steps, step))


def score(current: Current) -> float:
    """Log-probability of the readings of a settled flight, of the decisions on them, and of its process noise."""
    run, time_s, total = current.found.run, current.events.time_s, -roughness(current.model)
    for s, weight in enumerate(current.weight):
        at = np.flatnonzero(current.events.station == s)
        rows = current.events.row[at]
        total += log_probability_of_all(
            time_s[at], run.residual[at], run.residual_variance[at], weight[rows], current.possible[s][rows] > 0,
            current.sigma[s] ** 2, current.rates[s],
        )  # fmt: skip
    return total + run.log_likelihood
