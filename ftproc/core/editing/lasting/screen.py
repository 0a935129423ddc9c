"""Whether a jump may be a step at all, before steps are weighed: by the log around it as it is understood without one.

A step makes that likelier, as it is or with the rejected readings beside it taken in, whose rejection then need not be
explained. Both are linear problems of a sweep or two, where weighing settles process noise and decisions anew.

The same of the curves of a patch that was followed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from ftproc.core import odds
from ftproc.core.editing.lasting import scan
from ftproc.core.editing.lasting.clock import gain_at_a_gap
from ftproc.core.editing.lasting.curves import CLOCK, Curve, columns_of
from ftproc.core.editing.lasting.proposals import edges_about
from ftproc.core.editing.lasting.scan import Jump
from ftproc.core.editing.lasting.weighing import Scene, Weighed, as_it_is
from ftproc.core.filtering.columns import said_of
from ftproc.core.filtering.records import Model, Observations
from ftproc.core.filtering.smoother import likelihood_of
from ftproc.core.identification.profile import median_level, pieces
from ftproc.core.identification.stretches import runs_of
from ftproc.records import FloatArray

ELEVATED = 30.0  # times the usual process noise
HIDDEN = 25.0  # the same by the typical process noise of the part, where it may have grown for the jump: turns 20


def left_of(part: Scene, jump: Jump, around: tuple[int, int], without: Weighed) -> Jump:
    """A jump with those of its ways that make a part of a log likelier than it is without a fault, and with that of a
    clock, if there are any: it is no linear problem. around: the sample of the part about which it is, and how far
    from it at most."""
    edges = edges_about(len(part.possible), *around)

    def gain(way: tuple[int, ...], log: Observations, model: Model) -> float:
        """With a step of some channels at one of the edges, as if each were off alone."""
        channels, starts = [(channel, jump.station) for channel in way], part.starts(log)
        return sum(float(scan.steps_of(log, model, starts, part.setting, c, edges)[1:].max()) for c in channels)

    def leaves(way: tuple[int, ...]) -> bool:
        taken_in = _with_rejected(part, way, jump.station, around, without.weight)
        if _is_more_than(-odds.FAULT, part, partial(gain, way), without, taken_in):
            return True
        if len(without.model.jerk) > 1 and gain(way, part.log, median_level(without.model)) > HIDDEN:
            return True
        return way == (CLOCK,) and gain_at_a_gap(part, around[0], without.weight, without.model) > -odds.FAULT

    left = [way for way in jump.ways if leaves(way)]
    return jump._replace(ways=tuple(way for way in jump.ways if way in left or (left and way == (CLOCK,))))


def leaves_curves(part: Scene, curves: Sequence[Curve], least: float, without: Weighed) -> bool:
    """Whether curves make a part of a log by so much likelier than it is without a fault, and than their terms do by
    chance."""
    gain, taken_in = partial(_gain, part, curves), np.maximum(without.weight, part.taking_in(curves))
    return _is_more_than(least, part, gain, without, taken_in)


def may_leave_curves(part: Scene, few: Sequence[Curve], most: Sequence[Curve], least: float) -> bool:
    """The same at the typical process noise of the log, before the part's own is sought; and whether the process noise
    as it was decided leaves anything to them: few terms make the part likelier, or most do without all that it has more
    than is typical."""
    weight = part.log.weight
    by_median, decided = (as_it_is(part, weight, model) for model in (part.at_median, part.own or part.at_median))
    if not leaves_curves(part, few, -odds.FAULT, decided):
        least = max(least, decided.log_probability - by_median.log_probability - odds.FAULT)
    return leaves_curves(part, most, least, by_median)


def others_as_usual(part: Scene, curves: Sequence[Curve]) -> bool:
    """Whether a part of a log seems agile where curves act, but the readings that they do not act on are as likely with
    the usual process noise there: what moves does so in more than one component."""
    own, usual, inside = part.own, part.at_median, np.zeros(0, np.int64)
    if own is None:
        return False
    weight, knot = part.log.weight.copy(), pieces(part.log.time_s, own)
    for curve in curves:
        weight[curve.rows, curve.component] = 0.0
        inside = np.union1d(inside, knot[curve.rows])
    if own.jerk[inside, 0].max() < ELEVATED * usual.jerk[0, 0]:
        return False
    jerk = own.jerk.copy()
    jerk[inside] = np.minimum(jerk[inside], usual.jerk)
    log = part.log._replace(weight=weight)
    starts = part.starts(log)
    typical = likelihood_of(log, own._replace(jerk=jerk), starts)
    return typical > likelihood_of(log, own, starts) + odds.FAULT


def _gain(part: Scene, curves: Sequence[Curve], log: Observations, model: Model) -> float:
    """In log-likelihood, by curves of the likeliest sizes; without what their terms gain by chance."""
    said = said_of(log, model, part.starts(log), columns_of(curves, part.setting))
    scale = np.sqrt(np.maximum(np.diag(said.information), 1e-300))
    score, information = said.score / scale, said.information / scale / scale[:, None]
    found = float(score @ np.linalg.lstsq(information, score, rcond=None)[0])
    return 0.5 * (found - sum(len(curve.size) for curve in curves))


def _is_more_than(
    least: float, part: Scene, gain: Callable[[Observations, Model], float], without: Weighed, taken_in: FloatArray
) -> bool:
    """Whether there is such a gain as the part is understood without a fault, or with rejected readings taken in (n, 3)
    weights, whose rejection then need not be explained."""
    if gain(part.log._replace(weight=without.weight), without.model) > least:
        return True
    if (taken_in == without.weight).all():
        return False
    more = as_it_is(part, taken_in, without.model).log_probability - without.log_probability
    return gain(part.log._replace(weight=taken_in), without.model) + more > least


def _with_rejected(
    part: Scene, way: Sequence[int], station: int, around: tuple[int, int], weight: FloatArray
) -> FloatArray:
    """The weights (n, 3) with the rejected runs beside a jump that may be a track taken in, of the components that
    jump."""
    found, (at, width) = weight.copy(), around
    for c in range(CLOCK) if CLOCK in way else way:
        rows = part.setting.rows(Curve(c, 0, len(weight), (), station))
        rows = rows[part.possible[rows, c]]
        for begin, end in runs_of(weight[rows, c] <= 0):
            run = rows[begin:end]
            if run[0] - width <= at <= run[-1] + width:
                found[run, c] = part.taken_in[run, c]
    return found
