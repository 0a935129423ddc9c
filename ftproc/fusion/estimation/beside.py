"""What stations measure beside range, azimuth and elevation, among the readings of all: range rates, and heights.

A height is the distance from the centre of the earth, and has an offset and a scale that are not known: those of the
pressure and of the temperature of the air; the other stations tell them. Heights are used from the beginning, because
without them a radar without elevations sees no place. Where no station tells the height, a prior stands for it, with an
offset that is as uncertain as that is. Range rates are looked at when the readings are decided on, as those of a single
log are.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ftproc.core import beside as understanding
from ftproc.core import odds
from ftproc.core.components import bounded
from ftproc.core.editing.copies import rounding_step
from ftproc.core.filtering import beside as layout
from ftproc.core.filtering.records import Scalars
from ftproc.core.model.earth import ECCENTRICITY2, MEAN_RADIUS_M, RADIUS_M, Geodetic
from ftproc.fusion.estimation.events import OFFSET, Events, Seen, Side
from ftproc.methods.height import alone, heights
from ftproc.methods.height.priors import SPECIFIED, Prior
from ftproc.order_statistics import median
from ftproc.records import FloatArray, IntArray, MeasurementLog

HEIGHT, RANGE_RATE, ASSUMED = "height", "range_rate", "assumed height"
BELOW = 2.0  # sigmas that a target must be below the ground
NO_HEIGHTS = "the heights make the readings less likely: none is used"
SHORTEST_M = 1.0  # of a distance over the ground


class Aside(NamedTuple):
    """A side of a station in the flight that is published. residual, variance: (n,) leave-one-out. cleaned: (n,) what
    the station would have read."""

    side: Side
    residual: FloatArray
    variance: FloatArray
    cleaned: FloatArray

    @classmethod
    def before(cls, side: Side) -> Aside:
        """Of which nothing is known yet."""
        unknown = [np.full(len(side.value), np.nan) for _ in range(3)]
        value, weight = side.value.copy(), np.zeros(len(side.value))
        return cls(side._replace(value=value, weight=weight, sigma=0.0, used=False), *unknown)

    def with_(self, rows: IntArray, own: Side, near: IntArray, left: FloatArray, cleaned: FloatArray) -> Aside:
        """With what a stretch shows of some rows, which are `near` there. left: (k, 2) residuals and variances."""
        self.residual[rows], self.variance[rows], self.cleaned[rows] = left[:, 0], left[:, 1], cleaned + own.level
        self.side.value[rows], self.side.weight[rows] = own.value[near] + own.level, own.weight[near]
        share = len(rows) / len(self.residual)
        return self._replace(
            side=self.side._replace(
                sigma=math.sqrt(self.side.sigma**2 + share * own.sigma**2), used=self.side.used or own.used,
                closing=self.side.closing or own.closing, why=self.side.why or own.why,
            )
        )  # fmt: skip


def sides(log: MeasurementLog, place: FloatArray, origin: Geodetic | None) -> tuple[tuple[Side, ...], FloatArray]:
    """What a log has beside its readings, and the 1-sigma (2,) of offset m and scale of its heights."""
    found, prior = [], np.zeros(2)
    if log.range_rate is not None and np.isfinite(log.range_rate).any():
        value = bounded(log.range_rate)
        side = Side(RANGE_RATE, layout.RATE, value, 1.0, np.isfinite(value).astype(float), place)
        found.append(side._replace(interval=log.station.range_rate_interval_mps))
    if log.heights is not None and np.isfinite(log.heights.above_m).any() and not elevated(log):
        radius, level = _earth(origin)
        above, centre = bounded(log.heights.above_m) - level, np.array([0.0, 0.0, -radius])
        own, good = alone.screened(log.time_s, above, rounding_step(log.heights.above_m))
        found.append(Side(HEIGHT, layout.DISTANCE, above, own, good.astype(float), centre, True, level))
        prior = np.array([alone.PRESSURE_M, alone.TEMPERATURE]) * log.heights.barometric
    return tuple(found), prior


def elevated(log: MeasurementLog) -> bool:
    """Whether a log has heights beside elevations: these are left out."""
    return log.heights is not None and bool(np.isfinite(log.measurement[:, 2]).any())


def with_prior(stations: list[Seen], priors: Sequence[Prior], origin: Geodetic | None) -> list[Seen]:
    """The stations with what is known of the height beforehand, where none of them tells it: those with ranges and
    azimuths."""
    plane = [{0, 1} <= set(station.components) for station in stations]
    told = any(2 in each.components or any(s.kind == layout.DISTANCE for s in each.beside) for each in stations)
    if told or not any(plane):
        return stations
    radius, level = _earth(origin)
    centre, found = np.array([0.0, 0.0, -radius]), list(stations)
    for s, (station, prior) in enumerate(zip(stations, priors, strict=True)):
        if plane[s]:
            above = float(np.linalg.norm(station.place - centre)) - radius + prior.height_m
            value, ones = np.full(len(station.time_s), above), np.ones(len(station.time_s))
            side = Side(ASSUMED, layout.DISTANCE, value, prior.sigma_m, ones, centre, True, level)
            words = f"{prior.height_m:g} m above {station.name}, 1 sigma {prior.sigma_m:g} m"
            if prior.why != SPECIFIED:
                words = f"that of {prior.why}, {words} (height.prior_m of its station states another)"
            biases = station.prior.copy()
            biases[OFFSET] = prior.sigma_m
            side = side._replace(why=f"no station tells the height: it is taken for {words}")
            found[s] = station._replace(beside=(*station.beside, side), prior=biases)
    return found


def above_ground(stations: list[Seen], state: FloatArray, sigma: FloatArray) -> list[Seen] | None:
    """The stations with a height as far above them as a target is below with these states (n, 9) and 1-sigmas (n, 9),
    where its height is assumed: ranges and azimuths alone do not tell above from below. None where it is not below."""
    assumed = any(side.name == ASSUMED for station in stations for side in station.beside)
    below = min(float(station.place[2]) for station in stations) - median(state[:, 2])
    if not (assumed and below > BELOW * median(sigma[:, 2])):
        return None
    return [
        station._replace(
            beside=tuple(
                side._replace(value=side.value + below) if side.name == ASSUMED else side for side in station.beside
            )
        )
        for station in stations
    ]


def _earth(origin: Geodetic | None) -> tuple[float, float]:
    """Radius of the earth at the origin of the range, and the height of that, m."""
    if origin is None:
        return MEAN_RADIUS_M, 0.0
    flat = 1 - ECCENTRICITY2 * math.sin(math.radians(origin[0])) ** 2
    return RADIUS_M * math.sqrt(1 - ECCENTRICITY2) / flat + origin[2], origin[2]


def with_elevations(
    stations: list[Seen], weight: list[FloatArray], sigma: FloatArray
) -> tuple[list[Seen], list[FloatArray], FloatArray]:
    """Stations, weights (rows, 3) and noise (m, 3) for a first track: with the elevations that heights stand for."""
    found, weights, wide = list(stations), list(weight), sigma.copy()
    for s, station in enumerate(stations):
        side = next((each for each in station.beside if each.kind == layout.DISTANCE), None)
        if side is None or not {0, 1} <= set(station.components) or 2 in station.components:
            continue
        z, weights[s], prior = station.measurement.copy(), weight[s].copy(), station.prior.copy()
        own = float(np.linalg.norm(station.place - side.point)) - side.about
        with np.errstate(invalid="ignore"):
            sine = heights.sine(side.value - own, z[:, 0])
            z[:, 2] = np.where(np.abs(sine) < 1, np.arcsin(np.clip(sine, -1, 1)), np.nan)
        used = (weight[s][:, 0] > 0) & (side.weight > 0) & np.isfinite(z[:, 2])
        if not used.any():
            continue
        weights[s][:, 2] = used
        ground = max(float(np.median(z[used, 0] * np.cos(z[used, 2]))), SHORTEST_M)
        wide[s, 2] = side.sigma / ground
        prior[2] = float(np.hypot(prior[6], prior[7] * np.median(side.value[used]))) / ground
        found[s] = station._replace(measurement=z, prior=prior)
    return found, weights, wide


def design(events: Events, state: FloatArray) -> FloatArray:
    """(kinds, n, UNKNOWNS) derivative of the scalars by clock, offset and scale, at states (n, 9)."""
    found = np.zeros((len(events.beside), len(state), layout.UNKNOWNS))
    for each, scalars in zip(found, events.beside, strict=True):
        far, rate, growth = _seen_from(scalars.point, state)
        if scalars.kind == layout.RATE:
            each[:, 0] = -growth
        else:
            each[:, 0], each[:, 1], each[:, 2] = -rate, 1.0, far + scalars.point[:, 2]
        each[far < SHORTEST_M] = 0.0
    return found


def expected(side: Side, state: FloatArray, biases: FloatArray) -> FloatArray:
    """(n,) what a station with such biases (PARAMETERS,) reads of states (n, 9)."""
    far, rate, _ = _seen_from(side.point, state)
    if side.kind == layout.RATE:
        return rate
    found: FloatArray = (far - side.about) * (1 + biases[7]) + biases[6]
    return found


def _seen_from(point: FloatArray, state: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Distance (n,) of states (n, 9) from a point, and its first and second derivative by the time."""
    seen, v, a = state[:, :3] - point, state[:, 3:6], state[:, 6:]
    far = np.maximum(np.sqrt((seen**2).sum(1)), layout.NEAREST_M)
    rate = (seen * v).sum(1) / far
    return far, rate, ((v**2).sum(1) + (seen * a).sum(1) - rate**2) / far


Flight = TypeVar("Flight", bound=Any)


def fitted(current: Flight, gate: float, smoothed: Callable[[Flight], Flight]) -> Flight:
    """A flight whose readings are decided on, with the noise of what stands beside them, and its outliers. current:
    `engine.Current`. smoothed: the same smoothed again."""
    for s, station in enumerate(current.stations):
        for j, side in enumerate(station.beside):
            if side.name == ASSUMED:
                continue
            current = _fitted(current, s, j, gate, smoothed)
    return current


def _fitted(current: Flight, s: int, j: int, gate: float, smoothed: Callable[[Flight], Flight]) -> Flight:
    side = current.stations[s].beside[j]
    kind = current.events.names.index(side.name)

    def with_(scalars: Scalars, **more: Any) -> Flight:
        own = side._replace(value=scalars.value, sigma=math.sqrt(scalars.variance[0]), weight=scalars.weight)
        stations = list(current.stations)
        sides = stations[s].beside
        stations[s] = stations[s]._replace(beside=(*sides[:j], own._replace(**more), *sides[j + 1 :]))
        return smoothed(current._replace(stations=stations))

    def residuals(scalars: Scalars) -> tuple[FloatArray, FloatArray]:
        flight = with_(scalars, used=True)
        left = flight.events.of(s, flight.found.beside[kind])
        return np.ascontiguousarray(left[:, 0]), np.ascontiguousarray(left[:, 1])

    def likelier(found: Flight, without: Flight) -> Flight:
        of_both = (understanding.of_the_rest(each.log, each.model, [each.start], kind) for each in (found, without))
        with_them, alone = of_both
        return without if with_them < alone - odds.SURE else found

    now = Scalars(side.value, np.full(len(side.value), side.sigma**2), side.weight)
    if side.name == HEIGHT:
        return likelier(with_(understanding.decided(now, residuals, gate)), with_(now, used=False, why=NO_HEIGHTS))
    channel = understanding.understood(now._replace(weight=0.0 * side.weight), residuals, gate, side.interval)
    if channel.why:
        return with_(now, why=channel.why)
    if channel.told < understanding.USEFUL:
        return with_(channel.rates, closing=channel.closing)
    return likelier(
        with_(channel.rates, used=True, closing=channel.closing),
        with_(now, why=understanding.HINDERS.format("range rates")),
    )
