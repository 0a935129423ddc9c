"""A log that was scanned for jumps, its parts weighed with curves, and the odds by which these are accepted."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ftproc.core import odds
from ftproc.core.editing.lasting import clock, scan
from ftproc.core.editing.lasting.curves import CLOCK, Curve
from ftproc.core.editing.lasting.proposals import CELLS, LONGEST, cell_of
from ftproc.core.editing.lasting.scan import Jump
from ftproc.core.editing.lasting.weighing import TAKEN_IN, Found, Scene, Weighed, weighed
from ftproc.core.filtering.smoother import RESIDUALS, smooth_log
from ftproc.core.identification.scales import scales_of
from ftproc.core.identification.stretches import runs_of
from ftproc.records import FloatArray

JUMPS = 5  # that are weighed in a log, by either set of weights
LEAST_GAIN, TOGETHER = 18.0, 0.03  # of a jump, in log-likelihood; of the largest: components that jump with it
LEAST_OFF = 10.0  # the same of a jump in a rejected run, by the noise alone
AROUND, MEMORIES = (150, 2000), 12.0  # samples on each side of what is weighed, and memories
OF_EACH = 30  # readings of each component on each side of what is weighed
SHORTEST_CELL = 2  # samples in a cell of a scan
REMEMBERED, SHORT = 2.5, 0.12  # samples that a filter remembers: with fewer, a long curve may as well be the target's
# motion, and this share of the log is the longest


class End(NamedTuple):
    """What a jump alone is. short: the likeliest short patch that begins or ends there, None if no fault is
    likelier. gain: in log-probability, of it, or of a patch that is rejected there, beyond that of a step, as an end of
    a long fault is one."""

    short: Found | None
    gain: float

    def odds(self, one_end: float) -> float:
        """In log-probability, to an end of a long fault. one_end: log-odds of such a fault that has it as an end."""
        return self.gain - one_end


class Scanned(NamedTuple):
    """A scene that was scanned for jumps; the samples on each side of what is weighed, those within which its jumps
    are known, the jumps, and the samples in a cell of a scan beside one. longest: share of the log that is off at most.
    left: jumps, of those that were looked at, which the process noise of the part around them leaves. runs: see
    `_runs`. ends: what jumps of channels before a sample are alone, of those that were looked at so, see `ends`."""

    scene: Scene
    around: int
    width: int
    jumps: list[Jump]
    cell: int
    longest: float
    left: list[Jump]
    runs: FloatArray
    ends: dict[tuple[tuple[tuple[int, int], ...], int], End]

    @property
    def samples(self) -> int:
        return len(self.scene.possible)

    def prior(self, curves: Sequence[Curve]) -> float:
        """Log-odds of there being such a fault, at one of the samples: seldom, or, if it is no longer than twice one
        of the rejected runs, as often as these are."""
        n, length = self.samples, curves[0].length
        stays = curves[0].begin == 0 or curves[0].end == n
        seldom = odds.FAULT - math.log(n) * (1 if stays else 2)
        like_it = self.runs[2 * self.runs >= length]
        if stays or not len(like_it):
            return seldom - math.log(3)
        return float(np.logaddexp(seldom, math.log((0.5 / like_it).sum() / n))) - math.log(3)

    def near(self, first: int, last: int) -> slice:
        """The samples that take part in weighing what lies between two, with some readings of each component on either
        side: a track that begins within a gap of one of them may be any."""
        begin, end = max(first - self.around, 0), min(last + self.around, self.samples)
        for possible in self.scene.possible.T:
            before, behind = np.flatnonzero(possible[:first])[-OF_EACH:], np.flatnonzero(possible[last:])[:OF_EACH]
            begin = min([begin, *before[:1].tolist()])
            end = max([end, *(last + 1 + behind[-1:]).tolist()])
        return slice(begin, end)


def scanned(scene: Scene) -> Scanned:
    """A scene with its jumps."""
    log = scene.log._replace(weight=scene.taken_in)
    memory = scales_of(log, scene.at_median.noise_variance).memory_samples(float(scene.at_median.jerk[0, 0]))
    width, around = max(int(memory / 2), SHORTEST_CELL), int(np.clip(MEMORIES * memory, *AROUND))
    starts, n, runs = scene.starts(log), len(scene.possible), _runs(scene)
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
        jumps = scan.jumps_between(between, edges, LEAST_GAIN, TOGETHER)
        return Scanned(scene, AROUND[1], width, jumps, cell, LONGEST, [], runs, {})
    found = []
    for each in (log, scene.log) if (log.weight != scene.log.weight).any() else (log,):
        smoothed = smooth_log(each, scene.at_median, scene.starts(each), RESIDUALS)
        sums = scan.sums(each, smoothed, scene.setting, len(scene.rates))
        found += scan.jumps(sums, LEAST_GAIN, JUMPS, 3 * width, TOGETHER)
    off = scene.residual / np.sqrt(scene.at_median.noise_variance)
    found += scan.beside_runs(scene.log.weight, scene.possible, off, LEAST_OFF)[:JUMPS]
    found += clock.gaps(scene.setting, JUMPS)
    longest = LONGEST if memory > REMEMBERED else SHORT
    return Scanned(scene, around, width, scan.distinct(found), width, longest, [], runs, {})


def _runs(scene: Scene) -> FloatArray:
    """(m,) samples from begin to end of each rejected run of each station."""
    found = list[int]()
    for (_, own), c in itertools.product(scene.stations(), range(CLOCK)):
        seen = own[scene.possible[own, c]]
        found += [seen[b - 1] + 1 - seen[a] for a, b in runs_of(scene.log.weight[seen, c] <= 0, TAKEN_IN)]
    return np.array(found, float)


def worth(scene: Scene) -> bool:
    """Whether there is work left for another weighing; one without is counted."""
    if scene.work is None or scene.work.left > 0:
        return True
    scene.work.passed += 1
    return False


def weighed_on(part: Scene, near: slice, curves: Sequence[Curve]) -> Weighed:
    """A part of a log with curves, whether nothing was rejected unjustly, or what they act on, or more."""
    own = [curve.within(near) for curve in curves]
    starts = {weight.tobytes(): weight for weight in (part.log.weight, part.taking_in(own), part.taken_in)}.values()
    if own and own[0].component == CLOCK:
        jumps = (clock.weighed_jump(part, weight, own[0]) for weight in starts)
        return max(jumps, key=lambda each: each.log_probability)
    return max((weighed(part, weight, own) for weight in starts), key=lambda each: each.log_probability)


def in_whole(found: Weighed, near: slice, n: int) -> tuple[Curve, ...]:
    """The curves of a part as those of the whole log of n samples; one that begins or ends with the part does
    so with the log."""
    length = near.stop - near.start
    return tuple(
        curve._replace(
            begin=curve.begin and curve.begin + near.start, end=n if curve.end == length else curve.end + near.start
        )
        for curve in found.curves
    )
