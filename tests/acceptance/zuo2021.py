"""`python -m tests.acceptance.zuo2021`: the experiment of Zuo et al. 2021, sections 3.1 and 3.2, as Markdown.

Four trials of the paper's flight, clean and with outliers in range. BPNN-EKF is an extended Kalman filter without
editing, its network started at random and trained by back-propagation with momentum; GA-BPNN-UKF is the main method
with its network started by the genetic search. Both networks see what the paper's see (feature set `correction`), are
trained on other noise of the same flight, and keep their gain only where held-out flights prove it. Errors are the
paper's (eqs 20, 21): the mean over the samples of the length of the position error, in m.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np

from ftproc import pipeline, scoring
from ftproc.correction.model import Model
from ftproc.correction.training.flights import train_flights
from ftproc.settings import FilterSettings, TrainSettings
from ftproc.simulation import simulate

TRIALS = (1, 2, 3, 4)  # seeds
PAPER = {  # Table 1: the clean flight
    "bpnn-ekf": (31.5347, 12.1745, 18.8466, 9.7875),
    "ga-bpnn-ukf": (9.0323, 9.6778, 11.9063, 6.5939),
}
SCENARIOS = {"clean": "zuo2021", "outliers": "zuo2021-outliers"}
FLIGHTS, FIRST_SEED = 24, 10_000  # to train on; far from the seeds of the trials
METHODS = {
    "bpnn-ekf": TrainSettings("correction", method="bpnn-ekf", optimiser="momentum", epochs=200),
    "ga-bpnn-ukf": TrainSettings("correction"),
}
WITHOUT_NETWORK = {"bpnn-ekf": "ekf"}  # the same filter; ga-bpnn-ukf runs without a model
HEADER = ("flight", "method", *(f"trial {t}" for t in TRIALS), "mean", "without the network", "Zuo et al. 2021, mean")


@cache
def model(method: str, scenario: str, flights: int = FLIGHTS, duration_s: float | None = None) -> Model:
    """The method's correction of its filter, trained on other flights of the scenario."""
    known = [simulate(scenario, seed=FIRST_SEED + k, duration_s=duration_s) for k in range(flights)]
    return train_flights([(flight.log, flight.truth) for flight in known], METHODS[method])


@cache
def errors(method: str, scenario: str, corrected: bool = True) -> tuple[float, ...]:
    """m, of each trial."""
    network = model(method, scenario) if corrected else None
    settings = FilterSettings(method=method if corrected else WITHOUT_NETWORK.get(method, method))
    found = []
    for seed in TRIALS:
        flight = simulate(scenario, seed=seed)
        score = scoring.score(pipeline.filter_log(flight.log, settings, network), flight.truth)
        assert score.rmse_seed_m is not None
        found.append(score.rmse_seed_m)
    return tuple(found)


def rows() -> Iterator[tuple[str, ...]]:
    """One row per flight and method, beside the paper's mean of Table 1."""
    for flight, scenario in SCENARIOS.items():
        for method in METHODS:
            own, plain = errors(method, scenario), errors(method, scenario, corrected=False)
            paper = f"{np.mean(PAPER[method]):.1f}" if flight == "clean" else "-"
            mean, without = f"{np.mean(own):.2f}", f"{np.mean(plain):.2f}"
            yield (flight, method.upper(), *(f"{e:.2f}" for e in own), mean, without, paper)


if __name__ == "__main__":
    from tests.bench.__main__ import markdown

    for line in markdown(HEADER, rows()):
        print(line, flush=True)
