"""The forward pass over a log whose weights are decided: the plain recursive filter."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core import ekf, motion, ukf
from ftproc.core.jit import kernel, part

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Start(NamedTuple):
    """Where a recursion begins: state (9,) and covariance (9, 9) before the update of `sample`."""

    sample: int
    state: FloatArray
    covariance: FloatArray


class Model(NamedTuple):
    """What the filter is told of noise and motion.

    noise_variance: (3,) m^2, rad^2, rad^2. jerk: (m, 6) tensor of the jerk density, m^2/s^5, each row holding for
    `knot_s` seconds from the first sample on. correlation: (3,) of the noise between neighbouring samples; where it is
    not zero, noise_variance is the larger variance of white noise that has the same effect (see `coloured`).
    """

    noise_variance: FloatArray
    jerk: FloatArray
    knot_s: float = math.inf
    correlation: FloatArray = np.zeros(3)

    @property
    def reading_variance(self) -> FloatArray:
        """(3,) variance of the noise of a single reading."""
        variance: FloatArray = self.noise_variance * (1 - self.correlation) / (1 + self.correlation)
        return variance


class FilterRun(NamedTuple):
    """What a recursive filter leaves behind, row for row with the log.

    state, predicted: (n, 9) after and before the update, SI units. sigma: (n, 9) 1-sigma after the update.
    innovation: (n, 3) m, rad, rad, NaN where missing. innovation_sigma: (n, 3) square root of the diagonal of S.
    weight: (n, 3) in [0, 1], zero where rejected or missing. nis: (n,) of the components used, NaN where none.
    los_sigma: (n, 6) 1-sigma of position and velocity along the radial, cross and up axes.
    since_start: (n,) samples since the last start. log_likelihood: of the innovations used.
    """

    time_s: FloatArray
    state: FloatArray
    predicted: FloatArray
    sigma: FloatArray
    innovation: FloatArray
    innovation_sigma: FloatArray
    weight: FloatArray
    nis: FloatArray
    los_sigma: FloatArray
    since_start: IntArray
    log_likelihood: float

    def rows(self, low: int, high: int) -> FilterRun:
        """Of the samples [low, high) alone; the likelihood stays that of the whole run."""
        return FilterRun._make([*(each[low:high] for each in self[:-1]), self.log_likelihood])


def empty_run(time_s: FloatArray) -> FilterRun:
    """A run of the right shapes for the kernels to fill."""
    n = len(time_s)
    return FilterRun(
        time_s, np.empty((n, 9)), np.empty((n, 9)), np.empty((n, 9)), np.empty((n, 3)), np.empty((n, 3)),
        np.zeros((n, 3)), np.full(n, np.nan), np.empty((n, 6)), np.zeros(n, np.int64), 0.0,
    )  # fmt: skip


@part
def line_of_sight_sigma(x: FloatArray, p: FloatArray, out: FloatArray) -> None:
    """1-sigma of position and velocity along the radial, cross and up axes at x."""
    ground = max(math.sqrt(x[0] * x[0] + x[1] * x[1]), 1e-9)
    slant = math.sqrt(ground * ground + x[2] * x[2])
    ca, sa, ce, se = x[0] / ground, x[1] / ground, ground / slant, x[2] / slant
    for axis in range(3):
        u, v, w = -sa, ca, 0.0
        if axis == 0:
            u, v, w = ca * ce, sa * ce, se
        elif axis == 2:
            u, v, w = -ca * se, -sa * se, ce
        for b in range(2):
            o = 3 * b
            variance = u * u * p[o, o] + v * v * p[o + 1, o + 1] + w * w * p[o + 2, o + 2]
            variance += 2 * (u * v * p[o, o + 1] + u * w * p[o, o + 2] + v * w * p[o + 1, o + 2])
            out[o + axis] = math.sqrt(max(variance, 0.0))


@part
def store(k: int, first: int, x: FloatArray, p: FloatArray, run: FilterRun) -> None:
    """The updated state of sample k of a run that began at `first`."""
    for i in range(9):
        run.state[k, i] = x[i]
        run.sigma[k, i] = math.sqrt(max(p[i, i], 0.0))
    line_of_sight_sigma(x, p, run.los_sigma[k])
    run.since_start[k] = k - first


@kernel
def run_span(
    first: int,
    last: int,
    time: FloatArray,
    z: FloatArray,
    weight: FloatArray,
    noise: FloatArray,
    jerk: FloatArray,
    knot_s: float,
    x: FloatArray,
    p: FloatArray,
    extended: bool,
    run: FilterRun,
) -> float:
    """Filter samples [first, last) from the state x, P (in place); fills the run; returns the log-likelihood."""
    factor, b, h, c = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    z_hat, e, used = np.zeros(3), np.zeros(3), np.zeros(3)
    pxz, gain, s, s_inv = np.zeros((9, 3)), np.zeros((9, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    state, covariance = x, p
    x, p = motion.own(state, covariance)
    likelihood = 0.0
    for k in range(first, last):
        if k > first:
            piece = motion.knot_index(time[k], time[0], knot_s, jerk.shape[0])
            motion.predict(x, p, time[k] - time[k - 1], jerk[piece], c)
        for i in range(9):
            run.predicted[k, i] = x[i]
        if extended:
            ekf.linearise(x, p, z_hat, h, c)
        else:
            ukf.linearise(x, p, factor, b, z_hat, h, c)
        ukf.innovate(z[k], z_hat, e)
        any_used = False
        for i in range(3):
            run.innovation[k, i] = e[i]
            run.innovation_sigma[k, i] = math.sqrt(c[i, i] + noise[i])
            used[i] = weight[k, i] if math.isfinite(e[i]) else 0.0
            run.weight[k, i] = used[i]
            any_used = any_used or used[i] > 0
        if any_used:
            ukf.cross_covariance(p, h, pxz)
            nis, gained = ukf.update(x, p, pxz, c, h, e, noise, used, s, s_inv, gain)
            run.nis[k] = nis
            likelihood += gained
        store(k, first, x, p, run)
    motion.hand_over(x, p, state, covariance)
    return likelihood


@kernel
def extrapolate_back(
    sample: int,
    time: FloatArray,
    z: FloatArray,
    noise: FloatArray,
    jerk: FloatArray,
    knot_s: float,
    x: FloatArray,
    p: FloatArray,
    state: FloatArray,
    sigma: FloatArray,
    los_sigma: FloatArray,
    residual: FloatArray,
    variance: FloatArray,
) -> None:
    """States of the samples before `sample` from x, P there (in place), going back in time; no reading is used.

    residual, variance (n, 3): reading minus what the state says, and its variance.
    """
    factor, b, h, c = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    z_hat, e = np.zeros(3), np.zeros(3)
    for k in range(sample - 1, -1, -1):
        piece = motion.knot_index(time[k], time[0], knot_s, jerk.shape[0])
        motion.predict(x, p, time[k] - time[k + 1], jerk[piece], c)
        ukf.linearise(x, p, factor, b, z_hat, h, c)
        ukf.innovate(z[k], z_hat, e)
        for i in range(3):
            residual[k, i] = e[i]
            variance[k, i] = c[i, i] + noise[i] if math.isfinite(e[i]) else math.nan
        for i in range(9):
            state[k, i] = x[i]
            sigma[k, i] = math.sqrt(max(p[i, i], 0.0))
        line_of_sight_sigma(x, p, los_sigma[k])


def filter_log(
    time_s: FloatArray,
    measurement: FloatArray,
    weight: FloatArray,
    model: Model,
    starts: list[Start],
    extended: bool = False,
) -> FilterRun:
    """Run the filter over the whole log, beginning anew at each start.

    time_s (n,), measurement (n, 3), weight (n, 3) in [0, 1]. Samples before the first start are extrapolated.
    extended: linearise by the Jacobian (EKF) instead of the unscented transform.
    """

    def span(first: int, stop: int, x: FloatArray, p: FloatArray, run: FilterRun) -> float:
        return run_span(
            first,
            stop,
            time_s,
            measurement,
            weight,
            model.noise_variance,
            model.jerk,
            model.knot_s,
            x,
            p,
            extended,
            run,
        )

    return run_spans(time_s, measurement, model, starts, span)


#: first and one past the last sample, state and covariance before the first (changed in place), the run to fill.
Span = Callable[[int, int, FloatArray, FloatArray, FilterRun], float]


def run_spans(time_s: FloatArray, measurement: FloatArray, model: Model, starts: list[Start], span: Span) -> FilterRun:
    """A run over the whole log by a filter that begins anew at each start; `span` returns its log-likelihood."""
    run = empty_run(time_s)
    likelihood = 0.0
    for start, stop in zip(starts, [s.sample for s in starts[1:]] + [len(time_s)], strict=True):
        likelihood += span(start.sample, stop, start.state.copy(), start.covariance.copy(), run)
    lead_in(measurement, model, starts[0], run)
    return run._replace(log_likelihood=likelihood)


def lead_in(measurement: FloatArray, model: Model, start: Start, run: FilterRun) -> None:
    """Fill the run before its first start."""
    if start.sample == 0:
        return
    variance = run.innovation_sigma  # squared until the last line
    extrapolate_back(
        start.sample, run.time_s, measurement, model.noise_variance, model.jerk, model.knot_s, start.state.copy(),
        start.covariance.copy(), run.state, run.sigma, run.los_sigma, run.innovation, variance,
    )  # fmt: skip
    before = slice(0, start.sample)
    run.predicted[before] = run.state[before]
    run.innovation_sigma[before] = np.sqrt(variance[before])
