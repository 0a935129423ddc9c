"""The ways in which a log may be meant: the units of its columns, whether its elevations are zenith angles, and whether
its angles are exchanged; each with how likely it is before the motion is used."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from ftproc.files.layout import CANONICAL
from ftproc.files.reading.meaning.schema import Column
from ftproc.files.reading.meaning.values import plausibility
from ftproc.files.reading.meaning.values.motion import Way
from ftproc.files.reading.meaning.values.plausibility import Sizes
from ftproc.files.units import UNITS, Unit
from ftproc.files.words import QUANTITIES
from ftproc.settings import Station

#: How likely a unit is where a name states none.
_PRIORS = {
    "time": dict.fromkeys(("s", "ms"), 1.0) | {"us": 0.3, "ns": 0.1, "min": 0.03, "h": 0.03, "d": 0.03},
    "range": {"m": 1.0, "km": 0.3, "ft": 0.1, "nmi": 0.1, "kft": 0.05, "kyd": 0.05, "mm": 0.03, "cm": 0.01},
    "angle": {"rad": 1.0, "deg": 0.05, "grad": 0.008, "mil": 1e-3, "mrad": 5e-4, "mil6000": 5e-4, "mil6300": 1e-4},
}
_SURVEYORS_GRAD = 0.03
#: How likely another unit is than the one that a name states, and a few of these.
_OTHER = {
    "time": (3e-4, ("s", "ms", "us")),
    "range": (3e-4, ("m", "km", "mm")),
    "angle": (0.02, ("rad", "deg", "grad", "mil")),
}
_BEHIND_A_BAR = re.compile(r"/ ?(\d+) ?(\w+)$")  # t/10 s: multiples of 10 s, or tenths of one
_SELDOM = 0.08  # times as likely as the other angles are mils, and parts of the unit that is stated
_PARTS = {"rad": ("mrad",), "deg": ("arcmin",)}
_NEVER = 1e-9  # but where a name is impossible
_CANONICAL = 0.3  # times as likely in a column of the program's own name
_MIXED, _ONE_WRONG = 0.03, 0.2  # two angles in two units, where no name states one, and where names do
_ZENITH, _ZENITH_BY_SURVEYORS, _EXCHANGED = 0.02, 0.5, 0.003
_SMALL_RAD, _SMALL = 6.284, 0.05  # azimuths that are all below a turn in rad, in another unit
STEEP_RAD, _STEEP = math.radians(60), 0.03  # few records have a median elevation above this
_LOW = 0.2  # elevations that are all below the zenith in rad, in another unit
_UPRIGHT_RAD = 1.65  # beyond any elevation
_COUNTS_ON = 0.05  # azimuths that go on beyond a turn
_OTHER_TURN = 1e-3  # azimuths that jump by the turn of another unit


class Known(NamedTuple):
    """What is known of a log before its values are read. bare_time: the times are numbers of which nothing states
    the unit. numbered: they are numbers without a date. standard: the format says what the columns are."""

    source: str
    found: Mapping[str, Column]
    station: Station
    bare_time: bool
    numbered: bool
    standard: bool = False

    @property
    def is_zenith(self) -> bool:
        stated = self.station.elevation_from
        return stated == "zenith" or (stated is None and "elevation" in self.found and self.found["elevation"].zenith)

    def is_open(self, quantity: str) -> bool:
        """Whether nothing states the unit."""
        if quantity == "time":
            return self.bare_time
        return quantity in self.found and not self.found[quantity].unit_is_stated

    def allows(self, way: Way) -> bool:
        """Whether a way agrees with all that names state."""
        each = zip(QUANTITIES, way.units, strict=True)
        stated = [(q, unit) for q, unit in each if q in self.found and not self.is_open(q)]
        open_zenith = "elevation" in self.found and self.found["elevation"].key in plausibility.SURVEYORS
        from_zero = way.zenith == self.is_zenith or (open_zenith and self.station.elevation_from is None)
        return from_zero and not way.exchanged and all(self.found[q].unit == unit for q, unit in stated)


def of_scales(log: Known, moves: bool) -> list[tuple[Unit | None, Unit | None, float]]:
    """The units of time and range, and how likely they are. moves: there is a motion, without which these are taken as
    usual."""
    times, ranges = ([*_units(log, quantity)][: None if moves else 1] for quantity in QUANTITIES[:2])
    return [(time, length, a * b) for (time, a), (length, b) in itertools.product(times, ranges)]


def of_angles(log: Known, sizes: Mapping[str, Sizes], moves: bool) -> list[tuple[Way, float]]:
    """The ways to understand the angles that their sizes allow, and how likely each is. Without a motion, bare angles
    are in one unit if they can be."""
    found = [(Way((None, None, a, e), *rest), prior) for (a, e, *rest), prior in _angles(log, sizes)]
    bare = log.is_open("azimuth") and log.is_open("elevation") and not moves
    alike = [
        (way, prior) for way, prior in found if way.units[2] and way.units[3] and way.units[2][0] == way.units[3][0]
    ]
    return alike if bare and alike else found


def _units(log: Known, quantity: str) -> Iterator[tuple[Unit | None, float]]:
    """The units that a quantity may have, that of its column or the usual one first, and how likely each is."""
    column, kind = log.found.get(quantity), quantity if quantity in ("time", "range") else "angle"
    if column is None:
        yield None, 1.0
        return
    if log.is_open(quantity):
        for name, prior in _PRIORS[kind].items():
            grad = name == "grad" and column.key in plausibility.SURVEYORS
            yield UNITS[quantity][name], _SURVEYORS_GRAD if grad else prior
        return
    yield column.unit, 1.0
    if _is_sure(column) or (quantity == "time" and not log.numbered):
        return
    if (behind := _BEHIND_A_BAR.search(column.name)) and column.unit.name == f"{behind[1]} {behind[2]}":
        inverse = column.unit.divide * float(behind[1]) ** 2
        yield Unit(f"1/{column.unit.name}", column.unit.multiply, inverse), 1.0
    prior, others = _OTHER[kind]
    if is_canonical(column):
        prior *= _CANONICAL if kind != "angle" else _NEVER
    parts = _PARTS.get(column.unit.name, ()) if kind == "angle" else ()
    for name in (*others, *parts):
        if name != column.unit.name and not (name == "grad" and column.unit.name == "gon"):
            yield UNITS[quantity][name], prior * (_SELDOM if name in ("mil", *parts) else 1.0)


def _is_sure(column: Column) -> bool:
    """Whether nothing is weighed against what a column is said to be."""
    return bool(column.unit_stated_by_user or column.notation or len(column.roles) > 1)


def is_canonical(column: Column) -> bool:
    """Whether the name is one of the program's own."""
    return column.name == CANONICAL[column.quantity]


def _angles(
    log: Known, sizes: Mapping[str, Sizes]
) -> Iterator[tuple[tuple[Unit | None, Unit | None, bool, bool], float]]:
    """Units of the angles, whether the elevation is a zenith angle and the angles exchanged; and how likely that is."""
    elevation = log.found.get("elevation")
    zeniths = [(log.is_zenith, 1.0)]
    if elevation is not None and log.station.elevation_from is None and not elevation.zenith:
        surveyors = elevation.key in plausibility.SURVEYORS
        zeniths.append((True, _ZENITH_BY_SURVEYORS if surveyors else _ZENITH))
    exchanges = [(False, 1.0)]
    both = [log.found[q] for q in QUANTITIES[2:] if q in log.found]
    if len(both) > 1 and not any(c.why == "--columns" or c.zenith or _is_sure(c) for c in both):
        exchanges.append((True, _EXCHANGED))
    each = itertools.product(_units(log, "azimuth"), _units(log, "elevation"), zeniths, exchanges)
    for (a, prior_a), (e, prior_e), (zenith, prior_z), (exchanged, prior_x) in each:
        prior = _of_both(log, (a, prior_a), (e, prior_e)) * prior_z * prior_x
        prior *= _fit(log, sizes, a, e, zenith, exchanged)
        if prior:
            yield (a, e, zenith, exchanged), prior


def _of_both(log: Known, azimuth: tuple[Unit | None, float], elevation: tuple[Unit | None, float]) -> float:
    """How likely two units are together: one instrument writes both angles alike."""
    (a, prior_a), (e, prior_e) = azimuth, elevation
    if a is None or e is None:
        return prior_a * prior_e
    alike = a.name == e.name or {a.name, e.name} == {"gon", "grad"}
    if log.is_open("azimuth") != log.is_open("elevation"):
        return prior_a * prior_e if alike else prior_a * prior_e * _MIXED
    if log.is_open("azimuth"):
        return max(prior_a, prior_e) if alike else min(prior_a, prior_e) * _MIXED
    if log.found["azimuth"].unit.name != log.found["elevation"].unit.name:
        return prior_a * prior_e
    one_wrong = log.found["azimuth"].unit.name in (a.name, e.name)
    return min(prior_a, prior_e) * (1.0 if alike else _ONE_WRONG if one_wrong else _MIXED)


def _fit(
    log: Known, sizes: Mapping[str, Sizes], azimuth: Unit | None, elevation: Unit | None, zenith: bool, exchanged: bool
) -> float:
    """0 where the angles are too large for their units; small where they are oddly small."""
    columns = ("elevation", "azimuth") if exchanged else ("azimuth", "elevation")
    found = 1.0
    for quantity, column, unit in zip(
        QUANTITIES[2:], columns, (azimuth, elevation)[:: -1 if exchanged else 1], strict=True
    ):
        mine = sizes.get(column)
        if unit is None or mine is None:
            continue
        if log.found[column].unit_stated_by_user:
            continue
        stated = not log.is_open(column) and log.found[column].unit == unit
        if not plausibility.fits(quantity, unit, mine, zenith, stated):
            return 0.0
        small = _SMALL_RAD / (1 if quantity == "azimuth" else 4)
        if unit.name != "rad" and mine.most <= small:
            found *= _SMALL if quantity == "azimuth" else _LOW
        most_rad = mine.most * unit.multiply / unit.divide
        upright = mine.rows < plausibility.FEW_ANGLES or zenith or most_rad < _UPRIGHT_RAD
        if quantity == "elevation" and not upright:
            found *= _SMALL
        half_rad = mine.half * unit.multiply / unit.divide
        if quantity == "elevation" and (math.pi / 2 - half_rad if zenith else half_rad) > STEEP_RAD:
            found *= _STEEP
        summed = "added" in log.found[column].roles
        if quantity == "azimuth" and not (stated or summed) and plausibility.counts_on(unit, mine):
            found *= _COUNTS_ON
        if quantity == "azimuth" and mine.turn and not plausibility.turns(unit, mine):
            found *= _OTHER_TURN
    return found
