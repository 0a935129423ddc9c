"""`python -m tests.acceptance.zuo2021`: the experiment of Zuo et al. 2021, sections 3.1 and 3.2, as Markdown.

Four trials of the paper's flight, clean and with outliers in range. BPNN-EKF is an extended Kalman filter without
editing, its network started at random; GA-BPNN-UKF is the main method, its network started by the genetic search. Both
networks are the paper's: update minus prediction in, truth minus estimate out, back-propagation by gradient descent
with momentum, on other flights of constant acceleration; held-out flights decide how much of their answers is applied.
Errors are the paper's (eqs 20, 21): the mean over the samples of the length of the position error, in m, of the same
samples for all: those from which every filter has an estimate.

The paper does not say what its filters assume. `untuned` is what someone specifies who does not know the angles'
noise, to which the paper adds none. Trained on the flight itself with other noise, as it was here once, the network
took the error of the untuned filter to a half; what it had learned was that flight.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np

from ftproc import pipeline
from ftproc.correction.model import Model
from ftproc.correction.training.flights import train_flights
from ftproc.records import Trajectory
from ftproc.settings import EPOCHS, FilterSettings, TrainSettings
from ftproc.simulation import Simulation, simulate
from ftproc.simulation.flights.kinematics import constant_acceleration
from ftproc.simulation.scenarios import draw, find_scenario
from ftproc.simulation.simulation import measure

TRIALS = (1, 2, 3, 4)  # seeds
PAPER = {  # Table 1: the clean flight
    "bpnn-ekf": (31.5347, 12.1745, 18.8466, 9.7875),
    "ga-bpnn-ukf": (9.0323, 9.6778, 11.9063, 6.5939),
}
SCENARIOS = {"clean": "zuo2021", "outliers": "zuo2021-outliers"}
ALL_KNOWN_S = 16.0  # before it, recursive editing has no estimate
FLIGHTS, FIRST_SEED = 24, 10_000  # to train on; far from the seeds of the trials
WITHOUT_NETWORK = {"bpnn-ekf": "ekf", "ga-bpnn-ukf": "ga-bpnn-ukf"}  # the same filter, run without a model
RECURSIVE = FilterSettings(editing="forward", gain_form=True)  # the paper's gate, its weight m scaling the gain
UNTUNED = replace(RECURSIVE, noise=(10**0.5, 0.1, 0.1), jerk_psd_m2ps5=0.01)
WAYS = {"untuned, forward": UNTUNED, "from the log, forward": RECURSIVE, "from the log, two-pass": FilterSettings()}
HEADER = (
    "flight", "settings", "method", *(f"trial {t}" for t in TRIALS), "mean", "without the network",
    "Zuo et al. 2021, mean",
)  # fmt: skip


@cache
def model(
    method: str, scenario: str, way: str = "from the log, two-pass", flights: int = FLIGHTS,
    duration_s: float | None = None,
) -> Model:  # fmt: skip
    """The method's correction of its filter, trained as the paper trains it on other flights of the scenario."""
    made = other_flight if scenario in SCENARIOS.values() else simulate
    known = [made(scenario, seed=FIRST_SEED + k, duration_s=duration_s) for k in range(flights)]
    settings = TrainSettings("correction", method=method, optimiser="momentum", epochs=EPOCHS["momentum"])
    return train_flights([(flight.log, flight.truth) for flight in known], settings, WAYS[way])


def other_flight(scenario: str, seed: int, duration_s: float | None = None) -> Simulation:
    """A flight of constant acceleration like the paper's, but another: the paper's is what the network is tried on."""
    rng = np.random.default_rng(seed)
    plan = draw(find_scenario(scenario), rng)
    start, velocity, acceleration = (
        rng.uniform(0.5, 2.0, 3) * each * rng.choice([-1.0, 1.0], 3) ** (1, 1, 0)
        for each in ((300.0, 346.0, 200.0), (40.0, 20.0, 10.0), (1.3, 1.7, 1.3))
    )
    flight = constant_acceleration(duration_s or plan.duration_s, start, velocity, acceleration)
    return measure(flight, plan, np.array(plan.noise), f"another {scenario}", seed)


def filtered(method: str, flight: Simulation, way: str, network: Model | None) -> Trajectory:
    return pipeline.filter_log(flight.log, replace(WAYS[way], method=method), network)


def error(trajectory: Trajectory, flight: Simulation) -> float:
    """m, from ALL_KNOWN_S on."""
    away = np.linalg.norm(trajectory.state[:, :3] - flight.truth.position_m, axis=1)
    return float(np.nanmean(away[trajectory.time_s >= ALL_KNOWN_S]))


@cache
def specified(method: str, angle_rad: float) -> float:
    """m, the mean over the trials of the clean flight without a network, with this noise of the angles specified."""
    settings = replace(UNTUNED, noise=(10**0.5, angle_rad, angle_rad), method=WITHOUT_NETWORK.get(method, method))
    flights = [simulate(SCENARIOS["clean"], seed=seed) for seed in TRIALS]
    return float(np.mean([error(pipeline.filter_log(f.log, settings), f) for f in flights]))


@cache
def errors(
    method: str, scenario: str, way: str = "from the log, two-pass", corrected: bool = True
) -> tuple[float, ...]:
    """m, of each trial."""
    network = model(method, scenario, way) if corrected else None
    name = method if corrected else WITHOUT_NETWORK.get(method, method)
    flights = [simulate(scenario, seed=seed) for seed in TRIALS]
    return tuple(error(filtered(name, flight, way, network), flight) for flight in flights)


def rows() -> Iterator[tuple[str, ...]]:
    """One row per flight, settings and method, beside the paper's mean of Table 1."""
    for flight, scenario in SCENARIOS.items():
        for way in WAYS:
            for method in PAPER:
                if method == "bpnn-ekf" and way == "from the log, two-pass":
                    continue  # it knows no editing: the row above
                own, plain = errors(method, scenario, way), errors(method, scenario, way, corrected=False)
                paper = f"{np.mean(PAPER[method]):.1f}" if flight == "clean" else "-"
                mean, without = f"{np.mean(own):.2f}", f"{np.mean(plain):.2f}"
                yield (flight, way, method.upper(), *(f"{e:.2f}" for e in own), mean, without, paper)


if __name__ == "__main__":
    from tests.bench.__main__ import markdown

    for line in markdown(HEADER, rows()):
        print(line, flush=True)
