"""What the tests of simulated flights and of scores share."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.records import FloatArray, Trajectory, Truth
from ftproc.simulation import Simulation, simulate

G = 9.80665


def load_factor(flight: Simulation) -> FloatArray:
    """(n,) g felt across the flight path."""
    v, a = flight.truth.velocity_mps, flight.truth.acceleration_mps2
    assert v is not None
    assert a is not None
    felt = a + np.array([0.0, 0.0, G])
    along = v / np.linalg.norm(v, axis=1, keepdims=True)
    across = felt - np.sum(felt * along, axis=1, keepdims=True) * along
    return np.asarray(np.linalg.norm(across, axis=1) / G)


def codes(flight: Simulation) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    assert flight.truth.outlier is not None
    return flight.truth.outlier


def deviation(flight: Simulation) -> FloatArray:
    """(n, 3) contaminated minus clean reading, azimuth wrapped."""
    d = flight.log.measurement - flight.clean
    d[:, 1] = wrap(d[:, 1])
    return d


def runs(flag: Iterable[float]) -> list[slice]:
    """Runs of non-zero flags, by walking along."""
    found, start = [], None
    for i, value in enumerate([*flag, 0]):
        if value and start is None:
            start = i
        if not value and start is not None:
            found.append(slice(start, i))
            start = None
    return found


def trajectory_for(truth: Truth, seed: int = 0, error_m: float = 4.0, **changes: Any) -> Trajectory:
    """An estimate of a truth with random errors, flags and a few rows without estimate."""
    rng = np.random.default_rng(seed)
    n = len(truth)
    state = np.zeros((n, 9))
    state[:, :3] = truth.position_m + error_m * rng.standard_normal((n, 3))
    if truth.velocity_mps is not None:
        state[:, 3:6] = truth.velocity_mps + rng.standard_normal((n, 3))
    state[rng.random(n) < 0.05] = np.nan
    made = Trajectory(
        name="flight.trajectory.parquet",
        row=np.arange(n),
        time_s=truth.time_s,
        measurement=from_cartesian(state[:, :3]),
        state=state,
        sigma=rng.uniform(2.0, 6.0, (n, 9)),
        measurement_sigma=np.tile([4.0, 1e-3, 1e-3], (n, 1)),
        outlier=rng.integers(0, 4, (n, 3)).astype(np.uint8),
        nis=np.ones(n),
        correction=np.zeros((n, 6)),
        metadata={"method": "ukf"},
    )
    return replace(made, **changes)


def flown(seed: int = 0, **options: Any) -> Truth:
    return simulate("calibration", seed=seed, duration_s=100.0, dt_s=0.5, **options).truth
