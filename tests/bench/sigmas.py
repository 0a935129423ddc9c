"""Published sigmas against the errors: the share of rows with all axes inside 3 sigma (of all seeds together; 99.2 % if
the errors are Gaussian), the largest error of any row in sigmas, and the RMS sigma over the RMS error (the median of
the seeds; rows with a sigma far above the usual one, as before a filter has settled, are left out of it): of position,
velocity and acceleration, in this order, by scenario and sampling rate."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np

from ftproc import pipeline
from ftproc.core import threads
from ftproc.correction import model_file
from ftproc.records import FloatArray
from ftproc.settings import FilterSettings
from ftproc.simulation import list_scenarios, simulate
from ftproc.simulation.scenarios import Plan, draw, find_scenario

RATES_HZ = (None, 1.0, 5.0, 20.0, 50.0, 100.0)  # None: the scenario's own
SEEDS = range(5)
MOST_ROWS = 6_000  # of a run; at high rates the flights are shorter
FAR_ABOVE = 3.0  # times the median sigma
SHOWN = ("in 3 sigma, %", "largest, sigmas", "sigma / error")
HEADER = ("scenario", "Hz", *(f"{how}: {what}" for how in ("filter", "`--smooth`") for what in SHOWN), "verdicts")


class Case(NamedTuple):
    """One row of the table. rate_hz: None for the scenario's own."""

    scenario: str
    rate_hz: float | None


class Run(NamedTuple):
    """One seed. error, sigma: (n, 9) of the state, in its units."""

    error: FloatArray
    sigma: FloatArray
    verdict: str


def cases() -> list[Case]:
    """Those that differ: a scenario with one rate of its own does not come twice at it."""
    found = []
    for name in list_scenarios():
        scenario = find_scenario(name)
        own = {1 / dt for dt in scenario.dt_s if len(scenario.dt_s) == 1 and not scenario.members}
        found += [Case(name, rate) for rate in RATES_HZ if rate not in own]
    return found


def rows(chosen: list[Case] | None = None) -> Iterator[tuple[str, ...]]:
    """One row per case, as they are done; the runs go in parallel on the processors there are."""
    todo = cases() if chosen is None else chosen
    with ProcessPoolExecutor(threads.available(), get_context("spawn"), threads.use, (1,)) as pool:
        jobs = [(c, [[pool.submit(run, c, s, smooth) for s in SEEDS] for smooth in (False, True)]) for c in todo]
        for case, waiting in jobs:
            yield _row(case, *([each.result() for each in ways] for ways in waiting))


def run(case: Case, seed: int, smooth: bool) -> Run:
    """Filter one draw of a scenario."""
    own = plan(case.scenario, seed)
    dt_s = own.dt_s if case.rate_hz is None else 1 / case.rate_hz
    flight = simulate(case.scenario, seed=seed, dt_s=dt_s, duration_s=min(own.duration_s, MOST_ROWS * dt_s))
    model = model_file.named("packaged")
    found = pipeline.filter_log(flight.log, FilterSettings(smooth=smooth), model)
    truth = flight.truth
    assert truth.velocity_mps is not None
    assert truth.acceleration_mps2 is not None
    state = np.hstack([truth.position_m, truth.velocity_mps, truth.acceleration_mps2])
    return Run(found.state - state, found.sigma, found.metadata["summary"]["trust"]["verdict"])


def plan(scenario: str, seed: int) -> Plan:
    """What `simulate` draws for the scenario with this seed."""
    return draw(find_scenario(scenario), np.random.default_rng(seed).spawn(1)[0])


def _row(case: Case, filtered: list[Run], smoothed: list[Run]) -> tuple[str, ...]:
    verdicts = [each.verdict for each in (*filtered, *smoothed)]
    counts = ", ".join(f"{verdicts.count(name)} {name}" for name in sorted(set(verdicts)))
    rate = "own" if case.rate_hz is None else f"{case.rate_hz:g}"
    return (case.scenario, rate, *_figures(filtered), *_figures(smoothed), counts)


def _figures(runs: list[Run]) -> tuple[str, ...]:
    """What is SHOWN, each of position, velocity and acceleration."""
    found = []
    for first in (0, 3, 6):
        axes = slice(first, first + 3)
        ratio = np.concatenate([np.abs(r.error[:, axes] / r.sigma[:, axes]) for r in runs])
        width = np.median([_width(r.error[:, axes], r.sigma[:, axes]) for r in runs])
        found.append((f"{100 * (ratio <= 3).all(1).mean():.1f}", f"{ratio.max():.3g}", f"{width:.2f}"))
    return tuple(", ".join(cells) for cells in zip(*found, strict=True))


def _width(error: FloatArray, sigma: FloatArray) -> float:
    """RMS sigma over RMS error, both (n, 3), of the rows with an ordinary sigma."""
    variance = (sigma**2).sum(1)
    usual = variance <= FAR_ABOVE**2 * np.median(variance)
    return float(np.sqrt(variance[usual].mean() / (error[usual] ** 2).sum(1).mean()))
