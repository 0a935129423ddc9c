"""A number that stands in columns side by side whose names do not say so, such as degrees and minutes, or km and m: the
second begins again whenever the first steps, so that both together change more smoothly than the first."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from ftproc.errors import InputError, quoted
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.meaning import parts
from ftproc.files.reading.meaning.names import Name, taken_apart
from ftproc.files.reading.meaning.numbers import as_text, parsed
from ftproc.files.reading.meaning.schema import Column
from ftproc.files.units import Unit, unit_named
from ftproc.files.words import QUANTITIES
from ftproc.records import FloatArray

WHY = "its columns carry over into each other"
SIXTIES = (60.0, 60.0)  # minutes to a degree, seconds to a minute
_SMOOTHER = 0.3  # of the bends of the first column are left, where the second carries over into it
_MOST_OF_ONE = 0.75  # of what makes one of the first column does the second reach
_MOST = 0.5  # of the cells
_FEWEST = 2  # rows at which the first one bends


def columns(header: TableHeader, stated: Mapping[str, str]) -> dict[str, str]:
    """{quantity: its columns as `--columns` takes them}. stated: those that are known."""
    if header.is_of_a_standard:
        return {}
    apart = [taken_apart(*each) for each in zip(header.names, header.units or [""] * len(header.names), strict=True)]
    beside = {first: _beside(apart, first) for first in range(len(apart))}
    found: dict[str, tuple[int, ...]] = {}
    for quantity in QUANTITIES[1:]:
        if quantity in stated or parts.found(quantity, dict(enumerate(apart))) is not None:
            continue
        for first, others in beside.items():
            if others and quantity not in found and _may_be(quantity, apart[first]):
                bases = _bases(quantity, [apart[index] for index in (first, *others)])
                values = _values(header, (first, *others))
                alike = len(found.get("azimuth", (0,))) - 1 if quantity == "elevation" else 0
                if count := behind(values, bases, alike):
                    found[quantity] = (first, *others[:count])
    return {quantity: "+".join(str(index + 1) for index in mine) for quantity, mine in found.items()}


def _may_be(quantity: str, name: Name) -> bool:
    if name.stem[-1:] == "d" and len(name.stem) > 2:  # AzD beside AzM
        name = name._replace(stem=name.stem[:-1], words=(name.stem[:-1],))
    by_unit = quantity == "range" and unit_named("range", name.stem) is not None and not name.unit
    return bool(name.means(quantity)) or by_unit or (quantity == "elevation" and name.is_zenith())


def _bases(quantity: str, names: Sequence[Name]) -> Sequence[float]:
    """How many of the second column make one of the first, and so on; 0 where the names do not say it."""
    if quantity != "range":
        return SIXTIES
    units = [unit_named(quantity, name.unit or name.stem) or Unit("", 0.0) for name in names]
    return [
        a.multiply * b.divide / (a.divide * b.multiply) if b.multiply else 0.0 for a, b in itertools.pairwise(units)
    ]


def _beside(apart: Sequence[Name], first: int) -> tuple[int, ...]:
    """The columns behind one that may hold the rest of its number: without a name, with its name, or named a part."""
    mine, found = apart[first], list[int]()
    for index in range(first + 1, min(first + 3, len(apart))):
        name = apart[index]
        same = name.stem in ("", mine.stem) or (len(mine.stem) > 1 and name.stem[:-1] == mine.stem[:-1])
        whole = unit_named("azimuth", name.unit) if name.unit and not parts.role(name.unit) else None
        if name.foreign or whole or not (same or parts.role(name.stem)):
            break
        found.append(index)
    return tuple(found)


def _values(header: TableHeader, indices: Sequence[int]) -> list[FloatArray | None]:
    """The numbers of columns at the beginning of the file; None for text."""
    try:
        blocks = header.blocks(indices)
        table = header.load([], indices) if blocks is None else next(blocks.tables)
    except InputError:
        return [None] * len(indices)
    return [parsed(as_text(column), header.decimal_comma) for column in table.columns]


def behind(values: Sequence[FloatArray | None], bases: Sequence[float], alike: int = 0) -> int:
    """How many columns behind the first hold the rest of its number. values: of each column, None for text. bases: how
    many of the second make one of the first, and so on. alike: as many do so in the other angle, so they need not
    show it."""
    count = 0
    for (one, other), base in zip(itertools.pairwise(values), bases, strict=False):
        if one is None or other is None or base <= 1:
            break
        known = np.isfinite(one) & np.isfinite(other)
        whole, rest = np.abs(one[known]), other[known]
        if not len(whole) or (whole != np.round(whole)).any() or rest.min() < 0 or rest.max() > base:
            break
        shown = np.ptp(rest) > _MOST_OF_ONE * base and (count or _carries(whole, rest / base))
        if not shown and count >= alike:
            break
        count += 1
    return count


def refuse_others(source: str, described: Column, degrees: FloatArray, minutes: FloatArray) -> None:
    """Ask where most degrees have decimals, or most minutes are beyond 60, so that one column may be another thing,
    unless the user names both."""
    first, second, *_ = described.name.split(" + ")
    quantity = described.quantity
    part = np.count_nonzero(np.isfinite(degrees) & (degrees % 1 != 0)) > _MOST * np.count_nonzero(np.isfinite(degrees))
    beyond = np.count_nonzero((minutes < 0) | (minutes > SIXTIES[0])) > _MOST * np.count_nonzero(np.isfinite(minutes))
    if (part or beyond) and described.why != "--columns":
        why = f'"{first}" has decimals' if part else f'"{second}" is beyond 60'
        alone, both = (quoted(f"{quantity}={named}") for named in (first, f"{first}+{second}"))
        raise InputError(
            f'{source}: the names say that "{first}" and "{second}" are degrees and minutes, but {why}. Say --columns '
            f"{alone} if it is the {quantity} alone, or --columns {both}."
        )


def joined(numbers: dict[int, FloatArray]) -> dict[int, int]:
    """How many columns behind one of degrees hold minutes and seconds; its values become those of all."""
    found = {}
    for index in sorted(numbers):
        parts = [numbers.get(index + k) for k in range(3)]
        if count := behind(parts, SIXTIES) if index in numbers else 0:
            each = [numbers.pop(index + k) if k else numbers[index] for k in range(count + 1)]
            rest = sum(part / 60.0 ** (k + 1) for k, part in enumerate(each[1:]))
            numbers[index] = each[0] + np.where(np.signbit(each[0]), -1, 1) * rest
            found[index] = count
    return found


def _carries(whole: FloatArray, rest: FloatArray) -> bool:
    """Whether the rest begins again whenever the whole steps."""
    before, after = (np.abs(np.diff(values, 2)) for values in (whole, whole + rest))
    bent = before > 0
    return bool(bent.sum() >= _FEWEST and np.median(after[bent]) < _SMOOTHER * np.median(before[bent]))
