"""Robust unscented Kalman filters: one recursion, in which the readings are weighted again until the weights fit
the residuals they leave (iteratively reweighted least squares; R/w per component). They differ in the weight only:

* Huber (Karlgaard and Schaub 2007; Wang, Cui and Guo 2010): w = min(1, k / u)
* Student t (Roth, Ozkan and Gustafsson 2013; Agamennoni, Nieto and Nebot 2012): w = (nu + 1) / (nu + u^2)
* maximum correntropy (Chen, Liu, Zhao and Principe 2017): w = exp(-u^2 / (2 b^2))

The first weights are those of the innovations, u = |e_i| / sqrt(S_ii); the next ones those of the residuals after the
update, u = |e_i - (H dx)_i| / sqrt(R_ii).
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part, record, zeros
from ftproc.core.filtering import ukf, unscented
from ftproc.core.filtering.filters import Filter
from ftproc.core.filtering.forward import recursion, store_innovation
from ftproc.core.filtering.records import Row, Sample
from ftproc.core.signatures import Layout

FloatArray = NDArray[np.float64]

HUBER, STUDENT, CORRENTROPY = 0, 1, 2
ITERATIONS = 5
NEGLIGIBLE = 1e-9  # a smaller weight leaves the reading out


@kernel
def weight_of(kind: int, parameter: float, u: float) -> float:
    """The weight of a reading whose residual is u sigmas. parameter: k, nu or b of the module's head."""
    if kind == HUBER:
        return 1.0 if u <= parameter else parameter / u
    if kind == STUDENT:
        return (parameter + 1) / (parameter + u * u)
    return math.exp(-0.5 * u * u / (parameter * parameter))


class Weighting(Protocol):
    """The record of a robust filter: kind and parameter of its weight, and the state before the update."""

    kind: float
    parameter: float
    x: Annotated[FloatArray, 9]
    p: Annotated[FloatArray, 9, 9]
    residual: Annotated[FloatArray, 3]
    variance: Annotated[FloatArray, 3]


WEIGHTING = record(Weighting)
Weightings = Annotated[Any, Layout(WEIGHTING)]


def weighting_of(kind: int, parameter: float) -> Any:
    """An array of one `Weighting`."""
    weightings = zeros(WEIGHTING)
    weightings["kind"], weightings["parameter"] = kind, parameter
    return weightings


@part
def _weigh(f: Filter, how: Weighting) -> bool:
    """Weights from the residuals; whether any reading is used."""
    any_used = False
    for i in range(3):
        f.used[i] = 0.0
        if math.isfinite(how.residual[i]):
            u = abs(how.residual[i]) / math.sqrt(how.variance[i])
            f.used[i] = weight_of(int(how.kind), how.parameter, u)
            if f.used[i] < NEGLIGIBLE:
                f.used[i] = 0.0
        any_used = any_used or f.used[i] > 0
    return any_used


@part
def _reweighted(f: Filter, sample: Sample, weightings: Weightings, row: Row) -> tuple[float, bool]:
    """The update of a sample, repeated until its weights fit the residuals that it leaves."""
    how = weightings[0]
    how.x[:] = f.x
    how.p[:] = f.p
    unscented.linearise(f)
    ukf.innovate(sample, f)
    store_innovation(f, row)
    for i in range(3):
        how.residual[i] = f.e[i]
        how.variance[i] = f.c[i, i] + f.noise[i] + f.late[i] * f.late[i]
    nis, gained = math.nan, 0.0
    for _ in range(ITERATIONS):
        if not _weigh(f, how):
            break
        f.x[:] = how.x
        f.p[:] = how.p
        nis, gained = ukf.update(f)
        for i in range(3):
            moved = 0.0
            for a in range(3):
                moved += f.h[i, a] * (f.x[a] - how.x[a])
            how.residual[i] = f.e[i] - moved
            how.variance[i] = f.noise[i]
    for i in range(3):
        row.weight[i] = f.used[i]
    row.nis = nis
    return gained, False


run_robust = recursion(_reweighted, Weightings)
