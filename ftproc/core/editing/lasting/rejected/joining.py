"""The rejected runs of a log, and whether they join the track: at both ends, as motion does, or at one, as where the
track comes back from a patch that it has followed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ftproc.core.editing.decisions import Decision, Record
from ftproc.core.identification.nearby import residuals_near
from ftproc.core.identification.stretches import runs_of
from ftproc.records import FloatArray, IntArray

PAIR, MOST_BY_CHANCE = 2, 3.0  # readings in a run beside which a patch may have been followed, and such pairs of a
# component that isolated outliers make by chance at most
SHORTEST, ENDS = 4, 5  # readings in one that may be anything else, and at its ends, of which the second nearest must be
# such a residual at most, in units of its 1-sigma; and of one that is an outlier in any case:
JOINED, FAR = 12.0, 25.0
SAME_SIDE = 0.7  # share of them that are on the side of the track where the one before is: noise changes sides
LENGTHS = (13, 40)  # samples beside a run that may belong to a patch


class Run(NamedTuple):
    """A rejected run of a component: the samples (m,) of its readings, and those of them (m,) that may be motion, of
    which there are none where it does not join the track at both ends. joins: whether it does at one. beside: runs of
    other components at the same time, which are the same motion."""

    component: int
    samples: IntArray
    motion: IntArray
    joins: bool
    beside: tuple[Run, ...] = ()

    @property
    def key(self) -> tuple[int, int, bytes]:
        """What distinguishes it from others."""
        return self.component, len(self.beside), self.samples.tobytes()

    def near(self, around: int) -> slice:
        """The samples that are weighed."""
        reach = LENGTHS[-1] + around
        return slice(max(int(self.samples[0]) - reach, 0), int(self.samples[-1]) + 1 + reach)

    def moves(self, before: FloatArray, after: FloatArray, offset: int) -> bool:
        """Whether other decisions (n, 3) take it for motion: they take it in, and reject nothing for it."""
        taken_in = [after[each.motion - offset, each.component] for each in (self, *self.beside)]
        return all(len(each) > 0 and each.mean() > 0.5 for each in taken_in) and bool((after >= before).all())

    def around(self, offset: int) -> slice:
        """The samples that are decided on, counted from one."""
        near = self.near(0)
        return slice(max(near.start - offset, 0), near.stop - offset)


def rejected_runs(record: Record, decision: Decision, around: int) -> Iterator[Run]:
    """The rejected runs of a log, those of several components together first."""
    found, marked = list[tuple[int, IntArray, tuple[bool, bool]]](), np.zeros(len(record.time_s), bool)
    for c in range(3):
        seen = np.flatnonzero(record.possible[:, c])
        runs = runs_of(decision.weight[seen, c] <= 0)
        lengths = runs[:, 1] - runs[:, 0]
        by_chance = (lengths == 1).sum() ** 2 > MOST_BY_CHANCE * len(seen)
        runs = runs[lengths >= (SHORTEST if by_chance else PAIR)]
        found += [(c, seen[begin:end], (begin == 0, end == len(seen))) for begin, end in runs]
    for _, inside, _ in found:
        marked[inside] = True
    residual, variance = residuals_near(record.weighted(decision.weight), decision.model, marked, around)
    alone = list[Run]()
    for c, inside, open_ends in found:
        away = residual[inside, c] / np.sqrt(variance[inside, c])
        edges = [edge for edge, is_open in zip((away[:ENDS], away[-ENDS:]), open_ends, strict=True) if not is_open]
        nearest = [float(np.sort(np.abs(edge))[1]) for edge in edges]
        joined = len(edges) > 0 and max(nearest) < JOINED
        near = (np.abs(away) < FAR) | any(open_ends)
        above = away[near] > 0
        same = (above[1:] == above[:-1]).sum() >= SAME_SIDE * (len(above) - 1)
        motion = joined and same and len(inside) >= SHORTEST
        alone.append(Run(c, inside, inside[near] if motion else inside[:0], min(nearest, default=0.0) < JOINED))
    yield from _together(alone)
    yield from (run for run in alone if run.joins or len(run.samples) >= SHORTEST)


def _together(alone: list[Run]) -> Iterator[Run]:
    """Runs that may be motion of one component with those of others that are rejected at about the same time."""
    may_move = [run for run in alone if len(run.motion)]
    for run in may_move:
        beside = tuple(each for each in may_move if each.component > run.component and _same_time(run, each))
        if beside and len({each.component for each in beside}) == len(beside):
            yield run._replace(beside=beside)


def _same_time(one: Run, other: Run) -> bool:
    """Whether two runs are rejected together for more than half of the time of both."""
    begins, ends = (one.samples[0], other.samples[0]), (one.samples[-1], other.samples[-1])
    return bool(2 * (min(ends) - max(begins)) > max(ends) - min(begins))
