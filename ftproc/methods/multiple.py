"""IMM-UKF: interacting multiple models (Zhang, Li and He 2012, for electro-optical theodolites), told apart by how
hard the target manoeuvres."""

from __future__ import annotations

import numpy as np

from ftproc.core.comparators.imm import run_imm
from ftproc.core.filtering.forward import run_spans
from ftproc.core.filtering.records import FilterRun
from ftproc.methods.estimate import Estimate, Readings
from ftproc.methods.preparing import finished, prepare
from ftproc.records import FloatArray
from ftproc.settings import FilterSettings

LEVELS = np.array([0.1, 1.0, 10.0])
SOJOURN_S, SOJOURN_SAMPLES = 5.0, 20  # a model holds for the longer of the two, on average


def estimate(readings: Readings, settings: FilterSettings) -> Estimate:
    """Filter by three models at once; every reading is used. `model` of the result is the middle one."""
    model, starts, _ = prepare(readings, settings)
    time_s, measurement, _ = readings
    interval = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 1.0
    sojourn = max(SOJOURN_S, SOJOURN_SAMPLES * interval)
    jerk = LEVELS[:, None] * model.jerk[0]
    probability = np.full((len(time_s), len(LEVELS)), np.nan)

    def span(first: int, stop: int, x: FloatArray, p: FloatArray, run: FilterRun) -> float:
        return run_imm(first, stop, time_s, measurement, model.noise_variance, jerk, sojourn, x, p, run, probability)

    run = run_spans(time_s, measurement, model, starts, span)
    weight = np.isfinite(measurement).astype(float)
    return finished(readings, settings, run, weight, weight, model, starts)
