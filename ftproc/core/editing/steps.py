"""Steps that stay: an encoder that slips, a range ambiguity, another lobe, a clock that jumps.

From one backward pass come the estimate and the variance of a step between any two samples (de Jong and Penzer 1998;
see `filtering.shifts`): of a component, and of the clock, which moves the target along its way. A manoeuvre may look
like a step to a filter that expects a calm flight, so each step that stands out is weighed against the same stretch
without it: both with a process noise that follows the flight, and with outlier decisions of their own.

Two-pass editing without steps follows one as motion, and rejects what lies beside it, or all that comes after it, as a
patch. So rejected runs that lie on a track of their own are taken in again before steps are looked for; and where the
readings of a rejected run jump from one side of the track to the other, a step is weighed, too.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.editing import alternatives
from ftproc.core.editing.decisions import Decision, Record
from ftproc.core.filtering.bridging import CLOCK, Step, bridged, refined
from ftproc.core.filtering.initialization import find_starts
from ftproc.core.filtering.records import Model
from ftproc.core.filtering.shifts import shifts
from ftproc.core.identification.likelihood import Fixed, fit_level
from ftproc.core.identification.nearby import residuals_near, samples_around
from ftproc.core.identification.profile import fit_profile, from_knot, median_level, roughness
from ftproc.core.identification.scales import scales_of
from ftproc.core.identification.standing_out import MOST, SMALLEST, end_of, standing_out
from ftproc.core.identification.stretches import runs_of
from ftproc.core.model.frames import to_cartesian, wrap
from ftproc.order_statistics import median, medians

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FEWEST, EVEN = 3, 5.0  # readings in a rejected run, and second differences in sigmas, that may be a track
AROUND, MEMORIES = (100, 400), 6.0  # samples on each side that decide between step and manoeuvre, and memories
MARGIN = 6.0  # by which the log-probability of a stretch with a step must be better, and ln of the places for it
SURE = 7.0  # sigmas of the noise: a smaller step than this may be an end of a weak patch
PATCHES = 12, 24, 48  # readings in a patch, of which a step may be an end
STAYS = 0.75  # share of the readings on either side of a step that must be good
AGREE, BESIDE = 0.75, 7  # share of a rejected run on either side of the track, and readings that tell how far they jump
JOINS = 0.3  # times as far off the track at one end of a run as at the other
EXPLAINED = 2.5  # sigmas of a step with the flight's process noise, below which it would gain less than MARGIN
HOPELESS = 50.0  # by which the log-probability is worse before a size is found again, for a step that is none
HALTS_MPS2 = 30.0  # acceleration with which things stand still and go on
SIZES = 2  # times that the size of a step is found again, as the decisions beside it change
PROFILE_STEPS = 2  # of the search for the jerk profile of a stretch


class Stretch(NamedTuple):
    """Part of a log around a step: its record; the weights (n, 3) as decided without steps, and with the runs taken in
    that lie on a track of their own; the model with the flight's process noise, and with that of a calm flight; the
    rates of outliers; and the margin by which a step must be likelier."""

    record: Record
    decided: FloatArray
    taken_in: FloatArray
    model: Model
    calm: Model
    rates: FloatArray
    margin: float

    def beliefs(self) -> list[FloatArray]:
        """The weights without steps, and with the runs taken in if there are any."""
        return [self.taken_in, self.decided] if (self.taken_in != self.decided).any() else [self.decided]


def find(record: Record, decision: Decision) -> list[Step]:
    """The steps in a log whose outliers were decided as if it had none; some are not sure."""
    calm, log = median_level(decision.model), record.weighted(decision.weight)
    rejected = np.zeros(len(record.time_s), bool)
    for _, run in _rejected_runs(record, decision, FEWEST):
        rejected[run] = True
    residual, _ = residuals_near(log, calm, rejected, samples_around(log, calm))
    weight = _taken_in(record, decision, calm, residual)
    scales = scales_of(record.weighted(weight), calm.noise_variance)
    around = int(np.clip(MEMORIES * scales.memory_samples(float(calm.jerk[0, 0])), *AROUND))
    margin, end = MARGIN + math.log(4 * len(record.time_s)), end_of(len(record.time_s))
    found: list[Step] = []
    candidates = [*_beside_runs(record, decision, calm, residual), *standing_out(log, calm, around // 2)]
    if (weight != decision.weight).any():
        candidates = [*standing_out(record.weighted(weight), calm, around // 2), *candidates]
    for step in candidates:
        again = any(step.component == s.component and abs(step.sample - s.sample) < BESIDE for s in found)
        if again or not end < step.sample <= len(record.time_s) - end:
            continue
        span = slice(max(step.sample - around, 0), step.sample + around)
        near, model = from_knot(decision.model, record.time_s, span)
        known, one = ([s._replace(sample=s.sample - near.start) for s in some] for some in (found, [step]))
        known = [s for s in known if s.sure and 0 < s.sample < near.stop - near.start]
        part = record.part(near)
        own = slice(None) if step.component == CLOCK else step.component
        taken = decision.weight[near].copy()
        taken[:, own] = weight[near, own]
        stretch = Stretch(part, decision.weight[near], taken, model, calm, decision.rates, margin)
        likelier = _likelier(stretch, known, one[0])
        if likelier is not None:
            found.append(likelier._replace(sample=near.start + likelier.sample))
    return found


def _rejected_runs(record: Record, decision: Decision, shortest: int) -> Iterator[tuple[int, IntArray]]:
    """The component and the samples of each run of rejected readings that is not shorter."""
    for c in range(3):
        seen = np.flatnonzero(record.possible[:, c])
        for begin, end in runs_of(decision.weight[seen, c] <= 0, shortest):
            yield c, seen[begin:end]


def _taken_in(record: Record, decision: Decision, calm: Model, residual: FloatArray) -> FloatArray:
    """The decisions' weights (n, 3), but with the rejected runs whose readings lie on a track of their own. residual:
    (n, 3) leave-one-out, of these decisions."""
    weight = decision.weight.copy()
    sigma = np.sqrt(calm.noise_variance)
    for c, run in _rejected_runs(record, decision, FEWEST):
        if median(np.abs(np.diff(residual[run, c], 2))) < EVEN * sigma[c]:
            weight[run, c] = 1.0
    return weight


def _beside_runs(record: Record, decision: Decision, calm: Model, residual: FloatArray) -> list[Step]:
    """The steps that rejected runs may hide, the largest first. residual: (n, 3) leave-one-out."""
    found: list[tuple[float, Step]] = []
    for c, run in _rejected_runs(record, decision, 2 * FEWEST):
        sigma = math.sqrt(calm.noise_variance[c])
        after = run[-1] + 1 + np.flatnonzero(record.possible[run[-1] + 1 :, c])[:1]
        for place, jump in _jumps(residual[run, c]):
            if abs(jump) > SMALLEST * sigma and place < len(run) + len(after):
                found.append((abs(jump) / sigma, Step(c, int(np.append(run, after)[place]), jump, sigma)))
    return [step for _, step in sorted(found, key=lambda each: -each[0])[:MOST]]


def _jumps(off: FloatArray) -> Iterator[tuple[int, float]]:
    """Where, and by how much, the readings of a rejected run may jump for good, from their distances off the track: a
    track that is bent from before a step to after it lies between the two, or joins one of them slowly."""
    n = len(off)
    higher = np.cumsum(np.sign(off))  # readings above the track less those below, up to each
    for place, other in ((int(higher.argmin()) + 1, higher[-1]), (int(higher.argmax()) + 1, -higher[-1])):
        if min(place, n - place) >= FEWEST and 0.5 * (n + other) + abs(higher[place - 1]) >= AGREE * n:
            yield place, float(median(off[place : place + BESIDE]) - median(off[max(place - BESIDE, 0) : place]))
    first, last = median(off[:BESIDE]), median(off[-BESIDE:])
    if abs(last) < JOINS * abs(first):
        yield 0, first
    if abs(first) < JOINS * abs(last):
        yield n, -last


def _without(stretch: Stretch, steps: Sequence[Step]) -> Stretch:
    """The stretch with some steps bridged."""
    log = stretch.record.weighted(stretch.taken_in)
    return stretch._replace(record=stretch.record._replace(measurement=bridged(log, stretch.calm, steps)))


def _likelier(stretch: Stretch, known: Sequence[Step], step: Step) -> Step | None:
    """The step, with the size that the stretch tells, if the stretch is likelier with it than without, given the steps
    that are known."""
    try:
        stretch = _without(stretch, known)
        if _is_motion(stretch, step):
            return None
        without, model = max(
            ((_decided(stretch, stretch.decided, model), model) for model in (stretch.model, stretch.calm)),
            key=lambda tried: tried[0].likelihood,
        )
        with_it, bridge, step = max(
            (_sized(stretch, step, weight, model, without.likelihood - HOPELESS) for weight in stretch.beliefs()),
            key=lambda tried: tried[0].likelihood,
        )
        weight = with_it.weight
        if not with_it.likelihood > without.likelihood + MARGIN or not _stays(stretch.record, weight, step):
            return None
        if _size(stretch, bridge, step) < SMALLEST:
            return None
        least = max(_likelihood(stretch, weight) for weight in stretch.beliefs())
        most = _likelihood(bridge, weight) - stretch.margin
        if not most > least:
            return None
        large = min(_size(stretch, bridge, step), abs(step.size) / step.sigma) >= SURE
        large = large and not _may_be_a_halt(stretch, bridge, step)
        return step._replace(
            sure=large and all(_likelihood(stretch, patch) < most for patch in _patches(stretch, step))
        )
    except ValueError:  # a component has too few readings there
        return None


def _is_motion(stretch: Stretch, step: Step) -> bool:
    """Whether hardly anything is left of a step with the flight's process noise, where no rejected run lies beside it:
    then it would gain no more than that, whatever is decided."""
    own, model = slice(None) if step.component == CLOCK else step.component, stretch.model
    beside = slice(max(step.sample - 2 * BESIDE, 0), step.sample + 2 * BESIDE)
    if (stretch.record.possible[beside, own] & (stretch.decided[beside, own] <= 0)).sum() >= FEWEST:
        return False
    log = stretch.record.weighted(stretch.decided)
    found = shifts(log, model, find_starts(log, model.noise_variance, float(model.jerk[0, 0])))
    near = slice(max(step.sample - BESIDE, 0), step.sample + BESIDE), step.component
    return not (found.score[near] ** 2 > EXPLAINED**2 * found.information[near]).any()


def _sized(
    stretch: Stretch, step: Step, weight: FloatArray, model: Model, least: float
) -> tuple[alternatives.Step, Stretch, Step]:
    """The decisions with a step bridged, from these weights (n, 3) on, the stretch without it, and its size. least:
    log-probability below which there is no hope for it."""
    bridge = _without(stretch, [step])
    for _ in range(SIZES):
        with_it = _decided(bridge, weight, model)
        if with_it.likelihood < least:
            break
        weight = with_it.weight
        log, (step,) = refined(bridge.record.weighted(weight), model, [step])
        bridge = bridge._replace(record=bridge.record._replace(measurement=log.measurement))
    return with_it, bridge, step


def _patches(stretch: Stretch, step: Step) -> Iterator[FloatArray]:
    """The decisions (n, 3) in which the readings just before a step, or just after, are a patch."""
    own = slice(None) if step.component == CLOCK else step.component
    for length in PATCHES:
        for side in (slice(step.sample - length, step.sample), slice(step.sample, step.sample + length)):
            weight = stretch.decided.copy()
            weight[side, own] = 0.0
            yield weight


def _size(stretch: Stretch, bridge: Stretch, step: Step) -> float:
    """How far a step moves the readings, in sigmas of the component that it moves most."""
    rows, _ = step.moved(len(stretch.decided))
    away = stretch.record.measurement[rows] - bridge.record.measurement[rows]
    away[:, 1] = wrap(away[:, 1])
    seen = np.where(np.isfinite(away), np.abs(away), 0.0) / np.sqrt(stretch.calm.noise_variance)
    return float(medians(seen).max())


def _may_be_a_halt(stretch: Stretch, bridge: Stretch, step: Step) -> bool:
    """Whether the target may have stood still, or hurried, where its clock seems to jump: the way that is missing asks
    for no more acceleration than things that stand and go have."""
    if step.component != CLOCK:
        return False
    rows, _ = step.moved(len(stretch.decided))
    z, moved = stretch.record.measurement[rows], bridge.record.measurement[rows]
    away = np.linalg.norm(to_cartesian(z) - to_cartesian(moved), axis=1)
    seen = away[np.isfinite(away)]
    return len(seen) > 0 and 4 * median(seen) < HALTS_MPS2 * step.size**2


def _stays(record: Record, weight: FloatArray, step: Step) -> bool:
    """Whether most readings on both sides are good with the step; else it is the edge of a patch."""
    own = slice(None) if step.component == CLOCK else step.component
    return all(
        weight[side, own].sum() >= STAYS * record.possible[side, own].sum()
        for side in (slice(0, step.sample), slice(step.sample, None))
    )


def _decided(stretch: Stretch, weight: FloatArray, model: Model) -> alternatives.Step:
    """The decisions on a stretch, as they are or made once again, whichever are likelier."""
    return max(alternatives.decisions(_ready(stretch, model), weight, 2), key=lambda step: step.likelihood)


def _likelihood(stretch: Stretch, weight: FloatArray) -> float:
    """Log-probability of the readings of a stretch with a process noise and outlier decisions of its own, and of that
    process noise: it may grow for a moment, as a step asks for, but seldom does."""
    log, model = stretch.record.weighted(weight), stretch.calm
    starts = find_starts(log, model.noise_variance, float(model.jerk[0, 0]))
    if not stretch.record.fixed.jerk:
        level = fit_level(log, starts, model, Fixed(np.ones(3, bool), False))
        model = fit_profile(log, starts, level, PROFILE_STEPS)
    likeliest = max(step.likelihood for step in alternatives.decisions(_ready(stretch, model), weight))
    return likeliest - roughness(model)


def _ready(stretch: Stretch, model: Model) -> alternatives.Neighbourhood:
    r = stretch.record
    return alternatives.Neighbourhood(r.time_s, r.measurement, r.possible, model, stretch.rates, r.gate, r.uneven)
