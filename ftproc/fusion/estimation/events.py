"""The readings of all stations in one series, in the order of true time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.biases import PARAMETERS
from ftproc.core.filtering.records import Observations, Sites
from ftproc.core.model.stations import levelled
from ftproc.records import FloatArray, IntArray

CLOCK = 5  # among the parameters of a station


class Seen(NamedTuple):
    """What one station has seen. time_s: (n,) by its own clock. measurement: (n, 3) range m, azimuth anticlockwise from
    its x (east) and elevation rad, NaN where missing. place (3,) m, axes (3, 3): see `core.model.stations`. prior:
    (PARAMETERS,) 1-sigma of its biases m, rad, rad, tilts rad, rad, and clock offset s; zero for what is known. known:
    (3,) noise 1-sigma that the user specified, else NaN. accepted: (n, 3) readings that are good by hand."""

    name: str
    time_s: FloatArray
    measurement: FloatArray
    place: FloatArray
    axes: FloatArray
    prior: FloatArray
    known: FloatArray
    accepted: NDArray[np.bool_]

    @property
    def components(self) -> list[int]:
        """Those of which it has a reading."""
        return [int(c) for c in np.flatnonzero(np.isfinite(self.measurement).any(0))]


class Events(NamedTuple):
    """time_s: (n,) true time, in order. station, row: (n,) who has taken each, and its row in that station's log.
    measurement: (n, 3) without biases. sites: as of `Observations`."""

    time_s: FloatArray
    station: IntArray
    row: IntArray
    measurement: FloatArray
    sites: Sites

    def weighted(self, weight: list[FloatArray]) -> Observations:
        """As a filter sees them, with the weights (rows, 3) of each station."""
        return Observations(self.time_s, self.measurement, self.gathered(weight), None, self.sites)

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
    return Events(time_s[order], station[order], row[order], np.ascontiguousarray(measurement[order]), sites)


def moved_to(time_s: FloatArray, state: FloatArray, wanted: FloatArray) -> FloatArray:
    """(k, 9) states at other times, by the motion from the nearest one before."""
    at = np.clip(np.searchsorted(time_s, wanted, side="right") - 1, 0, len(time_s) - 1)
    late = (wanted - time_s[at])[:, None]
    p, v, a = state[at, :3], state[at, 3:6], state[at, 6:]
    return np.hstack([p + late * v + 0.5 * late**2 * a, v + late * a, a])
