"""The readings of all stations in one series, in the order of true time."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering import beside as layout
from ftproc.core.filtering.biases import PARAMETERS
from ftproc.core.filtering.records import Observations, Scalars, Sites, Uneven
from ftproc.core.model.stations import levelled
from ftproc.records import COMPONENTS, FloatArray, IntArray

CLOCK, OFFSET, SCALE = 5, 6, 7  # among the parameters of a station
APART_M = math.nextafter(1e3, 2e3)  # 1-sigma of the offset of heights that are not those of the transponder that other
# stations hear: no number that a range file states


class Side(NamedTuple):
    """Scalars of a station beside its readings, see `core.filtering.beside`. name: of the quantity. value: (n,) m/s
    outward, or m above the level of the origin, NaN where missing; sigma: their noise; weight: (n,) zero for outliers;
    used: whether any are. level: height of the origin, m. closing: whether the log counts inward. why: they are not
    used, in words. interval: in which they are ambiguous, or zero."""

    name: str
    kind: float
    value: FloatArray
    sigma: float
    weight: FloatArray
    point: FloatArray
    used: bool = False
    level: float = 0.0
    closing: bool = False
    why: str = ""
    interval: float = 0.0

    @property
    def about(self) -> float:
        """The distance from the point at which the value is zero, m; of a range rate nothing."""
        return 0.0 if self.kind == layout.RATE else -float(self.point[2])

    def part(self, rows: slice) -> Side:
        """Of some of the rows."""
        return self._replace(value=self.value[rows], weight=self.weight[rows])

    def unbiased(self, biases: FloatArray) -> FloatArray:
        """(n,) without the biases (PARAMETERS,) of the station."""
        if self.kind == layout.RATE:
            return self.value
        found: FloatArray = self.value * (1 - biases[SCALE]) - biases[OFFSET] + self.about
        return found


class Seen(NamedTuple):
    """What one station has seen. time_s: (n,) by its own clock. measurement: (n, 3) range m, azimuth anticlockwise from
    its x (east) and elevation rad, NaN where missing. place (3,) m, axes (3, 3): see `core.model.stations`. prior:
    (PARAMETERS,) 1-sigma of its biases m, rad, rad, tilts rad, rad, clock offset s, and of its heights
    the offset m and the scale; zero for what is known. known: (3,) noise 1-sigma that the user specified, else NaN.
    accepted: (n, 3) readings that are good by hand. beside: what else it measures. times: (n,) of the noise's variance,
    by row, where the log states it. away_m: how far from the target a place is that positions are seen from, zero for a
    tracker. copied: (3, kinds) readings of each component that were not measured, see `copies`; these are missing.
    unstated: components whose bias the range file takes as known, against what the readings say. elevated: whether it
    has heights beside elevations, which are not used."""

    name: str
    time_s: FloatArray
    measurement: FloatArray
    place: FloatArray
    axes: FloatArray
    prior: FloatArray
    known: FloatArray
    accepted: NDArray[np.bool_]
    beside: tuple[Side, ...] = ()
    times: FloatArray | None = None
    away_m: float = 0.0
    copied: IntArray = np.zeros((3, 4), np.int64)
    unstated: tuple[int, ...] = ()
    elevated: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Of its components: seen from the south, a range is a northing, and the angles are across and up."""
        return ("north", "east", "up") if self.away_m else COMPONENTS

    @property
    def components(self) -> list[int]:
        """Those of which it has a reading."""
        return [int(c) for c in np.flatnonzero(np.isfinite(self.measurement).any(0))]

    @property
    def sees_place(self) -> bool:
        """Whether its readings, or a height in place of the elevation, determine where the target is."""
        high = 2 in self.components or any(side.kind == layout.DISTANCE for side in self.beside)
        return high and {0, 1} <= set(self.components)


class Events(NamedTuple):
    """time_s: (n,) true time, in order. station, row: (n,) who has taken each, and its row in that station's log.
    measurement: (n, 3) without biases. sites: as of `Observations`. beside: the scalars of all stations, by name."""

    time_s: FloatArray
    station: IntArray
    row: IntArray
    measurement: FloatArray
    sites: Sites
    names: tuple[str, ...] = ()
    beside: tuple[Scalars, ...] = ()
    uneven: Uneven | None = None

    def weighted(self, weight: list[FloatArray]) -> Observations:
        """As a filter sees them, with the weights (rows, 3) of each station."""
        return Observations(self.time_s, self.measurement, self.gathered(weight), self.uneven, self.sites, self.beside)

    def gathered(self, by_station: list[FloatArray]) -> FloatArray:
        """(n, ...) of what is known row by row of each station."""
        found = np.empty((len(self.time_s), *by_station[0].shape[1:]), by_station[0].dtype)
        for s, values in enumerate(by_station):
            here = self.station == s
            found[here] = values[self.row[here]]
        return found

    def of(self, s: int, values: FloatArray) -> FloatArray:
        """(rows, ...) of the log of a station, from values (n, ...) of the events."""
        here = np.flatnonzero(self.station == s)
        found = np.empty((len(here), *values.shape[1:]), values.dtype)
        found[self.row[here]] = values[here]
        return found


def merge(stations: list[Seen], biases: FloatArray, range_m: FloatArray) -> Events:
    """The events with biases (m, PARAMETERS) taken out, clock offsets out of the times. range_m (m,): typical."""
    assert biases.shape[1] == PARAMETERS
    time_s = np.concatenate([each.time_s - b[CLOCK] for each, b in zip(stations, biases, strict=True)])
    measurement = np.concatenate([each.measurement - b[:3] for each, b in zip(stations, biases, strict=True)])
    sizes = [len(each.time_s) for each in stations]
    station = np.repeat(np.arange(len(stations)), sizes)
    row = np.concatenate([np.arange(size) for size in sizes])
    order = np.argsort(time_s, kind="stable")
    axes = levelled(np.stack([each.axes for each in stations]), biases[:, 3:CLOCK])
    sites = Sites(station[order], np.stack([each.place for each in stations]), axes, range_m)
    events = Events(time_s[order], station[order], row[order], np.ascontiguousarray(measurement[order]), sites)
    names = tuple(dict.fromkeys(side.name for each in stations for side in each.beside))
    if any(each.times is not None for each in stations):
        times = [np.ones(len(each.time_s)) if each.times is None else each.times for each in stations]
        every = np.repeat(events.gathered(times)[:, None], 3, axis=1)
        events = events._replace(uneven=Uneven(every, np.zeros_like(every)))
    return events._replace(names=names, beside=tuple(_gathered(events, stations, biases, name) for name in names))


def _gathered(events: Events, stations: list[Seen], biases: FloatArray, name: str) -> Scalars:
    """The scalars of a quantity of all stations."""
    n = len(events.time_s)
    found = Scalars(np.full(n, np.nan), np.ones(n), np.zeros(n), point=np.zeros((n, 3)))
    for s, (station, own) in enumerate(zip(stations, biases, strict=True)):
        here = events.station == s
        rows = events.row[here]
        for side in station.beside:
            if side.name == name:
                found = found._replace(kind=side.kind)
                found.value[here], found.variance[here] = side.unbiased(own)[rows], side.sigma**2
                found.weight[here], found.point[here] = side.weight[rows] if side.used else 0.0, side.point
    return found
