"""The options that describe the columns of a log: `--units` and `--columns`."""

from __future__ import annotations

from collections.abc import Mapping

from ftproc.errors import UsageError, nearest
from ftproc.files.units import ALIASES, QUANTITIES, SPELT_OUT, UNITS, Unit

#: `--columns range=none`: the file has no such quantity, whatever its columns are called.
ABSENT = "none"

_EXAMPLES = {"--units": "range=km,azimuth=deg", "--columns": "time=T0,range=RNG"}


def parse_units(given: str | Mapping[str, str] | None) -> dict[str, str]:
    """The `--units` option -> {quantity: unit name}. Raises UsageError for a quantity or unit not known."""
    found = {quantity: name.lower() for quantity, name in _pairs("--units", given).items()}
    for quantity, name in found.items():
        if name not in UNITS[quantity]:
            raise UsageError(
                f'--units: "{name}" is not a unit of {quantity}; understood are '
                f"{', '.join(UNITS[quantity])}{_nearest_unit(name, UNITS[quantity])}"
            )
    return found


def parse_columns(given: str | Mapping[str, str] | None) -> dict[str, str]:
    """The `--columns` option -> {quantity: column name}. Raises UsageError."""
    found = _pairs("--columns", given)
    if found.get("time") == ABSENT:
        raise UsageError("--columns: a log must have a time; name the time column.")
    seen: dict[str, str] = {}
    for quantity, name in found.items():
        if name != ABSENT and name in seen:
            raise UsageError(f'--columns: column "{name}" cannot be both {seen[name]} and {quantity}.')
        seen[name] = quantity
    return found


def _pairs(option: str, given: str | Mapping[str, str] | None) -> dict[str, str]:
    """`"az=deg, range=km"` or a mapping -> {"azimuth": "deg", "range": "km"}.

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


def _split(option: str, text: str) -> list[tuple[str, str]]:
    parts = [part.partition("=") for part in text.split(",") if part.strip()]
    for key, equals, value in parts:
        if not (key.strip() and equals and value.strip()):
            raise UsageError(f'{option}: "{key + equals + value}" is not QUANTITY=NAME, as in {_EXAMPLES[option]}.')
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


def _nearest_unit(word: str, known: Mapping[str, Unit]) -> str:
    """As `nearest`, also for a unit that is spelt out: metres, degrees."""
    spelt = next((unit for unit, stem in SPELT_OUT.items() if unit in known and word.lower().startswith(stem)), None)
    return nearest(spelt or word, known)
