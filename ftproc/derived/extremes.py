"""The extremes of a flight with their times: the table that a test report begins with."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ftproc.derived.quantities import QUANTITIES, Derived
from ftproc.records import FloatArray, Trajectory


class Extreme(NamedTuple):
    """what: such as `greatest load factor`. value, sigma: in `unit`; the sigma is NaN where it is not known. row: of
    the trajectory."""

    what: str
    value: float
    sigma: float
    unit: str
    time_s: float
    row: int


def extremes(trajectory: Trajectory) -> list[Extreme]:
    """The greatest and least speed, height, climb rate, turn rate, load factor and distance of a flight.

    The row is the one that is farthest out by its value less 1 sigma, so that one with a far larger sigma than the
    others, at a start or in a gap, is none. The sigma is that of the row: of many noisy rows the farthest lies a
    little farther out than the flight has been.
    """
    derived, state, sigma = Derived.of(trajectory), trajectory.state, trajectory.sigma
    length, length_sigma = _norm(state[:, :3], sigma[:, :3])
    speed, speed_sigma = _norm(state[:, 3:6], sigma[:, 3:6])
    of = {q.name: (derived.value[:, k], derived.sigma[:, k], q.unit) for k, q in enumerate(QUANTITIES)}
    distance = trajectory.measurement[:, 0], trajectory.measurement_sigma[:, 0], "m"
    if not np.isfinite(distance[0]).any():
        distance = length, length_sigma, "m"
    over, height = _height(trajectory)
    wanted = (
        ("greatest speed", (speed, speed_sigma, "m/s"), 1),
        ("least speed", (speed, speed_sigma, "m/s"), -1),
        (f"highest {over}", height, 1),
        (f"lowest {over}", height, -1),
        ("steepest climb", of["climb_rate_mps"], 1),
        ("steepest descent", of["climb_rate_mps"], -1),
        ("greatest load factor", of["load_factor"], 1),
        ("least load factor", of["load_factor"], -1),
        ("fastest turn", of["turn_rate_degps"], 0),
        ("closest approach", distance, -1),
        ("greatest distance", distance, 1),
    )
    found = (_extreme(trajectory, what, *each, sign) for what, each, sign in wanted)
    return [each for each in [*found, _impact(trajectory)] if each is not None]


def _impact(trajectory: Trajectory) -> Extreme | None:
    """The predicted impact, or apogee, of the summary: its distance over the ground, with the sigma along that."""
    s = trajectory.metadata.get("summary", {}).get("impact")
    if s is None:
        return None
    place = np.array([s["x_m"], s["y_m"]])
    length = float(np.sqrt(place @ place))
    along = place / max(length, 1e-9)
    sigma = float(np.sqrt(along @ np.array(s["covariance_xy_m2"]) @ along))
    what = f"predicted {s['kind']}, distance over ground ({s['semi_major_m']:.3g} by {s['semi_minor_m']:.3g} m)"
    return Extreme(what, length, sigma, "m", float(s["time_s"]), len(trajectory) - 1)


def _extreme(
    trajectory: Trajectory, what: str, value: FloatArray, sigma: FloatArray, unit: str, sign: int
) -> Extreme | None:
    """The row with the greatest (sign 1), the least (-1) or in size the largest (0) value."""
    known = np.isfinite(value) & np.isfinite(sigma)
    rows = np.flatnonzero(known if known.any() else np.isfinite(value))
    if not len(rows):
        return None
    by = np.abs(value[rows]) if sign == 0 else sign * value[rows]
    row = int(rows[(by - np.nan_to_num(sigma[rows])).argmax()])
    return Extreme(what, float(value[row]), float(sigma[row]), unit, float(trajectory.time_s[row]), row)


def _height(trajectory: Trajectory) -> tuple[str, tuple[FloatArray, FloatArray, str]]:
    """Above the ellipsoid with a site, else over the station."""
    extra, sigma = trajectory.extra, trajectory.sigma[:, 2]
    if extra is not None and "height_m" in extra.column_names:
        return "above the ellipsoid", (np.asarray(extra.column("height_m"), float), sigma, "m")
    return "over the station", (trajectory.state[:, 2], sigma, "m")


def _norm(vector: FloatArray, sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The length of (n, 3) vectors and its 1-sigma, from those along the axes."""
    length = np.sqrt((vector**2).sum(1))
    with np.errstate(invalid="ignore", divide="ignore"):
        spread = np.sqrt(((vector * sigma) ** 2).sum(1)) / length
    return length, spread
