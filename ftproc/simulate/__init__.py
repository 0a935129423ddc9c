"""Simulated flights, as dirty as real logs, with their truth.

from ftproc.simulate import simulate
flight = simulate("manoeuvre", seed=3)
flight.log, flight.truth
"""

from ftproc.simulate.instrument import InstrumentErrors
from ftproc.simulate.scenarios import Scenario, list_scenarios
from ftproc.simulate.simulation import Simulation, simulate
from ftproc.simulate.spec import GRAMMAR, Fault, OutlierSpec, parse_outliers

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
