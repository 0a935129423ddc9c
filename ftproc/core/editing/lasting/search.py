"""Faults that last, weighed against motion: patches of any length, steps that stay, clocks that jump, other targets.

Wherever a station jumps (`scan`), the jump is weighed on the log around it (`weighing`), first as a step of one
component, of several, and of the clock. With the jump taken out, the process noise there is that of the flight, and a
scan of the stretches that begin or end with it tells from where to where the components may be off (`proposals`). These
are weighed too, the likeliest is taken, and the log is searched again without it.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence

import numpy as np

from ftproc.core import odds
from ftproc.core.editing.lasting import clock
from ftproc.core.editing.lasting.between import likeliest_followed
from ftproc.core.editing.lasting.curves import CLOCK, Curve
from ftproc.core.editing.lasting.ends import around, by_itself, instead_of
from ftproc.core.editing.lasting.proposals import SHORTEST, LocatedJump, exactly, other_end, proposals, steps
from ftproc.core.editing.lasting.scan import Jump
from ftproc.core.editing.lasting.scanned import (
    Scanned,
    in_whole,
    scanned,
    weighed_on,
    worth,
)
from ftproc.core.editing.lasting.screen import left_of
from ftproc.core.editing.lasting.weighing import Found, Scene, Weighed, as_it_is, weighed
from ftproc.core.identification.profile import median_level

ROUNDS = 8  # over a log
CERTAIN = 4.0  # sigmas of its size from which a component takes part in a fault of several


def search(scene: Scene) -> list[Found]:
    """The faults that last in the log of one or several stations whose outliers were decided as if it had none. A patch
    that was followed replaces those beside it only if it explains more: what lies between two patches seems one."""
    found, rejected = list[Found](), list[Jump]()
    seen = first = scanned(scene)
    for _ in range(ROUNDS):
        best = _likeliest(seen, rejected)
        if best is None or any(best.curves[0][:3] == each.curves[0][:3] for each in found):
            break
        found = _joined(seen._replace(scene=scene), found, best)
        if best.curves[0].component == CLOCK:  # along which track its readings move, another search knows
            break
        seen = scanned(scene.without([curve for each in found for curve in each.curves]))._replace(left=first.left)
    followed = likeliest_followed(first)
    if followed is None:
        return found
    short = instead_of(first, followed)
    for each in [followed] if short is None else short:
        found = _likelier(first, found, each)
    return found


def _likelier(first: Scanned, found: list[Found], new: Found) -> list[Found]:
    """What was found, or a patch instead of what is beside it, if it explains more."""
    beside = [each for each in found if each.adjoins(new)]
    rest = first._replace(scene=first.scene.without([c for each in found if each not in beside for c in each.curves]))
    if not beside or _odds_of([new], rest, *beside) > _odds_of(beside, rest, new):
        found = [new, *(each for each in found if each not in beside)]
    return found


def _odds_of(found: Sequence[Found], seen: Scanned, *others: Found) -> float:
    """How likely some faults are together, weighed where they and others are."""
    n, curves = seen.samples, [curve for each in found for curve in each.curves]
    edges = [e for each in (*found, *others) for c in each.curves for e in (c.begin, c.end)]
    near = seen.near(min(edges), max(edges))
    with contextlib.suppress(ValueError, np.linalg.LinAlgError):
        likely = weighed_on(seen.scene.part(near), near, [curve.of(len(curve.size)) for curve in curves])
        return likely.log_probability + sum(seen.prior(each.curves) + odds.STAYS * each.stays(n) for each in found)
    return -math.inf


def _joined(seen: Scanned, found: Sequence[Found], new: Found) -> list[Found]:
    """What was found, and a new fault. Beside a patch of a component that was found, another one of it, or a step of it
    that seems to stay, may show that the readings between them are off as well: they are weighed together."""
    n = seen.samples
    stays = new.stays(n)
    for k, each in enumerate(found):
        middle = _middle(each, new, n)
        if middle is None or middle.length > 2 * seen.around:
            continue
        step, kept = (new.curves, [each]) if stays else ((), [each, new])
        known = [of.curves[0].of(len(of.curves[0].size)) for of in kept]
        edges = [edge for curve in (middle, *known) for edge in (curve.begin, curve.end)]
        near = seen.near(min(edges), max(edges))
        part = seen.scene.without([curve for of in found if of is not each for curve in of.curves]).part(near)
        try:
            without = weighed_on(part, near, [*known, *(curve.of(1) for curve in step)])
            together = [weighed_on(part, near, [*known, middle.of(terms)]) for terms in (1, 2, 3)]
        except (ValueError, np.linalg.LinAlgError):
            continue
        best = max(together, key=lambda of: of.log_probability)
        gain = best.log_probability - without.log_probability  # its ends are those of what is known
        if gain > (odds.STAYS if stays else odds.SURE - odds.FAULT):
            whole = zip(in_whole(best, near, n), best.sigma, strict=True)
            sized = {curve.begin: ((curve,), (sigma,)) for curve, sigma in whole}
            kept = [of._replace(curves=sized[of.curves[0].begin][0], sigma=sized[of.curves[0].begin][1]) for of in kept]
            filled = Found(*sized[middle.begin], gain + (new.gain if stays else odds.FAULT), (new,) if stays else ())
            return [*found[:k], *found[k + 1 :], *kept, filled]
    return [*found, new]


def _middle(patch: Found, new: Found, n: int) -> Curve | None:
    """What lies between a patch and another, or a step that stays, if both are of the same component alone."""
    (one, *more), (other, *others) = patch.curves, new.curves
    same = (one.component, one.station) == (other.component, other.station)
    if more or others or patch.stays(n) or not same or one.component == CLOCK:
        return None
    behind = other.begin > one.begin
    begin, end = (one.end, other.begin) if behind else (other.begin if new.stays(n) else other.end, one.begin)
    return one._replace(begin=begin, end=end) if end - begin >= SHORTEST else None


def _likeliest(seen: Scanned, rejected: list[Jump]) -> Found | None:
    """What the largest jump is that is no motion; those that are motion are added to the rejected. Where one station
    jumps, others seem to: the likeliest of all of them at a sample counts."""
    for jump in seen.jumps:
        if any(abs(jump.sample - old.sample) < seen.width and jump.station == old.station for old in rejected):
            continue
        if not worth(seen.scene):
            return None
        here = [each for each in seen.jumps if abs(each.sample - jump.sample) <= seen.width]
        found = [each for each in (_tried(seen, each) for each in here) if each is not None]
        if found:
            return max(found, key=lambda each: each.gain)
        rejected += here
    return None


def _tried(seen: Scanned, jump: Jump) -> Found | None:
    """What happened at a jump; None if it is motion, or there are too few readings to tell."""
    with contextlib.suppress(ValueError, np.linalg.LinAlgError):
        return _at(seen, jump)
    return None


def _at(seen: Scanned, jump: Jump) -> Found | None:
    """What happened at a jump; None if it is motion."""
    n, near = seen.samples, seen.near(jump.sample, jump.sample)
    part = seen.scene.part(near)
    there = jump.sample - near.start, seen.width
    # What was rejected of one station, others may show to be right.
    screened = len(part.rates) == 1 or bool((part.taken_in == part.log.weight).all())
    if screened:
        jump = left_of(part, jump, there, as_it_is(part, part.log.weight, part.at_median))
    else:
        jump = _left_as_steps(seen, jump)
    if not jump.ways:
        return None
    without = weighed(part, part.log.weight, ())
    if screened and not (jump := left_of(part, jump, there, without)).ways:
        return None
    seen.left.append(jump)
    null = max(each.log_probability for each in (without, weighed(part, part.taken_in, ())))
    gain, located, step = max((_as_step(seen, jump, way, null) for way in jump.ways), key=lambda each: each[0])
    moves = [curve.component for curve in _moving(step.curves, step.sigma)]
    if not moves:  # other decisions, from which it was weighed, explain what it gains
        return None
    if len(moves) < len(step.curves):
        gain, located, step = max((gain, located, step), _as_step(seen, jump, moves, null), key=lambda each: each[0])
    if not odds.FAULT <= gain < odds.PERFECT * seen.scene.possible[near].sum() or not 0 < located.sample < n:
        return None
    if located.channels[0][0] == CLOCK:
        if jump.ways == ((CLOCK,),) and clock.leaves_gap(seen.scene.setting, located.sample, step.curves[0].size[0]):
            return None  # motion in what is left of it explains as much
        return Found(in_whole(step, near, n), step.sigma, gain)
    proposed = list(proposals(seen.scene, located._replace(width=seen.cell, at_median=median_level(step.model))))
    if (CLOCK,) in jump.ways and len(part.rates) == 1:  # by the same part of the log
        proposed.append([Curve(CLOCK, located.sample, n, (0.0,), jump.station)])
    ends = [edge for curves in proposed for edge in (curves[0].begin, curves[0].end) if 0 < edge < n]
    whole, alone = seen.near(min(ends), max(ends)), around(seen, located.sample)
    if whole.stop - whole.start > alone.stop - alone.start:
        end = by_itself(seen, located.channels, located.sample)
        if end.short is not None and end.odds(seen.prior(in_whole(step, near, n))) > odds.OPEN:
            return end.short
    best = _best(seen, proposed, whole, located)
    short = None if best is None else instead_of(seen, best)
    return max(short or [best], key=_gain) if best is not None else None


def _left_as_steps(seen: Scanned, jump: Jump) -> Jump:
    """A jump with those of its ways that as a step make the log around it likelier with its typical process noise,
    before it is weighed with its own."""
    typical = seen._replace(scene=seen.scene._replace(fixed=True))
    part = typical.scene.part(seen.near(jump.sample, jump.sample))
    null = max(weighed(part, weight, ()).log_probability for weight in (part.log.weight, part.taken_in))
    steps = ((way, _as_step(typical, jump, way, null)[2]) for way in jump.ways)
    return jump._replace(ways=tuple(way for way, step in steps if step.log_probability > null - odds.FAULT))


def _as_step(seen: Scanned, jump: Jump, way: Sequence[int], null: float) -> tuple[float, LocatedJump, Weighed]:
    """A jump as a step of some components, or of the clock: its gain, where it is, and the log around it. null:
    log-probability without it."""
    near = seen.near(jump.sample, jump.sample)
    part, channels = seen.scene.part(near), [(c, jump.station) for c in way]
    there = LocatedJump(
        channels, jump.sample - near.start, [each.sample for each in seen.jumps], seen.width, part.at_median
    )
    sample = jump.sample if tuple(way) == (CLOCK,) else near.start + exactly(part, there)
    located = there._replace(sample=sample, longest=seen.longest)
    sides = steps(seen.scene, channels, located.sample)
    step = max((weighed_on(part, near, side) for side in sides), key=lambda each: each.log_probability)
    return step.log_probability - null + seen.prior(sides[0]), located, step


def _best(seen: Scanned, proposed: Sequence[Sequence[Curve]], here: slice, located: LocatedJump) -> Found | None:
    """The likeliest of what was proposed, all weighed on the same part of the log."""
    part, n = seen.scene.part(here), seen.samples
    null = weighed_on(part, here, ()).log_probability

    def outcome(curves: Sequence[Curve]) -> Found:
        found = weighed_on(part, here, curves)
        gain = found.log_probability - null + seen.prior(curves)
        return Found(in_whole(found, here, n), found.sigma, gain)

    def standing(of: Found) -> float:
        return of.gain + odds.STAYS * of.stays(n)

    outcomes = [outcome(curves) for curves in proposed]
    best = max(outcomes, key=standing)
    if not odds.FAULT <= best.gain < odds.PERFECT * part.possible.sum():
        return None
    moves = _moving(best.curves, best.sigma)
    if 0 < len(moves) < len(best.curves):
        best = max(best, outcome(moves), key=standing)
    if len(best.curves[0].size) > 1:  # its other end is known to a cell
        one = best.curves[0]
        other, at = (one.begin if one.end == located.sample else one.end), located.sample - here.start
        edge = here.start + other_end(part, located._replace(sample=at), other - here.start, 2 * seen.cell, True)
        ends = {"begin": min(located.sample, edge), "end": max(located.sample, edge)}
        if ends["end"] - ends["begin"] >= SHORTEST:
            sharper = outcome([curve.of(len(curve.size))._replace(**ends) for curve in best.curves])
            best = max(best, sharper, key=standing)
    nearly = sorted((each for each in outcomes if each.gain > best.gain - odds.OPEN), key=_gain)
    likeliest = {each.lies(located.sample, n): each for each in nearly}
    likeliest.pop(best.lies(located.sample, n), None)
    return best._replace(others=tuple(likeliest.values()))


def _moving(curves: Sequence[Curve], sigma: Sequence[float]) -> list[Curve]:
    """The curves, of no size, of those that are off at all."""
    return [c.of(len(c.size)) for c, s in zip(curves, sigma, strict=True) if abs(c.size[0]) > CERTAIN * s]


def _gain(found: Found) -> float:
    return found.gain
