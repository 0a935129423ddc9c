"""The options that describe what is read of a log: `--units`, `--columns`, `--widths`, `--where`, `--target`."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ftproc.errors import UsageError, nearest
from ftproc.files.units import UNITS, unit_named
from ftproc.files.words import ALIASES, FURTHER_ALIASES, QUANTITIES

#: `--columns range=none`: the file has no such quantity, whatever its columns are called.
ABSENT = "none"

_EXAMPLES = {"--units": "range=km,azimuth=deg", "--columns": "time=T0,range=RNG"}

_CONDITION = re.compile(r"\s*(.+?)\s*(<=|>=|==|!=|=|<|>)\s*(.*?)\s*")
_MOST_WIDTH = 10_000  # characters


class Condition(NamedTuple):
    """A row counts if its cell of `column` passes `test` (<, <=, =, !=, >=, >) against `value`."""

    column: str
    test: str
    value: str

    def __str__(self) -> str:
        return f"{self.column}{self.test}{self.value}"


class Extract(NamedTuple):
    """What of a file is read. widths: of the columns of a text, in characters. where: conditions on its rows. target:
    COLUMN=VALUE for one of several, or `none`: there is only one, whatever the rows suggest. signal: the strength of
    the signal too, if there is a column of it in dB."""

    widths: tuple[int, ...] = ()
    where: tuple[Condition, ...] = ()
    target: str = ""
    signal: bool = False


def parse_widths(given: str | Sequence[int] | None) -> tuple[int, ...]:
    """The `--widths` option -> the widths of the columns in characters. Raises UsageError."""
    parts = given.split(",") if isinstance(given, str) else given or ()
    try:
        widths = tuple(int(part) for part in parts)
    except (TypeError, ValueError):
        widths = (0,)
    if any(not 0 < width <= _MOST_WIDTH for width in widths):
        raise UsageError(f'--widths: "{given}" is not a list of whole numbers above zero, such as 8,10,10,8.')
    return widths


def parse_where(given: Sequence[str] | str | None) -> tuple[Condition, ...]:
    """The `--where` options -> conditions. Raises UsageError for what is not COLUMN<VALUE or the like."""
    found = []
    for text in [given] if isinstance(given, str) else given or ():
        parts = _CONDITION.fullmatch(text)
        if parts is None or not parts[3]:
            raise UsageError(f'--where: "{text}" is not a condition such as quality>=5 or mode=auto.')
        found.append(Condition(parts[1], parts[2].replace("==", "="), parts[3]))
    return tuple(found)


def parse_units(given: str | Mapping[str, str] | None) -> dict[str, str]:
    """The `--units` option -> {quantity: unit name}. Raises UsageError for a quantity or unit not known."""
    found = {}
    for quantity, word in _pairs("--units", given).items():
        unit = unit_named(quantity, word)
        if unit is None:
            raise UsageError(
                f'--units: "{word}" is not a unit of {quantity}; understood are '
                f"{', '.join(UNITS[quantity])}{nearest(word, UNITS[quantity])}"
            )
        found[quantity] = unit.name
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
    for quantity, aliases in (*ALIASES.items(), *FURTHER_ALIASES.items()):
        if wanted in (quantity, *aliases):
            return quantity
    known = (*QUANTITIES, *FURTHER_ALIASES)
    raise UsageError(
        f'{option}: "{key.strip()}" is not a quantity of a log; expected {", ".join(known)}{nearest(wanted, known)}'
    )
