"""Where the network helps, and what it costs where it cannot: error in position with it over error without, on flights
it has not seen, with 90 % bootstrap intervals over these."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from ftproc import pipeline
from ftproc.correction.apply import correct
from ftproc.correction.model import Model
from ftproc.correction.training.flights import filtered_flights
from ftproc.correction.training.samples import Flight
from ftproc.correction.training.stages import train_model
from ftproc.records import FloatArray
from ftproc.settings import FilterSettings, TrainSettings
from ftproc.simulation import InstrumentErrors, Simulation, simulate

TRAINING, NEW = 24, 12  # flights
FIRST_SEED = 5000
REFRACTED = InstrumentErrors(elevation_zero_rad=3e-4, refraction=2.8e-4)
THEODOLITE = InstrumentErrors(
    azimuth_zero_rad=3e-4, elevation_zero_rad=-2e-4, mislevel_rad=6e-4, mislevel_azimuth_rad=0.7,
    collimation_rad=4e-4, refraction=2.8e-4,
)  # fmt: skip

SERVO = InstrumentErrors(servo_lag_s=0.02, servo_lag_s2=0.01)
CIRCLES = InstrumentErrors(
    azimuth_eccentricity_rad=4e-4, azimuth_ellipticity_rad=4e-4, elevation_ellipticity_rad=4e-4, circle_zero_rad=-0.4
)
ALL = InstrumentErrors(**{
    **{name: value for each in (SERVO, CIRCLES, THEODOLITE) for name, value in vars(each).items() if value},
    "range_zero_m": -3.0, "range_walk_m": 6.0, "range_walk_at_m": 9000.0,
})  # fmt: skip
FADING = InstrumentErrors(range_walk_m=6.0, range_walk_at_m=9000.0, echo_db=6.0)

HEADER = ("what is wrong", "flights learned from", "features", "filter", "velocity", "smoother")


@dataclass(frozen=True)
class Case:
    """specified: the settings of the filter, given the noise and the jerk density found from the log."""

    name: str
    scenario: str = "manoeuvre-clean"
    instrument: InstrumentErrors | None = None
    outliers: str | None = None
    specified: Callable[[tuple[float, float, float], float], FilterSettings] | None = None
    training: int = TRAINING
    duration_s: float | None = None
    features: str = "auto"


CASES = {
    "matched": Case("nothing"),
    "a": Case(
        "process noise 100 times too small",
        specified=lambda _, jerk: FilterSettings(editing="none", jerk_psd_m2ps5=jerk / 100),
    ),
    "b": Case("elevation bias and refraction", instrument=REFRACTED),
    "c": Case(
        "elevation noise specified 5 times too small",
        specified=lambda noise, _: FilterSettings(editing="none", noise=(noise[0], noise[1], noise[2] / 5)),
    ),
    "d": Case("noise correlated over 0.5 s", outliers="correlation=0.5"),
    "calibration": Case("zero-set, mislevel, collimation, refraction", "calibration", THEODOLITE, training=3),
    "manoeuvre": Case("the same, manoeuvring flights", "manoeuvre", THEODOLITE, training=6),
    "servo": Case("servo lag", instrument=SERVO, features="mount"),
    "circles": Case("circles off their axes", instrument=CIRCLES, features="mount"),
    "all": Case("all of these, and range walk", instrument=ALL, features="mount"),
    "range": Case("walk of ranges whose echoes fade", instrument=FADING, features="mount"),
    "strength": Case("the same, with the strength of the signal", instrument=FADING, features="echo"),
}


def flights(case: Case, seeds: range) -> dict[str, list[Flight]]:
    """Runs with truth, by stage."""
    found: dict[str, list[Flight]] = {"filter": [], "smoother": []}
    for seed in seeds:
        how = {"instrument": case.instrument, "outliers": case.outliers, "duration_s": case.duration_s}
        flight = simulate(case.scenario, seed=seed, **how)  # type: ignore[arg-type]
        known = filtered_flights([(flight.log, flight.truth)], _settings(case, flight))
        for stage in found:
            found[stage] += known[stage]
    return found


def _settings(case: Case, flight: Simulation) -> FilterSettings:
    if case.specified is None:
        return FilterSettings()
    metadata = pipeline.filter_log(flight.log).metadata
    found, jerk = metadata["settings"], metadata["jerk_profile"]["psd_m2ps5"]
    noise = (found["noise_range_m"], found["noise_azimuth_rad"], found["noise_elevation_rad"])
    return case.specified(noise, float(np.exp(np.mean(np.log(jerk)))))


@dataclass(frozen=True)
class Result:
    """model: what was learned. squares: by stage and quantity, the sums of squared errors of each new flight (n, 2),
    with the network and without."""

    model: Model
    squares: dict[str, FloatArray]

    def ratio(self, what: str = "filter position") -> float:
        """Root mean square of the error with the network over that without, over all new flights."""
        total = self.squares[what].sum(0)
        return float(np.sqrt(total[0] / total[1]))

    def interval(self, what: str) -> str:
        """The ratio with its 90 % bootstrap interval over flights."""
        each = self.squares[what]
        drawn = each[np.random.default_rng(0).integers(0, len(each), (2000, len(each)))].sum(1)
        low, high = np.quantile(np.sqrt(drawn[:, 0] / drawn[:, 1]), [0.05, 0.95])
        return f"{self.ratio(what):.3f} ({low:.3f} to {high:.3f})"


def result(case: Case, new: int = NEW, settings: TrainSettings | None = None) -> Result:
    """Learn from the training flights of a case, and hold what was learned against new ones."""
    settings = replace(settings or TrainSettings(), features=case.features)
    model = train_model(flights(case, range(FIRST_SEED, FIRST_SEED + case.training)), settings)
    squares = {}
    for stage, runs in flights(case, range(FIRST_SEED + TRAINING, FIRST_SEED + TRAINING + new)).items():
        for quantity, columns in (("position", slice(0, 3)), ("velocity", slice(3, 6))):
            pairs = []
            for flight in runs:
                error = flight.error[:, :6]
                used = model.stages.get(stage)
                beside = flight.smoothed, flight.signal_db
                left = error if used is None else error - correct(flight.run, used, *beside).values
                known = np.isfinite(error).all(1)
                pairs.append([np.sum(e[known][:, columns] ** 2) for e in (left, error)])
            squares[f"{stage} {quantity}"] = np.array(pairs)
    return Result(model, squares)


def rows() -> Iterator[tuple[str, ...]]:
    """One row per case."""
    for case in CASES.values():
        found = result(case)
        used = (f"{stage.features.name} ({name})" for name, stage in found.model.stages.items() if stage.helps)
        ratios = (found.interval(what) for what in ("filter position", "filter velocity", "smoother position"))
        yield (case.name, str(case.training), ", ".join(used) or "none", *ratios)
