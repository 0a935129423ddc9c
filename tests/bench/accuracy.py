"""Accuracy on simulated flights: the plain `filter` and `--smooth`, beside an oracle that knows all but
the process noise."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from ftproc import pipeline, scoring
from ftproc.core.filtering import forward
from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.filtering.smoother import smooth_log
from ftproc.core.model import motion
from ftproc.correction import model_file
from ftproc.settings import FilterSettings
from ftproc.simulation import Simulation, simulate

SCENARIOS = (
    "zuo2021", "zuo2021-outliers", "manoeuvre-clean", "manoeuvre", "radar", "overhead", "cruise", "family",
)  # fmt: skip
SEEDS = range(100, 108)
JERK_GRID = 10.0 ** np.arange(-4.0, 4.1, 0.5)  # m^2/s^5


def rows() -> Iterator[tuple[str, ...]]:
    """One row per scenario, medians over the seeds."""
    model = model_file.named("packaged")
    for scenario in SCENARIOS:
        figures = np.array([_flight(simulate(scenario, seed=seed), model) for seed in SEEDS])
        clean = np.isnan(figures).all(0)
        middle = np.where(clean, np.nan, np.median(np.nan_to_num(figures), 0))
        (f, fr, *fi), (s, sr, *si), (recall, alarms) = np.split(middle, (5, 10))
        yield (
            scenario, f"{f:.3g}", f"{fr:.2f}", _percent(fi), f"{s:.3g}", f"{sr:.2f}", _percent(si),
            "-" if np.isnan(recall) else f"{100 * recall:.1f}", f"{100 * alarms:.2f}",
        )  # fmt: skip


HEADER = ("scenario", "filter m", "/ oracle", "p, v, a in 3 sigma %", "smooth m", "/ oracle", "p, v, a in 3 sigma %",
          "found %", "false alarms %")  # fmt: skip
QUANTITIES = ("position", "velocity", "acceleration")


def _percent(shares: Iterable[float]) -> str:
    return ", ".join(f"{100 * share:.1f}" for share in shares)


def _flight(flight: Simulation, model: object) -> list[float]:
    figures: list[float] = []
    for smooth, best in zip((False, True), _oracle(flight), strict=True):
        trajectory = pipeline.filter_log(flight.log, FilterSettings(smooth=smooth), model)  # type: ignore[arg-type]
        score = scoring.score(trajectory, flight.truth).as_dict()
        shares = [score[quantity]["share_in_3_sigma"] for quantity in QUANTITIES]
        figures += [score["rmse_3d_m"], score["rmse_3d_m"] / best, *shares]
    found = np.isin(trajectory.outlier, (1, 2))
    readings = np.isfinite(flight.log.measurement)
    bad = (flight.truth.outlier != 0) & readings
    off = flight.log.measurement - flight.clean
    off[:, 1] = np.mod(off[:, 1] + np.pi, 2 * np.pi) - np.pi
    large = bad & (np.abs(off) >= 8 * np.array(flight.sigma))
    return [*figures, float(found[large].mean()) if large.any() else np.nan, float(found[readings & ~bad].mean())]


def _oracle(flight: Simulation) -> tuple[float, float]:
    """RMSE in m of filter and smoother with the true flags, noise and start and the best single jerk level."""
    truth, log = flight.truth, flight.log
    assert truth.outlier is not None
    assert truth.velocity_mps is not None
    weight = (np.isfinite(log.measurement) & (truth.outlier == 0)).astype(float)
    observations = Observations(log.time_s - log.time_s[0], log.measurement, weight)
    known = np.diag(np.r_[np.full(3, 25.0), np.full(3, 4.0), np.full(3, 25.0)])
    starts = [Start(0, np.r_[truth.position_m[0], truth.velocity_mps[0], np.zeros(3)], known)]
    best = [np.inf, np.inf]
    for jerk in JERK_GRID:
        model = Model(np.array(flight.sigma) ** 2, motion.isotropic(float(jerk)))
        runs = forward.filter_log(observations, model, starts), smooth_log(observations, model, starts)
        states = [run.state for run in runs]
        for k, state in enumerate(states):
            error = state[:, :3] - truth.position_m
            best[k] = min(best[k], float(np.sqrt((error**2).sum(1).mean())))
    return best[0], best[1]
