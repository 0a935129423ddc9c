"""How likely it is that a log is meant in some way, by the motion that this gives its target: the rate of its rows, the
distance, the speed, the noise of the angles, and how straight the path is.

An angle in a wrong unit, from a wrong zero, or taken for the other angle bends a straight path about the station. So
the acceleration is compared with v^2 / r, which is what such bending amounts to, whatever the units of range and time.
A path with far less acceleration than that is no accident.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.files.reading.meaning.values import paths
from ftproc.files.units import Unit
from ftproc.files.words import QUANTITIES
from ftproc.order_statistics import median
from ftproc.records import FloatArray

_MOST_ROWS = 1000  # that are used

#: How likely a value is up to each limit, and beyond the last.
_STEP_S = (
    (2e-4, 1e-3),
    (9e-4, 0.01),
    (2.1e-3, 0.05),
    (4.9e-3, 0.3),
    (2.6, 1.0),
    (13, 0.3),
    (60, 0.02),
    (math.inf, 2e-3),
)
_SPEED = ((0.01, 1e-3), (0.05, 3e-3), (0.3, 0.01), (2, 0.1), (1000, 1.0), (3000, 0.1), (9000, 0.03), (75e3, 3e-3),
          (math.inf, 1e-6))  # fmt: skip
_RANGE_M = ((1, 1e-3), (20, 0.03), (400, 0.3), (5e5, 1.0), (5e6, 0.05), (math.inf, 1e-3))
_NOISE_RAD = ((1e-6, 0.1), (1e-5, 0.2), (3e-5, 0.6), (5e-3, 1.0), (0.01, 0.3), (0.03, 0.02), (math.inf, 2e-3))
#: The noise of one angle over that of the other, which one instrument has alike.
_UNLIKE = ((8.0, 1.0), (25.0, 0.2), (math.inf, 0.05))
_LEAST_NOISE = 1e-7  # rad; less is no noise
_HEIGHT_M = ((2e4, 1.0), (5e4, 0.2), (math.inf, 0.1))
#: Gravity, and a path that falls so: how near, and how likely it is then, however far and fast.
_EARTH_M3PS2, _EARTH_M = 3.986e14, 6.371e6
_NEAR, _FALLS = 0.25, 20.0
_NO_FLIGHT = ((4e4, 2e6), 1500.0, 0.05)  # m, where nothing stays that is slower, m/s
#: Bounds between which the acceleration, in units of v^2 / r, counts, and by which power: below the middle one it is
#: smaller than any mistake makes it.
_BENT = ((0.02, 0.3, 3.0), (0.3, 1.0, 1.0))


class Sample(NamedTuple):
    """Some rows, in the units of the file: times (n,) and readings (n, 3); NaN in absent columns."""

    time: FloatArray
    readings: FloatArray


class Way(NamedTuple):
    """A way to understand a log. units: of time, range, azimuth and elevation, None where absent. zenith: the elevation
    counts from the vertical. exchanged: the azimuth is in the column of the elevation, and the other way round."""

    units: tuple[Unit | None, ...]
    zenith: bool = False
    exchanged: bool = False


class Motion:
    """What the readings of a log show, each figure found once."""

    def __init__(self, near: Sample, far: Sample) -> None:
        """near: the first rows; far: such of the whole log; in time order."""
        self._near, self._far = near, far
        self._known: dict[Hashable, Any] = {}

    def likelihood(self, way: Way) -> float:
        """Of the readings, but for a factor that is the same for all ways."""
        return self.of_scales(way) * self.of_angles(way)

    def of_scales(self, way: Way) -> float:
        """What depends on the units of time and range."""
        time, length, *_ = way.units
        odds = 1.0 if time is None else _at(_STEP_S, self._once(("rate", time), partial(self._rate, time)))
        if length is not None and time is not None:
            odds *= _FALLS if self.falls(way) else self._flies(way, length)
        return odds

    def _flies(self, way: Way, range_: Unit) -> float:
        """How likely the distance, the height and the speed are."""
        size, speed = range_.multiply / range_.divide, self.speed(way)
        height = self._of(way, "height", self._height) * size
        odds = _at(_RANGE_M, self.distance() * size) * _at(_HEIGHT_M, height)
        if speed is None:
            return odds
        (low, high), slow, unlikely = _NO_FLIGHT
        return odds * _at(_SPEED, speed) * (unlikely if low < height < high and speed < slow else 1.0)

    def of_angles(self, way: Way) -> float:
        """What does not depend on the units of time and range."""
        noises = self.noises(way)
        odds = math.prod(_at(_NOISE_RAD, noise) for noise in noises)
        if len(noises) == 2 and min(noises) > _LEAST_NOISE:
            odds *= _at(_UNLIKE, max(noises) / min(noises))
        return odds * self._straight(way)

    def _straight(self, way: Way) -> float:
        """How likely a path so straight is."""
        bent, found = self.bent(way), 1.0
        if bent is None:
            return 1.0
        for low, high, power in _BENT:
            found *= (high / min(max(bent, low), high)) ** power
        return found

    def falls(self, way: Way) -> bool:
        """Whether the path is bent as by gravity alone: that of a satellite, or of a shell."""
        found = self._of(way, "path", self._path) if all(way.units) else None
        time, length, *_ = way.units
        if found is None or time is None or length is None:
            return False
        size, second = length.multiply / length.divide, time.multiply / time.divide
        position, acceleration = found[0] * size, found[1] * size / second**2
        down = position + np.array([0.0, 0.0, _EARTH_M])
        gravity = -_EARTH_M3PS2 * down / np.linalg.norm(down) ** 3
        return bool(np.linalg.norm(acceleration - gravity) < _NEAR * np.linalg.norm(gravity))

    def bent(self, way: Way) -> float | None:
        """The acceleration in units of v^2 / r; None where the log has no path."""
        found: float | None = self._of(way, "bent", self._bent)
        return found

    def speed(self, way: Way) -> float | None:
        """The usual one in m/s; None if the way is hidden in the noise."""
        time, length, *_ = way.units
        if time is None or length is None:
            return None
        speed: float | None = self._of(way, "speed", self._speed)
        return None if speed is None else speed * length.multiply / length.divide * time.divide / time.multiply

    def noises(self, way: Way) -> list[float]:
        """Of the angles that are there, in rad."""
        return [self._once(("noise", k, u), partial(self._noise, k, u)) for k, u in enumerate(way.units[2:], 1) if u]

    def elevation(self, way: Way) -> float:
        """The median, in rad."""
        found: float = self._of(way, "elevation", self._elevation)
        return found

    def distance(self) -> float:
        """The median, in the unit of the file."""
        found: float = self._once("distance", lambda: median(np.abs(self._far.readings[:, 0])))
        return found

    def turn(self, way: Way) -> float:
        """How far the angles turn, in rad."""
        azimuth, elevation = _angles(self._far.readings, way)
        return float(max(np.ptp(np.unwrap(azimuth)), np.ptp(elevation)))

    def gone(self) -> float:
        """How far the range changes, as a share of it."""
        return float(np.ptp(np.abs(self._far.readings[:, 0]))) / max(self.distance(), 1e-9)

    def _of(self, way: Way, what: str, figure: Callable[[Way], Any]) -> Any:
        """A figure of the path, in the units of the file."""
        return self._once((what, way[1:], way.units[2:]), partial(figure, way))

    def _once(self, key: Hashable, figure: Callable[[], Any]) -> Any:
        if key not in self._known:
            self._known[key] = figure()
        return self._known[key]

    def _rate(self, unit: Unit) -> float:
        steps = np.diff(unit.to_si(self._near.time))
        steps = steps[steps > 0]
        return median(steps) if len(steps) else 1.0

    def _noise(self, k: int, unit: Unit) -> float:
        angle = unit.to_si(self._near.readings[:, k])
        return paths.noise(np.unwrap(angle) if k == 1 else angle)

    def _elevation(self, way: Way) -> float:
        return median(_angles(self._far.readings, way)[1])

    def _height(self, way: Way) -> float:
        """The median, in the unit of the range; 0 for a log without elevations."""
        return median(self._far.readings[:, 0] * np.sin(_angles(self._far.readings, way)[1]))

    def _speed(self, way: Way) -> float | None:
        return paths.speed(self._far.time, paths.positions(self._far.readings[:, 0], *_angles(self._far.readings, way)))

    def _bent(self, way: Way) -> float | None:
        if way.units[2] is None or not np.isfinite(self._far.readings[0, 0]):
            return None
        found = [paths.bent(*self._blocks(way, n)) for n in paths.STRAIGHT if len(self._far.time) >= n]
        return min((each for each in found if math.isfinite(each)), default=None)

    def _path(self, way: Way) -> tuple[FloatArray, FloatArray] | None:
        """The mean position and acceleration, (3,) each, in the units of the file."""
        moment, position, _ = self._blocks(way, paths.STRAIGHT[0])
        past = (np.diff(moment) > 0).all()
        return (position.mean(0), paths.derived(moment, position)[1].mean(0)) if past else None

    def _blocks(self, way: Way, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Times (n,), positions (n, 3) and distances (n,), the medians of so many blocks of rows."""
        moment, distance = (
            self._once(("median", k, count), partial(paths.medians, values, count))
            for k, values in enumerate((self._far.time, self._far.readings[:, 0]))
        )
        angles = [np.zeros(count) if u is None else self._middles(k, u, count) for k, u in enumerate(way.units[2:], 1)]
        return moment, paths.positions(distance, *_turned(angles, way)), distance

    def _middles(self, k: int, unit: Unit, count: int) -> FloatArray:
        angle = self._far.readings[:, k]
        found: FloatArray = self._once(("middle", k, unit, count), lambda: paths.middles(unit.to_si(angle), count))
        return found


def of(quantities: Mapping[str, FloatArray], units: Mapping[str, Unit]) -> Motion | None:
    """The motion in the rows that have all quantities; None for too few. quantities: (n,) in SI, if `units` is."""
    rows = np.flatnonzero(np.logical_and.reduce([np.isfinite(values) for values in quantities.values()]))
    if len(rows) < paths.FEWEST or not np.ptp(quantities["time"][rows]) > 0:
        return None
    near, far = rows[:_MOST_ROWS], rows[:: 1 + len(rows) // _MOST_ROWS]
    return Motion(_in_file_units(quantities, units, near), _in_file_units(quantities, units, far))


def _in_file_units(quantities: Mapping[str, FloatArray], units: Mapping[str, Unit], rows: NDArray[np.intp]) -> Sample:
    rows = rows[np.argsort(quantities["time"][rows], kind="stable")]
    raw = {q: values[rows] * units[q].divide / units[q].multiply for q, values in quantities.items()}
    parts = [raw.get(quantity, np.full(len(rows), np.nan)) for quantity in QUANTITIES]
    return Sample(parts[0], np.column_stack(parts[1:]))


def _angles(readings: FloatArray, way: Way) -> tuple[FloatArray, FloatArray]:
    """(n,) azimuth and elevation in rad, 0 where absent."""
    each = enumerate(way.units[2:], 1)
    return _turned([np.zeros(len(readings)) if u is None else u.to_si(readings[:, k]) for k, u in each], way)


def _turned(angles: Sequence[FloatArray], way: Way) -> tuple[FloatArray, FloatArray]:
    """Azimuth and elevation of the angles of two columns in rad."""
    azimuth, elevation = angles[::-1] if way.exchanged else angles
    return azimuth, math.pi / 2 - elevation if way.zenith and way.units[3] is not None else elevation


def _at(table: Sequence[tuple[float, float]], value: float) -> float:
    return next((odds for limit, odds in table if value <= limit), 0.0)
