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
from typing import NamedTuple

import numpy as np

from ftproc.core.editing.lasting import between, clock, scan
from ftproc.core.editing.lasting.between import TERMS, of_terms
from ftproc.core.editing.lasting.curves import CLOCK, Curve
from ftproc.core.editing.lasting.proposals import (
    CELLS,
    LONGEST,
    SHORTEST,
    LocatedJump,
    cell_of,
    exactly,
    other_end,
    proposals,
    steps,
)
from ftproc.core.editing.lasting.scan import Jump
from ftproc.core.editing.lasting.screen import leaves_a_jump
from ftproc.core.editing.lasting.shapes import of_any_shape, of_few_terms
from ftproc.core.editing.lasting.weighing import Found, Scene, Weighed, as_it_is, weighed
from ftproc.core.filtering.smoother import RESIDUALS, smooth_log
from ftproc.core.identification.profile import median_level
from ftproc.core.identification.scales import scales_of
from ftproc.core.work import for_lasting_faults

ROUNDS, JUMPS = 8, 5  # over a log, and jumps that are weighed in one, by either set of weights
LEAST_GAIN, TOGETHER = 18.0, 0.03  # of a jump, in log-likelihood; of the largest: components that jump with it
LEAST_OFF = 10.0  # the same of a jump in a rejected run, by the noise alone
CERTAIN = 4.0  # sigmas of its size from which a component takes part in a step of several
AROUND, MEMORIES = (150, 2000), 12.0  # samples on each side of what is weighed, and memories
SHORTEST_CELL = 2  # samples in a cell of a scan
REMEMBERED, SHORT = 2.5, 0.12  # samples that a filter remembers: with fewer, a long curve may as well be the target's
# motion, and this share of the log is the longest
PRIOR, DOUBT, MARGIN = -6.0, -6.0, 8.0  # log-odds of such a fault at a jump; with which it is reported, and taken out
OPEN = 10.0  # in log-probability, within which a jump may be one or another: beside agile targets it tells little
MOST_EACH = 20.0  # of log-probability, of each reading: where more is gained, the part without the fault was lost
FOLLOWED = 25.0  # the same of a patch that motion explains but for its ends: turns gain 18 without one


class Scanned(NamedTuple):
    """A scene that was scanned for jumps; the samples on each side of what is weighed, those within which its jumps
    are known, the jumps, and the samples in a cell of a scan beside one."""

    scene: Scene
    around: int
    width: int
    jumps: list[Jump]
    cell: int
    longest: float = LONGEST

    @property
    def samples(self) -> int:
        return len(self.scene.possible)

    def near(self, first: int, last: int) -> slice:
        """The samples that take part in weighing what lies between two."""
        return slice(max(first - self.around, 0), min(last + self.around, self.samples))


def search(scene: Scene) -> list[Found]:
    """The faults that last in the log of one or several stations whose outliers were decided as if it had none. A patch
    that was followed replaces those beside it only if it explains more: what lies between two patches seems one."""
    found, rejected = list[Found](), list[Jump]()
    seen = scanned(scene)
    followed = _followed(seen)
    for _ in range(ROUNDS):
        best = _likeliest(seen, rejected)
        if best is None or any(best.curves[0][:3] == each.curves[0][:3] for each in found):
            break
        found.append(best)
        if best.curves[0].component == CLOCK:  # along which track its readings move, another search knows
            break
        seen = scanned(scene.without([curve for each in found for curve in each.curves]))
    beside = [each for each in found if followed is not None and each.adjoins(followed)]
    if followed is not None and followed.gain > sum(each.gain for each in beside):
        found = [followed, *(each for each in found if each not in beside)]
    return found


def scanned(scene: Scene) -> Scanned:
    """A scene with its jumps."""
    log = scene.log._replace(weight=scene.taken_in)
    memory = scales_of(log, scene.at_median.noise_variance).memory_samples(float(scene.at_median.jerk[0, 0]))
    width, around = max(int(memory / 2), SHORTEST_CELL), int(np.clip(MEMORIES * memory, *AROUND))
    starts, n = scene.starts(log), len(scene.possible)
    if len(scene.rates) > 1:
        width, cell = max(width, n // CELLS), cell_of(width, n)
        edges, channels = scan.spread([], width, n), list(np.ndindex(len(scene.rates), CLOCK + 1))
        gain = [
            scan.steps_of(
                scene.log._replace(weight=scene.taking_in([Curve(c, 0, n, (), s)])),
                scene.at_median,
                starts,
                scene.setting,
                (c, s),
                edges,
            )
            for s, c in channels
        ]
        between = np.stack(gain).reshape(len(scene.rates), CLOCK + 1, -1)
        return Scanned(scene, AROUND[1], width, scan.jumps_between(between, edges, LEAST_GAIN, TOGETHER), cell)
    found = list[Jump]()
    for each in (log, scene.log) if (log.weight != scene.log.weight).any() else (log,):
        smoothed = smooth_log(each, scene.at_median, scene.starts(each), RESIDUALS)
        sums = scan.sums(each, smoothed, scene.setting, len(scene.rates))
        found += scan.jumps(sums, LEAST_GAIN, JUMPS, 3 * width, TOGETHER)
    off = scene.residual / np.sqrt(scene.at_median.noise_variance)
    found += scan.beside_runs(scene.log.weight, scene.possible, off, LEAST_OFF)[:JUMPS]
    found += clock.gaps(scene.setting, JUMPS)
    longest = LONGEST if memory > REMEMBERED else SHORT
    return Scanned(scene, around, width, scan.distinct(found), width, longest)


def _likeliest(seen: Scanned, rejected: list[Jump]) -> Found | None:
    """What the largest jump is that is no motion; those that are motion are added to the rejected. Where one station
    jumps, others seem to: the likeliest of all of them at a sample counts."""
    for jump in seen.jumps:
        if any(abs(jump.sample - old.sample) < seen.width and jump.station == old.station for old in rejected):
            continue
        if not _worth(seen.scene):
            return None
        here = [each for each in seen.jumps if abs(each.sample - jump.sample) <= seen.width]
        found = [each for each in (_tried(seen, each) for each in here) if each is not None]
        if found:
            return max(found, key=lambda each: each.gain)
        rejected += here
    return None


def _worth(scene: Scene) -> bool:
    """Whether there is work left for another weighing; one without is counted."""
    if scene.work is None or scene.work.left > 0:
        return True
    scene.work.passed += 1
    return False


def _followed(seen: Scanned) -> Found | None:
    """The likeliest patch between two rejected runs of one station, if it is likelier than the runs as two patches."""
    if len(seen.scene.rates) > 1:
        return None
    found, n, work = list[Found](), seen.samples, for_lasting_faults(seen.samples)  # so that enough is left for jumps
    scene = seen.scene._replace(work=work)
    for stretches in between.followed(scene, seen.jumps, seen.width):
        if not _worth(scene):
            break
        near = seen.near(min(each.begin for each in stretches), max(each.end for each in stretches))
        part, at_jumps = scene.part(near), [each.at_jumps(seen.jumps) for each in stretches]
        with contextlib.suppress(ValueError, np.linalg.LinAlgError):
            ends = [[curve.within(near) for curve in of_terms(each, TERMS[0])] for each in (stretches, at_jumps)]
            first = of_few_terms(part, ends, FOLLOWED, _prior(ends[0], n))
            if first is None:
                continue
            runs = [curve for each in stretches for curve in each.runs()]
            null = max(_weighed(part, near, curves).log_probability for curves in ((), runs))
            best = of_any_shape(part, first)
            best = max(
                best, _weighed(part, slice(0, len(part.possible)), best.curves), key=lambda each: each.log_probability
            )
            gain = best.log_probability - null + _prior(best.curves, n)
            found.append(Found(_in_whole(best, near, n), best.sigma, gain))
    return max((each for each in found if each.gain > FOLLOWED), key=lambda each: each.gain, default=None)


def _tried(seen: Scanned, jump: Jump) -> Found | None:
    """What happened at a jump; None if it is motion, or there are too few readings to tell."""
    with contextlib.suppress(ValueError, np.linalg.LinAlgError):
        return _at(seen, jump)
    return None


def _at(seen: Scanned, jump: Jump) -> Found | None:
    """What happened at a jump; None if it is motion."""
    n, near = seen.samples, seen.near(jump.sample, jump.sample)
    part = seen.scene.part(near)
    around = jump.sample - near.start, seen.width
    # What was rejected of one station, others may show to be right.
    screened = len(part.rates) == 1 or bool((part.taken_in == part.log.weight).all())
    if screened and not leaves_a_jump(part, jump, around, as_it_is(part, part.log.weight, part.at_median)):
        return None
    without = weighed(part, part.log.weight, ())
    if screened and not leaves_a_jump(part, jump, around, without):
        return None
    null = max(each.log_probability for each in (without, weighed(part, part.taken_in, ())))
    gain, located, step = max((_as_step(seen, jump, way, null) for way in jump.ways), key=lambda each: each[0])
    moves = [c.component for c, s in zip(step.curves, step.sigma, strict=True) if abs(c.size[0]) > CERTAIN * s]
    if 0 < len(moves) < len(step.curves):
        gain, located, step = max((gain, located, step), _as_step(seen, jump, moves, null), key=lambda each: each[0])
    if not DOUBT <= gain < MOST_EACH * seen.scene.possible[near].sum() or not 0 < located.sample < n:
        return None
    if located.channels[0][0] == CLOCK:
        return Found(_in_whole(step, near, n), step.sigma, gain)
    proposed = list(proposals(seen.scene, located._replace(width=seen.cell, at_median=median_level(step.model))))
    if (CLOCK,) in jump.ways and len(part.rates) == 1:  # by the same part of the log
        proposed.append([Curve(CLOCK, located.sample, n, (0.0,), jump.station)])
    ends = [edge for curves in proposed for edge in (curves[0].begin, curves[0].end) if 0 < edge < n]
    return _best(seen, proposed, seen.near(min(ends), max(ends)), located)


def _as_step(seen: Scanned, jump: Jump, way: Sequence[int], null: float) -> tuple[float, LocatedJump, Weighed]:
    """A jump as a step of some components, or of the clock: its gain, where it is, and the log around it. null:
    log-probability without it."""
    n, near = seen.samples, seen.near(jump.sample, jump.sample)
    part, channels = seen.scene.part(near), [(c, jump.station) for c in way]
    there = LocatedJump(
        channels, jump.sample - near.start, [each.sample for each in seen.jumps], seen.width, part.at_median
    )
    sample = jump.sample if tuple(way) == (CLOCK,) else near.start + exactly(part, there)
    located = there._replace(sample=sample, longest=seen.longest)
    sides = steps(seen.scene, channels, located.sample)
    step = max((_weighed(part, near, side) for side in sides), key=lambda each: each.log_probability)
    return step.log_probability - null + _prior(sides[0], n), located, step


def _best(seen: Scanned, proposed: Sequence[Sequence[Curve]], here: slice, located: LocatedJump) -> Found | None:
    """The likeliest of what was proposed, all weighed on the same part of the log."""
    part, n = seen.scene.part(here), seen.samples
    null = _weighed(part, here, ()).log_probability

    def outcome(curves: Sequence[Curve]) -> Found:
        found = _weighed(part, here, curves)
        gain = found.log_probability - null + _prior(curves, n)
        return Found(_in_whole(found, here, n), found.sigma, gain)

    outcomes = [outcome(curves) for curves in proposed]
    best = max(outcomes, key=_gain)
    if not DOUBT <= best.gain < MOST_EACH * part.possible.sum():
        return None
    if len(best.curves[0].size) > 1:  # its other end is known to a cell
        one = best.curves[0]
        other, at = (one.begin if one.end == located.sample else one.end), located.sample - here.start
        edge = here.start + other_end(part, located._replace(sample=at), other - here.start, 2 * seen.cell, True)
        ends = {"begin": min(located.sample, edge), "end": max(located.sample, edge)}
        if ends["end"] - ends["begin"] >= SHORTEST:
            sharper = outcome([curve.of(len(curve.size))._replace(**ends) for curve in best.curves])
            best = max(best, sharper, key=_gain)
    nearly = sorted((each for each in outcomes if each.gain > best.gain - OPEN), key=_gain)
    likeliest = {each.lies(located.sample, n): each for each in nearly}
    likeliest.pop(best.lies(located.sample, n), None)
    return best._replace(others=tuple(likeliest.values()))


def _gain(found: Found) -> float:
    return found.gain


def _weighed(part: Scene, near: slice, curves: Sequence[Curve]) -> Weighed:
    """A part of a log with curves, whether nothing was rejected unjustly, or what they act on, or more."""
    own = [curve.within(near) for curve in curves]
    starts = {weight.tobytes(): weight for weight in (part.log.weight, part.taking_in(own), part.taken_in)}.values()
    if own and own[0].component == CLOCK:
        jumps = (clock.weighed_jump(part, weight, own[0]) for weight in starts)
        return max(jumps, key=lambda each: each.log_probability)
    return max((weighed(part, weight, own) for weight in starts), key=lambda each: each.log_probability)


def _in_whole(found: Weighed, near: slice, n: int) -> tuple[Curve, ...]:
    """The curves of a part as those of the whole log of n samples; one that begins or ends with the part does
    so with the log."""
    length = near.stop - near.start
    return tuple(
        curve._replace(
            begin=curve.begin and curve.begin + near.start, end=n if curve.end == length else curve.end + near.start
        )
        for curve in found.curves
    )


def _prior(curves: Sequence[Curve], n: int) -> float:
    """Log-odds of there being such a fault, at one of n samples."""
    ends = 1 if curves[0].begin == 0 or curves[0].end == n else 2
    return PRIOR - math.log(3) - ends * math.log(n)
