"""Real-time editing of a range instrument's readings (Yu, Feng, Li and Guo, Luoyang): the simple gate, the line
through four points, and the anti-outlier Kalman filter, each as first given and as improved there.

The paper's thresholds are those of one radar and a target that moves little between its scans (0.06 degrees; D = 0.6;
Q : R : P0 = 3 : 1 : 5 of a random walk in longitude and latitude). Here readings are held against a short polynomial
through those before, and what is not set follows from the log, in the same proportions where it gives any.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ftproc.core.comparators import channels as kernels
from ftproc.core.comparators import walks
from ftproc.methods import channels
from ftproc.methods.channels import POLYNOMIAL, Cleaned
from ftproc.methods.estimate import Estimate, Readings
from ftproc.methods.parameters import Parameter, of_component, per_component
from ftproc.records import FloatArray, IntArray
from ftproc.settings import FilterSettings

SMALL_GAIN = 0.002  # m of the paper
FIRST_VARIANCE = 5.0  # times the noise variance
LINE = {"order": 1.0, "window": 4.0, "longest": 3.0}  # of the least-squares method
IN_LOG = "from the log"

GATE_PARAMETERS = (*POLYNOMIAL, *per_component("F", "threshold of the gate, the paper's 0.06 degrees", IN_LOG))
LINE_PARAMETERS = (
    Parameter("order", "degree of the polynomial that is extrapolated", "1, the paper's", 0, 2, True),
    Parameter("window", "values that it goes through", "4, the paper's", 1, channels.LONGEST_WINDOW, True),
    Parameter("longest", "readings rejected in a row, after which they are accepted", "3, the paper's", 1, 1000, True),
    *per_component("D", "threshold on the residual, the paper's 0.6 degrees", IN_LOG),
)
KALMAN_PARAMETERS = (
    *POLYNOMIAL,
    Parameter("r", "gate in sigmas of the innovation, 4 to 6 in the paper", "--gate", 0.1, 100),
    Parameter("m", "factor of the gain for an outlier", f"{SMALL_GAIN}, the paper's", 0, 1),
    *per_component("Q", "variance that the state gains in an interval", IN_LOG, 2),
    *per_component("R", "variance of a reading", "from the log, or --noise", 2),
)


def gate(readings: Readings, settings: FilterSettings, check_first: bool = False) -> Estimate:
    """Readings that differ too much from what the accepted ones foretell are dropped: no estimate there."""
    log = channels.prepare(readings, settings, blindly=not check_first)
    weight = _accepted(log, settings, check_first)
    value = np.where(weight > 0, log.reading, np.nan)
    return channels.estimate(readings, log, Cleaned(value, weight))


def least_squares(readings: Readings, settings: FilterSettings) -> Estimate:
    """Readings too far from the line through the last four values are replaced by it."""
    log = channels.prepare(readings, settings)
    known = replace(settings, parameters=tuple({**LINE, **dict(settings.parameters)}.items()))
    columns = [
        kernels.least_squares(
            log.time_s, log.of(c),
            channels.predictor(log, c, channels.expect(log, c, known), known, "D"),
        )
        for c in range(3)
    ]  # fmt: skip
    value, weight = (np.stack(part, 1) for part in zip(*columns, strict=True))
    return channels.estimate(readings, log, Cleaned(value, weight))


def outlier_kalman(readings: Readings, settings: FilterSettings, improved: bool = False) -> Estimate:
    """The anti-outlier Kalman filter. improved: begin with readings that agree, and turn down the gain of the component
    that is off only."""
    log = channels.prepare(readings, settings, blindly=not improved)
    seen = np.isfinite(log.reading).astype(float)
    begin = _first(_accepted(log, settings, True), seen) if improved else _first(seen, seen)
    expected = [channels.expect(log, c, settings) for c in range(3)]
    noise, walk = np.empty(3), np.empty(3)
    for c, e in enumerate(expected):
        noise[c] = of_component(settings, "R", c, float(log.sigma[c]) ** 2, 2)
        walk[c] = of_component(settings, "Q", c, e.walk, 2)
    order, window = (np.array([e[k] for e in expected], np.int64) for k in (0, 1))
    longest = int(settings.parameter("longest") or channels.LONGEST)
    x0 = log.reading[begin, range(3)]
    model = walks.Walk(begin, x0, FIRST_VARIANCE * noise, noise, walk, order, window, longest, log.interval_s)
    small = settings.parameter("m")
    value, variance, *rest, weight = walks.outlier_kalman(
        log.time_s, log.reading, model, settings.parameter("r") or settings.gate,
        SMALL_GAIN if small is None else small, improved,
    )  # fmt: skip
    return channels.estimate(readings, log, Cleaned(value, weight, rest[0], rest[1], np.sqrt(variance)))


def _accepted(log: channels.Log, settings: FilterSettings, check_first: bool) -> FloatArray:
    """(n, 3) 1 for what the simple gate accepts."""
    columns = [
        kernels.gate(
            log.time_s, log.of(c),
            channels.predictor(log, c, channels.expect(log, c, settings), settings, "F"), check_first,
        )
        for c in range(3)
    ]  # fmt: skip
    return np.stack(columns, 1)


def _first(accepted: FloatArray, seen: FloatArray) -> IntArray:
    """(3,) first accepted sample of each component; the first seen one where none is."""
    first: IntArray = np.where(accepted.any(0), accepted.argmax(0), seen.argmax(0))
    return first
