"""Interacting multiple models (Blom and Bar-Shalom 1988; for theodolites Zhang, Li and He 2012): several unscented
Kalman filters side by side that differ in the jerk they expect, and a Markov chain that says how readily the target
begins or ends a manoeuvre. Every filter begins a step from a mixture of them all."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import kernel, part, record, zeros
from ftproc.core.filtering import ukf, unscented
from ftproc.core.filtering.filters import FILTER, Filters
from ftproc.core.filtering.forward import Span, lead_in, store
from ftproc.core.filtering.records import FilterRun, Model, Observations, Row, Rows, Samples, Start, between, empty_rows
from ftproc.core.model import motion
from ftproc.core.signatures import Layout, Matrix

FloatArray = NDArray[np.float64]


class Mode(Protocol):
    """The record of one model of the target's motion: its probability after the last reading, that expected before the
    next one, its state after mixing, and what its filter made of the reading."""

    probability: float
    expected: float
    x: Annotated[FloatArray, 9]
    p: Annotated[FloatArray, 9, 9]
    gained: float
    nis: float


MODE = record(Mode)
Modes = Annotated[Any, Layout(MODE)]


@part
def _mixture(share: FloatArray, filters: Any, x: FloatArray, p: FloatArray) -> None:
    """Mean and covariance of the mixture of the filters in these shares (m,)."""
    x[:] = 0.0
    p[:] = 0.0
    for m in range(len(share)):
        for i in range(9):
            x[i] += share[m] * filters[m].x[i]
    for m in range(len(share)):
        f = filters[m]
        for i in range(9):
            for j in range(9):
                p[i, j] += share[m] * (f.p[i, j] + (f.x[i] - x[i]) * (f.x[j] - x[j]))


@part
def _mix(stay: float, filters: Any, modes: Any, share: FloatArray) -> None:
    """The state that each filter continues from, and its probability before the reading; share (m,) is scratch."""
    models = len(modes)
    for j in range(models):
        total = 0.0
        for i in range(models):
            share[i] = modes[i].probability * (stay if i == j else (1 - stay) / (models - 1))
            total += share[i]
        for i in range(models):
            share[i] /= total
        modes[j].expected = total
        _mixture(share, filters, modes[j].x, modes[j].p)
    for j in range(models):
        filters[j].x[:] = modes[j].x
        filters[j].p[:] = modes[j].p


@kernel
def _run(
    span: Span, samples: Samples, filters: Filters, modes: Modes, sojourn_s: float, rows: Rows, probability: Matrix
) -> float:
    """Filter a span by all models; the last of the filters is what they say together. Fills the rows and the
    probability (n, m) of each model; returns the log-likelihood."""
    models = len(modes)
    share, together = np.zeros(models), filters[models]
    likelihood = 0.0
    for k in range(span.first, span.last):
        row = rows[k]
        if k > span.first:
            interval = samples[k].time_s - samples[k - 1].time_s
            _mix(math.exp(-interval / sojourn_s), filters, modes, share)
            for m in range(models):
                motion.predict(filters[m], interval)
        for i in range(9):
            row.predicted[i] = 0.0
            for m in range(models):
                row.predicted[i] += modes[m].expected * filters[m].x[i]
        any_used = False
        row.nis = math.nan
        for m in range(models):
            f = filters[m]
            unscented.linearise(f)
            ukf.innovate(samples[k], f)
            any_used = ukf.use(samples[k].weight, f)
            modes[m].gained = 0.0
            if any_used:
                modes[m].nis, modes[m].gained = ukf.update(f)
        likelihood += _weigh_models(modes)
        _store_innovation(filters, modes, any_used, row)
        for m in range(models):
            share[m] = probability[k, m] = modes[m].probability
        _mixture(share, filters, together.x, together.p)
        store(together, row)
        row.since_start = k - span.start
    return likelihood


@part
def _weigh_models(modes: Any) -> float:
    """Probabilities after the reading; returns its log-likelihood."""
    best = modes[0].gained
    for m in range(len(modes)):
        best = max(best, modes[m].gained)
    total = 0.0
    for m in range(len(modes)):
        modes[m].probability = modes[m].expected * math.exp(modes[m].gained - best)
        total += modes[m].probability
    for m in range(len(modes)):
        modes[m].probability = max(modes[m].probability / total, 1e-12)
    return float(best + math.log(total))


@part
def _store_innovation(filters: Any, modes: Any, any_used: bool, row: Row) -> None:
    """Keep innovation, its sigma, weights and NIS of the models together."""
    for i in range(3):
        mean, square = 0.0, 0.0
        for m in range(len(modes)):
            f = filters[m]
            mean += modes[m].expected * f.e[i]
            square += modes[m].expected * (f.c[i, i] + f.noise[i])
        if math.isfinite(filters[0].e[i]):
            for m in range(len(modes)):
                square += modes[m].expected * (filters[m].e[i] - mean) ** 2
        row.innovation[i] = mean
        row.innovation_sigma[i] = math.sqrt(square)
        row.weight[i] = filters[0].used[i]
    if any_used:
        row.nis = 0.0
        for m in range(len(modes)):
            row.nis += modes[m].expected * modes[m].nis


class Jumps(NamedTuple):
    """How the target manoeuvres: the jerk along each axis for each model (m, 3), and how long one holds on average."""

    jerk: FloatArray
    sojourn_s: float


def filter_log(log: Observations, model: Model, starts: list[Start], jumps: Jumps) -> tuple[FilterRun, FloatArray]:
    """Run the filters over the whole log, re-initialized at each start; and the probability (n, m) of each model.
    Samples before the first start are extrapolated. model: the noise; its jerk serves for that extrapolation only."""
    samples, rows = log.samples(model.noise_variance), empty_rows(len(log.time_s))
    models, likelihood = len(jumps.jerk), 0.0
    probability = np.full((len(log.time_s), models), np.nan)
    for start, stop in between(starts, len(log.time_s)):
        filters, modes = zeros(FILTER, models + 1), zeros(MODE, models)
        filters[:] = model.filter(start)
        filters["jerk"][:models] = jumps.jerk
        modes["probability"], modes["expected"] = 1 / models, 1 / models
        span = Span(start.sample, stop, start.sample)
        likelihood += _run(span, samples, filters, modes, jumps.sojourn_s, rows, probability)
    lead_in(log, model, starts[0], rows)
    return FilterRun.of(log.time_s, rows, likelihood), probability
