"""Robust unscented Kalman filters: one recursion, in which the readings are weighted anew until the weights fit the
residuals they leave (iteratively reweighted least squares; R/w per component). They differ in the weight only:

* Huber (Karlgaard and Schaub 2007; Wang, Cui and Guo 2010): w = min(1, k / u)
* Student t (Roth, Ozkan and Gustafsson 2013; Agamennoni, Nieto and Nebot 2012): w = (nu + 1) / (nu + u^2)
* maximum correntropy (Chen, Liu, Zhao and Principe 2017): w = exp(-u^2 / (2 b^2))

The first weights are those of the innovations, u = |e_i| / sqrt(S_ii); the next ones those of the residuals after the
update, u = |e_i - (H dx)_i| / sqrt(R_ii).
"""

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

HUBER, STUDENT, CORRENTROPY = 0, 1, 2
ITERATIONS = 5
NEGLIGIBLE = 1e-9  # a smaller weight leaves the reading out


@kernel
def weight_of(kind: int, parameter: float, u: float) -> float:
    """The weight of a reading u sigmas off. parameter: k, nu or b of the module's head."""
    if kind == HUBER:
        return 1.0 if u <= parameter else parameter / u
    if kind == STUDENT:
        return (parameter + 1) / (parameter + u * u)
    return math.exp(-0.5 * u * u / (parameter * parameter))


@part
def _weigh(kind: int, parameter: float, residual: FloatArray, variance: FloatArray, used: FloatArray) -> None:
    for i in range(3):
        if math.isfinite(residual[i]):
            used[i] = weight_of(kind, parameter, abs(residual[i]) / math.sqrt(variance[i]))
            if used[i] < NEGLIGIBLE:
                used[i] = 0.0
        else:
            used[i] = 0.0


@kernel
def run_robust(
    first: int,
    last: int,
    time: FloatArray,
    z: FloatArray,
    noise: FloatArray,
    jerk: FloatArray,
    knot_s: float,
    kind: int,
    parameter: float,
    x: FloatArray,
    p: FloatArray,
    run: FilterRun,
) -> float:
    """Filter samples [first, last) from the state x, P (in place); fills the run; returns the log-likelihood of the
    innovations at their final weights."""
    factor, b, h, c = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    z_hat, e, used, residual, variance = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    pxz, gain, s, s_inv = np.zeros((9, 3)), np.zeros((9, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    x0, p0 = np.zeros(9), np.zeros((9, 9))
    likelihood = 0.0
    for k in range(first, last):
        if k > first:
            piece = motion.knot_index(time[k], time[0], knot_s, jerk.shape[0])
            motion.predict(x, p, time[k] - time[k - 1], jerk[piece], c)
        x0[:] = x
        p0[:] = p
        run.predicted[k] = x
        ukf.linearise(x, p, factor, b, z_hat, h, c)
        innovate(z[k], z_hat, e)
        ukf.cross_covariance(p, h, pxz)
        for i in range(3):
            residual[i] = e[i]
            variance[i] = c[i, i] + noise[i]
            run.innovation[k, i] = e[i]
            run.innovation_sigma[k, i] = math.sqrt(variance[i])
        nis, gained = math.nan, 0.0
        for _ in range(ITERATIONS):
            _weigh(kind, parameter, residual, variance, used)
            if used[0] <= 0 and used[1] <= 0 and used[2] <= 0:
                break
            x[:] = x0
            p[:] = p0
            nis, gained = ukf.update(x, p, pxz, c, h, e, noise, used, s, s_inv, gain)
            for i in range(3):
                moved = h[i, 0] * (x[0] - x0[0]) + h[i, 1] * (x[1] - x0[1]) + h[i, 2] * (x[2] - x0[2])
                residual[i] = e[i] - moved
                variance[i] = noise[i]
        run.weight[k] = used
        run.nis[k] = nis
        likelihood += gained
        store(k, first, x, p, run)
    return likelihood
