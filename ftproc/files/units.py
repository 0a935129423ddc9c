"""Units that a log may be in, and their factors to SI (seconds, metres, radians)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from ftproc.errors import UsageError, nearest
from ftproc.records import COMPONENTS, FloatArray

#: What a log is made of, in the order of its canonical columns.
QUANTITIES = ("time", *COMPONENTS)

#: Bare names, lower case, first the full name. Names are compared without regard to case.
ALIASES: Mapping[str, tuple[str, ...]] = {
    "time": ("time", "t"),
    "range": ("range", "r"),
    "azimuth": ("azimuth", "az", "a"),
    "elevation": ("elevation", "el", "e"),
}


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
    Unit("gon", math.pi, 200.0),  # the same, as surveyors write it
    Unit("mgon", math.pi, 200e3),
    Unit("arcsec", math.pi, 648e3),
)

#: quantity -> unit name -> unit; the first of each is the SI unit.
UNITS: Mapping[str, Mapping[str, Unit]] = {
    quantity: {unit.name: unit for unit in units}
    for quantity, units in zip(QUANTITIES, (_TIMES, _LENGTHS, _ANGLES, _ANGLES), strict=True)
}

#: How words begin that a user may write instead of the unit.
_SPELT = {
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


def _nearest_unit(word: str, known: Mapping[str, Unit]) -> str:
    """As `nearest`, also for a unit that is spelt out: metres, degrees."""
    spelt = next((unit for unit, stem in _SPELT.items() if unit in known and word.lower().startswith(stem)), None)
    return nearest(spelt or word, known)


def pairs(option: str, given: str | Mapping[str, str] | None) -> dict[str, str]:
    """`"az=deg, range=km"` or a mapping -> {"azimuth": "deg", "range": "km"}, keys in full.

    Raises UsageError, naming `option`, for a part without `=`, an unknown quantity or one named twice.
    """
    if given is None:
        return {}
    items = given.items() if isinstance(given, Mapping) else _split(option, given)
    found: dict[str, str] = {}
    for key, value in items:
        quantity = _quantity(option, str(key))
        if quantity in found:
            raise UsageError(f"{option} names {quantity} twice; give it once.")
        found[quantity] = str(value).strip()
    return found


def parse_units(given: str | Mapping[str, str] | None) -> dict[str, str]:
    """The `--units` option -> {quantity: unit name}. Raises UsageError for a quantity or unit not known."""
    found = {quantity: name.lower() for quantity, name in pairs("--units", given).items()}
    for quantity, name in found.items():
        if name not in UNITS[quantity]:
            raise UsageError(
                f'--units: "{name}" is not a unit of {quantity}; understood are '
                f"{', '.join(UNITS[quantity])}{_nearest_unit(name, UNITS[quantity])}"
            )
    return found


def _split(option: str, text: str) -> list[tuple[str, str]]:
    parts = [part.partition("=") for part in text.split(",") if part.strip()]
    for key, equals, value in parts:
        if not (key.strip() and equals and value.strip()):
            example = "range=km,azimuth=deg" if option == "--units" else "time=T0,range=RNG"
            raise UsageError(f'{option}: "{key + equals + value}" is not QUANTITY=NAME, as in {example}.')
    return [(key, value) for key, _, value in parts]


def _quantity(option: str, key: str) -> str:
    wanted = key.strip().lower()
    for quantity, aliases in ALIASES.items():
        if wanted in aliases:
            return quantity
    raise UsageError(
        f'{option}: "{key.strip()}" is not a quantity of a log; expected {", ".join(QUANTITIES)}'
        f"{nearest(wanted, QUANTITIES)}"
    )
