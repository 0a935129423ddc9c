"""The loop of every recursive filter, and the plain one: a forward pass over a log whose weights are decided."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import empty, kernel, part, record, variant, zeros
from ftproc.core.filtering import beside, ukf
from ftproc.core.filtering.filters import ColouredFilters, Filter, Filters
from ftproc.core.filtering.records import (
    ROW,
    FilterRun,
    Model,
    Observations,
    Row,
    Rows,
    Sample,
    Samples,
    Start,
    between,
)
from ftproc.core.model import forces, jacobian, motion
from ftproc.core.model.kinematics import path_sigma
from ftproc.core.model.measurement import line_of_sight_sigma
from ftproc.core.signatures import Layout

FloatArray = NDArray[np.float64]


class Span(NamedTuple):
    """Samples [first, last) of a log, on a track that started at sample `start`."""

    first: int
    last: int
    start: int


#: The update by which filters differ: (filter, sample, extra, row) -> log-likelihood gained, whether the track is lost.
Update = Callable[[Filter, Sample, Any, Row], tuple[float, bool]]

#: (span, samples, profile, filters, extra, rows) -> see `recursion`.
Recursion = Callable[[Span, Any, motion.Profile, Any, Any, Any], tuple[int, float]]


@part
def _move(f: Filter, profile: motion.Profile, before: int, after: int, interval: float) -> None:
    """Predict over an interval between two samples."""
    if profile.motion.acts:
        forces.travel(f, profile.motion, before, after, interval)
    else:
        motion.predict(f, interval)
    motion.decorrelate(f, interval)


@part
def advance(f: Filter, samples: Any, k: int, profile: motion.Profile) -> None:
    """Predict from sample k - 1 to sample k."""
    time_s = samples[k].time_s
    motion.drive(f, profile, time_s)
    _move(f, profile, k - 1, k, time_s - samples[k - 1].time_s)


@part
def store(f: Filter, row: Row) -> None:
    """Keep the updated state."""
    for i in range(9):
        row.state[i] = f.x[i]
        row.sigma[i] = math.sqrt(max(f.p[i, i], 0.0))
    line_of_sight_sigma(f.x, f.p, row.los_sigma)
    path_sigma(f.x, f.p, f.path, row.path_sigma)


@part
def store_innovation(f: Filter, row: Row) -> None:
    """Keep the innovation, its sigma and the weights."""
    for i in range(3):
        row.innovation[i] = f.e[i]
        row.innovation_sigma[i] = math.sqrt(f.c[i, i] + f.noise[i] + f.late[i] * f.late[i])
        row.weight[i] = f.used[i]


@part
def _weighted(f: Filter, sample: Sample, extended: bool, row: Row) -> tuple[float, bool]:
    """The update of a sample whose weights are decided; extended: linearised by the Jacobian."""
    if extended:
        jacobian.linearise(f)
    else:
        ukf.expect_at(sample, f)
    ukf.innovate(sample, f)
    any_used = ukf.use(sample.weight, f)
    store_innovation(f, row)
    if not any_used:
        return 0.0, False
    row.nis, gained = ukf.update(f)
    return gained, False


_update: Update = _weighted  # of the loop below; each recursion has its own


def _loop(
    span: Span, samples: Samples, profile: motion.Profile, filters: Filters, extra: Any, rows: Rows
) -> tuple[int, float]:
    """Predict, update, keep what came of it; see `recursion`."""
    f = filters[0]
    likelihood = 0.0
    for k in range(span.first, span.last):
        sample, row = samples[k], rows[k]
        if k > span.start:
            advance(f, samples, k, profile)
        for i in range(9):
            row.predicted[i] = f.x[i]
        row.nis = math.nan
        if len(profile.beside) > 0:
            likelihood += beside.take(f.x, f.p, profile.beside, k)
        gained, lost = _update(f, sample, extra, row)
        likelihood += gained
        store(f, row)
        row.since_start = k - span.start
        if lost:
            return k, likelihood
    return span.last, likelihood


def recursion(update: Update, kind: Any, filters: Any = Filters) -> Recursion:
    """A recursive filter: the kernel that runs the loop with this update of one sample compiled into it.

    The kernel takes a span of the samples, from the state of the filter (an array of one `filters.Filter`), which it
    changes, and fills the rows. extra: what else the update needs, annotated as `kind`. filters: annotation of the
    filter's record. It returns the sample at which
    the track was lost, or the span's end, and the log-likelihood of what was used.

    The code of the loop is shared; each kernel has an `_update` of its own among its globals.
    """
    name = update.__name__ + ("_coloured" if filters is ColouredFilters else "")
    return kernel(variant(_loop, update.__module__, name, extra=kind, filters=filters, _update=update))


run_weighted = recursion(_weighted, bool)
run_weighted_coloured = recursion(_weighted, bool, ColouredFilters)


class Estimated(Protocol):
    """What the whole record, or a way back, says of the state at one sample; see `smoother.SmootherRun`."""

    state: Annotated[FloatArray, 9]
    sigma: Annotated[FloatArray, 9]
    los_sigma: Annotated[FloatArray, 6]
    path_sigma: Annotated[FloatArray, 6]


class Left(Protocol):
    """What it leaves of the readings of one sample: residuals and their variances, and NIS."""

    residual: Annotated[FloatArray, 3]
    residual_variance: Annotated[FloatArray, 3]
    nis: float


ESTIMATED, LEFT = record(Estimated), record(Left)
Estimates = Annotated[Any, Layout(ESTIMATED)]
Residuals = Annotated[Any, Layout(LEFT)]


def _extrapolated(
    samples: Samples, profile: motion.Profile, filters: Filters, estimates: Estimates, residuals: Residuals
) -> None:
    """Fill the estimates and residuals of the samples before the first that has none, from the state there, which is
    changed; no reading is used."""
    f = filters[0]
    for k in range(len(estimates) - 1, -1, -1):
        row, left, time_s = estimates[k], residuals[k], samples[k].time_s
        motion.drive(f, profile, time_s)
        _move(f, profile, k + 1, k, time_s - samples[k + 1].time_s)
        ukf.expect_at(samples[k], f)
        ukf.innovate(samples[k], f)
        for i in range(3):
            left.residual[i] = f.e[i]
            left.residual_variance[i] = (
                f.c[i, i] + f.noise[i] + f.late[i] * f.late[i] if math.isfinite(f.e[i]) else math.nan
            )
        left.nis = math.nan
        for i in range(9):
            row.state[i] = f.x[i]
            row.sigma[i] = math.sqrt(max(f.p[i, i], 0.0))
        line_of_sight_sigma(f.x, f.p, row.los_sigma)
        path_sigma(f.x, f.p, f.path, row.path_sigma)


_extrapolate = kernel(variant(_extrapolated, __name__, "_extrapolate"))
_extrapolate_coloured = kernel(variant(_extrapolated, __name__, "_extrapolate_coloured", filters=ColouredFilters))


def extrapolated(log: Observations, model: Model, start: Start) -> tuple[Any, Any]:
    """`Estimated` and `Left` records of the samples before a start, from the state there back in time; no reading is
    used."""
    estimates, residuals = zeros(ESTIMATED, start.sample), zeros(LEFT, start.sample)
    if start.sample:
        extrapolate = _extrapolate_coloured if model.coloured else _extrapolate
        samples = log.part(slice(start.sample + 1)).samples(model.noise_variance)
        extrapolate(samples, model.profile(log.time_s), model.filter(start), estimates, residuals)
    return estimates, residuals


def filter_log(log: Observations, model: Model, starts: list[Start], extended: bool = False) -> FilterRun:
    """Run the filter over the whole log, re-initialized at each start. Samples before the first start are extrapolated.

    extended: linearise by the Jacobian (EKF) instead of the unscented transform.
    """
    return run_log(run_weighted_coloured if model.coloured else run_weighted, log, model, starts, extended)


def filter_with_beside(log: Observations, model: Model, starts: list[Start]) -> tuple[FilterRun, FloatArray]:
    """The same, and what `beside` leaves of the log's scalars (kinds, n, WIDTH)."""
    return run_with_beside(run_weighted_coloured if model.coloured else run_weighted, log, model, starts, False)


def run_log(run: Recursion, log: Observations, model: Model, starts: list[Start], extra: Any) -> FilterRun:
    """A run over the whole log by a recursion that is re-initialized at each start; extra: see `recursion`."""
    return run_with_beside(run, log, model, starts, extra)[0]


def run_with_beside(
    run: Recursion, log: Observations, model: Model, starts: list[Start], extra: Any
) -> tuple[FilterRun, FloatArray]:
    """The same, with what `beside` leaves of the log's scalars."""
    samples, profile = log.samples(model.noise_variance), model.profile_of(log)
    rows = empty(ROW, len(log.time_s))
    likelihood = 0.0
    for start, stop in between(starts, len(log.time_s)):
        likelihood += run(Span(start.sample, stop, start.sample), samples, profile, model.filter(start), extra, rows)[1]
    lead_in(log, model, starts[0], rows)
    return FilterRun.of(log.time_s, rows, likelihood), profile.beside


def lead_in(log: Observations, model: Model, start: Start, rows: Any) -> None:
    """Fill the rows before the first start."""
    before, (found, left) = rows[: start.sample], extrapolated(log, model, start)
    for name in ("state", "sigma", "los_sigma", "path_sigma"):
        before[name] = found[name]
    before["predicted"], before["innovation"] = found["state"], left["residual"]
    before["innovation_sigma"] = np.sqrt(left["residual_variance"])
    before["nis"], before["weight"], before["since_start"] = np.nan, 0.0, 0.0
