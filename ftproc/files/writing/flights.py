"""Simulated flights out: a log, in any units, and its truth."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ftproc.files import arrow
from ftproc.files.layout import ACCELERATION, OUTLIER, POSITION, VELOCITY, Target
from ftproc.files.options import parse_units
from ftproc.files.units import si_unit, unit_named
from ftproc.files.words import QUANTITIES
from ftproc.files.writing import tables
from ftproc.records import FlagArray, FloatArray, MeasurementLog, Truth

if TYPE_CHECKING:
    import pyarrow as pa


def write_log(
    log: MeasurementLog, target: Target, units: str | Mapping[str, str] | None = None, azimuth_from: str = "x"
) -> None:
    """Write `log` to a .csv, .csv.gz, .parquet or .feather file or `-` (CSV on stdout).

    units: of columns that are not to be in SI, such as `range=km`; column names end in the unit. azimuth_from:
    `north` writes azimuths from 0 to a full turn, as surveys do. In SI every float64 reads back bit for bit; a missing
    reading is an empty cell (NaN in Parquet). Raises OutputError, UsageError.
    """
    tables.write_table(tables.with_extra(_log_table(log, parse_units(units), azimuth_from), log.extra), target)


def _log_table(log: MeasurementLog, units: Mapping[str, str], azimuth_from: str) -> pa.Table:
    """The log with its units in the column names, such as `range_km`; SI for quantities not in `units`."""
    arrays = {}
    of_log = [log.time_s, *log.measurement.T, *([] if log.range_rate is None else [log.range_rate])]
    for quantity, values in zip((*QUANTITIES, "range_rate"), of_log, strict=False):
        if quantity == "elevation" and np.isnan(values).all() and np.isfinite(log.measurement[:, :2]).any(0).all():
            continue  # of an instrument that measures none
        if quantity == "azimuth" and azimuth_from == "north":
            values = np.mod(values, 2 * math.pi)
            values = np.where(values >= 2 * math.pi, 0.0, values)  # a tiny negative angle, rounded
        unit = unit_named(quantity, units.get(quantity, "")) or si_unit(quantity)
        name = f"{quantity} ({unit.name})" if " " in unit.name else f"{quantity}_{unit.name}"  # with a factor
        arrays[name] = np.ascontiguousarray(values * unit.divide / unit.multiply)
    return arrow.table(arrays)


def write_truth(truth: Truth, target: Target) -> None:
    """Write `truth` to a .csv, .csv.gz, .parquet or .feather file or `-` (CSV on stdout), bit for bit.

    Raises OutputError.
    """
    groups = ((POSITION, truth.position_m), (VELOCITY, truth.velocity_mps), (ACCELERATION, truth.acceleration_mps2))
    arrays: dict[str, FloatArray | FlagArray] = {"time_s": truth.time_s}
    for names, group in groups:
        if group is not None:
            arrays.update(zip(names, np.ascontiguousarray(group.T), strict=True))
    if truth.outlier is not None:
        arrays.update(zip(OUTLIER, np.ascontiguousarray(truth.outlier.T), strict=True))
    tables.write_table(arrow.table(arrays), target)
