"""How likely a part of a log is with some curves of faults and without them: the one score by which they are accepted.

Readings, curves with their sizes integrated out, outlier decisions, and the process noise, which is the part's own each
time: it may grow for a moment, as a manoeuvre asks for, but seldom does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core import odds
from ftproc.core.editing import outlier_chain, patch_likelihood
from ftproc.core.editing.decisions import Decision, Record
from ftproc.core.editing.lasting.curves import CLOCK, Curve, Fitted, Setting, fitted, without
from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.filtering.smoother import RESIDUALS, SmootherRun, smooth_log
from ftproc.core.identification.likelihood import fit_jerk
from ftproc.core.identification.nearby import start_of_part
from ftproc.core.identification.profile import fit_profile, median_level, of_part, roughness, starts_of
from ftproc.core.identification.stretches import runs_of
from ftproc.core.identification.uneven_noise import rates
from ftproc.core.model import stations
from ftproc.core.work import Work
from ftproc.order_statistics import median
from ftproc.records import FloatArray, IntArray

BESIDE = 12  # samples between two faults that may be one: a track that was followed joins the other within them
SETTLED = 2  # rounds of deciding, at most
TAKEN_IN, EVEN = 3, 5.0  # readings in a rejected run, and second differences in sigmas, that may be a track
PROFILE_STEPS = 2  # of the search for the process noise


class Scene(NamedTuple):
    """A part of a log of one or several stations, and what decides in it.

    log: with the weights as decided. possible (n, 3): readings that may be good. taken_in (n, 3): the weights with the
    rejected runs that may be a track. setting: see `curves`. at_median: the model with the median process noise;
    fixed: whether that is known. rates (stations, 3, 3) of outliers. gate: in sigmas. residual (n, 3): leave-one-out,
    as decided. track, doubt: (n, 9) states about which a filter may start, and their 1-sigma; None where a start is to
    be found in the readings. work: what weighing may still cost; None without a bound.
    """

    log: Observations
    possible: NDArray[np.bool_]
    taken_in: FloatArray
    setting: Setting
    at_median: Model
    fixed: bool
    rates: FloatArray
    gate: float
    residual: FloatArray
    track: FloatArray | None = None
    doubt: FloatArray | None = None
    own: Model | None = None
    work: Work | None = None

    def part(self, near: slice | IntArray) -> Scene:
        """Some of the samples."""
        return self._replace(
            log=self.log.part(near), possible=self.possible[near], taken_in=self.taken_in[near],
            setting=self.setting.part(near), residual=self.residual[near],
            track=None if self.track is None else self.track[near],
            doubt=None if self.doubt is None else self.doubt[near],
        )  # fmt: skip

    def stretch(self, near: slice) -> Scene:
        """Some of the samples, with the process noise that they have in the log."""
        part = self.part(near)
        return part._replace(own=self.own and of_part(self.own, part.log.time_s - self.log.time_s[0]))

    def without(self, curves: Sequence[Curve]) -> Scene:
        """With curves taken out of the readings."""
        return self._replace(log=self.log._replace(measurement=without(self.log.measurement, self.setting, curves)))

    def taking_in(self, curves: Sequence[Curve]) -> FloatArray:
        """Weights (n, 3) as decided, but with the rejected runs of what the curves act on taken in."""
        weight = self.log.weight.copy()
        for curve in curves:
            rows, columns = self.setting.rows(curve), slice(None) if curve.component == CLOCK else curve.component
            weight[rows, columns] = self.taken_in[rows, columns]
        return weight

    def stations(self) -> Iterator[tuple[int, IntArray]]:
        """Each station, and its samples."""
        if self.setting.station is None:
            yield 0, np.arange(len(self.possible))
            return
        for s in range(len(self.rates)):
            yield s, np.flatnonzero(self.setting.station == s)

    def starts(self, log: Observations, model: Model | None = None) -> list[Start]:
        """Where a filter over the log starts, by the process noise of a model, or by the median."""
        if self.track is not None and self.doubt is not None:
            return [start_of_part(self.track[0], self.doubt[0])]
        return starts_of(log, self.at_median if model is None else model, self.at_median)


class Weighed(NamedTuple):
    """A scene as it is understood: curves with their sizes, and the 1-sigma of the first term of each; weights (n, 3),
    the model, and the log-probability of all of it."""

    curves: tuple[Curve, ...]
    sigma: tuple[float, ...]
    weight: FloatArray
    model: Model
    log_probability: float


class Found(NamedTuple):
    """curves: that are accepted together, with the 1-sigma of the first term of each. gain: of log-probability, with
    their prior; others: what else the jump may be that is less likely by OPEN at most: the best that lies before it,
    that lies behind it, and that stays."""

    curves: tuple[Curve, ...]
    sigma: tuple[float, ...]
    gain: float
    others: tuple[Found, ...] = ()

    def stays(self, n: int) -> bool:
        """Whether the fault lasts until an end of the log of n samples."""
        return self.curves[0].begin == 0 or self.curves[0].end == n

    def lies(self, sample: int, n: int) -> str:
        """Where the readings that are off lie, seen from the jump before a sample."""
        return "on" if self.stays(n) else "before" if self.curves[0].begin < sample else "behind"

    def adjoins(self, other: Found) -> bool:
        """Whether one begins about where, or before, the other ends, in a component of both; a clock acts on all."""
        return any(
            (one.component == each.component or CLOCK in (one.component, each.component))
            and one.begin <= each.end + BESIDE
            and each.begin <= one.end + BESIDE
            for one in self.curves
            for each in other.curves
        )


def weighed(scene: Scene, weight: FloatArray, curves: Sequence[Curve]) -> Weighed:
    """The scene with these curves, decided on from these weights on. Raises ValueError where a component has too few
    readings."""
    if scene.work is not None:
        scene.work.left -= len(scene.possible)
    model, known, settled = scene.at_median, tuple(curves), False
    for _ in range(SETTLED):
        found = _fitted(scene, scene.log._replace(weight=weight), model, known)
        known = found.curves
        starts = scene.starts(found.log)
        if not scene.fixed:
            level = fit_jerk(found.log, starts, scene.at_median)
            model = fit_profile(found.log, starts, level, PROFILE_STEPS)
        smoothed = smooth_log(found.log, model, scene.starts(found.log, model), RESIDUALS)
        before, weight = weight, _decided(scene, smoothed, model)
        settled = bool((weight == before).all())
        if settled:
            break
    if curves or not settled:
        found = _fitted(scene, scene.log._replace(weight=weight), model, known)
        smoothed = smooth_log(found.log, model, scene.starts(found.log, model), RESIDUALS)
    return _understood(scene, found, smoothed, weight, model)


def as_it_is(scene: Scene, weight: FloatArray, model: Model) -> Weighed:
    """The scene without curves, with these weights (n, 3) and by this model."""
    found = _fitted(scene, scene.log._replace(weight=weight), model, ())
    smoothed = smooth_log(found.log, model, scene.starts(found.log, model), RESIDUALS)
    return _understood(scene, found, smoothed, weight, model)


def _understood(scene: Scene, found: Fitted, smoothed: SmootherRun, weight: FloatArray, model: Model) -> Weighed:
    """The scene with fitted curves, weights (n, 3) and a model, and what is smoothed with them."""
    likely = found.log_probability if found.curves else smoothed.log_likelihood
    likely += _rejections(scene, weight, smoothed, model) - roughness(model)
    likely -= odds.START * (len(scene.starts(found.log, model)) - 1)
    first = np.cumsum([0, *(len(curve.size) for curve in found.curves)])[:-1]
    sigma = np.sqrt(np.diag(found.covariance))[first] if found.curves else np.zeros(0)
    return Weighed(found.curves, tuple(sigma.tolist()), weight, model, likely)


def late_of(log: Observations, state: FloatArray) -> FloatArray:
    """(n, 3) by which readings of states (n, 9) grow with an offset of their clock, per s."""
    if log.sites is None:
        return -rates(state)
    station, position, axes, _ = log.sites
    return np.ascontiguousarray(stations.design(state, position[station], axes[station])[:, :, 2])


def _fitted(scene: Scene, log: Observations, model: Model, curves: tuple[Curve, ...]) -> Fitted:
    """The curves with the likeliest sizes, if there are any."""
    if not curves:
        return Fitted((), log, 0.0, np.zeros((0, 0)))
    starts = scene.starts(log._replace(measurement=without(log.measurement, scene.setting, curves)), model)
    return fitted(log, model, starts, scene.setting, curves)


def _decided(scene: Scene, smoothed: SmootherRun, model: Model) -> FloatArray:
    """(n, 3) weights, by the outlier chain of each station."""
    weight, noise = np.zeros(scene.possible.shape), model.noise_variance.reshape(-1, 3)
    for s, rows in scene.stations():
        residual, variance = smoothed.residual[rows], smoothed.residual_variance[rows]
        good = outlier_chain.classify(residual, variance, noise[s].copy(), scene.rates[s].copy(), scene.gate)
        weight[rows] = (good > 0.5) & scene.possible[rows]
    return weight


def _rejections(scene: Scene, weight: FloatArray, smoothed: SmootherRun, model: Model) -> float:
    """Log-probability of the rejected readings, and of there being such."""
    noise, time_s = model.noise_variance.reshape(-1, 3), scene.log.time_s
    return sum(
        patch_likelihood.log_probability_of_all(
            time_s[rows], smoothed.residual[rows], smoothed.residual_variance[rows], weight[rows],
            scene.possible[rows], noise[s].copy(), scene.rates[s],
        )
        for s, rows in scene.stations()
    )  # fmt: skip


def scene_of(record: Record, decision: Decision, work: Work | None) -> Scene:
    """A log as it has been decided on, in which faults that last are sought."""
    log, at_median = record.weighted(decision.weight), median_level(decision.model)
    smoothed = smooth_log(log, decision.model, decision.starts)
    weight = with_even_runs(log.weight, record.possible, smoothed.residual, np.sqrt(at_median.noise_variance))
    setting = Setting(record.time_s, late_of(log, smoothed.state))
    return Scene(
        log, record.possible, weight, setting, at_median, record.fixed.jerk, decision.rates[None], record.gate,
        smoothed.residual, own=decision.model, work=work,
    )  # fmt: skip


def with_even_runs(
    weight: FloatArray, possible: NDArray[np.bool_], residual: FloatArray, sigma: FloatArray
) -> FloatArray:
    """Weights (n, 3) with the rejected runs whose readings lie on a track of their own taken in. residual: (n, 3)
    leave-one-out. sigma (3,) of the noise."""
    found = weight.copy()
    for c in range(3):
        seen = np.flatnonzero(possible[:, c])
        for begin, end in runs_of(weight[seen, c] <= 0, TAKEN_IN):
            if median(np.abs(np.diff(residual[seen[begin:end], c], 2))) < EVEN * sigma[c]:
                found[seen[begin:end], c] = 1.0
    return found
