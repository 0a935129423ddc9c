"""What real instruments do to their readings beside white noise: flights of two scenarios without outliers, measured
with each effect. Median position errors of the raw readings and of the smoother; how much of the truth lies inside 3
sigma; how many good readings are called outliers; and the verdicts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np

from ftproc import pipeline
from ftproc.core.model.frames import to_cartesian
from ftproc.settings import FilterSettings
from ftproc.simulation import Simulation, parse_instrument, simulate

SCENARIOS = {"manoeuvre-clean": 60.0, "radar": 300.0}  # seconds
SEEDS = range(200, 204)
EFFECTS = {
    "none": ("none", "none"),
    "rounded to 3 sigma": (
        "range_rounding_m=10,azimuth_rounding_mrad=0.6,elevation_rounding_mrad=0.6",
        "range_rounding_m=100,azimuth_rounding_mrad=3,elevation_rounding_mrad=3",
    ),
    "late time stamps": ("stamp_jitter_s=0.05", "stamp_jitter_s=0.5"),
    "noise correlated over 10 samples": (
        "range_wander_m=4,azimuth_wander_mrad=0.3,elevation_wander_mrad=0.3,wander_s=0.5",
        "range_wander_m=40,azimuth_wander_mrad=1.5,elevation_wander_mrad=1.5,wander_s=10",
    ),
    "angles held for 4 samples": ("azimuth_held=4,elevation_held=4", "azimuth_held=4,elevation_held=4"),
}
HEADER = ("scenario", "effect", "raw, m", "smoothed, m", "inside 3 sigma", "called outliers", "verdicts")


def rows() -> Iterator[tuple[str, ...]]:
    """One row for each scenario and effect."""
    for which, (scenario, duration_s) in enumerate(SCENARIOS.items()):
        for effect, specs in EFFECTS.items():
            instrument = parse_instrument(specs[which])
            flights = [
                simulate(scenario, seed=seed, duration_s=duration_s, outliers="none", instrument=instrument)
                for seed in SEEDS
            ]
            found = [_one(flight) for flight in flights]
            raw, smoothed, inside, flagged = np.median([each[:4] for each in found], axis=0)
            verdicts = Counter(each[4] for each in found)
            yield (
                scenario, effect, f"{raw:.3g}", f"{smoothed:.3g}", f"{100 * inside:.1f} %", f"{100 * flagged:.2f} %",
                ", ".join(f"{count} {verdict}" for verdict, count in sorted(verdicts.items())),
            )  # fmt: skip


def _one(flight: Simulation) -> tuple[float, float, float, float, str]:
    """Median errors of readings and smoother, m, share inside 3 sigma, share called outliers, and the verdict."""
    trajectory = pipeline.filter_log(flight.log, FilterSettings(smooth=True))
    away = trajectory.state[:, :3] - flight.truth.position_m
    raw = to_cartesian(flight.log.measurement) - flight.truth.position_m
    return (
        float(np.nanmedian(np.linalg.norm(raw, axis=1))),
        float(np.median(np.linalg.norm(away, axis=1))),
        float(np.mean(np.abs(away) <= 3 * trajectory.sigma[:, :3])),
        float(np.isin(trajectory.outlier, (1, 2)).mean()),
        trajectory.metadata["summary"]["trust"]["verdict"],
    )
