"""What the record says of a few stretches of it: only what lies around them is smoothed, all of it in one sweep."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.initialization import find_starts
from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.filtering.smoother import RESIDUALS, SmootherRun, smooth_log
from ftproc.core.identification.profile import from_knot, median_level
from ftproc.core.identification.scales import scales_of
from ftproc.core.identification.stretches import Stretches, runs_of, stretches_of, widened
from ftproc.records import FloatArray, IntArray

FREE, WIDER = (50.0, 20.0, 20.0), 3.0  # m, m/s, m/s2, and times its own: 1-sigma of the state where a part begins
AROUND, MEMORIES = (60, 200), 8.0  # samples on each side that tell what lies between, and memories


def start_of_part(state: FloatArray, sigma: FloatArray) -> Start:
    """Where a filter over a part of a log starts, from a smoothed state (9,) and its 1-sigma."""
    return Start(0, state, np.diag(np.repeat(FREE, 3) ** 2 + (WIDER * sigma) ** 2))


def samples_around(log: Observations, at_median: Model) -> int:
    """Samples on each side that are enough to decide on what lies between."""
    scales = scales_of(log, at_median.noise_variance)
    return int(np.clip(MEMORIES * scales.memory_samples(float(at_median.jerk[0, 0])), *AROUND))


def smoothed_near(
    log: Observations, model: Model, marked: NDArray[np.bool_], around: int
) -> tuple[IntArray, SmootherRun]:
    """The samples (m,) within so many of what is marked (n,), one at least, and the smoother's residuals of them, with
    a jerk profile. If a component is not seen near one of the stretches, all of the log is smoothed."""
    runs = runs_of(widened(marked, around)).tolist()
    begins, own = from_knot(model, log.time_s, slice(runs[0][0], len(marked)))
    runs[0][0], level = begins.start, float(median_level(model).jerk[0, 0])
    near = stretches_of(log, (slice(*run) for run in runs), model.noise_variance, level)
    if near is None or len(near.samples) < sum(end - begin for begin, end in runs):
        starts = find_starts(log, model.noise_variance, level)
        near, own = Stretches(np.arange(len(marked)), log, starts), model
    return near.samples, smooth_log(near.log, own, near.starts, RESIDUALS)


def residuals_near(
    log: Observations, model: Model, marked: NDArray[np.bool_], around: int
) -> tuple[FloatArray, FloatArray]:
    """Leave-one-out residuals (n, 3) and their variances around what is marked; NaN far from it."""
    residual, variance = np.full(log.weight.shape, np.nan), np.full(log.weight.shape, np.nan)
    if marked.any():
        samples, smoothed = smoothed_near(log, model, marked, around)
        residual[samples], variance[samples] = smoothed.residual, smoothed.residual_variance
    return residual, variance
