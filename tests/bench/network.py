"""What the packaged network does to the filter and to live rows of flights that it has not seen, with seeds that were
fixed beforehand: the error with it over the error without, the geometric mean over flights with its 90 % bootstrap
interval; and the mean share of rows that are inside 3 sigma without it, with it, and with it if the sigmas were so much
smaller. At the end, a network that a fleet's past flights have taught without truth, over the packaged one."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ftproc import pipeline
from ftproc.correction import model_file
from ftproc.correction.model import Model
from ftproc.correction.training.flights import train_flights
from ftproc.errors import InputError
from ftproc.records import FloatArray
from ftproc.settings import FilterSettings, TrainSettings
from ftproc.simulation import Simulation, simulate

SCENARIOS = {
    "family": "its own family",
    "manoeuvre": "fighter, outliers",
    "manoeuvre-clean": "fighter, none",
    "overhead": "pass near the zenith",
    "radar": "airliner, 1 Hz",
    "cruise": "straight legs",
    "calibration": "steady circles",
    "abrupt": "never seen: parachute, impact, ignition",
    "zuo2021": "never seen: 61 rows without a manoeuvre",
}
SEEDS = range(8000, 8012)
FILTER, LIVE = FilterSettings(), FilterSettings(editing="live")
PAST, UNSEEN = range(8100, 8124), range(8200, 8212)
LONGEST_S = 120.0
SMALLER = 0.95
IN_SIGMA = f"in 3 sigma without, with, of {SMALLER} sigma %"
HEADER = (
    "flights", "what", "number", "position", "velocity", "worst position", "corrected %", f"position {IN_SIGMA}",
    f"velocity {IN_SIGMA}",
)  # fmt: skip


def rows() -> Iterator[tuple[str, ...]]:
    """One row per scenario and way of editing, and one of the fleet."""
    packaged = model_file.named("packaged")
    assert packaged is not None
    for before, settings in (("", FILTER), ("live: ", LIVE)):
        for name, what in SCENARIOS.items():
            found = [_figures(name, seed, packaged, settings) for seed in SEEDS]
            yield _row(name, f"{before}{what}", np.array(found))
    past = [(_flight("manoeuvre-clean", seed).log, None) for seed in PAST]
    own = train_flights(past, TrainSettings("motion"))
    both = [[_figures("manoeuvre-clean", seed, model) for model in (own, packaged)] for seed in UNSEEN]
    found = [np.concatenate([mine[:1], usual[:1], usual[3:4], mine[3:]]) for mine, usual in both]
    yield _row("manoeuvre-clean", f"a fleet's own, of {len(PAST)} past flights without truth", np.array(found))


def _flight(scenario: str, seed: int) -> Simulation:
    whole = simulate(scenario, seed=seed)
    short = float(whole.log.time_s[-1] - whole.log.time_s[0]) <= LONGEST_S
    return whole if short or scenario == "radar" else simulate(scenario, seed=seed, duration_s=LONGEST_S)


def _figures(scenario: str, seed: int, model: Model, settings: FilterSettings = FILTER) -> FloatArray:
    """(5, 2) of position and velocity, over the rows that have an estimate: root mean square of the errors m and m/s,
    with the network and without; shares inside 3 sigma without, with, and with it and smaller sigmas. NaN where the
    filter itself diverges."""
    flight = _flight(scenario, seed)
    try:
        found = pipeline.filter_log(flight.log, settings, model)
    except InputError:
        return np.full((5, 2), np.nan)
    truth = np.concatenate([flight.truth.position_m, flight.truth.velocity_mps], axis=1)
    known = np.isfinite(found.state).all(1)
    corrected, plain = ((state - truth)[known] for state in (found.state[:, :6], found.state[:, :6] - found.correction))
    bound = 3 * found.sigma[known, :6]
    errors = [[np.sqrt(np.mean(np.sum(e[:, k : k + 3] ** 2, 1))) for k in (0, 3)] for e in (corrected, plain)]
    inside = [np.abs(plain) < bound, np.abs(corrected) < bound, np.abs(corrected) < SMALLER * bound]
    return np.array([*errors, *([np.mean(each[:, k : k + 3].all(1)) for k in (0, 3)] for each in inside)])


def _row(name: str, what: str, figures: FloatArray) -> tuple[str, ...]:
    """figures: (flights, 5, 2)."""
    figures = figures[np.isfinite(figures).all((1, 2))]
    ratio = figures[:, 0] / figures[:, 1]
    drawn = np.log(ratio)[np.random.default_rng(0).integers(0, len(ratio), (2000, len(ratio)))].mean(1)
    low, high = np.exp(np.quantile(drawn, [0.05, 0.95], axis=0))
    mean = np.exp(np.log(ratio).mean(0))
    cells = [f"{mean[k]:.3f} ({low[k]:.3f} to {high[k]:.3f})" for k in (0, 1)]
    worst, changed = f"{ratio[:, 0].max():.3f}", f"{100 * np.mean((ratio != 1).any(1)):.0f}"
    shares = [", ".join(f"{100 * share:.1f}" for share in figures[:, 2:, k].mean(0)) for k in (0, 1)]
    return name, what, str(len(ratio)), *cells, worst, changed, *shares
