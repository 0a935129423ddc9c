"""Patches that were followed: their readings pass for motion, but for some rejected where the track leaves and returns.

The jerk profile of a filter with a short memory follows a patch of any shape, and no jump is left by which it shows.
What shows are the rejected readings at either end. So what lies from one rejected run to a later one, of a component or
of several whose runs coincide, is weighed as a curve, of as many terms as explain it.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ftproc.core.editing.lasting.curves import CLOCK, Curve
from ftproc.core.editing.lasting.proposals import LONGEST
from ftproc.core.editing.lasting.scan import Jump
from ftproc.core.editing.lasting.weighing import TAKEN_IN, Scene
from ftproc.core.identification.stretches import runs_of
from ftproc.records import FloatArray

TERMS, PER_TERM = (5, 2, 8, 12, 22), 4  # of a curve, and samples for each at least
FROM_IT, MOST = 2, 6  # runs from the first to the last, and stretches that are weighed


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


def followed(scene: Scene, jumps: Sequence[Jump], within: int) -> list[list[Between]]:
    """Where a patch may have been followed, of one component or of several, in the log of one station: its jumps are
    known within so many samples."""
    found = list[tuple[int, Between]]()
    for c in range(CLOCK):
        seen = np.flatnonzero(scene.possible[:, c])
        runs = runs_of(scene.log.weight[seen, c] <= 0, TAKEN_IN).tolist()
        for (k, (a, b)), (m, (d, e)) in itertools.combinations(enumerate(runs), 2):
            if m - k <= FROM_IT and d - b >= max(b - a, e - d) and e - a <= LONGEST * len(seen):
                ends = int(seen[a]), int(seen[b]), int(seen[d]), int(seen[e - 1]) + 1
                found.append((m - k, Between(c, *ends)))
    single = [each for _, each in sorted(found) if each.jumps(jumps, within)][:MOST]
    together = [[each for each in single if each.coincides(one)] for one in single]
    several = {tuple(each): each for each in together if len(each) > 1}
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
