"""Kinds of values in a station file: each checks a value from TOML and says what it expected."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from ftproc.errors import UsageError, nearest
from ftproc.files.options import parse_widths

#: The value as the options hold it, or a ValueError that says what was expected.
Kind = Callable[[object], Any]

_LARGEST = 2**53
UNSTATED_M = 100.0  # 1-sigma of a height for which none is stated


def number(low: float = -math.inf, high: float = math.inf) -> Kind:
    """A finite number from low to high; above zero when low is the smallest float above it."""
    if low > 0 and high == math.inf:
        expected = "a number above zero"
    elif math.isinf(low) and math.isinf(high):
        expected = "a number"
    else:
        expected = f"a number from {low:g} to {high:g}"

    def kind(value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ValueError(expected)
        try:
            found = float(value)
        except OverflowError as error:  # a whole number of more than 308 digits
            raise ValueError(expected) from error
        if not (math.isfinite(found) and low <= found <= high):
            raise ValueError(expected)
        return found

    return kind


def positive() -> Kind:
    return number(low=math.ulp(0.0))


def whole(low: int) -> Kind:
    """A whole number from low on that a float holds exactly, because TOML may write it as one."""

    def kind(value: object) -> int:
        if isinstance(value, bool) or not isinstance(value, int | float) or value % 1 != 0 or value < low:
            raise ValueError(f"a whole number from {low}")
        if value > _LARGEST:
            raise ValueError(f"a whole number from {low} to {_LARGEST}")
        return int(value)

    return kind


def words(*known: str) -> Kind:
    """One of the known words."""

    def kind(value: object) -> str:
        if value not in known:
            raise ValueError(" or ".join(f'"{word}"' for word in known))
        return str(value)

    return kind


def text(value: object) -> str:
    """Any text that is not empty."""
    if not isinstance(value, str) or not value.strip():
        raise ValueError("a text in quotes")
    return value


def widths(value: object) -> str:
    """The widths of columns, as text such as "10,12,12,12" or as a list of whole numbers."""
    expected = 'widths such as "10,12,12,12"'
    if not isinstance(value, str | list):
        raise ValueError(expected)
    try:
        return ",".join(map(str, parse_widths(value)))
    except UsageError as error:
        raise ValueError(expected) from error


def prior(value: object) -> tuple[float, float]:
    """A height in m and its 1-sigma, as text such as "0,100"; of one without a sigma 100 m."""
    parts = str(value).split(",")
    try:
        found = tuple(float(part) for part in parts)
    except ValueError:
        found = ()
    known = 0 < len(found) <= 2 and all(map(math.isfinite, found)) and not isinstance(value, bool)
    if not known or min(found[1:], default=1) <= 0:
        raise ValueError('a height in m and its sigma, such as "0,100"')
    height, sigma = (*found, UNSTATED_M)[:2]
    return height, sigma


def vector(value: object) -> tuple[float, float, float]:
    """Three finite numbers."""
    if isinstance(value, list) and len(value) == 3 and not any(isinstance(each, bool) for each in value):
        one = number()
        return one(value[0]), one(value[1]), one(value[2])
    raise ValueError("three numbers, such as [1.5, 0, 2]")


def file_name(value: object) -> str:
    """A possible name of a file."""
    if "\0" in text(value):
        raise ValueError("the name of a file, which has no NUL")
    return str(value)


def parameters(value: object) -> str:
    """Parameters of a method, NAME=VALUE,..."""
    from ftproc.errors import UsageError
    from ftproc.methods.parameters import parse

    try:
        parse([text(value)])
    except UsageError as error:
        raise ValueError('parameters of a method, such as "window=6,m=0.01"') from error
    return str(value)


def flag(value: object) -> bool:
    """true or false."""
    if not isinstance(value, bool):
        raise ValueError("true or false")
    return value


def method(value: object) -> str:
    """The name of a method."""
    from ftproc.methods import registry

    if not isinstance(value, str) or value not in registry.METHODS:
        hint = nearest(str(value), registry.METHODS)
        raise ValueError("the name of a method, see --list-methods" + hint.removesuffix("?"))
    return str(value)
