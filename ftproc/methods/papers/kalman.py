"""Kalman filters of another make: the linear one on readings converted to positions (`core.comparators.converted`), and
IMM-UKF, interacting multiple models (Zhang, Li and He 2012, for electro-optical theodolites), which differ in how hard
the target manoeuvres."""

from __future__ import annotations

import numpy as np

from ftproc.core.comparators import imm
from ftproc.core.comparators.converted import conversion_of, run_converted
from ftproc.core.filtering.forward import run_log
from ftproc.methods.estimate import Estimate, Readings, typical_interval
from ftproc.methods.parameters import Parameter
from ftproc.methods.preparing import Filtered, finished, prepare
from ftproc.settings import FilterSettings

SPREAD = 10.0
SOJOURN_S, SOJOURN_SAMPLES = 5.0, 20  # a model holds for the longer of the two, on average
IMM_PARAMETERS = (
    Parameter("ratio", "of the models' jerk PSDs, from one to the next of the three", str(SPREAD), 1, 1e6),
    Parameter("sojourn_s", "how long a model holds on average, s", "5 s or 20 intervals", 1e-3, 1e6),
)


def converted(readings: Readings, settings: FilterSettings) -> Estimate:
    """Convert and filter; every reading is used."""
    model, starts = prepare(readings, settings)
    log = readings.unedited()
    run = run_log(run_converted, log, model, starts, conversion_of(model.noise_variance))
    return finished(Filtered(log, run, model, starts), settings)


def multiple(readings: Readings, settings: FilterSettings) -> Estimate:
    """Filter by three models at once; every reading is used. `model` of the result is the middle one."""
    model, starts = prepare(readings, settings)
    log = readings.unedited()
    usual_s = max(SOJOURN_S, SOJOURN_SAMPLES * typical_interval(log.time_s))
    sojourn_s = settings.parameter("sojourn_s") or usual_s
    levels = (settings.parameter("ratio") or SPREAD) ** np.array([-1.0, 0.0, 1.0])
    jumps = imm.Jumps(levels[:, None] * model.jerk[0], sojourn_s)
    run, _ = imm.filter_log(log, model, starts, jumps)
    return finished(Filtered(log, run, model, starts), settings)
