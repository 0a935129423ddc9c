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

from ftproc.correction.apply import correct
from ftproc.correction.model import Stage
from ftproc.correction.training.flights import filtered_flights
from ftproc.correction.training.train import train
from ftproc.settings import FilterSettings, TrainSettings
from ftproc.simulation import simulate

TRIALS = (1, 2, 3, 4)  # seeds
PAPER = {  # Table 1: the clean flight
    "BPNN-EKF": (31.5347, 12.1745, 18.8466, 9.7875),
    "GA-BPNN-UKF": (9.0323, 9.6778, 11.9063, 6.5939),
}
SCENARIOS = {"clean": "zuo2021", "outliers": "zuo2021-outliers"}
FLIGHTS = 24  # to train on; their seeds are far from the trials'
METHODS = {
    "BPNN-EKF": ("bpnn-ekf", TrainSettings("correction", optimiser="momentum", start="random", epochs=200)),
    "GA-BPNN-UKF": ("ga-bpnn-ukf", TrainSettings("correction", start="genetic")),
}
HEADER = ("flight", "method", *(f"trial {t}" for t in TRIALS), "mean", "without the network", "Zuo et al. 2021, mean")


@cache
def network(method: str, scenario: str) -> Stage:
    """The method's correction of its filter, trained on other flights of the scenario."""
    name, settings = METHODS[method]
    flights = [simulate(scenario, seed=10_000 + number) for number in range(FLIGHTS)]
    pairs = [(flight.log, flight.truth) for flight in flights]
    known = filtered_flights(pairs, FilterSettings(method=name))
    return train(known["filter"], settings)


@cache
def errors(method: str, scenario: str, corrected: bool = True) -> tuple[float, ...]:
    """m, of each trial."""
    found = []
    for seed in TRIALS:
        flight = simulate(scenario, seed=seed)
        settings = FilterSettings(method=METHODS[method][0])
        run = filtered_flights([(flight.log, flight.truth)], settings)["filter"][0].run
        position = run.state[:, :3]
        if corrected:
            position = position + correct(run, network(method, scenario)).values[:, :3]
        found.append(float(np.linalg.norm(position - flight.truth.position_m, axis=1).mean()))
    return tuple(found)


def rows() -> Iterator[tuple[str, ...]]:
    """One row per flight and method, beside the paper's mean of Table 1."""
    for flight, scenario in SCENARIOS.items():
        for method in METHODS:
            own, plain = errors(method, scenario), errors(method, scenario, corrected=False)
            paper = f"{np.mean(PAPER[method]):.1f}" if flight == "clean" else "-"
            yield (flight, method, *(f"{e:.2f}" for e in own), f"{np.mean(own):.2f}", f"{np.mean(plain):.2f}", paper)


if __name__ == "__main__":
    from tests.bench.__main__ import markdown

    for line in markdown(HEADER, rows()):
        print(line, flush=True)
