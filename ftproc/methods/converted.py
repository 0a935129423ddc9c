"""The linear Kalman filter on readings converted to positions; see `ftproc.core.comparators.converted`."""

from __future__ import annotations

from ftproc.core.comparators.converted import conversion_of, run_converted
from ftproc.core.filtering.forward import run_log
from ftproc.methods.estimate import Estimate, Readings
from ftproc.methods.preparing import Filtered, finished, prepare
from ftproc.settings import FilterSettings


def estimate(readings: Readings, settings: FilterSettings) -> Estimate:
    """Convert and filter; every reading is used."""
    model, starts = prepare(readings, settings)
    log = readings.unedited()
    run = run_log(run_converted, log, model, starts, conversion_of(model.noise_variance))
    return finished(Filtered(log, run, model, starts), settings)
