"""How much a window keeps, and what its newest part begins with: the filter's prediction there, and the pieces of the
jerk profile that hold from there on."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ftproc.core.filtering.beside import WEIGHT
from ftproc.core.filtering.forward import Span, run_weighted, run_weighted_coloured
from ftproc.core.filtering.initialization import WIDEST_BLIND_BRIDGE
from ftproc.core.filtering.records import Model, Observations, Start, empty_rows
from ftproc.core.identification.profile import MAX_KNOTS
from ftproc.core.live.predictive_chain import run_predictive, run_predictive_coloured
from ftproc.records import FloatArray

BLOCK = 4096  # samples between edits of a window that has nothing to learn
CROWD = 1024  # samples between refreshes of a window whose clock stands still
CROWDED = 2  # times the newest part, or a CROWD, as samples that wait for their lag: more come much faster than usual


class Sizes(NamedTuple):
    """Samples of the window, and of its newest part, where decisions are open; lag_s: for which samples wait in it."""

    window: int
    near: int
    lag_s: float = 0.0

    @property
    def most_waiting(self) -> int:
        """Samples that wait for their lag; of more, the first ones leave earlier."""
        return CROWDED * max(self.near, CROWD)


class Flown(NamedTuple):
    """How hard the target has manoeuvred so far: the largest density (3,) of its jerk."""

    jerk: FloatArray = np.zeros(3)

    def with_pieces(self, model: Model, count: int) -> Flown:
        """With the first pieces of a profile."""
        return Flown(np.maximum(self.jerk, model.jerk[:count].max(0, initial=0.0)))

    def unseen(self, model: Model, time_s: FloatArray) -> Model:
        """The model with a profile over samples at these times (n,): in pieces that lie in a gap, of which nothing
        tells, the target may manoeuvre as hard as ever; a filter bridges it with the piece in which it ends."""
        if not math.isfinite(model.knot_s):
            return model
        model = stretched(model, float(time_s[-1] - time_s[0]))
        empty = np.ones(len(model.jerk), bool)
        empty[np.minimum((time_s - time_s[0] + 1e-9) / model.knot_s, len(empty) - 1).astype(int)] = False
        empty[1:] |= empty[:-1]
        return model._replace(jerk=np.where(empty[:, None], np.maximum(model.jerk, self.jerk), model.jerk))


def may_be_anywhere(place_m: FloatArray, model: Model, gap_s: float) -> bool:
    """Whether a target at this place (3,) may be so far away after a gap that a filter would linearise about a wrong
    one."""
    moved_m = math.sqrt(float(model.jerk[-1].max()) * gap_s**5 / 20)
    return moved_m > WIDEST_BLIND_BRIDGE * float(np.linalg.norm(place_m))


def predicted(filters: Any) -> Start:
    """A filter's state as the start of what follows."""
    return Start(0, filters["x"][0, :9].copy(), filters["p"][0, :9, :9].copy())


def piece(after_s: float, model: Model) -> int:
    """The piece of a jerk profile that holds so long after its beginning."""
    return int((after_s + 1e-9) / model.knot_s) if math.isfinite(model.knot_s) else 0


def later(pieces: FloatArray, passed: int) -> FloatArray:
    """Those of a profile (m, 3) that are left when so many have passed, at least the last."""
    return pieces[min(passed, len(pieces) - 1) :]


def stretched(model: Model, span_s: float) -> Model:
    """The model with as many pieces of its jerk profile as the span needs; the last one goes on. They become longer
    where MAX_KNOTS of them are too few: one time stamp may lie years after the others."""
    knot_s = max(model.knot_s, span_s / MAX_KNOTS)
    longer = knot_s / model.knot_s if knot_s > model.knot_s else 1.0
    before = np.minimum(longer * np.arange(max(math.ceil(span_s / knot_s), 1)), len(model.jerk) - 1).astype(int)
    return model._replace(jerk=model.jerk[before], knot_s=knot_s)


def filtered(
    log: Observations, span: Span, model: Model, filters: Any, chains: Any, first_s: float
) -> tuple[Any, FloatArray]:
    """`Row` records of a span of a log, filtered from a state, which is changed, and the weights of its range rates.
    chains: of the decisions, which follow; None where all are made. first_s: where the jerk profile begins; NaN with
    the log."""
    rows, profile = empty_rows(len(log.time_s)), model.profile_of(log)
    profile = profile if math.isnan(first_s) else profile._replace(first_s=first_s)
    samples = log.samples(model.noise_variance)
    if chains is None:
        (run_weighted_coloured if model.coloured else run_weighted)(span, samples, profile, filters, False, rows)
    else:
        (run_predictive_coloured if model.coloured else run_predictive)(span, samples, profile, filters, chains, rows)
    return rows, profile.beside[0, :, WEIGHT] if log.beside else np.ones(len(rows))
