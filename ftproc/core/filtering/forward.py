"""The forward pass over a log whose weights are decided: the plain recursive filter."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part
from ftproc.core.filtering import ukf
from ftproc.core.filtering.records import FilterRun, Model, Start, empty_run
from ftproc.core.model import jacobian, motion
from ftproc.core.model.measurement import innovate, line_of_sight_sigma

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


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
            jacobian.linearise(x, p, z_hat, h, c)
        else:
            ukf.linearise(x, p, factor, b, z_hat, h, c)
        innovate(z[k], z_hat, e)
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
        innovate(z[k], z_hat, e)
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
