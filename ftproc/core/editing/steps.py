"""Steps that stay: an encoder that slips, a range ambiguity, another lobe, a clock that jumps.

From one backward pass come the estimate and the variance of a step between any two samples (de Jong and Penzer 1998;
see `smoother.shifts`): of a component, and of the clock, which moves the target along its way. A manoeuvre may look
like a step to a filter that expects a calm flight, so each step that stands out is weighed against the same stretch
without it: both with a process noise that follows the flight, and with outlier decisions of their own.

Two-pass editing without steps follows one as motion, and rejects what lies beside it, or all that comes after it, as a
patch. So rejected runs that lie on a track of their own are taken in again before steps are looked for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.editing.alternatives import Neighbourhood, decisions
from ftproc.core.editing.decisions import Decision, Record
from ftproc.core.editing.runs import runs_of
from ftproc.core.filtering.initialization import find_starts, first_state
from ftproc.core.filtering.records import Model, Observations
from ftproc.core.filtering.smoother import shifts, smooth_log
from ftproc.core.identification.likelihood import Fixed, fit_level
from ftproc.core.identification.profile import fit_profile, median_level
from ftproc.core.model.frames import from_cartesian, wrap

FloatArray = NDArray[np.float64]

CLOCK = 3  # in place of a component
LEAST = 5.0  # sigmas of a step's estimate that make it worth weighing
FEWEST, EVEN = 3, 3.0  # readings in a rejected run, and sigmas between its neighbours, that may be a track
AROUND = 100  # samples on each side that decide between step and manoeuvre
APART = 25  # samples between steps of one component
MARGIN = 4.0  # by which the log-probability of a stretch with a step must be better, and ln of the places for it
MOST = 8  # steps that are weighed at a time
PROFILE_STEPS = 3  # of the search for the jerk profile of a stretch
END = 5  # samples at either end in which no step is looked for


class Step(NamedTuple):
    """From a sample on the readings of a component (range, azimuth, elevation) are larger by `size` m, rad, rad, or,
    where it is CLOCK, their times by so many seconds. sigma: 1-sigma of the size."""

    component: int
    sample: int
    size: float
    sigma: float


def find(record: Record, decision: Decision) -> list[Step]:
    """The steps in a log whose outliers were decided as if it had none."""
    calm = median_level(decision.model)
    weight = _taken_in(record, decision, calm)
    found: list[Step] = []
    for step in _standing_out(record.weighted(weight), calm):
        if _is_likelier(record, decision, weight, found, step):
            found.append(step)
    return found


def bridged(log: Observations, model: Model, steps: Sequence[Step]) -> FloatArray:
    """The readings (n, 3) as they would be without the steps: those after each are moved to the side before it."""
    z = log.measurement.copy()
    for step in steps:
        later = slice(step.sample, len(z))
        if step.component == CLOCK:
            z[later] -= _way(log._replace(measurement=z), model, step)
        else:
            z[later, step.component] -= step.size
    z[:, 1] = wrap(z[:, 1])
    return z


def spread(state: FloatArray, steps: Sequence[Step]) -> tuple[FloatArray, FloatArray]:
    """(n, 3) variances, m2, that the uncertain sizes of the steps add to the positions of states (n, 9) after them:
    along x, y, z, and along the radial, cross and up axes."""
    axes, lines = np.zeros((len(state), 3)), np.zeros((len(state), 3))
    for step in steps:
        after = state[step.sample :]
        (x, y, z), ground = after[:, :3].T, np.hypot(after[:, 0], after[:, 1])
        slant = np.hypot(ground, z)
        out = after[:, :3] / slant[:, None]
        cross = np.stack([-y, x, np.zeros_like(x)], 1) / np.maximum(ground, 1e-300)[:, None]
        turned = np.stack([out, cross, np.cross(out, cross)], 1)
        moves = (out, cross * ground[:, None], turned[:, 2] * slant[:, None], after[:, 3:6])[step.component]
        axes[step.sample :] += (moves * step.sigma) ** 2
        lines[step.sample :] += ((turned @ moves[:, :, None])[:, :, 0] * step.sigma) ** 2
    return axes, lines


def _way(log: Observations, model: Model, step: Step) -> FloatArray:
    """(m, 3) by how much the readings from a clock's jump on are larger than those of the target so many seconds later
    on its way, which the readings after the jump alone tell."""
    later = slice(step.sample, len(log.time_s))
    after = log.part(later)
    start = first_state(after, model.noise_variance, 0, slice(0, len(after.time_s)))
    state = smooth_log(after, median_level(model), [start]).state
    position, velocity, acceleration = state[:, :3], state[:, 3:6], state[:, 6:]
    further = position + step.size * (velocity + 0.5 * step.size * acceleration)
    way: FloatArray = from_cartesian(position) - from_cartesian(further)
    way[:, 1] = wrap(way[:, 1])
    return way


def _taken_in(record: Record, decision: Decision, calm: Model) -> FloatArray:
    """The decisions' weights (n, 3), but with the rejected runs whose readings lie on a track of their own."""
    weight = decision.weight.copy()
    rejected = record.possible & (weight <= 0)
    if not (rejected[:-1] & rejected[1:]).any():
        return weight
    log = record.weighted(decision.weight)
    residual = smooth_log(log, calm, decision.starts, residuals_only=True).residual
    sigma = np.sqrt(calm.noise_variance)
    for c in range(3):
        seen = np.flatnonzero(record.possible[:, c])
        for begin, end in runs_of(weight[seen, c] <= 0):
            run = seen[begin:end]
            if len(run) >= FEWEST and np.median(np.abs(np.diff(residual[run, c]))) < EVEN * sigma[c]:
                weight[run, c] = 1.0
    return weight


def _standing_out(log: Observations, calm: Model) -> list[Step]:
    """The steps of which a calm flight would show too little, the clearest first."""
    try:
        starts = find_starts(log, calm.noise_variance, float(calm.jerk[0, 0]))
    except ValueError:
        return []
    score, information = shifts(log, calm, starts)
    size = np.divide(np.abs(score), np.sqrt(np.maximum(information, 0)), out=np.zeros_like(score), where=information > 0)
    size[:END] = size[-END:] = 0.0
    found: list[Step] = []
    while len(found) < MOST and size.max() > LEAST:
        k, c = (int(i) for i in np.unravel_index(int(size.argmax()), size.shape))
        estimate, sigma = score[k, c] / information[k, c], 1 / math.sqrt(information[k, c])
        found.append(Step(c, k + 1, float(-estimate if c == CLOCK else estimate), sigma))
        size[max(k - APART, 0) : k + APART, c] = 0.0
    return found


def _is_likelier(record: Record, decision: Decision, weight: FloatArray, known: Sequence[Step], step: Step) -> bool:
    """Whether a stretch of the log is likelier with a step than without, given the steps that are known."""
    near = slice(max(step.sample - AROUND, 0), step.sample + AROUND)
    part, calm = record.part(near), median_level(decision.model)
    inside = [s._replace(sample=s.sample - near.start) for s in known if near.start < s.sample < near.stop]
    one = step._replace(sample=step.sample - near.start)
    try:
        without = part._replace(measurement=bridged(part.weighted(weight[near]), calm, inside))
        best = max(_likelihood(without, w[near], decision, calm) for w in (decision.weight, weight))
        bridge = without._replace(measurement=bridged(without.weighted(weight[near]), calm, [one]))
        gain = _likelihood(bridge, weight[near], decision, calm) - best
    except ValueError:  # a component has too few readings there
        return False
    return gain > MARGIN + math.log(4 * len(record.time_s))


def _likelihood(part: Record, weight: FloatArray, decision: Decision, calm: Model) -> float:
    """Log-probability of the readings of a stretch, with a process noise and outlier decisions of its own."""
    log = part.weighted(weight)
    starts = find_starts(log, calm.noise_variance, float(calm.jerk[0, 0]))
    model = calm
    if not part.fixed.jerk:
        level = fit_level(log, starts, calm, Fixed(np.ones(3, bool), False))
        model = fit_profile(log, starts, level, PROFILE_STEPS)
    stretch = Neighbourhood(
        part.time_s, part.measurement, part.possible, model, decision.rates, part.gate, part.uneven
    )
    return max(step.likelihood for step in decisions(stretch, weight))
