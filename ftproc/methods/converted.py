"""The linear Kalman filter on readings converted to positions; see `ftproc.core.comparators.converted`."""

from __future__ import annotations

import numpy as np

from ftproc.core.comparators.converted import run_converted
from ftproc.core.filtering.forward import run_spans
from ftproc.core.filtering.records import FilterRun
from ftproc.methods.estimate import Estimate, Readings
from ftproc.methods.preparing import finished, prepare
from ftproc.records import FloatArray
from ftproc.settings import FilterSettings


def estimate(readings: Readings, settings: FilterSettings) -> Estimate:
    """Convert and filter; every reading is used."""
    model, starts, _ = prepare(readings, settings)
    time_s, measurement, _ = readings

    def span(first: int, stop: int, x: FloatArray, p: FloatArray, run: FilterRun) -> float:
        return run_converted(
            first, stop, time_s, measurement, model.noise_variance, model.jerk, model.knot_s, x, p, run
        )

    run = run_spans(time_s, measurement, model, starts, span)
    weight = np.isfinite(measurement).astype(float)
    return finished(readings, settings, run, weight, weight, model, starts)
