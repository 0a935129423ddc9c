"""Rivals at their best: each method of the papers with the parameters that, of those tried, give the smallest error on
the very flights it is held against (which no user could know), beside its own choice and the program's default. Medians
of the position error (3-D RMSE) in metres, and the share of outliers found."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ftproc import pipeline, scoring
from ftproc.errors import InputError
from ftproc.settings import FilterSettings
from ftproc.simulation import Simulation, simulate

SCENARIOS = ("zuo2021-outliers", "radar")
SEEDS = range(100, 103)
POLYNOMIALS = [
    {"order": 0.0},
    *({"order": o, "window": w} for o, w in ((1.0, 4.0), (1.0, 10.0), (2.0, 6.0), (2.0, 12.0))),
]
THRESHOLDS = ({}, {"r": 3.0}, {"r": 6.0})
GATES = [a | b for a in POLYNOMIALS for b in ({}, {"longest": 8.0})]
KALMAN = [a | b | {"m": m} for a, b, m in itertools.product(POLYNOMIALS, THRESHOLDS, (0.0, 0.002))]
TRIED: Mapping[str, Sequence[Mapping[str, float]]] = {
    "gate": GATES,
    "gate-improved": GATES,
    "ls4": [a | b for a in POLYNOMIALS[1:] for b in ({}, {"longest": 6.0}, {"longest": 12.0})],
    "outlier-kf": KALMAN,
    "outlier-kf-improved": KALMAN,
    "ls-window-kf": [a | b for a in POLYNOMIALS for b in ({}, {"longest": 8.0}, {"longest": 30.0})],
    "rkf": [a | {"memory": m} for a in POLYNOMIALS for m in (0.5, 0.9, 0.97)],
    "huber-ukf": [{"k": k} for k in (0.7, 1.0, 2.0)],
    "student-t-ukf": [{"nu": nu} for nu in (2.0, 3.0, 8.0)],
    "mcc-ukf": [{"b": b} for b in (1.5, 2.0, 4.0)],
    "enpf-chi2": [{"gate": g, "jitter": j} for g, j in itertools.product((0.99, 0.9999), (0.25, 1.0))],
    "renpf": [{"moves": m} for m in (2.0, 15.0)],
}
HEADER = (
    "method",
    *(f"{s}, {what}" for s in SCENARIOS for what in ("its own choice", "at its best", "found %", "with")),
)


def rows() -> Iterator[tuple[str, ...]]:
    """One row per method, the program's default first."""
    flights = {name: [simulate(name, seed=seed) for seed in SEEDS] for name in SCENARIOS}
    default = [_median(some, FilterSettings()) for some in flights.values()]
    yield (
        FilterSettings.method,
        *(cell for e, f in default for cell in (f"{e:.3g}", f"{e:.3g}", f"{100 * f:.0f}", "-")),
    )
    for method, tried in TRIED.items():
        cells: list[str] = []
        for some in flights.values():
            own, *_ = _median(some, FilterSettings(method=method))
            settings = [FilterSettings(method=method, parameters=tuple(given.items())) for given in ({}, *tried)]
            (error, found), best = min((_median(some, s), s.parameters) for s in settings)
            said = ", ".join(f"{name}={value:g}" for name, value in best) or "nothing set"
            cells += [f"{own:.3g}", f"{error:.3g}", f"{100 * found:.0f}", said]
        yield (method, *cells)


def _median(flights: Sequence[Simulation], settings: FilterSettings) -> tuple[float, float]:
    """Position error, m, and share of the outliers that are found."""
    found = [_one(flight, settings) for flight in flights]
    error, share = np.median(found, axis=0)
    return float(error), float(share)


def _one(flight: Simulation, settings: FilterSettings) -> tuple[float, float]:
    try:
        trajectory = pipeline.filter_log(flight.log, settings)
    except InputError:  # a lost track
        return np.inf, 0.0
    error = scoring.score(trajectory, flight.truth).rmse_3d_m
    assert error is not None
    flagged = np.isin(trajectory.outlier, (1, 2))
    return error, float(flagged[flight.truth.outlier > 0].mean())
