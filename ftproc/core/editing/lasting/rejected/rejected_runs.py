"""Reassessment of the rejected runs of an edited log: each is weighed once more against what else it may be.

A run whose readings leave the track and join it again without a jump may be motion. One beside which the track has
followed a patch, or has been dragged by one that begins slowly, may be longer, or all good, and the readings beside it
the patch. Each way is decided with a jerk profile of its own, in which no other event takes part, and scored with one.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
from collections.abc import Iterator

import numpy as np

from ftproc.core import odds
from ftproc.core.editing import outlier_chain
from ftproc.core.editing.decisions import Decision, Record
from ftproc.core.editing.lasting.between import PER_TERM, TERMS, of_any_shape
from ftproc.core.editing.lasting.curves import Curve
from ftproc.core.editing.lasting.faults import MOTION, PATCH, Rival
from ftproc.core.editing.lasting.rejected.followed import followed, with_weight
from ftproc.core.editing.lasting.rejected.joining import LENGTHS, SHORTEST, Run, rejected_runs
from ftproc.core.editing.lasting.weighing import scene_of, weighed
from ftproc.core.editing.reassessment import (
    COMPARED_STEPS,
    PROFILE_STEPS,
    log_probability,
    short_record,
    with_profile,
)
from ftproc.core.filtering.records import Model
from ftproc.core.filtering.smoother import RESIDUALS, smooth_log
from ftproc.core.identification.nearby import samples_around
from ftproc.core.identification.profile import median_level, starts_of
from ftproc.core.work import Work
from ftproc.records import FloatArray

AGILE = 100.0  # times the median process noise, where the search for that of motion which begins at once begins, too
ROUNDS, REPEATS = 2, 3  # over a log, whose runs may have changed; of deciding
WEIGHED = 10  # times that the samples around a run are weighed, about
ELSEWHERE = 3.0  # sigmas of the position, by which two understandings must differ to be distinguished


def reassess_rejected(record: Record, decision: Decision, work: Work) -> tuple[Decision, tuple[Rival, ...]]:
    """The decisions on a log, replaced around rejected runs where others are likelier, while there is work left; and
    those of which either may be."""
    at_median, rivals, seen = median_level(decision.model), list[Rival](), set[tuple[int, int, bytes]]()
    around, found = samples_around(record.weighted(decision.weight), at_median), decision
    for _ in range(ROUNDS):
        weight = found.weight.copy()
        for run in [each for each in rejected_runs(record, found, around) if each.key not in seen]:
            near = run.near(around)
            if work.left <= 0:
                work.passed += 1
                seen.add(run.key)
                continue
            part, own = short_record(record, near), found._replace(weight=weight[near].copy(), model=at_median)
            if (own.weight[run.samples - near.start, run.component] > 0).any():  # another run's reassessment took it in
                continue
            seen.add(run.key)
            work.left -= WEIGHED * (near.stop - near.start)
            try:
                best, gain = _likeliest(part, own, run, near.start)
            except ValueError:  # a component has too few readings there
                continue
            if gain > 0 and not run.beside and best[run.samples - near.start, run.component].mean() > 0.5:
                gain = min(gain, _more_than_a_curve(part, own, best, run, near.start))
            if gain > 0:
                weight[near] = best
            changed = np.flatnonzero(best[:, run.component] != own.weight[:, run.component])
            if abs(gain) < odds.LIKELIER and len(changed) >= SHORTEST and _apart(part, own, best):
                begin, end = int(changed[0]) + near.start, int(changed[-1]) + 1 + near.start
                taken_in = bool(best[changed, run.component].mean() > 0.5)
                ways = (MOTION, PATCH) if taken_in == (gain > 0) else (PATCH, MOTION)
                rivals.append(Rival(run.component, begin, end, abs(gain), *ways))
        if (weight == found.weight).all():
            break
        found = found._replace(weight=weight, starts=starts_of(record.weighted(weight), at_median))
    return found, tuple(rivals)


def _likeliest(part: Record, decision: Decision, run: Run, offset: int) -> tuple[FloatArray, float]:
    """The likeliest other decisions (n, 3) on a part of a log, and by how much more likely they are."""
    before, here = decision.weight, run.around(offset)
    unknown = before.copy()
    unknown[here, run.component] = 0.0
    unfollowed = with_profile(part, with_weight(part, decision, unknown), PROFILE_STEPS)
    found, decided = {before.tobytes(): (0.0, before)}, dict[bytes, FloatArray]()

    @functools.cache
    def as_before() -> float:
        return log_probability(part, with_weight(part, decision, before))

    for way, follows in _ways(part, before, run, offset) if len(run.samples) >= SHORTEST else ():
        with contextlib.suppress(ValueError):  # a component has too few readings there
            if follows:
                model = with_profile(part, with_weight(part, decision, way), COMPARED_STEPS)
                other = _decided(part, decision._replace(weight=way), model, here, {})
            else:
                other = _decided(part, decision._replace(weight=way), unfollowed, here, decided)
            if other.tobytes() not in found:
                moves = run.moves(before, other, offset)
                prior = odds.MOTION * (1 + len(run.beside)) if moves and (run.beside or not follows) else odds.FAULT
                found_so = with_weight(part, decision, other)
                gain = log_probability(part, found_so) - as_before() + prior
                if moves and run.beside:
                    agile = found_so.model._replace(jerk=AGILE * found_so.model.jerk)
                    gain = max(gain, log_probability(part, found_so._replace(model=agile)) - as_before() + prior)
                found[other.tobytes()] = gain, other
    for other in followed(part, decision, run, offset, unfollowed) if run.joins else ():
        if other.tobytes() not in found:
            found_so = with_weight(part, decision, other)
            found[other.tobytes()] = log_probability(part, found_so) - as_before() + odds.FAULT, other
    del found[before.tobytes()]
    gain, other = max(found.values(), key=lambda each: each[0], default=(-np.inf, before))
    return other, gain


def _more_than_a_curve(part: Record, decision: Decision, other: FloatArray, run: Run, offset: int) -> float:
    """By how much more likely motion, by other decisions (n, 3), is than a patch whose readings lie on a curve."""
    begin, end = int(run.samples[0]) - offset, int(run.samples[-1]) + 1 - offset
    most = min((end - begin) // PER_TERM, TERMS[0])
    taken_in = decision.weight.copy()
    taken_in[run.samples - offset, run.component] = 1.0
    scene = scene_of(part, with_weight(part, decision, taken_in), None)
    try:
        motion = weighed(scene, other, ())
        curve = of_any_shape(scene, weighed(scene, taken_in, [Curve(run.component, begin, end, (0.0,) * most)]))
    except (ValueError, np.linalg.LinAlgError):
        return np.inf
    return motion.log_probability + odds.ONE_END - curve.log_probability


def _ways(part: Record, weight: FloatArray, run: Run, offset: int) -> Iterator[tuple[FloatArray, bool]]:
    """Decisions (n, 3) with which to begin: what a run may be; and whether the jerk follows them: where readings are
    few nothing else tells how it moves, but then it follows a patch as well."""
    c, first, last = run.component, int(run.samples[0]) - offset, int(run.samples[-1]) + 1 - offset
    if len(run.motion):
        other = weight.copy()
        for each in (run, *run.beside):
            other[each.motion - offset, each.component] = 1.0
        yield other, False
        yield other, True
    if run.beside:
        return
    yield weight, False
    for length, before, good in itertools.product(LENGTHS, (True, False), (False, True)):
        other = weight.copy()
        if good:
            other[first:last, c] = part.possible[first:last, c]
        other[max(first - length, 0) : first, c] *= not before
        other[last : last + length, c] *= before
        yield other, False


def _decided(part: Record, decision: Decision, model: Model, here: slice, known: dict[bytes, FloatArray]) -> FloatArray:
    """(n, 3) decisions from these on, made again in a part of the samples. known: what follows from which decisions by
    this model; others are added."""
    weight = decision.weight
    for _ in range(REPEATS):
        before, key = weight, weight.tobytes()
        if key not in known:
            known[key] = _decided_once(part, decision._replace(weight=weight), model, here)
        weight = known[key]
        if (weight == before).all():
            break
    return weight


def _decided_once(part: Record, decision: Decision, model: Model, here: slice) -> FloatArray:
    log = part.weighted(decision.weight)
    smoothed = smooth_log(log, model, starts_of(log, decision.model), RESIDUALS)
    good = outlier_chain.classify(
        smoothed.residual, smoothed.residual_variance, model.reading_variance, decision.rates.copy(), part.gate
    )
    decided = decision.weight.copy()
    decided[here] = part.with_accepted(((good > 0.5) & part.possible).astype(float))[here]
    return decided


def _apart(part: Record, decision: Decision, other: FloatArray) -> bool:
    """Whether other decisions (n, 3) put the target elsewhere."""
    one, two = (
        smooth_log(part.weighted(each.weight), with_profile(part, each, COMPARED_STEPS), each.starts)
        for each in (with_weight(part, decision, weight) for weight in (decision.weight, other))
    )
    sigma = np.maximum(one.sigma[:, :3], two.sigma[:, :3])
    return bool((np.abs(one.state[:, :3] - two.state[:, :3]) > ELSEWHERE * sigma).any())
