"""What a model of motion is worth: smoothed errors of position and velocity over those with white jerk, medians of the
flights, for each model alone and for the one that the log chooses, by scenario and sampling rate; and how often that
is another one than white jerk."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np

from ftproc import pipeline
from ftproc.core import threads
from ftproc.core.identification.motions.motion_models import WHITE
from ftproc.errors import FtprocError
from ftproc.records import FloatArray
from ftproc.settings import AUTO, FilterSettings
from ftproc.simulation import simulate

SCENARIOS = ("manoeuvre-clean", "aerodynamic", "radar", "cruise", "ballistic", "release", "abrupt")
INTERVALS_S = (None, 0.02, 0.2, 1.0)  # None: the scenario's own
SEEDS = range(200, 208)
MODELS = (WHITE, "turning-force", "ballistic", AUTO)
HEADER = ("scenario", "interval", *(f"{name}: position, velocity" for name in MODELS[1:]), "other than white jerk")


def errors(scenario: str, dt_s: float | None, seed: int, motion: str) -> tuple[FloatArray, bool]:
    """RMSE of position m and velocity m/s, infinite where there is no track; and whether the motion is another than
    white jerk."""
    flight = simulate(scenario, seed=seed, dt_s=dt_s)
    try:
        found = pipeline.filter_log(flight.log, FilterSettings(smooth=True, motion=motion))
    except FtprocError:
        return np.full(2, np.inf), False
    truth = np.concatenate([flight.truth.position_m, flight.truth.velocity_mps], 1)
    wrong = (found.state[:, :6] - truth[np.isin(flight.truth.time_s, found.time_s)]) ** 2
    rmse = np.sqrt([wrong[:, :3].sum(1).mean(), wrong[:, 3:].sum(1).mean()])
    return rmse, found.metadata["summary"]["motion"] != WHITE.replace("-", " ")


def rows() -> Iterator[tuple[str, ...]]:
    """One row per scenario and interval."""
    with ProcessPoolExecutor(threads.available(), get_context("spawn"), threads.use, (1,)) as pool:
        cases = [(scenario, dt_s) for scenario in SCENARIOS for dt_s in INTERVALS_S]
        jobs = {
            case: [[pool.submit(errors, *case, seed, motion) for seed in SEEDS] for motion in MODELS] for case in cases
        }
        for (scenario, dt_s), runs in jobs.items():
            found = [[run.result() for run in each] for each in runs]
            rmse = np.array([[error for error, _ in each] for each in found])
            ratio = np.median(rmse[1:] / rmse[0], axis=1)
            chosen = sum(other for _, other in found[-1])
            interval = "its own" if dt_s is None else f"{dt_s:g} s"
            cells = (f"{position:.3f}, {velocity:.3f}" for position, velocity in ratio)
            yield scenario, interval, *cells, f"{chosen} of {len(SEEDS)}"
