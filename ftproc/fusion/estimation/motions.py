"""The motion of a fused flight: the model that the readings of all stations choose, and the runs over events with it.

A motion whose forces act is linearised about the track that was smoothed before; so that no step turns too far, gaps
between the events get samples without readings, which the runs that are returned do not have.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.biases import Biased, Directions, smooth_biased
from ftproc.core.filtering.forward import filter_log
from ftproc.core.filtering.records import FilterRun, Model, Observations, Start
from ftproc.core.filtering.smoother import PATHS, residuals_beside, smooth_log
from ftproc.core.identification.motions import motion_models
from ftproc.core.identification.motions.motion_models import Candidates
from ftproc.core.identification.profile import knot_length
from ftproc.core.identification.scales import scales_of
from ftproc.core.model.moving import between
from ftproc.records import FloatArray, IntArray

OTHER_KNOTS = 1.5  # times the distance of the knots of the jerk profile, before they are laid out again


class Motive(NamedTuple):
    """name: of the motion, in `motion_models.MODELS`. gain: by how much likelier the readings are than with white jerk;
    of white jerk, by how much the best of the others is, see `motion_models.Chosen`. abrupt_s: times of abrupt changes
    of the acceleration."""

    name: str = motion_models.WHITE
    gain: float = 0.0
    abrupt_s: tuple[float, ...] = ()

    def share(self, of: float, first_s: float, stop_s: float) -> Motive:
        """What such a share of the rows, between these times, has of the gain."""
        return self._replace(gain=of * self.gain, abrupt_s=tuple(t for t in self.abrupt_s if first_s <= t < stop_s))


def choose(
    log: Observations, start: Start, white: Model, among: Candidates, known: NDArray[np.bool_]
) -> tuple[Motive, Model]:
    """The likeliest motion, and the model with it. white, among, known: as in `motion_models.choose`."""
    found = motion_models.choose(log, [start], white, among, known)
    return Motive(found.name, found.gain, tuple(found.abrupt_s())), found.model


class _Stepped(NamedTuple):
    """A log with steps in its gaps, its start, the model linearised there, and the rows of the log's own samples."""

    log: Observations
    start: Start
    model: Model
    row: IntArray | None


def _stepped(log: Observations, model: Model, start: Start, state: FloatArray) -> _Stepped:
    """state: (n, 9) about which the motion is linearised."""
    if not model.motion.acts:
        return _Stepped(log, start, model, None)
    dense, (begin,), row = motion_models.with_steps(log, [start], state)
    course = state if row is None else between(log.time_s, state, dense.time_s)
    return _Stepped(dense, begin, model._replace(motion=model.motion.about(course)), row)


def smoothed(log: Observations, model: Model, start: Start, directions: Directions, state: FloatArray) -> Biased:
    """Smooth the events of all stations, those before the start too; see `biases.smooth_biased`. state: (n, 9) about
    which the motion is linearised."""
    stepped = _stepped(log, model, start, state)
    if stepped.row is not None:
        n, kinds = len(stepped.log.time_s), len(directions.beside)
        design, scalars = np.zeros((n, 3, 3)), np.zeros((kinds, n, directions.beside.shape[2]))
        design[stepped.row], scalars[:, stepped.row] = directions.design, directions.beside
        directions = directions._replace(design=design, beside=scalars)
    found = smooth_biased(stepped.log, stepped.model, stepped.start, directions)
    if stepped.row is not None:
        (head,) = found.run.heads
        run = motion_models.of_rows(found.run, stepped.row)._replace(heads=(head._replace(sample=start.sample),))
        beside = found.beside[:, stepped.row] if len(found.beside) else found.beside
        found = found._replace(run=run, spread=found.spread[stepped.row], beside=beside)
    _lead_in(log, model, found, state)
    return found


def _lead_in(log: Observations, model: Model, found: Biased, state: FloatArray) -> None:
    """Smooth the events before the start too, in place: back in time from the smoothed state there."""
    head = found.run.heads[0]
    if head.sample == 0:
        return
    there = slice(head.sample, None, -1)
    back = log.part(there)
    back.weight[0] = 0.0  # is in the head
    back = back._replace(beside=tuple(each._replace(weight=np.r_[0.0, each.weight[1:]]) for each in back.beside))
    behind = model._replace(jerk=model.jerk[:1], knot_s=math.inf, motion=model.motion.about(state[there]))
    given = back, behind, [head._replace(sample=0)]
    for filled, values in zip(found.run[:7], smooth_log(*given, PATHS)[:7], strict=True):
        filled[: head.sample] = values[:0:-1]
    if back.beside:
        found.beside[:, : head.sample] = residuals_beside(*given)[:, :0:-1]


def filtered(log: Observations, model: Model, start: Start, state: FloatArray) -> FilterRun:
    """The causal filter over the events of all stations. state: (n, 9) smoothed."""
    stepped = _stepped(log, model, start, state)
    run = filter_log(stepped.log, stepped.model.causal, [stepped.start])
    return motion_models.of_rows(run, stepped.row)


def on_knots(log: Observations, model: Model) -> Model:
    """The model with as many knots as its profile needs over the events, whose span the clocks move; farther apart or
    closer together where the jerk has become another than the one that they were laid out for."""
    if not math.isfinite(model.knot_s):
        return model
    scales = scales_of(log, model.noise_variance)
    knot_s = knot_length(scales, float(np.median(model.jerk[:, 0])))
    if model.knot_s / OTHER_KNOTS < knot_s < model.knot_s * OTHER_KNOTS:
        knot_s = model.knot_s
    middle_s = (np.arange(max(math.ceil(scales.span_s / knot_s), 1)) + 0.5) * knot_s
    before = np.minimum((middle_s / model.knot_s).astype(int), len(model.jerk) - 1)
    return model._replace(jerk=model.jerk[before], knot_s=knot_s)
