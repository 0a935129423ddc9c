"""The names and units that logs have: quantities, their aliases, and factors to SI (seconds, metres, radians)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from ftproc.records import COMPONENTS, FloatArray

#: What a log is made of, in the order of its canonical columns.
QUANTITIES = ("time", *COMPONENTS)

#: Bare names, lower case, the full name first. Names are compared without regard to case.
ALIASES: Mapping[str, tuple[str, ...]] = {
    "time": ("time", "t"),
    "range": ("range", "r"),
    "azimuth": ("azimuth", "az", "a"),
    "elevation": ("elevation", "el", "e"),
}

#: How names of zenith angles begin, up to the first underscore; they are not elevations.
ZENITH_NAMES = ("zenith", "zen", "zd")

#: Suffixes that make a column something other than the quantity; they are not unknown units.
NOT_UNITS = frozenset(
    [
        *("rate", "dot", "sigma", "std", "err", "error", "bias", "res", "residual", "flag", "valid"),
        *("ok", "quality", "raw", "id", "status", "type", "gate", "true", "ref", "mps2"),
    ]
)


class Unit(NamedTuple):
    """SI value = value * multiply / divide. Two factors, so that milliseconds divide by an exact 1000."""

    name: str
    multiply: float = 1.0
    divide: float = 1.0

    def to_si(self, values: FloatArray) -> FloatArray:
        """`values` of any shape in this unit -> the same in s, m or rad (a new array if anything changes)."""
        if self.multiply != 1.0:
            values = values * self.multiply
        return values / self.divide if self.divide != 1.0 else values


_TIMES = (Unit("s"), Unit("ms", divide=1e3), Unit("us", divide=1e6))
_LENGTHS = (Unit("m"), Unit("km", 1e3), Unit("ft", 0.3048), Unit("nmi", 1852.0), Unit("nm", 1852.0))
_ANGLES = (
    Unit("rad"),
    Unit("deg", math.pi, 180.0),
    Unit("mrad", divide=1e3),
    Unit("mil", math.pi, 3200.0),  # 6400 to the turn
    Unit("grad", math.pi, 200.0),  # 400 to the turn
    Unit("gon", math.pi, 200.0),  # the surveyors' name of grad
    Unit("mgon", math.pi, 200e3),
    Unit("arcsec", math.pi, 648e3),
)

#: quantity -> unit name -> unit; the first of each is the SI unit.
UNITS: Mapping[str, Mapping[str, Unit]] = {
    quantity: {unit.name: unit for unit in units}
    for quantity, units in zip(QUANTITIES, (_TIMES, _LENGTHS, _ANGLES, _ANGLES), strict=True)
}

#: Unit -> how its spelt-out name begins, for "did you mean"; the first that fits counts.
SPELT_OUT: Mapping[str, str] = {
    "ms": "milli",
    "us": "micro",
    "s": "sec",
    "km": "kilo",
    "m": "met",
    "ft": "f",
    "nmi": "n",
    "rad": "radi",
    "deg": "degr",
    "mrad": "millir",
    "grad": "gradi",
    "arcsec": "arc",
}


def si_unit(quantity: str) -> Unit:
    """The SI unit of `quantity` (one of QUANTITIES)."""
    return next(iter(UNITS[quantity].values()))
