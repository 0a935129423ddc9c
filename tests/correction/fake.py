"""A small maker of filter runs with a known error: what a correction can learn is decided by the test."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ftproc.core.filtering.records import FilterRun, empty_rows
from ftproc.core.model.frames import line_of_sight_axes
from ftproc.correction.training.samples import Flight
from ftproc.records import FloatArray

SIGMA = np.array([2.0, 1.0, 1.5, 0.8, 0.5, 0.6])  # m, m/s along the line of sight


def run(rng: np.random.Generator, n: int = 600, dt: float = 0.1) -> FilterRun:
    """A straight flight a few kilometres away, with white innovations; nothing missing."""
    time = dt * np.arange(n, dtype=np.float64)
    velocity = rng.uniform(-80, 80, 3) * (1, 1, 0.05)
    position = np.array([3000.0, 2000.0, 1500.0]) + rng.uniform(-300, 300, 3) + time[:, None] * velocity
    state = np.concatenate([position, np.tile(velocity, (n, 1)), np.zeros((n, 3))], axis=1)
    sigma = np.tile([5.0, 4e-4, 4e-4], (n, 1))
    return FilterRun.of(time, empty_rows(n), 0.0)._replace(
        state=state,
        predicted=state - rng.normal(size=(n, 9)) * ([1.0] * 3 + [0.3] * 3 + [0.1] * 3),
        innovation=rng.normal(size=(n, 3)) * sigma,
        innovation_sigma=sigma,
        weight=np.ones((n, 3)),
        los_sigma=np.tile(SIGMA, (n, 1)),
        sigma=np.tile([1.5] * 3 + [0.6] * 3 + [0.3] * 3, (n, 1)),
        path_sigma=np.full((n, 6), np.nan),
        since_start=np.arange(n),
    )


def with_error(filtered: FilterRun, in_sigmas: FloatArray) -> Flight:
    """The flight whose truth is off the estimate by `in_sigmas` (n, 6) along the line of sight."""
    axes = line_of_sight_axes(filtered.state[:, :3])
    metres = (in_sigmas * filtered.los_sigma).reshape(-1, 2, 3)
    error = np.einsum("nij,npi->npj", axes, metres)
    return Flight(filtered, filtered.state[:, :3] + error[:, 0], filtered.state[:, 3:6] + error[:, 1])


def flights(seed: int, count: int, bias: Sequence[float] = (0.0,) * 6, lag: float = 0.0, n: int = 600) -> list[Flight]:
    """Flights whose error is white noise of one sigma, plus `bias` (in sigmas), plus `lag` times the
    normalised radial innovation of the sample before in the radial position."""
    made = []
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        filtered = run(rng, n)
        error = rng.normal(size=(n, 6)) + np.asarray(bias)
        error[1:, 0] += lag * (filtered.innovation / filtered.innovation_sigma)[:-1, 0]
        made.append(with_error(filtered, error))
    return made


def without(filtered: FilterRun, rows: slice, components: Sequence[int] = (0, 1, 2)) -> FilterRun:
    """The run with these components rejected in `rows`."""
    weight, innovation = filtered.weight.copy(), filtered.innovation.copy()
    for component in components:
        weight[rows, component] = 0.0
        innovation[rows, component] = np.nan
    return filtered._replace(weight=weight, innovation=innovation)
