"""What a page shows of a trajectory, in the units it is shown in: made once, drawn by the figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ftproc.core.model.frames import unwrap, wrap
from ftproc.records import Diagnostics, FloatArray, Trajectory, Truth
from ftproc.report.style import COMPONENT
from ftproc.report.thinning import Timeline
from ftproc.scoring import Score, score
from ftproc.scoring.matching import match

STANDARD_GRAVITY = 9.80665  # m/s2
SLOWEST = 1.0  # m/s; a slower target has no direction of flight


@dataclass(frozen=True)
class View:
    """A trajectory and what follows from it, row for row.

    timeline: its times. cleaned: (n, 3) m, deg, deg; the azimuth goes on past 180 deg. reading: the same of the raw
    readings, on the same turn as the cleaned ones; None when they are not known. components_used: (n,) degrees of
    freedom of `nis`. error: (n, 6) estimate minus truth, m and m/s; with `score` None without a truth.
    """

    trajectory: Trajectory
    timeline: Timeline
    cleaned: FloatArray
    reading: FloatArray | None
    components_used: FloatArray
    error: FloatArray | None = None
    score: Score | None = None

    @property
    def diagnostics(self) -> Diagnostics | None:
        return self.trajectory.diagnostics

    @property
    def summary(self) -> Mapping[str, Any]:
        """Empty for a trajectory of other make."""
        found = self.trajectory.metadata.get("summary")
        return found if isinstance(found, Mapping) else {}

    @property
    def gate(self) -> float | None:
        settings = self.trajectory.metadata.get("settings")
        found = settings.get("gate") if isinstance(settings, Mapping) else None
        return float(found) if isinstance(found, int | float) else None

    @property
    def has_position(self) -> bool:
        return bool(np.isfinite(self.trajectory.state[:, :3]).all(1).any())


def view(trajectory: Trajectory, truth: Truth | None = None) -> View:
    """Prepare a trajectory, and its errors against a truth, for the figures."""
    factor = np.array([quantity.factor for quantity in COMPONENT])
    cleaned = trajectory.measurement.copy()
    cleaned[:, 1] = unwrap(cleaned[:, 1])
    reading = None
    if trajectory.diagnostics is not None:
        reading = trajectory.diagnostics.reading.copy()
        turned = cleaned[:, 1] + wrap(reading[:, 1] - cleaned[:, 1])
        reading[:, 1] = np.where(np.isfinite(turned), turned, reading[:, 1])
        reading *= factor
    error = None
    if truth is not None:
        known = match(trajectory.time_s, truth)
        error = np.full((len(trajectory), 6), np.nan)
        error[:, :3] = trajectory.state[:, :3] - known.position_m
        if known.velocity_mps is not None:
            error[:, 3:] = trajectory.state[:, 3:6] - known.velocity_mps
    return View(
        trajectory, Timeline.of(trajectory.time_s), cleaned * factor, reading,
        (trajectory.outlier == 0).sum(1).astype(float), error, None if truth is None else score(trajectory, truth),
    )  # fmt: skip


def speed(state: FloatArray) -> FloatArray:
    """(n,) m/s of (n, 9) states."""
    found: FloatArray = np.sqrt((state[:, 3:6] ** 2).sum(1))
    return found


def load_factor(state: FloatArray) -> FloatArray:
    """(n,) g: the specific force across the direction of flight, which is what wings must carry; all of it when the
    target hardly moves. z is taken as the vertical."""
    felt = state[:, 6:9] + [0.0, 0.0, STANDARD_GRAVITY]
    v = speed(state)
    along = state[:, 3:6] / np.maximum(v, SLOWEST)[:, None]
    across = felt - np.where(v > SLOWEST, (felt * along).sum(1), 0.0)[:, None] * along
    found: FloatArray = np.sqrt((across**2).sum(1)) / STANDARD_GRAVITY
    return found
