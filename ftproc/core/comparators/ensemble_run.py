"""The ensemble and particle filters over a log of slant range, azimuth and elevation: 9 states, 3 readings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from ftproc.core.comparators import ensemble, particles
from ftproc.core.editing.track import RETRY_SAMPLES, reacquire
from ftproc.core.filtering.forward import lead_in
from ftproc.core.filtering.records import FilterRun, Model, Observations, Start, between, empty_rows
from ftproc.core.model import kinematics
from ftproc.core.model.frames import line_of_sight_axes
from ftproc.core.model.measurement import NO_RANGE_M
from ftproc.records import FloatArray

CONFIRMS = 0.5  # a reading used so far confirms the track
POWERS_OF_T = np.repeat([2.5, 1.5, 0.5], 3)  # by which Q(T)'s factor grows, row by row
UNIT_NOISE = np.array([[1 / 20, 1 / 8, 1 / 6], [1 / 8, 1 / 3, 1 / 2], [1 / 6, 1 / 2, 1.0]])  # Q(1 s) for a jerk of 1


class Motion(NamedTuple):
    """Constant acceleration driven by white jerk: factors (pieces, 9, 9) of Q(1 s), and how long each piece holds."""

    factor: FloatArray
    knot_s: float

    @classmethod
    def of(cls, model: Model) -> Motion:
        """Of a model's jerk profile."""
        unit = np.linalg.cholesky(UNIT_NOISE)
        return cls(np.array([np.kron(unit, np.diag(np.sqrt(jerk))) for jerk in model.jerk]), model.knot_s)

    def move(self, members: FloatArray, since_first_s: float, interval_s: float, rng: Generator) -> FloatArray:
        """Members (n, 9) one interval later, each with its own draw of the jerk."""
        t = interval_s
        piece = min(max(int(since_first_s / self.knot_s), 0), len(self.factor) - 1)
        moved: FloatArray = rng.standard_normal(members.shape) @ self.factor[piece].T * t**POWERS_OF_T
        moved += members
        moved[:, :3] += t * members[:, 3:6] + 0.5 * t * t * members[:, 6:]
        moved[:, 3:6] += t * members[:, 6:]
        return moved


def measure(members: FloatArray) -> FloatArray:
    """h: (n, 9) states -> (n, 3) slant range, azimuth, elevation."""
    x, y, z = members[:, 0], members[:, 1], members[:, 2]
    ground = np.sqrt(x * x + y * y)
    readings = np.empty((len(members), 3))
    readings[:, 0] = np.maximum(np.sqrt(ground * ground + z * z), NO_RANGE_M)
    readings[:, 1] = np.arctan2(y, x)
    readings[:, 2] = np.arctan2(z, ground)
    return readings


def subtract(a: FloatArray, b: FloatArray) -> FloatArray:
    """a minus b of readings (..., 3), the azimuth in [-pi, pi)."""
    d = a - b
    d[..., 1] -= 2 * np.pi * np.floor(d[..., 1] / (2 * np.pi) + 0.5)
    return d


class Settings(NamedTuple):
    """method: of `particles.UPDATES`. members: how many. longest_patch_s: without a reading that is used, after which
    the track counts as lost. tuned: arguments of the method's update by name."""

    method: str
    members: int
    longest_patch_s: float
    rng: Generator
    tuned: Mapping[str, float] = MappingProxyType({})


class _Run:
    """A method over a log: its rows, the covariances of position and velocity (n, 2, 3, 3), the starts it made."""

    def __init__(self, log: Observations, model: Model, settings: Settings) -> None:
        self.log, self.settings = log, settings
        self.sensor = ensemble.Sensor(measure, subtract, np.diag(model.noise_variance))
        self.motion = Motion.of(model)
        self.update: Update = partial(particles.UPDATES[settings.method], **settings.tuned)
        self.rows = empty_rows(len(log.time_s))
        self.covariance = np.empty((len(log.time_s), 9, 9))
        self.starts: list[Start] = []
        self.log_likelihood = 0.0

    def follow(self, start: Start, stop: int) -> None:
        """Filter from a start up to sample `stop`, re-acquiring when the track is lost."""
        time_s, rng, k = self.log.time_s, self.settings.rng, start.sample
        cloud = self._drawn(start)
        used_s, retry = time_s[k], k
        while k < stop:
            if k > self.starts[-1].sample:
                cloud = self.motion.move(cloud, time_s[k] - time_s[0], time_s[k] - time_s[k - 1], rng)
            cloud = self._step(k, cloud)
            self.rows["since_start"][k] = k - self.starts[-1].sample
            if self.rows["weight"][k].max() >= CONFIRMS or not np.isfinite(self.log.measurement[k]).any():
                used_s = time_s[k]
            elif time_s[k] - used_s > self.settings.longest_patch_s and k >= retry:
                again = reacquire(time_s, self.log.measurement, np.diag(self.sensor.noise), k)
                retry = k + RETRY_SAMPLES
                if again is not None:
                    cloud = self._drawn(again)
                    used_s = time_s[k]
                    continue  # the sample is filtered again, from the new state
            k += 1

    def _drawn(self, start: Start) -> FloatArray:
        """Members for a start."""
        self.starts.append(start)
        return ensemble.draw(start.state, start.covariance, self.settings.members, self.settings.rng)

    def _step(self, k: int, cloud: FloatArray) -> FloatArray:
        """Update the predicted members by sample k and keep what came of it; the members."""
        row = {name: self.rows[name] for name in self.rows.dtype.names}
        known = ensemble.forecast(cloud, self.log.measurement[k], self.sensor)
        row["predicted"][k] = row["state"][k] = cloud.mean(0)
        row["innovation"][k] = row["innovation_sigma"][k] = row["nis"][k] = np.nan
        row["weight"][k] = 0.0
        if known is not None:
            cloud, row["state"][k], gamma = self.update(known, self.settings.rng)
            row["innovation"][k, known.used] = known.innovation
            row["innovation_sigma"][k, known.used] = np.sqrt(np.diag(known.covariance))
            row["weight"][k, known.used] = gamma
            if gamma > 0:
                row["nis"][k] = known.rho
                self.log_likelihood += -0.5 * (known.rho - float(np.linalg.slogdet(known.inverse)[1]))
        self.covariance[k] = ensemble.spread(cloud)
        row["sigma"][k] = np.sqrt(np.diag(self.covariance[k]))
        return cloud


Update = Callable[[ensemble.Forecast, Generator], ensemble.Analysis]


def filter_log(
    log: Observations, model: Model, starts: list[Start], settings: Settings
) -> tuple[FilterRun, list[Start]]:
    """Run a method over the whole log, and every start it made.

    The weight of the run is gamma, how far each reading as a whole was used; sigmas are the members' spread. The filter
    is re-initialized at each of `starts`, and when no reading was used for longer than `longest_patch_s`: then it is
    the track that is wrong.
    """
    run = _Run(log, model, settings)
    for start, stop in between(starts, len(log.time_s)):
        run.follow(start, stop)
    rows, first = run.rows, starts[0].sample
    axes = line_of_sight_axes(rows["state"][first:, :3])[:, None]
    covariance = run.covariance[first:]
    blocks = np.stack([covariance[:, at : at + 3, at : at + 3] for at in (0, 3)], 1)
    variance = np.einsum("...ij,...jk,...ik->...i", axes, blocks, axes)
    rows["los_sigma"][first:] = np.sqrt(np.maximum(variance, 0.0)).reshape(-1, 6)
    rows["path_sigma"][first:] = kinematics.sigma_of(rows["state"][first:], covariance)
    lead_in(log, model, starts[0], rows)
    return FilterRun.of(log.time_s, rows, run.log_likelihood), run.starts
