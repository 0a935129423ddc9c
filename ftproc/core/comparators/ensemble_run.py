"""The ensemble and particle filters over a log of slant range, azimuth and elevation: 9 states, 3 readings."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ftproc.core.comparators import ensemble, particles
from ftproc.core.editing.track import RETRY_SAMPLES, reacquire
from ftproc.core.filtering.forward import lead_in
from ftproc.core.filtering.records import FilterRun, Model, Start, empty_run
from ftproc.core.model.frames import line_of_sight_axes
from ftproc.core.model.measurement import MIN_RANGE_M

FloatArray = NDArray[np.float64]

BELIEVED = 0.5  # a reading used so far confirms the track
POWERS_OF_T = np.repeat([2.5, 1.5, 0.5], 3)  # by which Q(T)'s factor grows, row by row
UNIT_NOISE = np.array([[1 / 20, 1 / 8, 1 / 6], [1 / 8, 1 / 3, 1 / 2], [1 / 6, 1 / 2, 1.0]])  # Q(1 s) for a jerk of 1


class Motion(NamedTuple):
    """Constant acceleration driven by white jerk: factors (pieces, 9, 9) of Q(1 s), and how long each piece holds."""

    factor: FloatArray
    knot_s: float

    @classmethod
    def of(cls, model: Model) -> Motion:
        """Of the jerk tensors of a model."""
        xx, xy, xz, yy, yz, zz = model.jerk.T
        tensors = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], -1).reshape(-1, 3, 3)
        unit = np.linalg.cholesky(UNIT_NOISE)
        return cls(np.array([np.kron(unit, ensemble.root(tensor)) for tensor in tensors]), model.knot_s)

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
    readings[:, 0] = np.maximum(np.sqrt(ground * ground + z * z), MIN_RANGE_M)
    readings[:, 1] = np.arctan2(y, x)
    readings[:, 2] = np.arctan2(z, ground)
    return readings


def subtract(a: FloatArray, b: FloatArray) -> FloatArray:
    """a minus b of readings (..., 3), the azimuth in [-pi, pi)."""
    d = a - b
    d[..., 1] -= 2 * np.pi * np.floor(d[..., 1] / (2 * np.pi) + 0.5)
    return d


class Job(NamedTuple):
    """A log, what is told of noise and motion, the method's update, and the run to fill. blocks (n, 2, 3, 3):
    covariances of position and velocity."""

    time_s: FloatArray
    measurement: FloatArray
    sensor: ensemble.Sensor
    motion: Motion
    update: Callable[[ensemble.Forecast, Generator], ensemble.Analysis]
    members: int
    longest_patch_s: float
    rng: Generator
    run: FilterRun
    blocks: FloatArray


def filter_log(
    method: str,
    time_s: FloatArray,
    measurement: FloatArray,
    model: Model,
    starts: list[Start],
    members: int,
    longest_patch_s: float,
    rng: Generator,
) -> tuple[FilterRun, list[Start]]:
    """Run a method of `particles.UPDATES` over the whole log, and every start it made.

    time_s (n,), measurement (n, 3) with NaN where missing. The weight of the run is gamma, how far each reading as a
    whole was used; sigmas are the members' spread. The filter begins anew at each of `starts`, and when no reading
    was believed for longer than `longest_patch_s`: then it is the track that is wrong.
    """
    run, begun = empty_run(time_s), []
    job = Job(
        time_s, measurement, ensemble.Sensor(measure, subtract, np.diag(model.noise_variance)), Motion.of(model),
        particles.UPDATES[method], members, longest_patch_s, rng, run, np.empty((len(time_s), 2, 3, 3)),
    )  # fmt: skip
    likelihood = 0.0
    for start, stop in zip(starts, [s.sample for s in starts[1:]] + [len(time_s)], strict=True):
        begun.append(start)
        likelihood += _follow(job, stop, begun)
    first = starts[0].sample
    axes = line_of_sight_axes(run.state[first:, :3])[:, None]
    variance = np.einsum("...ij,...jk,...ik->...i", axes, job.blocks[first:], axes)
    run.los_sigma[first:] = np.sqrt(np.maximum(variance, 0.0)).reshape(-1, 6)
    lead_in(measurement, model, starts[0], run)
    return run._replace(log_likelihood=likelihood), begun


def _follow(job: Job, stop: int, begun: list[Start]) -> float:
    """Filter from the last start up to sample `stop`, re-acquiring when the track is lost; the log-likelihood."""
    likelihood, k = 0.0, begun[-1].sample
    cloud = ensemble.draw(begun[-1].state, begun[-1].covariance, job.members, job.rng)
    believed_s, retry = job.time_s[k], k
    while k < stop:
        if k > begun[-1].sample:
            since, interval = job.time_s[k] - job.time_s[0], job.time_s[k] - job.time_s[k - 1]
            cloud = job.motion.move(cloud, since, interval, job.rng)
        cloud, gained = _step(job, k, cloud)
        likelihood += gained
        job.run.since_start[k] = k - begun[-1].sample
        if job.run.weight[k].max() >= BELIEVED or not np.isfinite(job.measurement[k]).any():
            believed_s = job.time_s[k]
        elif job.time_s[k] - believed_s > job.longest_patch_s and k >= retry:
            again = reacquire(job.time_s, job.measurement, np.diag(job.sensor.noise), k)
            retry = k + RETRY_SAMPLES
            if again is not None:
                begun.append(again)
                cloud = ensemble.draw(again.state, again.covariance, job.members, job.rng)
                believed_s = job.time_s[k]
                continue  # the sample is filtered again, from the new state
        k += 1
    return likelihood


def _step(job: Job, k: int, cloud: FloatArray) -> tuple[FloatArray, float]:
    """Update the predicted members by sample k and note what came of it; the members and the log-likelihood."""
    run, likelihood = job.run, 0.0
    known = ensemble.forecast(cloud, job.measurement[k], job.sensor)
    run.predicted[k] = run.state[k] = cloud.mean(0)
    run.innovation[k] = run.innovation_sigma[k] = run.nis[k] = np.nan
    run.weight[k] = 0.0
    if known is not None:
        cloud, run.state[k], gamma = job.update(known, job.rng)
        run.innovation[k, known.used] = known.innovation
        run.innovation_sigma[k, known.used] = np.sqrt(np.diag(known.covariance))
        run.weight[k, known.used] = gamma
        if gamma > 0:
            run.nis[k] = known.rho
            likelihood = -0.5 * (known.rho - np.linalg.slogdet(known.inverse)[1])
    covariance = ensemble.spread(cloud)
    run.sigma[k] = np.sqrt(np.diag(covariance))
    job.blocks[k] = covariance[:3, :3], covariance[3:6, 3:6]
    return cloud, float(likelihood)
