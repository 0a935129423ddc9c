"""Errors by name, as ranges write them: along track, across, vertical, horizontal; of position, velocity, acceleration
and the cleaned readings. What `score` prints and what limits are set on is found here."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ftproc.core.model.frames import from_cartesian, wrap
from ftproc.records import COMPONENTS, FloatArray, Trajectory
from ftproc.scoring.matching import MatchedTruth

STATE_UNITS = {"position": "m", "velocity": "mps", "acceleration": "mps2"}
READING_UNITS = ("m", "rad", "rad")
SIDES = ("along", "across", "vertical")
LEAST_SPEED = 1e-3  # m/s of the truth, below which it has no direction


@dataclass(frozen=True)
class Spread:
    """Of the errors of one name: bias is their mean, sigma the standard deviation about it, rms the root mean square;
    p95 and largest are of their size. Units as the name says."""

    bias: float
    sigma: float
    rms: float
    p95: float
    largest: float

    @classmethod
    def of(cls, error: FloatArray) -> Spread | None:
        """Of the finite ones of (n,); None without any."""
        known = error[np.isfinite(error)]
        if not len(known):
            return None
        size = np.abs(known)
        figures = (known.mean(), known.std(), np.sqrt((known**2).mean()), np.percentile(size, 95), size.max())
        return cls(*(float(figure) for figure in figures))


def errors(trajectory: Trajectory, truth: MatchedTruth) -> dict[str, FloatArray]:
    """(n,) errors, estimate minus truth, by name; NaN where either is not known.

    Of each quantity of the state that the truth has, its size (`position`), its axes (`position x`), and `along`,
    `across` (to the right), `vertical` and `horizontal`, in m, m/s, m/s2; of the cleaned readings `range` in m,
    `azimuth` and `elevation` in rad. Along is the truth's horizontal direction of flight; vertical is z.
    """
    found: dict[str, FloatArray] = {}
    ahead, right = _directions(trajectory, truth)
    kinds = (truth.position_m, truth.velocity_mps, truth.acceleration_mps2)
    for k, (quantity, true) in enumerate(zip(STATE_UNITS, kinds, strict=True)):
        if true is None:
            continue
        error = trajectory.state[:, 3 * k : 3 * k + 3] - true
        error[~np.isfinite(error).all(1)] = np.nan
        found[quantity] = np.sqrt((error**2).sum(1))
        found |= {f"{quantity} {axis}": column for axis, column in zip("xyz", error.T, strict=True)}
        sides = ((error[:, :2] * ahead).sum(1), (error[:, :2] * right).sum(1), error[:, 2])
        found |= {f"{quantity} {side}": part for side, part in zip(SIDES, sides, strict=True)}
        found[f"{quantity} horizontal"] = np.hypot(error[:, 0], error[:, 1])
    return found | _of_readings(trajectory, truth)


def vector(errors: Mapping[str, FloatArray], quantity: str) -> FloatArray:
    """(n, 3) the errors of a quantity along x, y and z."""
    return np.column_stack([errors[f"{quantity} {axis}"] for axis in "xyz"])


def of_readings(errors: Mapping[str, FloatArray], trajectory: Trajectory) -> tuple[list[str], FloatArray]:
    """The components with errors of the cleaned readings, and these errors (n, components) in their sigmas."""
    seen = [c for c, name in enumerate(COMPONENTS) if name in errors]
    error = np.stack([errors[COMPONENTS[c]] for c in seen], 1) if seen else np.empty((len(trajectory), 0))
    return [COMPONENTS[c] for c in seen], in_sigmas(error, trajectory.measurement_sigma[:, seen])


def in_sigmas(error: FloatArray, sigma: FloatArray) -> FloatArray:
    """Errors over published sigmas; NaN where there is no sigma."""
    published = np.isfinite(sigma) & (sigma > 0)
    ratio: FloatArray = np.divide(error, sigma, out=np.full(error.shape, np.nan), where=published)
    return ratio


def unit(name: str) -> str:
    """Of the errors of a name, as it stands at the end of keys."""
    if name in COMPONENTS:
        return READING_UNITS[COMPONENTS.index(name)]
    return STATE_UNITS[name.split()[0]]


def names() -> list[str]:
    """All names that there may be."""
    parts = ("", " x", " y", " z", *(f" {side}" for side in SIDES), " horizontal")
    return [f"{quantity}{part}" for quantity in STATE_UNITS for part in parts] + list(COMPONENTS)


def _of_readings(trajectory: Trajectory, truth: MatchedTruth) -> dict[str, FloatArray]:
    error = trajectory.measurement - from_cartesian(truth.position_m)
    error[:, 1] = wrap(error[:, 1])
    return {name: column for name, column in zip(COMPONENTS, error.T, strict=True) if np.isfinite(column).any()}


def _directions(trajectory: Trajectory, truth: MatchedTruth) -> tuple[FloatArray, FloatArray]:
    """(n, 2) horizontal unit vectors ahead and to the right; NaN where the truth stands still."""
    velocity = truth.velocity_mps
    if velocity is None:
        velocity = _rates(trajectory.time_s, truth.position_m)
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    with np.errstate(invalid="ignore", divide="ignore"):
        ahead = velocity[:, :2] / np.where(speed > LEAST_SPEED, speed, np.nan)[:, None]
    # With x north and y east, seen from above, the right of north is east; with x east and y north it is -y of x.
    sign = 1.0 if trajectory.metadata.get("frame") == "north-east-up" else -1.0
    return ahead, np.column_stack([-sign * ahead[:, 1], sign * ahead[:, 0]])


def _rates(time_s: FloatArray, position: FloatArray) -> FloatArray:
    """(n, 3) rates of positions by differences of distinct times; NaN where there are too few."""
    found = np.full(position.shape, np.nan)
    known = np.flatnonzero(np.isfinite(position).all(1))
    known = known[np.r_[True, np.diff(time_s[known]) > 0]] if len(known) else known
    if len(known) > 1:
        found[known] = np.gradient(position[known], time_s[known], axis=0)
    return found
