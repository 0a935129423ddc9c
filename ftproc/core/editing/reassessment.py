"""The second look: a jerk profile that follows the flight, and the decisions made again where something stands out.

A patch that escaped makes the jerk level too high hereabouts, so that it goes on escaping. So the places where the
profile stands out, where runs of readings are off together, and where the opposite of a decision may be likelier,
are looked at again from the profile's median on, which no single event can move. Only there: the rest of a long log
stays as it is.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ftproc.core.editing import alternatives, runs
from ftproc.core.editing.decisions import Decision, Record, decide
from ftproc.core.editing.runs import runs_of
from ftproc.core.filtering.initialization import begin_all
from ftproc.core.filtering.records import Model
from ftproc.core.filtering.smoother import smooth_log
from ftproc.core.identification import likelihood

FloatArray = NDArray[np.float64]

LOOKS = 6
LEAST_KEPT = 0.8  # of the readings of a component that were good before the first look
OTHER_LEVEL = 2.5  # times the jerk level at which an opposite was tried, before it is tried again
LOOK_STEPS = 3  # of the search for the jerk profile
STANDS_OUT = 8.0  # times the median of the jerk profile
AROUND = 200  # samples on each side of what stands out that are decided with it
LONGEST_SPAN = 3000  # samples that are decided together
SHORT_LOG, MOST = 8000, 0.5  # samples, and share that stands out: then all of it is looked at again, and noise as well


def look_again(record: Record, decision: Decision) -> Decision:
    """Give the model a jerk profile, and make the decisions again where it stands out or readings are suspicious."""
    profile = likelihood.fit_profile(*record.log, decision.weight, decision.starts, decision.model, LOOK_STEPS)
    calm = likelihood.median_level(profile)
    suspects = _suspects(record, decision, calm, profile)
    marked = suspects.any(1) | _stands_out(record.time_s, profile)
    for island in alternatives.islands(record.time_s, decision.weight, record.possible):
        marked[island.first : island.last] = True
    widened = _widened(marked)
    if len(widened) <= SHORT_LOG and widened.mean() > MOST:
        return _look_until_settled(record, decision, profile)
    weight = decision.weight.copy()
    fixed = record._replace(known=np.ones(3, bool))  # a span is too short to tell the noise from
    for span in _spans(widened):
        part = fixed.part(span)
        try:
            starts = begin_all(*part.log, weight[span], calm.noise_variance, float(calm.jerk[0, 0]))
        except ValueError:  # a component says too little hereabouts
            continue
        begun = Decision(weight[span], calm, starts, decision.rates)
        weight[span] = _look_until_settled(part, begun, None).weight
    starts = begin_all(*record.log, weight, calm.noise_variance, float(calm.jerk[0, 0]))
    return decision._replace(weight=weight, starts=starts, model=profile)


def _look_until_settled(record: Record, decision: Decision, profile: Model | None) -> Decision:
    """Look again from the calm level on until nothing changes, or LOOKS times.

    A look that rejects much of what was good is not believed: where the smallest noise that explains the readings
    left is taken for theirs, ever fewer are left.
    """
    first = decision.weight
    tried: set[alternatives.Island] = set()
    tried_at = np.inf
    for _ in range(LOOKS):
        if profile is None:
            profile = likelihood.fit_profile(*record.log, decision.weight, decision.starts, decision.model, LOOK_STEPS)
        calm = likelihood.median_level(profile)
        level = float(calm.jerk[0, 0])
        if not tried_at / OTHER_LEVEL < level < tried_at * OTHER_LEVEL:
            tried, tried_at = set(), level
        suspects = _suspects(record, decision, calm, profile)
        whole = alternatives.Neighbourhood(*record.log, record.possible, calm, decision.rates, record.gate)
        weight = alternatives.try_opposites(whole, np.where(suspects, 0.0, decision.weight), tried)
        if not _stands_out(record.time_s, profile).any() and (weight == decision.weight).all():
            break
        again = decide(record, decision._replace(weight=weight, model=calm), tune_first=False)
        if (again.weight == decision.weight).all() or (again.weight.sum(0) < LEAST_KEPT * first.sum(0)).any():
            break
        decision, profile = again, None
    if profile is None:
        profile = likelihood.fit_profile(*record.log, decision.weight, decision.starts, decision.model, LOOK_STEPS)
    return decision._replace(model=profile)


def _stands_out(time_s: FloatArray, profile: Model) -> NDArray[np.bool_]:
    """(n,) samples in pieces of the profile that are far above its median."""
    jerk = profile.jerk[:, 0]
    piece = np.zeros(len(time_s), int)
    if np.isfinite(profile.knot_s):
        piece = np.clip(((time_s - time_s[0]) / profile.knot_s).astype(int), 0, len(jerk) - 1)
    found: NDArray[np.bool_] = (jerk >= STANDS_OUT * np.median(jerk))[piece]
    return found


def _widened(marked: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) true within AROUND samples of what is marked."""
    edges = np.zeros(len(marked) + 1, int)
    for begin, end in runs_of(marked):
        edges[max(begin - AROUND, 0)] += 1
        edges[min(end + AROUND, len(marked))] -= 1
    return np.cumsum(edges)[:-1] > 0


def _spans(marked: NDArray[np.bool_]) -> Iterator[slice]:
    """The runs of what is marked, in pieces that are not too long."""
    for begin, end in runs_of(marked):
        pieces = max(1, round((end - begin) / LONGEST_SPAN))
        for low, high in itertools.pairwise(np.linspace(begin, end, pieces + 1).astype(int)):
            yield slice(low, high)


def _suspects(record: Record, decision: Decision, calm: Model, profile: Model) -> NDArray[np.bool_]:
    """(n, 3) readings that are good so far, in runs that are off together if the flight is calm, and off at once at
    both ends even if it is not."""
    weight, starts = decision.weight, decision.starts
    smoothed = smooth_log(*record.log, weight, calm, starts, residuals_only=True)
    suspects = runs.suspicious(record.time_s, smoothed.residual, smoothed.residual_variance, weight)
    if suspects.any():
        without = smooth_log(*record.log, np.where(suspects, 0.0, weight), profile, starts, residuals_only=True)
        suspects = runs.confirmed(suspects, without.residual, without.residual_variance)
    return suspects
