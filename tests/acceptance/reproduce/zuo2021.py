"""Zuo et al. 2021: GA-BPNN-UKF against BPNN-EKF on a simulated flight, and against its rival on a theodolite's log."""

from __future__ import annotations

from functools import cache

import numpy as np

from ftproc import pipeline, scoring
from ftproc.core.model.frames import from_cartesian, unwrap
from ftproc.correction.model import Model
from ftproc.correction.training.flights import train_flights
from ftproc.records import COMPONENTS, Trajectory
from ftproc.scoring.figures import average_gradient
from ftproc.settings import FilterSettings, TrainSettings
from ftproc.simulation import Simulation, simulate
from tests.acceptance.reproduce.page import Page, table

ORDER = 1

TRIALS = (1, 2, 3, 4)  # seeds of the flights that are shown
PAPER = {"bpnn-ekf": (31.5347, 12.1745, 18.8466, 9.7875), "ga-bpnn-ukf": (9.0323, 9.6778, 11.9063, 6.5939)}
PAPER_GRADIENT = {"algorithm 1": (4.0753, 0.524, 0.0019), "algorithm 2": (1.0552, 0.521, 0.0013)}
TRAINING = {"zuo2021": 12, "zuo2021-outliers": 12, "manoeuvre": 6}  # flights
THEODOLITE = {"scenario": "manoeuvre", "seed": 7, "duration_s": 75.0}

_TEXT = """## Zuo et al. 2021: GA-BPNN-UKF

The networks are trained as in the paper's section 2.2 (input: update minus prediction; target: truth minus estimate) on
other flights of the same kind, {flights} of them: BPNN-EKF by back-propagation from random first weights, GA-BPNN-UKF
after a genetic search for them. Held-out flights decide how much of a network's answer is applied, output by output.
All filters get noise and jerk level from the log, which the paper does not say how to choose; so the plain filters are
already better here than the paper's best.

### Section 3.1, table 1 and figures 4 and 5: constant acceleration, 60 s at 1 Hz, range variance 10 m²

Mean length of the position error (the paper's "RMSE", eqs 20 and 21) in metres; a theodolite's angle noise of 0.2 mrad,
which the paper does not give.
"""


@cache
def model(method: str, scenario: str) -> Model:
    """Trained on flights whose seeds none of the experiments uses."""
    options = {"duration_s": THEODOLITE["duration_s"]} if scenario == THEODOLITE["scenario"] else {}
    flights = [simulate(scenario, seed=5000 + i, **options) for i in range(TRAINING[scenario])]
    settings = TrainSettings(features="correction", method=method, population=20, generations=30, epochs=200, seed=2021)
    return train_flights([(f.log, f.truth) for f in flights], settings)


def run(method: str, flight: Simulation, scenario: str, smooth: bool = False) -> Trajectory:
    """The method on a flight, with a network of its own kind where it has one."""
    trained = "bpnn-ekf" if method == "bpnn-ekf" else "ga-bpnn-ukf"
    network = model(trained, scenario) if "bpnn" in method and not smooth else None
    return pipeline.filter_log(flight.log, FilterSettings(method=method, smooth=smooth), network)


def mean_error(trajectory: Trajectory, flight: Simulation) -> float:
    error = scoring.score(trajectory, flight.truth).rmse_seed_m
    assert error is not None
    return error


def applied(scenario: str) -> str:
    """What the held-out flights say of the two networks."""
    gains = {method: model(method, scenario).filter.gain for method in ("bpnn-ekf", "ga-bpnn-ukf")}
    said = [f"{method}: {', '.join(f'{g:.2f}' for g in gain)}" for method, gain in gains.items()]
    return (
        f"Share of the network's answer that held-out flights let through (x, y, z, vx, vy, vz): {'; '.join(said)}.\n"
    )


METHODS = ("ekf", "bpnn-ekf", "ukf", "ga-bpnn-ukf-plain", "ga-bpnn-ukf")


def _trials(scenario: str) -> str:
    """Mean errors of the methods, trial by trial, the paper's beside them on the clean flight."""
    flights = [simulate(scenario, seed=seed) for seed in TRIALS]
    rows: list[list[object]] = []
    if scenario == "zuo2021":
        rows += [[f"{name}, the paper", *figures] for name, figures in PAPER.items()]
    rows += [[f"{name}, here", *(mean_error(run(name, f, scenario), f) for f in flights)] for name in METHODS]
    smoothed = [mean_error(run("ga-bpnn-ukf", f, scenario, smooth=True), f) for f in flights]
    rows.append(["ga-bpnn-ukf --smooth, here", *smoothed])
    return table(("", *(f"trial {i}" for i in TRIALS)), rows)


def _ranges(page: Page, scenario: str, methods: tuple[str, ...], figures: tuple[int, int]) -> str:
    flight = simulate(scenario, seed=TRIALS[0])
    time, truth = flight.log.time_s, np.linalg.norm(flight.truth.position_m, axis=1)
    found = {name: run(name, flight, scenario).measurement[:, 0] for name in methods}

    def estimates(axis):
        axis.plot(time, flight.log.measurement[:, 0], ".", color="0.6", label="readings")
        axis.plot(time, truth, "k-", lw=0.8, label="truth")
        for name, values in found.items():
            axis.plot(time, values, "-", lw=1, label=name)
        axis.set(xlabel="time (s)", ylabel="range (m)")

    def deviations(axis):
        for name, values in found.items():
            axis.plot(time, values - truth, "-", lw=1, label=name)
        axis.set(xlabel="time (s)", ylabel="range error (m)")

    return page.plot(f"zuo2021_{figures[0]}", f"Figure {figures[0]}: range", estimates) + page.plot(
        f"zuo2021_{figures[1]}", f"Figure {figures[1]}: error of the range", deviations
    )


def _theodolite(page: Page) -> str:
    flight = simulate(**THEODOLITE)
    scenario = str(THEODOLITE["scenario"])
    names = ("wavelet-akf", "bpnn-ekf", "ga-bpnn-ukf")
    found = {name: run(name, flight, scenario) for name in names}
    gradients = {name: average_gradient(t.measurement) for name, t in found.items()}
    gradients["the truth"] = average_gradient(from_cartesian(flight.truth.position_m))
    gradients["the readings"] = average_gradient(flight.log.measurement)
    rows: list[list[object]] = [[f"{name}, the paper's log", *f, "-"] for name, f in PAPER_GRADIENT.items()]
    for name, g in gradients.items():
        error = mean_error(found[name], flight) if name in found else "-"
        rows.append([f"{name}, here", g.range_m, g.azimuth_rad, g.elevation_rad, error])

    def draw(axes):
        for c, (axis, unit) in enumerate(zip(axes, ("m", "rad", "rad"), strict=True)):
            straight = unwrap if c == 1 else np.asarray
            read = straight(flight.log.measurement[:, c])
            axis.plot(flight.log.time_s, read, ".", ms=2, color="0.7", label="readings")
            for name in names:
                axis.plot(flight.log.time_s, straight(found[name].measurement[:, c]), "-", lw=1, label=name)
            axis.set_ylabel(f"{COMPONENTS[c]} ({unit})")
        axes[-1].set_xlabel("time (s)")

    return table(("", "F of R (m)", "F of A (rad)", "F of E (rad)", "mean position error (m)"), rows) + page.plot(
        "zuo2021_8_to_11", "Figures 8 to 11: a theodolite's readings, and what the methods make of them", draw, panels=3
    )


def section(page: Page) -> str:
    return "\n".join(
        [
            _TEXT.format(flights=TRAINING["zuo2021"]),
            _trials("zuo2021"),
            applied("zuo2021"),
            _ranges(page, "zuo2021", ("bpnn-ekf", "ga-bpnn-ukf"), (4, 5)),
            "### Section 3.2, figures 6 and 7: the same flight with outliers in range\n",
            _trials("zuo2021-outliers"),
            applied("zuo2021-outliers"),
            _ranges(page, "zuo2021-outliers", ("ukf", "bpnn-ekf", "ga-bpnn-ukf"), (6, 7)),
            "### Section 3.3, table 2 and figures 8 to 11: a theodolite's log\n\nThe paper's log is its own; here a "
            "fighter is tracked at 20 Hz, with outliers and patches in every component. F is the average gradient (eq. "
            "18), which measures motion as well as noise, so it should be that of the truth, not small. The paper's "
            "algorithm 1 is its ref. 12 (adaptive Kalman filter and wavelets), algorithm 2 the GA-BPNN anti-outlier "
            "UKF.\n",
            _theodolite(page),
            applied("manoeuvre"),
        ]
    )
