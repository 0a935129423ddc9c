"""What a page shows of a trajectory, in its units: computed once for all figures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.model.frames import from_cartesian, to_cartesian, unwrap, wrap
from ftproc.files.moments import Moments
from ftproc.quality.verdict import LEVELS, level_of
from ftproc.records import (
    ACCEPTED,
    BESIDE,
    COMPONENTS,
    GOOD,
    ISOLATED,
    MISSING,
    PATCH,
    REJECTED,
    Diagnostics,
    FlagArray,
    FloatArray,
    Trajectory,
    Truth,
)
from ftproc.report.style import QUANTITY, SIZE, Quantity
from ftproc.report.thinning import Timeline
from ftproc.scoring import Score, score
from ftproc.scoring.matching import match

OUTLIERS = (ISOLATED, PATCH, REJECTED)


class Channel(NamedTuple):
    """What is drawn of one thing that is measured: (n,) cleaned and raw (None: not known) in the unit of its quantity,
    labels, and residuals in their sigmas (None: not known). size: the unit of differences, and their factor from that
    of the quantity."""

    name: str
    quantity: Quantity
    size: Quantity
    cleaned: FloatArray
    reading: FloatArray | None
    flags: FlagArray
    scaled: FloatArray | None

    @property
    def drawn(self) -> FloatArray:
        """(n,) raw readings, or the estimate where these are not known."""
        return self.cleaned if self.reading is None else self.reading

    def rows(self, rows: slice) -> Channel:
        """Of some rows."""
        reading, scaled = (None if each is None else each[rows] for each in (self.reading, self.scaled))
        return self._replace(cleaned=self.cleaned[rows], reading=reading, flags=self.flags[rows], scaled=scaled)


@dataclass(frozen=True)
class View:
    """A trajectory with derived arrays, row for row.

    timeline: its times. channels: what is measured, the azimuth unwrapped. components_used: (n,) degrees of freedom of
    `nis`. error:
    (n, 9) estimate minus truth of the state, in its units. cleaned_error: (n, 3) the same of the cleaned readings, m,
    rad, rad. These and the score are None without a truth.
    """

    trajectory: Trajectory
    timeline: Timeline
    channels: tuple[Channel, ...]
    components_used: FloatArray
    error: FloatArray | None = None
    cleaned_error: FloatArray | None = None
    score: Score | None = None

    @cached_property
    def moments(self) -> Moments:
        """How its times are written."""
        return Moments.of(self.trajectory.metadata, self.trajectory.time_s)

    @cached_property
    def raw_position(self) -> tuple[FloatArray | None, NDArray[np.bool_]]:
        """(n, 3) m that each row's readings show, NaN where one is missing, and (n,) whether one of them is an outlier;
        None when the raw readings are not known."""
        bad: NDArray[np.bool_] = np.asarray(np.isin(self.trajectory.outlier, OUTLIERS).any(1))
        if self.trajectory.diagnostics is None:
            return None, bad
        return to_cartesian(self.trajectory.diagnostics.reading), bad

    @property
    def has_readings(self) -> bool:
        """Whether the raw readings are known."""
        return self.trajectory.diagnostics is not None

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


def apart(trajectory: Trajectory) -> tuple[str, ...]:
    """Channels that stand for no range, azimuth or elevation: NIS is without them, and their residuals are
    innovations."""
    return BESIDE if (trajectory.outlier[:, 2] != MISSING).any() else BESIDE[:1]


def view(trajectory: Trajectory, truth: Truth | None = None) -> View:
    """The view of a trajectory, with its errors against a truth."""
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
    channels = tuple(_channels(trajectory))
    scalars = apart(trajectory)
    used = [np.isin(channel.flags, (GOOD, ACCEPTED)) for channel in channels if channel.name not in scalars]
    return View(
        trajectory, Timeline.of(trajectory.time_s), channels, np.sum(used, 0, float), error, cleaned_error, scored
    )


def _channels(trajectory: Trajectory) -> Iterator[Channel]:
    known = trajectory.diagnostics
    for c, name in enumerate(COMPONENTS):
        cleaned = trajectory.measurement[:, c]
        reading = None if known is None else known.reading[:, c]
        if name == "azimuth":
            cleaned = unwrap(cleaned)
            reading = None if reading is None else _on_the_turn(reading, cleaned)
        scaled = None if known is None else _scaled(known.residual[:, c], known.residual_sigma[:, c])
        quantity, factor = QUANTITY[name], QUANTITY[name].factor
        reading = None if reading is None else factor * reading
        yield Channel(name, quantity, SIZE[name], factor * cleaned, reading, trajectory.outlier[:, c], scaled)
    for name, each in ({} if known is None else known.beside).items():
        scaled = _scaled(each.residual, each.residual_sigma)
        yield Channel(name, QUANTITY[name], SIZE[name], each.cleaned, each.reading, each.label, scaled)


def _on_the_turn(reading: FloatArray, cleaned: FloatArray) -> FloatArray:
    """Angles (n,) on the turn of others."""
    turned = cleaned + wrap(reading - cleaned)
    return np.where(np.isfinite(turned), turned, reading)


def _scaled(residual: FloatArray, sigma: FloatArray) -> FloatArray:
    with np.errstate(invalid="ignore", divide="ignore"):
        return residual / sigma


def speed(state: FloatArray) -> FloatArray:
    """(n,) m/s of (n, 9) states."""
    found: FloatArray = np.sqrt((state[:, 3:6] ** 2).sum(1))
    return found
