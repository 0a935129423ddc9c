"""IMM-UKF: interacting multiple models (Zhang, Li and He 2012, for electro-optical theodolites), which differ in how
hard the target manoeuvres."""

from __future__ import annotations

import numpy as np

from ftproc.core.comparators import imm
from ftproc.methods.estimate import Estimate, Readings, typical_interval
from ftproc.methods.preparing import Filtered, finished, prepare
from ftproc.settings import FilterSettings

LEVELS = np.array([0.1, 1.0, 10.0])
SOJOURN_S, SOJOURN_SAMPLES = 5.0, 20  # a model holds for the longer of the two, on average


def estimate(readings: Readings, settings: FilterSettings) -> Estimate:
    """Filter by three models at once; every reading is used. `model` of the result is the middle one."""
    model, starts = prepare(readings, settings)
    log = readings.unedited()
    interval = typical_interval(log.time_s) if len(log.time_s) > 1 else 1.0
    jumps = imm.Jumps(LEVELS[:, None] * model.jerk[0], max(SOJOURN_S, SOJOURN_SAMPLES * interval))
    run, _ = imm.filter_log(log, model, starts, jumps)
    return finished(Filtered(log, run, model, starts), settings)
