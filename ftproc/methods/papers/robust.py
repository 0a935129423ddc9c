"""UKFs that give outliers less weight instead of editing them: Huber, Student t, maximum correntropy. One kernel, three
weights; see `ftproc.core.comparators.robust`."""

from __future__ import annotations

import numpy as np

from ftproc.core.comparators import robust
from ftproc.core.filtering.forward import run_log
from ftproc.methods.estimate import Estimate, Readings
from ftproc.methods.parameters import Parameter
from ftproc.methods.preparing import Filtered, finished, prepare
from ftproc.settings import FilterSettings

HUBER_K = 1.345  # sigmas: 95 % efficient on Gaussian noise
STUDENT_NU = 4.0  # degrees of freedom
CORRENTROPY_B = 2.5  # sigmas: bandwidth of the kernel
HUBER_PARAMETERS = (Parameter("k", "full weight up to so many sigmas", str(HUBER_K), 0.1, 100),)
STUDENT_PARAMETERS = (Parameter("nu", "degrees of freedom", str(STUDENT_NU), 1, 1000),)
CORRENTROPY_PARAMETERS = (Parameter("b", "bandwidth of the kernel in sigmas", str(CORRENTROPY_B), 0.1, 100),)
LOST_AT = 10.0  # times the range that 99 % of the readings stay below: no target is there


def huber(readings: Readings, settings: FilterSettings) -> Estimate:
    """Huber's weight min(1, k / u)."""
    return _run(readings, settings, robust.HUBER, settings.parameter("k") or HUBER_K)


def student(readings: Readings, settings: FilterSettings) -> Estimate:
    """The weight (nu + 1) / (nu + u^2) of Student's t."""
    return _run(readings, settings, robust.STUDENT, settings.parameter("nu") or STUDENT_NU)


def correntropy(readings: Readings, settings: FilterSettings) -> Estimate:
    """The weight exp(-u^2 / (2 b^2)) of the maximum correntropy criterion."""
    return _run(readings, settings, robust.CORRENTROPY, settings.parameter("b") or CORRENTROPY_B)


def _run(readings: Readings, settings: FilterSettings, kind: int, parameter: float) -> Estimate:
    model, starts = prepare(readings, settings)
    log = readings.unedited()
    run = run_log(robust.run_robust, log, model, starts, robust.weighting_of(kind, parameter))
    farthest = LOST_AT * np.nanquantile(np.abs(log.measurement[:, 0]), 0.99)
    if not np.linalg.norm(run.state[:, :3], axis=1).max() < farthest:
        raise ValueError(f"{settings.method} lost the track, and cannot re-acquire it; use ga-bpnn-ukf")
    at_gate = robust.weight_of(kind, parameter, settings.gate)  # a reading with less is called an outlier
    kept = (run.weight > at_gate).astype(float)
    kept[: starts[0].sample] = np.isfinite(log.measurement[: starts[0].sample])  # extrapolated, not judged
    return finished(Filtered(log._replace(weight=run.weight), run, model, starts), settings, kept)
