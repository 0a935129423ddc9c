"""Simulated flights, as dirty as real logs, with their truth.

from ftproc.simulation import simulate
flight = simulate("manoeuvre", seed=3)
flight.log, flight.truth
"""

from ftproc.simulation.instrument import InstrumentErrors
from ftproc.simulation.scenarios import Scenario, list_scenarios
from ftproc.simulation.simulation import Simulation, simulate
from ftproc.simulation.spec import GRAMMAR, Fault, OutlierSpec, parse_outliers

__all__ = [
    "GRAMMAR",
    "Fault",
    "InstrumentErrors",
    "OutlierSpec",
    "Scenario",
    "Simulation",
    "list_scenarios",
    "parse_outliers",
    "simulate",
]
