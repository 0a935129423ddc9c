"""Patches that were followed: their readings pass for motion, but for those rejected where the track leaves and returns.

The jerk profile of a filter with a short memory follows a patch of any shape, and no jump is left by which it shows.
What shows are the rejected readings at either end. So what lies from one rejected run of a component to a later one is
weighed as a curve, of as many terms as explain it.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

from ftproc.core.editing.lasting.curves import CLOCK, Curve
from ftproc.core.editing.lasting.proposals import LONGEST
from ftproc.core.editing.lasting.weighing import TAKEN_IN, Scene
from ftproc.core.identification.stretches import runs_of

TERMS = (2, 5, 12, 22)
REACH, MOST = 2, 6  # runs from the first to the last, and pairs that are weighed
LEAST_BETWEEN = 10


def followed(scene: Scene) -> Iterator[list[Curve]]:
    """The curves, of each number of terms, that may lie between two rejected runs of a component of one station."""
    found = list[tuple[int, int, int, int]]()
    for c in range(CLOCK):
        seen = np.flatnonzero(scene.possible[:, c])
        runs = runs_of(scene.log.weight[seen, c] <= 0, TAKEN_IN)
        for (k, (a, b)), (m, (d, e)) in itertools.combinations(enumerate(runs.tolist()), 2):
            accepted = float(scene.log.weight[seen[b:d], c].sum())
            if m - k <= REACH and accepted >= max(LEAST_BETWEEN, b - a, e - d) and e - a <= LONGEST * len(seen):
                found.append((m - k, c, int(seen[a]), int(seen[e - 1]) + 1))
    for _, c, begin, end in sorted(found)[:MOST]:
        yield [Curve(c, begin, end, (0.0,) * terms) for terms in TERMS if 4 * terms <= end - begin]
