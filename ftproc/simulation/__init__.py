"""Simulated flights and logs with outliers, missing readings and instrument errors, with their truth.

from ftproc.simulation import simulate
flight = simulate("manoeuvre", seed=3)
flight.log, flight.truth

Calls `core.model`, for the measurement, and `records`; writes no file.
"""

from ftproc.simulation.instrument import InstrumentErrors
from ftproc.simulation.instrument_spec import INSTRUMENT_GRAMMAR, parse_instrument
from ftproc.simulation.outlier_spec import GRAMMAR, Fault, OutlierSpec, parse_outliers
from ftproc.simulation.ranges import DESCRIPTIONS as RANGE_SCENARIOS
from ftproc.simulation.ranges import SimulatedRange, simulate_range
from ftproc.simulation.scenarios import Scenario, list_scenarios
from ftproc.simulation.simulation import Simulation, simulate

__all__ = [
    "GRAMMAR", "INSTRUMENT_GRAMMAR", "RANGE_SCENARIOS", "Fault", "InstrumentErrors", "OutlierSpec", "Scenario",
    "SimulatedRange", "Simulation", "list_scenarios", "parse_instrument", "parse_outliers", "simulate",
    "simulate_range",
]  # fmt: skip
