"""Patches that were followed: their readings pass for motion, but for some rejected where the track leaves and returns.

The jerk profile of a filter with a short memory follows a patch of any shape, and no jump is left by which it shows, or
the step that is left explains little. What shows are the rejected readings at either end, or jumps. So what lies from
one rejected run, or jump, to a later one, of a component or of several whose runs coincide, is weighed as a curve, of
as many terms as explain it.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core import odds
from ftproc.core.editing.lasting.curves import CLOCK, Curve
from ftproc.core.editing.lasting.proposals import LONGEST
from ftproc.core.editing.lasting.scan import Jump
from ftproc.core.editing.lasting.scanned import Scanned, in_whole, weighed_on, worth
from ftproc.core.editing.lasting.screen import ELEVATED, leaves_curves, may_leave_curves, others_as_usual
from ftproc.core.editing.lasting.waves import is_of_the_target, likeliest_wave, moved, sharper_wave
from ftproc.core.editing.lasting.weighing import TAKEN_IN, Found, Scene, Weighed, as_it_is, weighed
from ftproc.core.identification.profile import pieces
from ftproc.core.identification.stretches import runs_of
from ftproc.records import FloatArray

TERMS, PER_TERM = (5, 2, 8, 12, 22, 48), 4  # of a curve, and samples for each at least
SCREENED = 22  # of a curve that a screen looks for
FEW, MANY, WAVE = range(3)  # terms of curves, or one rate, that are sought where a patch may have been followed
SHARPENED = 2  # times that a wave is sought again by what was found
TRIMMED = 2  # times that the ends of a patch are brought to where its readings fit it
FROM_IT, MOST = 2, 6  # runs from the first to the last, and stretches that are weighed
OF_EITHER = 2  # of those that leave nothing where they begin and end: from jump to jump, and by the process noise


class Between(NamedTuple):
    """The samples [begin, end) of a component from one rejected run to another; low, high: the samples between them."""

    component: int
    begin: int
    low: int
    high: int
    end: int

    def at_jumps(self, jumps: Sequence[Jump]) -> Between:
        """From the largest jump of the component in the first run to the largest in the last, where there are any."""
        own = [jump for jump in jumps if any(self.component in way for way in jump.ways)]  # the largest first
        begin = next((jump.sample for jump in own if self.begin <= jump.sample <= self.low), self.begin)
        end = next((jump.sample for jump in own if self.high <= jump.sample <= self.end), self.end)
        return self._replace(begin=begin, end=end)

    def is_longest(self, jumps: Sequence[Jump]) -> bool:
        """Whether what lies between the runs, or the largest jumps in them, is longer than what lies beyond."""
        sharp = self.at_jumps(jumps)
        begin = self.low if sharp.begin == self.begin else sharp.begin
        end = self.high if sharp.end == self.end else sharp.end
        return end - begin >= max(begin - self.begin, self.end - end)

    def runs(self) -> list[Curve]:
        """The rejected runs, each as a patch of its own."""
        return [
            Curve(self.component, begin, end, (0.0,) * min(TERMS[0], max((end - begin) // PER_TERM, 1)))
            for begin, end in ((self.begin, self.low), (self.high, self.end))
        ]

    def jumps(self, jumps: Sequence[Jump], within: int) -> bool:
        """Whether the component jumps in one of the runs, or beside it."""
        return any(
            low - within <= jump.sample <= high + within and any(self.component in way for way in jump.ways)
            for jump in jumps
            for low, high in ((self.begin, self.low), (self.high, self.end))
        )

    def coincides(self, other: Between) -> bool:
        """Whether the runs at both ends overlap."""
        firsts, lasts = max(self.begin, other.begin), max(self.high, other.high)
        return firsts <= min(self.low, other.low) and lasts <= min(self.end, other.end)


def followed(seen: Scanned) -> list[list[Between]]:
    """Where a patch may have been followed, of one component or of several, in the log of one station."""
    forgets = seen.longest < LONGEST  # each jump beside those of its motion
    at_jumps = [] if forgets else between_jumps(seen.jumps, seen.left, seen.width, seen.scene.possible)
    found = together([*between_runs(seen.scene, seen.jumps, seen.width), *at_jumps])
    likely = [*at_jumps[:1], *(each[0] for each in found if len(each) == CLOCK - 1)]
    return [*found, *([each._replace(component=c) for c in range(CLOCK)] for each in likely)]  # another target


def agile(seen: Scanned) -> list[list[Between]]:
    """Where a patch that goes to and fro may have been followed that leaves nothing where it begins and ends."""
    at_jumps = between_jumps(seen.jumps, seen.left, seen.width, seen.scene.possible, wanted=False)
    return [[each] for each in (*at_jumps[:OF_EITHER], *between_knots(seen.scene))]


def swinging(seen: Scanned) -> list[list[Between]]:
    """Where a wave of which less shows may have been followed: from one such stretch to another, and in both angles of
    a mount that has just locked on."""
    alone, pairs = between_knots(seen.scene), between_knots(seen.scene, 2)
    azimuths = (each for each in (*alone, *pairs) if each.component == 1 and each.begin == 0)
    return [*([each] for each in pairs), *([each, each._replace(component=2)] for each in azimuths)]


def between_runs(scene: Scene, jumps: Sequence[Jump], within: int) -> list[Between]:
    """The stretches of a component from one rejected run to another, at one of which it jumps; the shortest first."""
    found = list[tuple[int, Between]]()
    for c in range(CLOCK):
        seen = np.flatnonzero(scene.possible[:, c])
        runs = runs_of(scene.log.weight[seen, c] <= 0, TAKEN_IN).tolist()
        for (k, (a, b)), (m, (d, e)) in itertools.combinations(enumerate(runs), 2):
            if m - k <= FROM_IT and e - a <= LONGEST * len(seen):
                found.append((m - k, Between(c, int(seen[a]), int(seen[b]), int(seen[d]), int(seen[e - 1]) + 1)))
    return [each for _, each in sorted(found) if each.is_longest(jumps) and each.jumps(jumps, within)][:MOST]


def between_jumps(
    jumps: Sequence[Jump], left: Sequence[Jump], within: int, possible: NDArray[np.bool_], wanted: bool = True
) -> list[Between]:
    """The stretches from one jump of a component to another; those of the largest jumps first. At one of their ends
    motion leaves a jump, or at none, as wanted, and they have no gap. possible (n, 3): readings that may be good."""
    found, n = list[tuple[float, Between]](), len(possible)
    for c in range(CLOCK):
        own = [jump for jump in jumps if any(c in way for way in jump.ways)]
        ends = [(jump.gain, max(jump.sample - within, 0), min(jump.sample + within, n)) for jump in own]
        for (one, a, b), (other, d, e) in itertools.permutations(ends, 2):
            leaves = any(low <= jump.sample <= high for low, high in ((a, b), (d, e)) for jump in left)
            fits = PER_TERM * TERMS[0] + b <= d and e - a <= LONGEST * n
            if leaves == wanted and a < d and fits and not _has_a_gap(possible[a:e, c]):
                found.append((min(one, other), Between(c, a, b, d, e)))
    return [each for _, each in sorted(found, key=lambda of: -of[0])][:MOST]


def between_knots(scene: Scene, runs: int = 1) -> list[Between]:
    """The stretches in which the process noise is far above what is usual, or from one to another of two runs of such
    stretches, of each component; those where it is most first."""
    own, n, found = scene.own, len(scene.possible), list[tuple[float, Between]]()
    if own is None or scene.fixed:
        return []
    above, knot = own.jerk[:, 0] / scene.at_median.jerk[0, 0], pieces(scene.log.time_s, own)
    elevated = runs_of(above > ELEVATED).tolist()
    for from_to in itertools.combinations(elevated, runs):
        a, b = from_to[0][0], from_to[-1][1]
        begin, end = np.searchsorted(knot, (a, b)).tolist()
        width = (end - begin) // (b - a)
        if PER_TERM * TERMS[0] <= end - begin <= LONGEST * n:
            stretches = (Between(c, begin, begin + width, end - width, end) for c in range(CLOCK))
            whole = (each for each in stretches if not _has_a_gap(scene.possible[begin:end, each.component]))
            found += [(float(above[a:b].max()), each) for each in whole]
    return [each for _, each in sorted(found, key=lambda of: -of[0])][: CLOCK * OF_EITHER]


def _has_a_gap(possible: NDArray[np.bool_]) -> bool:
    """Whether so many readings (m,) are missing in a row as a curve needs at least."""
    return len(runs_of(~possible, PER_TERM * TERMS[0])) > 0


def together(single: Sequence[Between]) -> list[list[Between]]:
    """The stretches, each alone, and those of several components that coincide."""
    beside = [{each.component: each for each in (*single, one) if each.coincides(one)} for one in single]
    several = {tuple(sorted(each.values())): sorted(each.values()) for each in beside if len(each) > 1}
    return [*([each] for each in single), *several.values()]


def of_terms(stretches: Sequence[Between], terms: int) -> list[Curve]:
    """The curves of stretches, each with so many terms."""
    return [Curve(each.component, each.begin, each.end, (0.0,) * terms) for each in stretches]


def trimmed(curves: Sequence[Curve], weight: FloatArray) -> list[Curve]:
    """Curves from the first to the last of their readings that are used, by weights (n, 3)."""
    used = [np.flatnonzero(weight[curve.rows, curve.component] > 0) for curve in curves]
    return [
        curve.of(len(curve.size))._replace(begin=curve.begin + int(at[0]), end=curve.begin + int(at[-1]) + 1)
        if len(at)
        else curve
        for curve, at in zip(curves, used, strict=True)
    ]


def likeliest_followed(seen: Scanned) -> Found | None:
    """The likeliest patch between two rejected runs, or jumps, of one station, if it is likelier than these alone."""
    if len(seen.scene.rates) > 1:
        return None
    found, n, work = list[Found](), seen.samples, seen.scene.work
    scene, tried = seen.scene._replace(work=work and work.apart), list[tuple[list[list[Curve]], int]]()

    @functools.cache
    def without(begin: int, end: int, taken_in: bool) -> Weighed:
        part = scene.part(slice(begin, end))
        return weighed(part, part.taken_in if taken_in else part.log.weight, ())

    ways = (FEW, followed(seen)), (MANY, agile(seen)), (WAVE, swinging(seen))
    for way, stretches in ((way, each) for way, several in ways for each in several):
        if not worth(scene):
            break
        near = seen.near(min(each.begin for each in stretches), max(each.end for each in stretches))
        part, at_jumps = scene.stretch(near), [each.at_jumps(seen.jumps) for each in stretches]
        ends = [[curve.within(near) for curve in of_terms(each, TERMS[0])] for each in (stretches, at_jumps)]
        if (ends, way) in tried:
            continue
        tried.append((ends, way))
        with contextlib.suppress(ValueError, np.linalg.LinAlgError):
            span, least = (near.start, near.stop), odds.ONE_END if way == FEW else odds.SURE
            usual = partial(without, *span, False)
            if way == FEW:
                first = of_few_terms(part, ends, least, seen.prior(ends[0]), usual)
            else:
                first = (of_many_terms if way == MANY else of_an_instrument)(part, ends[0], usual)
            if first is None or first.curves[0].length > LONGEST * n:
                continue
            runs = [curve for each in stretches for curve in each.runs()]
            null = max(usual(), without(*span, True), weighed_on(part, near, runs), key=_likelihood)
            best = first if first.curves[0].wave is not None else of_any_shape(part, first)
            best = max(best, weighed_on(part, slice(0, len(part.possible)), best.curves), key=_likelihood)
            motion = max(null.log_probability, moved(part, best))
            if way != FEW:  # motion may be as agile
                motion = max(motion, as_it_is(part, part.log.weight, best.model).log_probability)
            gain = best.log_probability - motion + seen.prior(best.curves)
            if least < gain < odds.PERFECT * part.possible.sum():
                found.append(Found(in_whole(best, near, n), best.sigma, gain))
    return max(found, key=lambda each: each.gain, default=None)


def of_few_terms(
    part: Scene, ends: Sequence[Sequence[Curve]], least: float, prior: float, without: Callable[[], Weighed]
) -> Weighed | None:
    """The likeliest of curves of a few terms with these ends; None if those with the last ends explain the part of a
    log no better than motion does, and most terms too little for a gain of so much with this prior: motion that does
    not follow the patch leaves more to them. without: weighs the part without any."""
    few, most = ends[-1], [curve.of(SCREENED) for curve in ends[-1]]
    if not may_leave_curves(part, few, most, least - prior):
        return None
    first = weighed(part, part.log.weight, few)
    if first.log_probability > without().log_probability or leaves_curves(part, most, least, without()):
        return _likeliest(part, ends[:-1], first)
    return None


def of_many_terms(part: Scene, curves: Sequence[Curve], without: Callable[[], Weighed]) -> Weighed | None:
    """The likelier of a wave about these ends, and of curves of as many terms as they may have; None if motion is
    likelier than either, as a wave of the target may be."""
    wave, many = of_a_wave(part, curves), others_as_usual(part, curves)
    if wave is None and not many:
        return None
    found, least = None, without().log_probability
    if wave is not None and is_of_the_target(part, wave):
        least = max(least, wave.log_probability + odds.SURE)
    elif wave is not None and wave.log_probability > least:
        found = wave
    if not many:  # what the curves do not act on asks for the process noise as well
        return found
    shortest = min(curve.end - curve.begin for curve in curves)
    terms = max(each for each in TERMS if PER_TERM * each <= shortest)
    most = weighed(part, part.log.weight, [curve.of(terms) for curve in curves])
    if most.log_probability <= least:
        return found
    return most if found is None else max(most, found, key=_likelihood)


def of_an_instrument(part: Scene, curves: Sequence[Curve], without: Callable[[], Weighed]) -> Weighed | None:
    """The likeliest wave about these ends; None if there is none, or motion is likelier, or it is the target's."""
    wave = of_a_wave(part, curves)
    if wave is None or wave.log_probability <= without().log_probability or is_of_the_target(part, wave):
        return None
    return wave


def of_a_wave(part: Scene, curves: Sequence[Curve]) -> Weighed | None:
    """The likeliest wave about these ends, of whatever; None if there is none."""
    wave = likeliest_wave(part, curves)
    if wave is None:
        return None
    found = weighed(part, part.log.weight, wave)
    for _ in range(SHARPENED):
        found = _likeliest(part, [sharper_wave(part, found)], found)
    return found


def of_any_shape(part: Scene, best: Weighed) -> Weighed:
    """The likeliest curves of any number of terms, first with these ends, then with those that their readings show."""
    most = min(curve.end - curve.begin for curve in best.curves) // PER_TERM
    best = _likeliest(part, ([curve.of(terms) for curve in best.curves] for terms in TERMS[1:] if terms <= most), best)
    for _ in range(TRIMMED):
        best = _likeliest(part, [trimmed(best.curves, best.weight)], best)
    return best


def _likeliest(part: Scene, of: Iterable[Sequence[Curve]], *others: Weighed) -> Weighed:
    tried = (weighed(part, part.log.weight, curves) for curves in of)
    return max((*others, *tried), key=_likelihood)


def _likelihood(of: Weighed) -> float:
    return of.log_probability
