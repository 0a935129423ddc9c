"""The motion of an aircraft in a live track: a second filter, whose force turns with the velocity, over the same
readings and decisions, and the mixture of both. Its acceleration along the path fades.

The weight of the second follows from how well both have predicted the readings as they came (Bayesian model averaging,
Raftery et al. 2010, Technometrics 52, eq. 15-16). Its odds are bounded, so that a manoeuvre which it does not follow
costs it its weight within a few readings; and they are never better than those of its present run alone, which begins
with every refresh where that of white jerk does. So a second filter that diverges is not published.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ftproc.core.filtering.forward import Span
from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.filtering.smoother import SmootherRun, smooth_log
from ftproc.core.identification.motions.motion_models import MODELS
from ftproc.core.identification.profile import ALLOWANCE, climbed, with_allowance
from ftproc.core.identification.scales import Scales
from ftproc.core.live.pieces import filtered, later
from ftproc.records import FloatArray

MOST = 2.0  # of the logarithm of the odds, for and against
STEPS, EVERY = 1, 4  # of the search for its jerk profile, and refreshes from one to the next
LEAST, TINY = 1e-9, 1e-300  # weight that is none, and variance
MOTION = MODELS["turning-force"]._replace(fades=1.0)  # without, velocities are up to 3 % worse
MIXED = ("state", "predicted", "innovation", "nis")


class Case(NamedTuple):
    """The newest part of a window: the log with its decisions, the model with white jerk and its allowance, the
    prediction at its first sample, and scales."""

    log: Observations
    white: Model
    anchor: Start
    scales: Scales


class Second:
    """A filter beside one with white jerk, whose decisions it takes over. odds: the logarithm of those of the two
    filters, by the readings as they came. run: the same of its present run alone."""

    model: Model
    filters: Any

    def __init__(self) -> None:
        self.odds, self.run = -MOST, 0.0

    @property
    def weight(self) -> float:
        """Of its estimate in the mixture."""
        return 1 / (1 + math.exp(min(-min(self.odds, self.run), 700.0)))

    def begin(self, model: Model, filters: Any) -> None:
        """Begin a run with the state of some filters, which are changed."""
        self.model, self.filters, self.run = model, filters, 0.0

    def append(self, log: Observations, span: Span, rows: Any, first_s: float) -> None:
        """Run it over the next readings, as `rows` have decided on them, and mix its rows into these; see
        `pieces.filtered`."""
        new, weight = slice(span.first, span.last), np.zeros(len(rows))
        log.weight[new] = rows["weight"][new]
        other, _ = filtered(log, span, self.model, self.filters, None, first_s)
        for k, gained in enumerate(_gained(rows, other)[new].tolist(), span.first):
            self.odds, self.run = max(min(self.odds + gained, MOST), -MOST), self.run + gained
            weight[k] = self.weight
        _mix(rows, other, weight, MIXED)


class Turning:
    """The second filter of a window; nothing is done unless it acts. share: (m, 3) of the density of white jerk, piece
    by piece, that it needs."""

    def __init__(self, acts: bool) -> None:
        self.acts, self.share, self.second, self.refreshes = acts, np.ones((1, 3)), Second(), 0

    def passed(self, pieces: int) -> None:
        """The newest part begins so many pieces of the profile later."""
        self.share = later(self.share, pieces)

    def anew(self) -> None:
        """The profile of white jerk begins anew; the typical share stays."""
        self.share = np.exp(np.log(self.share).mean(0, keepdims=True))

    def refresh(self, case: Case, rows: Any) -> None:
        """Fit it to the newest part now and then, run it, and mix its rows into those of white jerk (n,)."""
        if not self.acts:
            return
        log, white, second = case.log, case.white, self.second
        held = self.share[np.minimum(np.arange(len(white.jerk)), len(self.share) - 1)]
        model = white._replace(jerk=held * white.jerk / ALLOWANCE, motion=MOTION)
        if self.refreshes % EVERY == 0:
            course = smooth_log(log, white, [case.anchor]).state
            about = model._replace(motion=model.motion.about(course))
            model = climbed(log, [case.anchor], about, STEPS, case.scales)[0]
            self.share = ALLOWANCE * model.jerk / white.jerk
        self.refreshes += 1
        model = with_allowance(log, model, case.scales).causal
        second.begin(model, model.filter(case.anchor))
        other, _ = filtered(log, Span(0, len(log.time_s), 0), model, second.filters, None, math.nan)
        second.run = float(_gained(rows, other).sum())
        _mix(rows, other, np.full(len(rows), second.weight), MIXED)

    def append(self, log: Observations, span: Span, rows: Any, first_s: float) -> None:
        """See `Second.append`."""
        if self.acts:
            self.second.append(log, span, rows, first_s)

    def smoothed(self, log: Observations, anchor: Start, white: SmootherRun) -> SmootherRun:
        """The same mixture of the smoothed newest part."""
        if not self.acts:
            return white
        model = self.second.model
        model = model._replace(motion=model.motion.about(white.state))
        other = smooth_log(log, model, [anchor])
        found = {name: getattr(white, name).copy() for name in ("state", "sigma", "los_sigma", "path_sigma")}
        _mix(found, {"state": other.state}, np.full(len(white.state), self.second.weight), ("state",))
        return white._replace(**found)


def _gained(rows: Any, other: Any) -> FloatArray:
    """(n,) by how much more likely the readings that were used are with other rows, but for the correlation of their
    innovations, in log-likelihood. Nothing speaks for a filter that has no numbers."""
    found: list[FloatArray] = []
    for each in (rows, other):
        used = each["weight"] > 0
        size = np.log(np.where(used, each["innovation_sigma"], 1.0)).sum(1)
        found.append(np.where(used.any(1), -0.5 * each["nis"] - size, 0.0))
    gained = found[1] - found[0]
    return np.where(np.isfinite(gained), gained, -np.inf)


def _mix(rows: Any, other: Any, weight: FloatArray, names: tuple[str, ...]) -> None:
    """Mix other rows into some, in place; weight: (n,) of the others. Sigmas stay those of white jerk, and allow for
    the difference of both: how the next manoeuvre begins, neither model knows."""
    some = np.flatnonzero((weight > LEAST) & np.isfinite(other["state"]).all(1))
    share = weight[some, None]
    with np.errstate(over="ignore", invalid="ignore"):  # after a gap of years; such rows are not published
        apart = share * (1 - share) * (other["state"][some] - rows["state"][some]) ** 2
        wider = np.sqrt(1 + apart / np.maximum(rows["sigma"][some] ** 2, TINY))
        rows["sigma"][some] *= wider
        for name in ("los_sigma", "path_sigma"):
            rows[name][some] *= wider.max(1, keepdims=True)
        for name in names:
            here, there = rows[name][some].T, other[name][some].T
            rows[name][some] = ((1 - share[:, 0]) * here + share[:, 0] * there).T
