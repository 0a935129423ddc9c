"""What follows from the faults of a single station that last: readings of patches are not used, steps are taken out,
steps that may be an end of a weak patch are left, and the rest is decided on again, until there are none."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core import odds
from ftproc.core.editing.decisions import Decision, Record
from ftproc.core.editing.lasting.curves import CLOCK, Curve
from ftproc.core.editing.lasting.faults import MOTION, PATCH, STEP, Rival, Step, levelled, taken_out, unseen
from ftproc.core.editing.lasting.proposals import near_end
from ftproc.core.editing.lasting.search import search
from ftproc.core.editing.lasting.weighing import Found, Scene, scene_of
from ftproc.core.editing.reassessment import log_probability
from ftproc.core.identification.profile import median_level
from ftproc.core.identification.stretches import runs_of
from ftproc.core.work import Work
from ftproc.order_statistics import median
from ftproc.records import FloatArray

HALTS_MPS2 = 30.0  # acceleration with which things stand still and go on
BEFORE, SEEN = 12, 0.25  # samples before a step, and share of them that may be good
SURE = 7.0  # sigmas of the noise: a smaller step may be an end of a weak patch
AGILE = 4.0  # times the process noise: where what is left asks for more, and for too many readings, the track is lost
LASTING_ROUNDS = 4  # of the search for faults that last: where one is taken out, another may show


class Understood(NamedTuple):
    """A log and the decisions on it without the faults that last: the steps that were taken out, the readings of
    patches (n, 3), the steps that are in doubt, what else may be nearly as likely, and where they were sought.
    probability: log-probability of all that is left. first: (n, 3) weights, as if there were none of these faults."""

    record: Record
    decision: Decision
    steps: tuple[Step, ...] = ()
    banned: NDArray[np.bool_] | None = None
    doubtful: Sequence[Step] = ()
    rivals: Sequence[Rival] = ()
    scene: Scene | None = None
    probability: float = math.nan
    first: FloatArray | None = None


def without_lasting(
    found: Understood, measurement: FloatArray, decided: Callable[..., tuple[Record, Decision]], work: Work
) -> Understood:
    """The log without the faults that last, decided again as long as there are some: without all that were found, or,
    where too little is left then, without the likeliest. A find may be mended by the next ones, so all of them are
    followed up; if it is not, what was understood before it counts."""
    best, told = found, 0.0
    for _ in range(LASTING_ROUNDS):
        if found.decision.model.coloured:  # which resembles many steps
            break
        scene = scene_of(found.record, found.decision, work)
        faults, before = search(scene), found
        told = max(told, *(each.gain for each in faults), 0.0)
        if faults and math.isnan(found.probability):
            best = before = found._replace(probability=log_probability(found.record, found.decision))
        found = _without(before, scene, faults, measurement, decided)
        if found.record is before.record and (likeliest := _likeliest(faults)):
            alone = _without(before, scene, likeliest, measurement, decided)
            found = found if alone.record is before.record else alone
        if found.record is before.record and before.decision.drifts:
            found = _without(before, other := _hidden_by_drift(before, work), search(other), measurement, decided)
        if found.record is before.record:
            return found if best.record is before.record else _with_rival(best, found, told)
        if not (_process_noise(found) > AGILE * _process_noise(best) and _is_lost(best, found, odds.COSTS)):
            best = found
    return best if best is found else _with_rival(best, found, told)


def _hidden_by_drift(found: Understood, work: Work) -> Scene:
    """The scene of a log whose noise grows only where neighbours differ more: where a channel jumps and the track
    diverges beside it, noise seems to grow for a while, and hides the jump."""
    return scene_of(found.record._replace(uneven=found.record.surely), found.decision, work)


def _process_noise(found: Understood) -> float:
    """Typical jerk PSD of a log, m2/s5."""
    return float(median_level(found.decision.model).jerk[0, 0])


def _with_rival(best: Understood, found: Understood, told: float) -> Understood:
    """The best of a log, with what was taken for patches in another as something that it may have. told: in
    log-probability, by how much they were likelier where they are."""
    banned = found.banned if best.banned is None or found.banned is None else found.banned & ~best.banned
    rivals = [
        Rival(component, begin, end, -told, MOTION, PATCH)
        for component in range(CLOCK)
        for begin, end in (() if banned is None else runs_of(banned[:, component]).tolist())
    ]
    return best._replace(rivals=[*best.rivals, *rivals], scene=found.scene)


def _likeliest(faults: Sequence[Found]) -> list[Found]:
    """The likeliest of several."""
    return [max(faults, key=lambda each: each.gain)] if len(faults) > 1 else []


def _without(
    found: Understood,
    scene: Scene,
    faults: Sequence[Found],
    measurement: FloatArray,
    decided: Callable[..., tuple[Record, Decision]],
) -> Understood:
    """The log decided on again without some faults of its scene; as it was decided on if that explains it better."""
    record, decision, new = found.record, found.decision, sorted_out(scene, faults)
    open_ = [each for each in new.rivals if each.chosen == MOTION]
    settled = [each for each in found.rivals if each.chosen != MOTION]
    found = found._replace(doubtful=new.doubtful, rivals=[*settled, *open_], scene=scene)
    if not new.steps and not new.banned.any():
        return found
    steps, banned = (*found.steps, *new.steps), new.banned if found.banned is None else found.banned | new.banned
    log = record.weighted(decision.weight)
    moved = levelled(log, scene.at_median.noise_variance, steps)
    first = decision.weight if found.first is None else found.first
    read = taken_out(log._replace(measurement=measurement), scene.at_median, scene.setting, moved, first)
    banned = banned | unseen(record.time_s, moved)[:, None]
    other = decided(read.measurement, banned=banned)
    if new.steps and _may_be_late_stamps((record, decision), other):
        return found
    rivals, probability = [*settled, *new.rivals], log_probability(*other)
    without = Understood(*other, steps, banned, new.doubtful, rivals, scene, probability, first)
    return found if new.banned.any() and _is_lost(found, without, odds.LOST) else without


def _is_lost(before: Understood, without: Understood, each: float) -> bool:
    """Whether the readings that are left are less likely than before by more than so much for each that is left out
    now: where the track is lost in a gap of good ones, or turns where only readings do. One that a patch explains is
    as likely as a good one is."""
    left_out = (before.record.possible & ~without.record.possible).sum(0)
    good = -0.5 * (np.log(2 * np.pi * before.decision.model.noise_variance) + 1.0)
    return bool(without.probability + left_out @ (good + each) < before.probability)


def _may_be_late_stamps(without: tuple[Record, Decision], levelled_log: tuple[Record, Decision]) -> bool:
    """Whether it may be late time stamps that resemble steps: they are left where the steps are taken out, or explain
    the log as well."""
    late = [decision.stamp_s > 0 for _, decision in (without, levelled_log)]
    if not any(late) or all(late):
        return all(late)
    record, decision = without
    possible = record.possible & levelled_log[0].possible  # of the same readings
    same = record._replace(possible=possible), decision._replace(weight=decision.weight * possible)
    return log_probability(*levelled_log) < log_probability(*same) + odds.SURE


class SortedOut(NamedTuple):
    """banned (n, 3): readings of patches. steps: that are sure. doubtful: that may be an end of a weak patch. rivals:
    what else may be, nearly as likely."""

    banned: NDArray[np.bool_]
    steps: list[Step]
    doubtful: list[Step]
    rivals: list[Rival]


def sorted_out(scene: Scene, found: Sequence[Found]) -> SortedOut:
    """What follows from the faults of a log."""
    n, noise_variance = len(scene.possible), scene.at_median.noise_variance
    result = SortedOut(np.zeros((n, 3), bool), [], [], [])
    for each in found:
        for curve, sigma in zip(each.curves, each.sigma, strict=True):
            is_level = curve.end == n and len(curve.size) == 1
            other_target = len(each.curves) == CLOCK and each.gain > odds.MANY * CLOCK  # no encoder or mount
            if not is_level or other_target or min(curve.begin, n - curve.begin) < near_end(n):
                if curve.component != CLOCK and each.gain > odds.SURE:
                    side = slice(0, curve.begin) if curve.end == n and 2 * curve.begin < n else curve.rows
                    result.banned[side, curve.component] = True
                    result.rivals.extend(_rivals(each, curve._replace(begin=side.start, end=side.stop), PATCH, None, n))
                continue
            if curve.component == CLOCK:
                large = not _may_be_a_halt(scene, curve)
            elif not _seen_before(scene, curve):
                continue
            else:
                large = abs(curve.size[0]) > SURE * math.sqrt(noise_variance[curve.component])
            sure = bool(large and each.gain > odds.MANY)
            step = Step(curve.component, curve.begin, curve.size[0], sigma, sure)
            (result.steps if step.sure else result.doubtful).append(step)
            result.rivals.extend(_rivals(each, curve, STEP if step.sure else MOTION, step, n))
    return result


def _rivals(found: Found, curve: Curve, chosen: str, step: Step | None, n: int) -> Iterator[Rival]:
    """What else a fault may be in a component. step: that it was weighed as, if it was."""
    if chosen == MOTION:
        yield Rival(curve.component, curve.begin, curve.end, 0.0, chosen, STEP, step)
    for other in found.others:
        for each, sigma in zip(other.curves, other.sigma, strict=True):
            if each.component == curve.component:
                gain = max(found.gain - other.gain, 0.0)
                if other.stays(n):
                    level = Step(each.component, each.begin, each.size[0], sigma)
                    yield Rival(curve.component, curve.begin, curve.end, gain, chosen, STEP, level)
                else:
                    yield Rival(curve.component, each.begin, each.end, gain, chosen, PATCH, step)


def _seen_before(scene: Scene, step: Curve) -> bool:
    """Whether readings just before a step may be good: behind a gap in a component a track may be anywhere."""
    before = scene.possible[max(step.begin - BEFORE, 0) : step.begin, step.component]
    return bool(before.mean() > SEEN)


def _may_be_a_halt(scene: Scene, clock: Curve) -> bool:
    """Whether the target may have stood still, or hurried, where its clock seems to jump: to make up for the way that
    is missing within the jump asks for no more acceleration than things that stand and go have."""
    (r, _, e), late = scene.log.measurement.T, scene.setting.late
    speed = np.sqrt(late[:, 0] ** 2 + (r * np.cos(e) * late[:, 1]) ** 2 + (r * late[:, 2]) ** 2)[clock.rows]
    speed = speed[np.isfinite(speed)]
    return len(speed) > 0 and 4 * median(speed) < HALTS_MPS2 * abs(clock.size[0])
