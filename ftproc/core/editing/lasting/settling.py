"""The log of a single station without its faults that last: they are sought and taken out, and the rest is decided on
again, until there are none."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.editing.decisions import Decision, Record
from ftproc.core.editing.lasting.faults import MOTION, Rival, Step, levelled, taken_out, unseen
from ftproc.core.editing.lasting.search import search
from ftproc.core.editing.lasting.sorting import sorted_out
from ftproc.core.editing.lasting.weighing import Scene, scene_of
from ftproc.core.editing.reassessment import log_probability
from ftproc.core.work import Work
from ftproc.records import FloatArray

STEP_MARGIN = 8.0  # in log-probability, by which steps must explain a log better than late stamps do
LOST = 100.0  # in log-probability, for each reading that is left out: ten go with the reading itself
LASTING_ROUNDS = 4  # of the search for faults that last: where one is taken out, another may show


class Understood(NamedTuple):
    """A log and the decisions on it without the faults that last: the steps that were taken out, the readings of
    patches (n, 3), the steps that are in doubt, what else may be nearly as likely, and where they were sought."""

    record: Record
    decision: Decision
    steps: tuple[Step, ...] = ()
    banned: NDArray[np.bool_] | None = None
    doubtful: Sequence[Step] = ()
    rivals: Sequence[Rival] = ()
    scene: Scene | None = None


def without_lasting(
    found: Understood, measurement: FloatArray, decided: Callable[..., tuple[Record, Decision]], work: Work
) -> Understood:
    """The log without the faults that last, decided again as long as there are some."""
    for _ in range(LASTING_ROUNDS):
        record, decision = found.record, found.decision
        if decision.model.coloured:  # which resembles many steps
            break
        scene = scene_of(record, decision, work)
        new = sorted_out(scene, search(scene))
        open_ = [each for each in new.rivals if each.chosen == MOTION]
        settled = [each for each in found.rivals if each.chosen != MOTION]
        found = found._replace(doubtful=new.doubtful, rivals=[*settled, *open_], scene=scene)
        if not new.steps and not new.banned.any():
            break
        steps, banned = (*found.steps, *new.steps), new.banned if found.banned is None else found.banned | new.banned
        log = record.weighted(decision.weight)
        moved = levelled(log, scene.at_median.noise_variance, steps)
        read = taken_out(log._replace(measurement=measurement), scene.at_median, scene.setting, moved)
        banned = banned | unseen(record.time_s, moved)[:, None]
        other = decided(read.measurement, banned=banned)
        if (new.steps and _may_be_late_stamps((record, decision), other)) or (
            new.banned.any() and _is_lost((record, decision), other, int(new.banned.sum()))
        ):
            break
        found = Understood(*other, steps, banned, new.doubtful, [*settled, *new.rivals], scene)
    return found


def _is_lost(before: tuple[Record, Decision], other: tuple[Record, Decision], without: int) -> bool:
    """Whether so many readings are missing that the track is lost in their gap: that makes the others unlikely."""
    return log_probability(*other) < log_probability(*before) - LOST * without


def _may_be_late_stamps(without: tuple[Record, Decision], levelled_log: tuple[Record, Decision]) -> bool:
    """Whether it may be late time stamps that resemble steps: they are left where the steps are taken out, or explain
    the log as well."""
    late = [decision.stamp_s > 0 for _, decision in (without, levelled_log)]
    if not any(late) or all(late):
        return all(late)
    record, decision = without
    possible = record.possible & levelled_log[0].possible  # of the same readings
    same = record._replace(possible=possible), decision._replace(weight=decision.weight * possible)
    return log_probability(*levelled_log) < log_probability(*same) + STEP_MARGIN
