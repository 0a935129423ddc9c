"""Reassessment: a jerk profile that follows the flight, and the decisions made again where something stands out.

A patch that was missed makes the process noise too high around it, so that it goes on being missed. So the stretches
where the profile stands out, where runs of readings are off together, and where an alternative hypothesis may be
likelier are decided again with the profile's median, which no single event can move. The rest of a long log stays as
it is.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ftproc.core import odds
from ftproc.core.components import any_of
from ftproc.core.editing import alternatives
from ftproc.core.editing.decisions import Decision, Record, decide
from ftproc.core.editing.runs import confirmed, suspicious
from ftproc.core.filtering.records import Model
from ftproc.core.filtering.smoother import RESIDUALS, smooth_log
from ftproc.core.identification.likelihood import NOISE_GROWTH, NOISE_SHRINKS
from ftproc.core.identification.nearby import residuals_near, samples_around
from ftproc.core.identification.profile import fit_profile, median_level, pieces, roughness, starts_of
from ftproc.core.identification.scales import scales_of
from ftproc.core.identification.stretches import runs_of, stretches_of, widened
from ftproc.order_statistics import median
from ftproc.records import FloatArray

Begin = Callable[[Record, FloatArray], tuple[Record, Decision]]

ROUNDS = 6
LEAST_KEPT = 0.8  # of the readings of a component that were good before the first round
FEW_MORE = 0.01  # of the readings: those that another hypothesis may reject beyond the first, to be preferred
OTHER_LEVEL = 2.5  # times the process noise at which an alternative was tried, before it is tried again
PROFILE_STEPS, COMPARED_STEPS = 2, 5  # of the search for the jerk profile; where two are compared
LONG = 4  # rejected readings in a row, for which decisions from all readings on are made, too
STANDS_OUT = 64.0  # times the median of the jerk profile
LONGEST_SPAN = 3000  # samples that are decided together
AT_LEAST = 1.02  # times the least noise that is allowed: less of it is at its bound
MANY, FAR_LESS = 2, 0.25  # components of which that is so, and the share of their noise that must be enough: where less
# comes of it, it is readings of a patch that were rejected
LESS = 3.0  # times less noise of a component, or more
SHORT_MEMORY, LONG_MEMORY = 8.0, 0.5  # samples, and share of the log: between them less noise was never likelier
FINER, FINEST = 16.0, 3  # times less noise, and how often
SHORT_LOG, MOST = 8000, 0.5  # samples, and share that stands out: then all of it is decided again, and noise as well


def reassess(record: Record, decision: Decision) -> Decision:
    """Give the model a jerk profile, and make the decisions again where it stands out or readings are suspicious."""
    profile = with_profile(record, decision)
    at_median = median_level(profile)
    marked, reach = _stands_out(record.time_s, profile), samples_around(record.weighted(decision.weight), at_median)
    for run in alternatives.accepted_runs(record.time_s, decision.weight, record.possible):
        marked[run.first : run.last] = True
    marked |= any_of(_suspects(record, decision, at_median, profile, widened(marked, reach)))
    around = widened(marked, reach)
    if len(around) <= SHORT_LOG and around.mean() > MOST:
        return _until_settled(record, decision, profile)
    weight, unexamined = decision.weight.copy(), 0
    for span in _doubtful(record, decision, at_median, list(_spans(around))):
        part = short_record(record, span)
        try:
            starts = starts_of(part.weighted(weight[span]), at_median)
        except ValueError:  # a component has too few readings there
            continue
        initial = Decision(weight[span], at_median, starts, decision.rates)
        decided = _until_settled(part, initial, with_profile(part, initial))
        weight[span] = decided.weight
        unexamined += decided.unexamined
    return decision._replace(
        weight=weight, starts=starts_of(record.weighted(weight), profile), model=profile, unexamined=unexamined
    )


def _doubtful(record: Record, decision: Decision, at_median: Model, spans: list[slice]) -> Iterator[slice]:
    """Those of some spans in which a profile and a median process noise of their own leave something to decide. All
    are fitted and smoothed together; most are turns that the level of the whole log has not expected."""
    near = stretches_of(record.weighted(decision.weight), spans, at_median.noise_variance, float(at_median.jerk[0, 0]))
    if near is None:
        return
    profile = fit_profile(near.log, near.starts, at_median, PROFILE_STEPS)
    piece, levels = pieces(near.log.time_s, profile), profile.jerk.copy()
    inside_near = list[tuple[slice, slice, slice]]()  # a span, where its samples are among those near, and its pieces
    for span in spans:
        low, high = np.searchsorted(near.samples, (span.start, span.stop)).tolist()
        if high > low:
            own = slice(piece[low], piece[high - 1] + 1)
            levels[own] = median_level(profile._replace(jerk=profile.jerk[own])).jerk
            inside_near.append((span, slice(low, high), own))
    smoothed = smooth_log(near.log, profile._replace(jerk=levels), near.starts, RESIDUALS)
    for span, inside, own in inside_near:
        part, possible = near.log.part(inside), record.possible[near.samples[inside]]
        memory_s = scales_of(part, at_median.noise_variance).memory_s(float(levels[own.start, 0]))
        suspects = suspicious(
            part.time_s, smoothed.residual[inside], smoothed.residual_variance[inside], part.weight, memory_s
        )
        left = np.where(suspects, 0.0, part.weight)
        stands_out = profile.jerk[own, 0].max() >= STANDS_OUT * median(profile.jerk[own, 0])
        if stands_out or suspects.any() or alternatives.accepted_runs(part.time_s, left, possible):
            yield span


def with_profile(record: Record, decision: Decision, steps: int = PROFILE_STEPS) -> Model:
    """The decision's model with a jerk profile."""
    return fit_profile(record.weighted(decision.weight), decision.starts, decision.model, steps)


def _until_settled(record: Record, decision: Decision, profile: Model) -> Decision:
    """Decide again from the median process noise until nothing changes, or ROUNDS times.

    A round that rejects much of what was good is not accepted: where the smallest noise that explains the readings
    left is taken for theirs, ever fewer are left. Nor is the outcome, if it makes all readings together less likely
    than the decisions before did, each with a jerk profile of its own: then turns are taken for patches.
    """
    first = decision._replace(model=profile)
    search = alternatives.Search(record.work)
    tried_at = np.inf
    for _ in range(ROUNDS):
        at_median = median_level(profile)
        level = float(at_median.jerk[0, 0])
        if not tried_at / OTHER_LEVEL < level < tried_at * OTHER_LEVEL:
            tried_at = level
            search.tried.clear()
        suspects = _suspects(record, decision, at_median, profile)
        whole = alternatives.Neighbourhood(
            record.time_s, record.measurement, record.possible, at_median, decision.rates, record.gate, record.uneven
        )
        weight = alternatives.try_alternatives(whole, np.where(suspects, 0.0, decision.weight), search)
        if not _stands_out(record.time_s, profile).any() and (weight == decision.weight).all():
            break
        again = decide(record, decision._replace(weight=weight, model=at_median), tune_first=False)
        again = again._replace(model=with_profile(record, again))
        again = _or_as_they_are(record, again, decision._replace(weight=record.with_accepted(weight)), decision)
        if (again.weight == decision.weight).all() or (again.weight.sum(0) < LEAST_KEPT * first.weight.sum(0)).any():
            break
        decision, profile = again, again.model
    found = decision._replace(model=profile, unexamined=len(search.unexamined - search.tried))
    if (found.weight != first.weight).any() and log_probability_as_it_is(record, found) < log_probability_as_it_is(
        record, first
    ) - odds.LIKELIER:
        return first._replace(rounds=found.rounds, unexamined=found.unexamined)
    return found


def _or_as_they_are(record: Record, again: Decision, tried: Decision, before: Decision) -> Decision:
    """The decisions made again from those that were tried, or these as they are, with a jerk profile of their own,
    where that is likelier: deciding with constant process noise may lead away from them."""
    if (tried.weight == before.weight).all():
        return again
    tried = tried._replace(starts=starts_of(record.weighted(tried.weight), median_level(before.model)))
    return max(again, tried._replace(model=with_profile(record, tried)), key=partial(log_probability_as_it_is, record))


def likelier(one: tuple[Record, Decision], other: tuple[Record, Decision]) -> tuple[Record, Decision]:
    """Of two ways to understand a log, that which makes all of its readings together likelier."""
    return one if other[1] is one[1] or log_probability(*other) <= log_probability(*one) else other


def preferred(found: tuple[Record, Decision], other: tuple[Record, Decision]) -> tuple[Record, Decision]:
    """The other hypothesis, if it is likelier and does not reject many more readings to be so."""
    least = found[1].weight.sum() - FEW_MORE * found[0].possible.sum()
    return likelier(found, other) if other[1].weight.sum() > least else found


def rejects_runs(record: Record, decision: Decision) -> bool:
    """Whether the decisions reject readings of a component in a row."""
    rejected = (decision.weight[record.possible[:, c], c] <= 0 for c in range(3))
    return any(len(runs_of(each, LONG)) > 0 for each in rejected)


def with_less_noise(found: tuple[Record, Decision], begin: Begin) -> tuple[Record, Decision]:
    """The decisions made again from far less noise, as long as the noise found is the least that screening allows: what
    it took for noise may have been motion, where a slow instrument follows an agile target. begin: from a record and
    weights (n, 3) on."""
    for _ in range(FINEST):
        record, decision = found
        at_least = decision.model.noise_variance <= AT_LEAST * (record.sigma / NOISE_SHRINKS) ** 2
        if (at_least & ~record.fixed.noise).sum() < MANY:
            break
        other = begin(record._replace(sigma=record.sigma / FINER), decision.weight)
        less = other[1].model.noise_variance < FAR_LESS**2 * decision.model.noise_variance
        if less.sum() < MANY or preferred(found, other) is found:
            break
        found = other
    return found


def finer_noise(found: tuple[Record, Decision], begin: Begin) -> Iterator[tuple[Record, Decision]]:
    """The decisions made again from less and less noise, while that is likelier, where the readings hardly tell noise
    from motion: the noise is the least that screening allows, or the most, or the filter remembers few of them, or
    nearly all."""
    for _ in range(FINEST):
        record, decision = found
        if record.fixed.noise.all() or not _may_be_motion(record, decision):
            return
        other = begin(record._replace(sigma=record.sigma / LESS), record.screened)
        if preferred(found, other) is found or log_probability(*other) < log_probability(*found) + odds.POSSIBLE:
            return
        yield other
        found = other


def _may_be_motion(record: Record, decision: Decision) -> bool:
    """Whether some of the noise may be motion, or of the motion noise."""
    model, variance = decision.model, decision.model.noise_variance
    least, most = (record.sigma / NOISE_SHRINKS) ** 2, (NOISE_GROWTH * record.sigma) ** 2
    bound = ~record.fixed.noise & ((variance <= AT_LEAST * least) | (AT_LEAST * variance >= most))
    memory = scales_of(record.weighted(decision.weight), variance).memory_samples(float(model.jerk[0, 0]))
    return bool(bound.any()) or not SHORT_MEMORY < memory < LONG_MEMORY * len(record.time_s)


def log_probability(record: Record, decision: Decision) -> float:
    """Of all readings of a log, as it is understood, with a jerk profile of its own."""
    return log_probability_as_it_is(record, decision._replace(model=with_profile(record, decision, COMPARED_STEPS)))


def log_probability_as_it_is(record: Record, decision: Decision) -> float:
    """Log-probability of all readings, of the decisions on them, of late time stamps and of the jerk profile."""
    model, log = decision.model, record.weighted(decision.weight)
    smoothed = smooth_log(log, model, starts_of(log, model), RESIDUALS)
    whole = alternatives.Neighbourhood(
        record.time_s, record.measurement, record.possible, model, decision.rates, record.gate, record.uneven
    )
    rejected = alternatives.rejections(whole, decision.weight, smoothed)
    return smoothed.log_likelihood + rejected + decision.stamps - roughness(model)


def _stands_out(time_s: FloatArray, profile: Model) -> NDArray[np.bool_]:
    """(n,) samples in pieces of the profile that are far above its median."""
    jerk = profile.jerk[:, 0]
    found: NDArray[np.bool_] = (jerk >= STANDS_OUT * median(jerk))[pieces(time_s, profile)]
    return found


def _spans(marked: NDArray[np.bool_]) -> Iterator[slice]:
    """The runs of what is marked, in pieces that are not too long."""
    for begin, end in runs_of(marked):
        pieces = max(1, round((end - begin) / LONGEST_SPAN))
        for low, high in itertools.pairwise(np.linspace(begin, end, pieces + 1).astype(int)):
            yield slice(low, high)


def short_record(record: Record, span: slice) -> Record:
    """The record of a stretch that is too short to tell the noise from."""
    return record.part(span)._replace(fixed=record.fixed._replace(noise=np.ones(3, bool)))


def _suspects(
    record: Record, decision: Decision, at_median: Model, profile: Model, marked: NDArray[np.bool_] | None = None
) -> NDArray[np.bool_]:
    """(n, 3) readings that are good so far, in runs that are off together at the median process noise, and off at once
    at both ends even with the profile. marked: (n,) samples among which none is sought."""
    weight, starts = decision.weight, decision.starts
    log = record.weighted(weight)
    smoothed = smooth_log(log, at_median, starts, RESIDUALS)
    memory_s = scales_of(log, at_median.noise_variance).memory_s(float(at_median.jerk[0, 0]))
    suspects = suspicious(record.time_s, smoothed.residual, smoothed.residual_variance, weight, memory_s)
    if marked is not None:
        suspects[marked] = False
    if suspects.any():
        without = record.weighted(np.where(suspects, 0.0, weight))
        near = residuals_near(without, profile, any_of(suspects), samples_around(log, at_median))
        suspects = confirmed(suspects, *near)
    return suspects
