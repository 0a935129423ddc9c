"""What a page shows of a trajectory, in its units: computed once for all figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ftproc.core.model.frames import from_cartesian, to_cartesian, unwrap, wrap
from ftproc.files.moments import Moments
from ftproc.quality.verdict import LEVELS, level_of
from ftproc.records import ACCEPTED, GOOD, ISOLATED, PATCH, REJECTED, Diagnostics, FloatArray, Trajectory, Truth
from ftproc.report.style import COMPONENT
from ftproc.report.thinning import Timeline
from ftproc.scoring import Score, score
from ftproc.scoring.matching import match

OUTLIERS = (ISOLATED, PATCH, REJECTED)


@dataclass(frozen=True)
class View:
    """A trajectory with derived arrays, row for row.

    timeline: its times. cleaned: (n, 3) m, deg, deg, the azimuth unwrapped. reading: the raw readings in these
    units, on the same turn; None when they are not known. components_used: (n,) degrees of freedom of `nis`. error:
    (n, 9) estimate minus truth of the state, in its units. cleaned_error: (n, 3) the same of the cleaned readings, m,
    rad, rad. These and the score are None without a truth.
    """

    trajectory: Trajectory
    timeline: Timeline
    cleaned: FloatArray
    reading: FloatArray | None
    components_used: FloatArray
    error: FloatArray | None = None
    cleaned_error: FloatArray | None = None
    score: Score | None = None

    @cached_property
    def moments(self) -> Moments:
        """How its times are said."""
        return Moments.of(self.trajectory.metadata, self.trajectory.time_s)

    @cached_property
    def raw_position(self) -> tuple[FloatArray | None, NDArray[np.bool_]]:
        """(n, 3) m that each row's readings show, NaN where one is missing, and (n,) whether one of them is an outlier;
        None when the raw readings are not known."""
        bad: NDArray[np.bool_] = np.asarray(np.isin(self.trajectory.outlier, OUTLIERS).any(1))
        if self.trajectory.diagnostics is None:
            return None, bad
        return to_cartesian(self.trajectory.diagnostics.reading), bad

    def part(self, rows: slice) -> View:
        """Some of its rows, for the figure of the readings."""
        whole = self.trajectory
        trajectory = replace(
            whole, row=whole.row[rows], time_s=whole.time_s[rows], measurement=whole.measurement[rows],
            state=whole.state[rows], sigma=whole.sigma[rows], measurement_sigma=whole.measurement_sigma[rows],
            outlier=whole.outlier[rows], nis=whole.nis[rows], correction=whole.correction[rows], extra=None,
            diagnostics=None,
        )  # fmt: skip
        reading = None if self.reading is None else self.reading[rows]
        timeline = Timeline.of(trajectory.time_s)
        return View(trajectory, timeline, self.cleaned[rows], reading, self.components_used[rows])

    @property
    def diagnostics(self) -> Diagnostics | None:
        return self.trajectory.diagnostics

    @property
    def summary(self) -> Mapping[str, Any]:
        """Empty for a trajectory of another program or version."""
        return summary_of(self.trajectory)

    @property
    def gate(self) -> float | None:
        settings = self.trajectory.metadata.get("settings")
        found = settings.get("gate") if isinstance(settings, Mapping) else None
        return float(found) if isinstance(found, int | float) else None

    @property
    def has_position(self) -> bool:
        return bool(np.isfinite(self.trajectory.state[:, :3]).all(1).any())


def summary_of(trajectory: Trajectory) -> Mapping[str, Any]:
    """The summary in its metadata; empty for a trajectory of another program or version."""
    found = trajectory.metadata.get("summary")
    trust = found.get("trust") if isinstance(found, Mapping) else None
    if not isinstance(found, Mapping) or not isinstance(trust, Mapping) or level_of(trust) not in LEVELS:
        return {}
    return found


def view(trajectory: Trajectory, truth: Truth | None = None) -> View:
    """The view of a trajectory, with its errors against a truth."""
    factor = np.array([quantity.factor for quantity in COMPONENT])
    cleaned = trajectory.measurement.copy()
    cleaned[:, 1] = unwrap(cleaned[:, 1])
    reading = None
    if trajectory.diagnostics is not None:
        reading = trajectory.diagnostics.reading.copy()
        turned = cleaned[:, 1] + wrap(reading[:, 1] - cleaned[:, 1])
        reading[:, 1] = np.where(np.isfinite(turned), turned, reading[:, 1])
        reading *= factor
    error = cleaned_error = scored = None
    if truth is not None:
        known = match(trajectory.time_s, truth)
        error = np.full((len(trajectory), 9), np.nan)
        for k, true in enumerate((known.position_m, known.velocity_mps, known.acceleration_mps2)):
            if true is not None:
                error[:, 3 * k : 3 * k + 3] = trajectory.state[:, 3 * k : 3 * k + 3] - true
        cleaned_error = trajectory.measurement - from_cartesian(known.position_m)
        cleaned_error[:, 1] = wrap(cleaned_error[:, 1])
        scored = score(trajectory, truth) if np.isfinite(known.position_m).any() else None
    return View(
        trajectory, Timeline.of(trajectory.time_s), cleaned * factor, reading,
        np.isin(trajectory.outlier, (GOOD, ACCEPTED)).sum(1).astype(float), error, cleaned_error, scored,
    )  # fmt: skip


def speed(state: FloatArray) -> FloatArray:
    """(n,) m/s of (n, 9) states."""
    found: FloatArray = np.sqrt((state[:, 3:6] ** 2).sum(1))
    return found
