"""A simulated flight to its files, in the units asked for."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ftproc.errors import UsageError
from ftproc.files import atomic, truth, writing
from ftproc.files.units import QUANTITIES, UNITS, parse_units, si_unit

if TYPE_CHECKING:
    import pyarrow as pa

    from ftproc.records import MeasurementLog
    from ftproc.simulation import Simulation


def check(output: str, truth_output: str | None) -> None:
    """Raise UsageError or OutputError before any work when the two cannot both be written."""
    for target in (output, truth_output):
        if target is not None:
            writing.kind_of(target)
            atomic.check_target(target)
    if truth_output is not None and (output == truth_output or _resolved(output) == _resolved(truth_output)):
        raise UsageError(f"-o and --truth are both {output}; give the truth a place of its own.")


def _resolved(target: str) -> str:
    from pathlib import Path

    return target if target == "-" else str(Path(target).resolve())


def write(flight: Simulation, output: str, truth_output: str | None, units: str | None, azimuth_from: str) -> None:
    """Write the truth, then the log: who waits for the log finds both. Raises OutputError, UsageError."""
    table = as_table(flight.log, parse_units(units), azimuth_from)
    if truth_output is not None:
        truth.write(flight.truth, truth_output)
    writing.write_table(table, output)


def as_table(log: MeasurementLog, units: dict[str, str], azimuth_from: str) -> pa.Table:
    """The log with its units in the column names, such as `range_km`; SI where `units` says nothing."""
    import pyarrow as pa

    arrays = {}
    for index, quantity in enumerate(QUANTITIES):
        values = log.time_s if index == 0 else log.measurement[:, index - 1]
        if quantity == "azimuth" and azimuth_from == "north":
            values = np.mod(values, 2 * math.pi)
            values = np.where(values >= 2 * math.pi, 0.0, values)  # what rounding makes of a tiny negative angle
        unit = UNITS[quantity][units.get(quantity, si_unit(quantity).name)]
        arrays[f"{quantity}_{unit.name}"] = np.ascontiguousarray(values * unit.divide / unit.multiply)
    return pa.table(arrays)
