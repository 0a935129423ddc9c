"""Every method on simulated flights: medians of the position error (3-D RMSE) in metres."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ftproc import pipeline, scoring
from ftproc.errors import InputError
from ftproc.methods import registry
from ftproc.settings import FilterSettings
from ftproc.simulation import Simulation, simulate

SCENARIOS = ("zuo2021", "zuo2021-outliers", "manoeuvre-clean", "manoeuvre", "radar", "overhead")
SEEDS = range(100, 105)
HEADER = ("method", *SCENARIOS)


def rows() -> Iterator[tuple[str, ...]]:
    """One row per method, one per method and smoother where there is one, and one per way of editing as the readings
    come; a lost track counts as infinite."""
    flights = {name: [simulate(name, seed=seed) for seed in SEEDS] for name in SCENARIOS}
    for way, settings in _ways():
        medians = [np.median([_error(flight, settings) for flight in some]) for some in flights.values()]
        yield (way, *(f"{m:.3g}" for m in medians))


def _ways() -> Iterator[tuple[str, FilterSettings]]:
    """What is compared, by its options."""
    for method in registry.METHODS.values():
        for smooth in (False, True):
            if registry.obstacle(method, smooth, None) is None:
                settings = FilterSettings(method=method.name, smooth=smooth)
                yield f"{method.name}{' --smooth' if smooth else ''}", settings
        if method.name == registry.MAIN:
            for editing, lag_s in (("live", 0.0), ("live", 2.0), ("forward", 0.0), ("none", 0.0)):
                lag = f" --lag {lag_s:g}" if lag_s else ""
                yield f"{method.name} --editing {editing}{lag}", FilterSettings(editing=editing, lag_s=lag_s)


def _error(flight: Simulation, settings: FilterSettings) -> float:
    try:
        trajectory = pipeline.filter_log(flight.log, settings)
    except InputError:
        return np.inf
    error = scoring.score(trajectory, flight.truth).rmse_3d_m
    assert error is not None
    return error
