"""Where the decisions of a fused flight are reassessed: intervals in which readings are rejected for a while."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np

from ftproc.core.filtering.records import Observations
from ftproc.records import FloatArray

SHORTEST, SHORTEST_S, BRIDGED = 3, 1.0, 2  # readings, or s, of a run; readings between two rejected ones of it
TOGETHER_S, LONGEST_S = 1.0, 45.0  # seconds between runs of one interval, and of an interval
ACCEPTED, ACCEPTED_S = 48, 6.0  # readings and seconds between two runs of a component that may belong to one patch
MARGIN_MEMORIES, MARGIN_S, MARGIN_SAMPLES = 8.0, (2.0, 20.0), 60.0  # on each side, whose likelihood is compared
EDGE_S = 0.3  # by which a hypothesis reaches beyond the interval
OTHER_LEVEL = 2.0  # times the jerk level at which an interval was examined, before it is examined again
WORK, WORK_PER_SAMPLE = 250_000, 250  # samples that one search may smooth, and for each of the events

Channel = tuple[int, int]  # station, component


class Interval(NamedTuple):
    """Where readings are rejected: from, to (s), and the channels. together: more than one of them at a time."""

    first_s: float
    last_s: float
    channels: frozenset[Channel]
    together: bool = False

    def is_like(self, other: Interval) -> bool:
        """Whether it is the same interval; the clocks move it a little."""
        moved = max(abs(self.first_s - other.first_s), abs(self.last_s - other.last_s))
        return moved < EDGE_S and self.channels == other.channels


class Search:
    """The intervals that were examined; they are examined again once the typical level of the jerk is another.
    unexamined: those that no work was left for; work is counted in samples that are smoothed, so that a result does not
    depend on the machine."""

    def __init__(self, samples: int) -> None:
        self.tried: set[Interval] = set()
        self.unexamined: set[Interval] = set()
        self.work = WORK + WORK_PER_SAMPLE * samples
        self.level = math.inf

    def begin(self, level: float) -> None:
        """Reassess, at this jerk level, m^2/s^5."""
        if not self.level / OTHER_LEVEL < level < self.level * OTHER_LEVEL:
            self.level = level
            self.tried.clear()

    def take(self, interval: Interval) -> bool:
        """Whether an interval is yet to be examined, and work is left for it."""
        if any(interval.is_like(other) for other in self.tried):
            return False
        if self.work <= 0:
            self.unexamined.add(interval)
            return False
        self.tried.add(interval)
        return True


def find(log: Observations, possible: FloatArray) -> list[Interval]:
    """The intervals, in the order of time."""
    assert log.sites is not None
    found: list[Interval] = []
    for s, c in itertools.product(range(len(log.sites.range_m)), range(3)):
        rows = np.flatnonzero((log.sites.station == s) & (possible[:, c] > 0))
        if len(rows) == 0:
            continue
        rejected = np.flatnonzero(log.weight[rows, c] <= 0)
        runs = []
        for run in np.split(rejected, np.flatnonzero(np.diff(rejected) > BRIDGED + 1) + 1):
            if len(run) == 0:
                continue
            first, last = float(log.time_s[rows[run[0]]]), float(log.time_s[rows[run[-1]]])
            if len(run) >= SHORTEST or last - first > SHORTEST_S:
                runs.append((int(run[0]), int(run[-1]), first, last))
        found += _bridged(runs, frozenset([(s, c)]))
    merged: list[Interval] = []
    for interval in sorted(found):
        one = merged[-1] if merged else None
        if one and interval.first_s <= one.last_s + TOGETHER_S and interval.last_s - one.first_s < LONGEST_S:
            together = one.together or interval.first_s <= one.last_s
            merged[-1] = Interval(
                one.first_s, max(one.last_s, interval.last_s), one.channels | interval.channels, together
            )
        else:
            merged.append(interval)
    return merged


def _bridged(runs: list[tuple[int, int, float, float]], channel: frozenset[Channel]) -> list[Interval]:
    """The runs of a component, joined where few readings between two of them are accepted."""
    found: list[Interval] = []
    before = None
    for begin, end, first, last in runs:
        near = before is not None and begin - before <= ACCEPTED and first - found[-1].last_s <= ACCEPTED_S
        if near and last - found[-1].first_s < LONGEST_S:
            found[-1] = found[-1]._replace(last_s=last)
        else:
            found.append(Interval(first, last, channel))
        before = end
    return found


def margin_s(time_s: FloatArray, memory_s: float) -> float:
    """Seconds on each side of an interval that the comparison looks at. memory_s: of the filter."""
    wanted = float(np.clip(MARGIN_MEMORIES * memory_s, *MARGIN_S))
    return max(wanted, MARGIN_SAMPLES * float(np.median(np.diff(time_s))))
