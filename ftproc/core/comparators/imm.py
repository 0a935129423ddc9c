"""Interacting multiple models (Blom and Bar-Shalom 1988; for theodolites Zhang, Li and He 2012): several unscented
Kalman filters side by side that differ in the jerk they expect, and a Markov chain that says how readily the target
changes from calm flight to a manoeuvre. Every filter begins a step from a mixture of them all."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part
from ftproc.core.filtering import ukf
from ftproc.core.filtering.forward import store
from ftproc.core.filtering.records import FilterRun
from ftproc.core.model import motion
from ftproc.core.model.measurement import innovate

FloatArray = NDArray[np.float64]


@part
def _mixture(share: FloatArray, xs: FloatArray, ps: FloatArray, x: FloatArray, p: FloatArray) -> None:
    """Mean and covariance of the mixture of the models in these shares (m,)."""
    x[:] = 0.0
    p[:] = 0.0
    for m in range(len(share)):
        for i in range(9):
            x[i] += share[m] * xs[m, i]
    for m in range(len(share)):
        for i in range(9):
            for j in range(9):
                p[i, j] += share[m] * (ps[m, i, j] + (xs[m, i] - x[i]) * (xs[m, j] - x[j]))


@part
def _mix(
    stay: float, mu: FloatArray, xs: FloatArray, ps: FloatArray, mixed_x: FloatArray, mixed_p: FloatArray,
    share: FloatArray, expected: FloatArray,
) -> None:  # fmt: skip
    """What each model begins with, and its probability before the reading: expected (m,)."""
    models = len(mu)
    for j in range(models):
        total = 0.0
        for i in range(models):
            share[i] = mu[i] * (stay if i == j else (1 - stay) / (models - 1))
            total += share[i]
        for i in range(models):
            share[i] /= total
        expected[j] = total
        _mixture(share, xs, ps, mixed_x[j], mixed_p[j])
    xs[:] = mixed_x
    ps[:] = mixed_p


@kernel
def run_imm(
    first: int,
    last: int,
    time: FloatArray,
    z: FloatArray,
    noise: FloatArray,
    jerk: FloatArray,
    sojourn_s: float,
    x: FloatArray,
    p: FloatArray,
    run: FilterRun,
    probability: FloatArray,
) -> float:
    """Filter samples [first, last) from the state x, P (in place); fills the run and the probability (n, m) of each
    model; returns the log-likelihood.

    jerk: (m, 6) tensor of each model. sojourn_s: how long the target keeps to one, on average.
    """
    models = jerk.shape[0]
    factor, b, h, c = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    z_hat, e, used = np.zeros(3), np.zeros(3), np.zeros(3)
    pxz, gain, s, s_inv = np.zeros((9, 3)), np.zeros((9, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    xs, ps = np.zeros((models, 9)), np.zeros((models, 9, 9))
    mixed_x, mixed_p = np.zeros((models, 9)), np.zeros((models, 9, 9))
    mu, expected, share = np.full(models, 1 / models), np.full(models, 1 / models), np.zeros(models)
    gained, innovation, variance, nis = np.zeros(models), np.zeros((models, 3)), np.zeros((models, 3)), np.zeros(models)
    for m in range(models):
        xs[m] = x
        ps[m] = p
    likelihood = 0.0
    for k in range(first, last):
        if k > first:
            interval = time[k] - time[k - 1]
            _mix(math.exp(-interval / sojourn_s), mu, xs, ps, mixed_x, mixed_p, share, expected)
            for m in range(models):
                motion.predict(xs[m], ps[m], interval, jerk[m], c)
        for i in range(9):
            run.predicted[k, i] = 0.0
            for m in range(models):
                run.predicted[k, i] += expected[m] * xs[m, i]
        any_used = False
        for m in range(models):
            ukf.linearise(xs[m], ps[m], factor, b, z_hat, h, c)
            innovate(z[k], z_hat, e)
            for i in range(3):
                used[i] = 1.0 if math.isfinite(e[i]) else 0.0
                run.weight[k, i] = used[i]
                innovation[m, i], variance[m, i] = e[i], c[i, i] + noise[i]
                any_used = any_used or used[i] > 0
            gained[m] = 0.0
            if any_used:
                ukf.cross_covariance(ps[m], h, pxz)
                nis[m], gained[m] = ukf.update(xs[m], ps[m], pxz, c, h, e, noise, used, s, s_inv, gain)
        likelihood += _weigh_models(gained, expected, mu)
        _report(k, expected, innovation, variance, nis, any_used, run)
        _mixture(mu, xs, ps, x, p)
        probability[k] = mu
        store(k, first, x, p, run)
    return likelihood


@part
def _weigh_models(gained: FloatArray, expected: FloatArray, mu: FloatArray) -> float:
    """Probabilities after the reading; returns its log-likelihood."""
    best: float = gained.max()
    total = 0.0
    for m in range(len(mu)):
        mu[m] = expected[m] * math.exp(gained[m] - best)
        total += mu[m]
    for m in range(len(mu)):
        mu[m] = max(mu[m] / total, 1e-12)
    return best + math.log(total)


@part
def _report(
    k: int, expected: FloatArray, innovation: FloatArray, variance: FloatArray, nis: FloatArray, any_used: bool,
    run: FilterRun,
) -> None:  # fmt: skip
    """Innovation, its sigma and NIS of the models together."""
    for i in range(3):
        mean, square = 0.0, 0.0
        for m in range(len(expected)):
            mean += expected[m] * innovation[m, i]
            square += expected[m] * variance[m, i]
        run.innovation[k, i] = mean
        if math.isfinite(innovation[0, i]):  # not of the mean: sums in any order may lose the sight of NaN
            for m in range(len(expected)):
                square += expected[m] * (innovation[m, i] - mean) ** 2
        run.innovation_sigma[k, i] = math.sqrt(square)
    if any_used:
        run.nis[k] = 0.0
        for m in range(len(expected)):
            run.nis[k] += expected[m] * nis[m]
