"""What a simulated instrument measures beside range and azimuth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ftproc.core.model.earth import MEAN_RADIUS_M
from ftproc.records import FloatArray, Heights, MeasurementLog

ELEVATION, FLIGHT_LEVEL, RANGE_RATE, AMBIGUOUS = "elevation", "flight_level", "range_rate", "ambiguous"
SIGNAL = "signal_db"  # a column
INTERVAL_MPS = 60.0  # in which an ambiguous range rate repeats
RATE_MPS, WRONG_RATES, WRONG_MPS = 0.5, 0.02, (10.0, 200.0)  # 1-sigma of range rates, share of outliers, their sizes
LEVEL_M, STEP = 30.48, 0.25  # of a flight level; to which a transponder rounds them
OFFSET_M = 80.0  # 1-sigma: the pressure at sea level, which no transponder knows
GARBLED, GARBLES, MISSED = 0.02, (10.0, 20.0, 50.0, 100.0, 200.0), 0.02  # shares of the replies, and flight levels


def measured(
    log: MeasurementLog,
    position_m: FloatArray,
    velocity_mps: FloatArray,
    names: tuple[str, ...],
    rng: np.random.Generator,
    level: tuple[float, float | None] = (0.0, None),
) -> MeasurementLog:
    """The log as it is with these quantities beside range and azimuth. position_m, velocity_mps: (n, 3) the truth, row
    for row. level: the height of the station, m, and what the pressure of the air does to the flight levels, m; None
    is drawn."""
    if ELEVATION not in names:
        measurement = log.measurement.copy()
        measurement[:, 2] = np.nan
        log = replace(log, measurement=measurement)
    if RANGE_RATE in names:
        return _with_rates(log, position_m, velocity_mps, rng, INTERVAL_MPS * (AMBIGUOUS in names))
    if FLIGHT_LEVEL not in names:
        return log
    import pyarrow as pa

    station_m, offset_m = level
    levels = _levels(position_m, station_m, OFFSET_M * rng.standard_normal() if offset_m is None else offset_m, rng)
    return replace(log, extra=pa.table({FLIGHT_LEVEL: levels}), heights=Heights(levels * LEVEL_M, barometric=True))


def with_signal(log: MeasurementLog, signal_db: FloatArray) -> MeasurementLog:
    """The log with the strength of the signal (n,) at its rows."""
    import pyarrow as pa

    column = pa.array(signal_db)
    extra = pa.table({SIGNAL: column}) if log.extra is None else log.extra.append_column(SIGNAL, column)
    return replace(log, extra=extra, signal_db=signal_db)


def _with_rates(
    log: MeasurementLog, position_m: FloatArray, velocity_mps: FloatArray, rng: np.random.Generator, interval: float
) -> MeasurementLog:
    n = len(position_m)
    rate = (position_m * velocity_mps).sum(1) / np.sqrt((position_m**2).sum(1)) + RATE_MPS * rng.standard_normal(n)
    wrong = rng.random(n) < WRONG_RATES
    rate = rate + np.where(wrong, rng.choice((-1.0, 1.0), n) * rng.uniform(*WRONG_MPS, n), 0.0)
    if interval > 0:
        rate = rate - interval * np.round(rate / interval)
    return replace(log, range_rate=rate, station=replace(log.station, range_rate_interval_mps=interval))


def _levels(position_m: FloatArray, station_m: float, offset_m: float, rng: np.random.Generator) -> FloatArray:
    """(n,) flight levels, in steps of 25 ft, a few of them garbled or missing; by standard pressure."""
    x, y, z = position_m.T
    height = np.sqrt(x**2 + y**2 + (z + MEAN_RADIUS_M) ** 2) - MEAN_RADIUS_M + station_m
    level = np.round((height + offset_m) / LEVEL_M / STEP) * STEP
    n = len(level)
    garbled = rng.random(n) < GARBLED
    level = level + np.where(garbled, rng.choice((-1.0, 1.0), n) * rng.choice(GARBLES, n), 0.0)
    return np.where(rng.random(n) < MISSED, np.nan, level)
