"""The feature set `motion`: what the target does, as the filter sees it, in line-of-sight axes and in units of the
filter's own sigmas and memory, so that one network serves any range, rate, noise and target.

A filter that takes the jerk for white noise lags behind every manoeuvre in the same way: the acceleration of a steady
turn has the rate -|a_n|^2/|v|^2 v, that of a change of thrust stays where it is. The last innovations alone do not say
which it is.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ftproc.core.filtering.records import FilterRun
from ftproc.correction.features import APPLIED, LOS_NAMES, Features, LineOfSight, innovations, lever_m
from ftproc.records import FloatArray, IntArray

GRAVITY = 9.81  # m/s2
SLOW_MPS = 0.5  # below this a target has no direction
LONGEST = 256  # samples that are used before one at most
MOST = 6.0  # innovations are cut off at so many sigmas
FARTHEST = 5.0  # sigmas, and so of targets: what is learned is not the few worst samples
SINGLE, SUMS = 4, (4, 8, 16)  # innovations, and sums of those before
MEMORIES = (0.5, 2.0)  # of the filter, over which changes of the acceleration are taken


class MotionFeatures(Features):
    """Sums of innovations; the acceleration, its part across the velocity, and its rate in a steady turn, over the
    sigma of the acceleration; its changes; how the sigmas of readings, position, velocity and acceleration compare;
    direction and speed of the flight; elevation; and which components were used. Targets: the error along the
    line-of-sight axes over the filter's sigma."""

    name = "motion"
    outputs = LOS_NAMES
    direct = True
    proven = True
    hidden = 64
    most = 400
    _SIZE: ClassVar[int] = 61

    @property
    def floor(self) -> FloatArray:
        return np.full(self._SIZE, 0.05)

    def _raw(self, run: FilterRun, start: int, stop: int) -> FloatArray:
        first = max(start - LONGEST, 0)
        latest = innovations(run, start, stop, SINGLE, SUMS).clip(-MOST, MOST)
        return np.concatenate([latest, _Motion(run.rows(first, stop), start - first).columns()], axis=1)

    def unit(self, los: LineOfSight) -> FloatArray:
        return los.sigma

    def targets(self, los: LineOfSight, error: FloatArray) -> FloatArray:
        return self.from_cartesian(los, error[:, :APPLIED]).clip(-FARTHEST, FARTHEST)


class _Motion:
    """Quantities of the motion of a run, from its sample `first` on: m samples. v, a: (m, 3) along the line-of-sight
    axes; course: (n, 3) a of the whole run. memory_s: (m, 1) of the filter, the sigma of the velocity over that of the
    acceleration."""

    def __init__(self, run: FilterRun, first: int) -> None:
        n = len(run.time_s)
        axes = LineOfSight.of(run, 0, n).axes
        self.time_s, self.course = run.time_s, np.einsum("nij,nj->ni", axes, run.state[:, 6:])
        self.run, self.own = run.rows(first, n), np.arange(first, n)
        self.v, self.a = np.einsum("nij,nj->ni", axes[first:], self.run.state[:, 3:6]), self.course[first:]
        self.position_sigma, self.velocity_sigma = self.run.los_sigma[:, :3], self.run.los_sigma[:, 3:]
        self.acceleration_sigma = _rms(self.run.sigma[:, 6:])
        self.memory_s = _rms(self.velocity_sigma) / self.acceleration_sigma

    def columns(self) -> FloatArray:
        """(m, 40)."""
        run, v, a, memory_s = self.run, self.v, self.a, self.memory_s
        unit = self.acceleration_sigma
        speed = np.linalg.norm(v, axis=1, keepdims=True) + SLOW_MPS
        along = (a * v).sum(1, keepdims=True) / speed
        across = a - along * v / speed
        rate = np.linalg.norm(across, axis=1, keepdims=True) / speed  # of turn, rad/s
        x, y, z = run.state[:, :3].T
        ground = np.hypot(x, y)
        innovation_sigma = run.innovation_sigma * lever_m(run.state[:, :3])
        back = [self.samples_back(share) for share in MEMORIES]
        return np.concatenate(
            [
                _compressed(a / unit),
                _compressed(across / unit),
                _compressed(-(rate**2) * v * memory_s / unit),
                _compressed(along / speed * across * memory_s / unit),
                *(_compressed(np.nan_to_num((a - self.course[k]) / unit)) for k in back),
                np.log(self.position_sigma / innovation_sigma),
                np.log(self.position_sigma / (memory_s * self.velocity_sigma)),
                np.log(self.velocity_sigma / (memory_s * unit)),
                np.log(memory_s / self.interval_s()),
                _compressed(speed * memory_s / _rms(self.position_sigma)) / 5,
                v / speed,
                _compressed(3 * rate * memory_s),
                _compressed(np.linalg.norm(a, axis=1, keepdims=True) / GRAVITY),
                np.log(speed) / 3,
                np.log(unit),
                np.arctan2(z, ground)[:, None],
                run.weight > 0.0,
            ],
            axis=1,
        )

    def samples_back(self, memories: float) -> IntArray:
        """(m,) the sample that was so many memories before each, since the filter was initialized."""
        wanted = self.run.time_s - memories * np.nan_to_num(self.memory_s[:, 0], posinf=0.0)
        oldest = np.maximum(self.own - np.minimum(self.run.since_start, LONGEST), 0)
        return np.clip(np.searchsorted(self.time_s, wanted), oldest, self.own)

    def interval_s(self) -> FloatArray:
        """(m, 1) the mean interval of the last 16 samples."""
        back = np.maximum(self.own - 16, 0)
        passed = self.own - back
        return ((self.run.time_s - self.time_s[back]) / np.maximum(passed, 1))[:, None].clip(1e-6)


def _rms(values: FloatArray) -> FloatArray:
    """(n, 1) root mean square of (n, m)."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", values, values) / values.shape[1]))[:, None]


def _compressed(values: FloatArray) -> FloatArray:
    """log(1 + |x|) with the sign of x."""
    return np.asarray(np.sign(values) * np.log1p(np.abs(values)))
