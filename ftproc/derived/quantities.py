"""Ground speed, track, climb rate, flight path angle, turn rate and load factor, row by row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.model.kinematics import GRAVITY, SLOWEST
from ftproc.records import FloatArray, Trajectory

DIRECTED = 3.0  # sigmas: a target that is slower has no direction that could be published
NORTH, FROM_X = "track_deg", "track_from_x_deg"  # names of the track's column


class Quantity(NamedTuple):
    """name: of the column. factor: from SI units and rad to its unit. label, unit: for figures and tables."""

    name: str
    label: str
    unit: str
    factor: float = 1.0


DEGREES = 180 / np.pi
QUANTITIES = (
    Quantity("ground_speed_mps", "ground speed", "m/s"),
    Quantity(NORTH, "track", "deg", DEGREES),
    Quantity("climb_rate_mps", "climb rate", "m/s"),
    Quantity("flight_path_angle_deg", "flight path angle", "deg", DEGREES),
    Quantity("turn_rate_degps", "turn rate", "deg/s", DEGREES),
    Quantity("load_factor", "load factor", "g"),
)
TRACK, ANGLE, TURN = 1, 3, 4  # those that need a direction


@dataclass(frozen=True)
class Derived:
    """value: (n, 6) in the units of QUANTITIES; NaN where the velocity is not estimated, and track, flight path angle
    and turn rate also where the target is slower than DIRECTED of its sigmas. sigma: (n, 6) 1-sigma of these; NaN where
    the covariance is not known. from_north: whether the track is counted clockwise from north, and the turn rate
    positive to the right; else both are counted as the log's azimuth, from x."""

    value: FloatArray
    sigma: FloatArray
    from_north: bool

    @classmethod
    def of(cls, trajectory: Trajectory) -> Derived:
        """Of any trajectory that has velocities; of one from a file the sigmas are those of its columns, if there are
        any."""
        metadata, unknown = trajectory.metadata, np.full((len(trajectory), len(QUANTITIES)), np.nan)
        north = axes_of_north(metadata)
        value = np.stack(_values(_along_north_and_east(trajectory, north)), 1) * _FACTOR
        value[:, TRACK] %= 360.0
        sigma = _published(trajectory, unknown) if trajectory.path_sigma is None else trajectory.path_sigma * _FACTOR
        sigma = np.where(np.isfinite(value), sigma, np.nan)
        slow = ~_directed(trajectory, horizontal=True)
        value[slow[:, None] & _IS_HEADING], sigma[slow[:, None] & _IS_HEADING] = np.nan, np.nan
        still = ~_directed(trajectory, horizontal=False)
        value[still, ANGLE], sigma[still, ANGLE] = np.nan, np.nan
        return cls(value, sigma, north is not None)

    def columns(self) -> dict[str, FloatArray]:
        """By the names of the columns: each quantity, and its sigma."""
        names = [q.name if q.name != NORTH or self.from_north else FROM_X for q in QUANTITIES]
        pairs = zip(names, self.value.T, self.sigma.T, strict=True)
        return {key: each for name, value, sigma in pairs for key, each in ((name, value), (f"sigma_{name}", sigma))}


_FACTOR = np.array([q.factor for q in QUANTITIES])
_IS_HEADING = np.isin(np.arange(len(QUANTITIES)), (TRACK, TURN))


def axes_of_north(metadata: Mapping[str, Any]) -> tuple[int, int] | None:
    """The axes that point north and east; None where they are not known."""
    if metadata.get("frame") == "north-east-up":
        return 0, 1
    return (1, 0) if site_of(metadata) is not None or metadata.get("stations") else None


def site_of(metadata: Mapping[str, Any]) -> Sequence[float] | None:
    """Latitude deg, longitude deg and height m of the station; None where it is not known."""
    settings = metadata.get("settings")
    site = settings.get("site") if isinstance(settings, Mapping) else None
    return site if isinstance(site, list | tuple) and len(site) == 3 else None


def _along_north_and_east(trajectory: Trajectory, north: tuple[int, int] | None) -> FloatArray:
    """(n, 6) velocity and acceleration along north, east and up at the target, or along x, y and z."""
    vectors = trajectory.state[:, 3:9].reshape(-1, 2, 3)
    if north is None:
        return vectors.reshape(-1, 6)
    turned, site, extra = vectors[:, :, [*north, 2]], site_of(trajectory.metadata), trajectory.extra
    if site is not None and extra is not None and {"lat_deg", "lon_deg"} <= set(extra.column_names):
        there = _from_earth(*(np.asarray(extra.column(name), float) for name in ("lat_deg", "lon_deg")))
        turned = np.einsum("nij,kj,nvk->nvi", there, _from_earth(*map(np.asarray, site[:2])), turned)
    return turned.reshape(-1, 6)


def _from_earth(latitude_deg: FloatArray, longitude_deg: FloatArray) -> FloatArray:
    """(..., 3, 3) rows: north, east and up at places on the ellipsoid, in earth-centred axes."""
    sp, cp = np.sin(np.radians(latitude_deg)), np.cos(np.radians(latitude_deg))
    sl, cl = np.sin(np.radians(longitude_deg)), np.cos(np.radians(longitude_deg))
    nothing = np.zeros_like(sp)
    rows = ((-sp * cl, -sp * sl, cp), (-sl, cl, nothing), (cp * cl, cp * sl, sp))
    found: FloatArray = np.stack([np.stack(np.broadcast_arrays(*row), -1) for row in rows], -2)
    return found


def _values(vectors: FloatArray) -> list[FloatArray]:
    """The quantities of (n, 6) velocity m/s and acceleration m/s2; SI units and rad."""
    (vx, vy, vz), acceleration = vectors[:, :3].T, vectors[:, 3:]
    ground = np.hypot(vx, vy)
    with np.errstate(invalid="ignore", divide="ignore"):
        turn = (vx * acceleration[:, 1] - vy * acceleration[:, 0]) / ground**2
    return [ground, np.arctan2(vy, vx), vz, np.arctan2(vz, ground), turn, load_factor(vectors)]


def load_factor(vectors: FloatArray) -> FloatArray:
    """(n,) g: the specific force across the direction of flight; all of it of a target slower than SLOWEST."""
    force, v = vectors[:, 3:] + [0.0, 0.0, GRAVITY], np.sqrt((vectors[:, :3] ** 2).sum(1))
    along = vectors[:, :3] / np.maximum(v, SLOWEST)[:, None]
    across = force - np.where(v > SLOWEST, (force * along).sum(1), 0.0)[:, None] * along
    found: FloatArray = np.sqrt((across**2).sum(1)) / GRAVITY
    return found


def _directed(trajectory: Trajectory, horizontal: bool) -> NDArray[np.bool_]:
    """(n,) whether the target is fast enough to have a direction."""
    axes = slice(3, 5 if horizontal else 6)
    speed = np.sqrt((trajectory.state[:, axes] ** 2).sum(1))
    sigma = np.nan_to_num(trajectory.sigma[:, axes]).max(1)
    found: NDArray[np.bool_] = speed > DIRECTED * sigma
    return found


def _published(trajectory: Trajectory, unknown: FloatArray) -> FloatArray:
    """The sigmas in the columns of a trajectory from a file, NaN where there are none."""
    extra, found = trajectory.extra, unknown.copy()
    for k, quantity in enumerate(QUANTITIES):
        for name in (quantity.name, FROM_X) if k == TRACK else (quantity.name,):
            if extra is not None and f"sigma_{name}" in extra.column_names:
                found[:, k] = np.asarray(extra.column(f"sigma_{name}"), float)
    return found
