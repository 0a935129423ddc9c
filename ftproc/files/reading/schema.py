"""Which column of a file is the time, the range, the azimuth and the elevation, and in what unit.

The rules, first to last:
1. a column named by `--columns`;
2. the canonical name, exactly: `time_s`, `range_m`, `azimuth_rad`, `elevation_rad`. It has priority over bare names,
   because these may be something else, such as a temperature `T` or an acceleration `A`;
3. one column by bare name (`R`, `az`: the unit of `--units`, else SI) or by bare name and unit (`az_deg`, `Az [deg]`).
Two columns that could be the same quantity are an error, not a guess.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ftproc.errors import InputError, nearest
from ftproc.files.layout import CANONICAL
from ftproc.files.options import ABSENT
from ftproc.files.units import ALIASES, NOT_UNITS, QUANTITIES, UNITS, ZENITH_NAMES, Unit, si_unit


class Column(NamedTuple):
    """The column of a quantity: its position in the file, its unit, and who stated the unit."""

    quantity: str
    position: int
    name: str
    unit: Unit
    unit_stated_by_user: bool
    unit_in_name: bool


def resolve(
    source: str, names: Sequence[str], units: Mapping[str, str], columns: Mapping[str, str]
) -> dict[str, Column]:
    """The columns of the log among `names` of file `source`: {quantity: column}, the time first.

    units, columns: as `parse_units` and `parse_columns` return them.
    Raises InputError if the time or every component is missing, if two columns fit one quantity, if a column of
    `--columns` is absent, and if a column's name and `--units` contradict each other.
    """
    found: dict[str, Column] = {}
    claimed = set(columns.values())
    for quantity in QUANTITIES:
        if columns.get(quantity) == ABSENT:
            continue
        if quantity in columns:
            column: Column | None = _named(source, names, quantity, columns[quantity], units.get(quantity))
        else:
            column = _recognised(source, names, quantity, claimed, units.get(quantity))
        if column is not None:
            found[quantity] = column
    _check_complete(source, names, found, columns)
    return found


def remarks(names: Sequence[str], found: Mapping[str, Column], timestamps: bool) -> tuple[str, ...]:
    """Remarks for the user: units that are assumed, and unused columns that may hold an absent quantity.

    timestamps: the time needs no unit.
    """
    lines = []
    assumed = [
        f'"{column.name}" in {column.unit.name}'
        for column in found.values()
        if not (column.unit_in_name or column.unit_stated_by_user or (timestamps and column.quantity == "time"))
    ]
    if assumed:
        lines.append(f"no unit is stated, so these are taken to be: {', '.join(assumed)}")
    absent = [quantity for quantity in QUANTITIES if quantity not in found]
    unused = [name for place, name in enumerate(names) if place not in {column.position for column in found.values()}]
    if absent and unused:
        lines.append(f"no column is taken for {' and '.join(absent)}; not used: {listed(unused)}")
    return tuple(lines)


def listed(names: Sequence[str]) -> str:
    """The columns of a file for a message, at most twenty of them."""
    shown = ", ".join(names[:20])
    return f"{shown} and {len(names) - 20} more" if len(names) > 20 else shown


def _named(source: str, names: Sequence[str], quantity: str, name: str, unit: str | None) -> Column:
    if name not in names:
        raise InputError(
            f'{source}: there is no column "{name}", which --columns or the station file names for {quantity}'
            f"{nearest(name, names) or '.'} Its columns are: {listed(names)}."
        )
    _refuse_twice(source, names, name)
    suffix = UNITS[quantity].get(_stem_and_suffix(name)[1])
    chosen = UNITS[quantity][unit] if unit else suffix or si_unit(quantity)
    return Column(quantity, names.index(name), name, chosen, unit is not None, suffix is not None)


def _recognised(source: str, names: Sequence[str], quantity: str, claimed: set[str], unit: str | None) -> Column | None:
    free = [name for name in names if name not in claimed]
    fits = {name: _unit_in_name(quantity, name) for name in free if _fits(quantity, name)}
    canonical = CANONICAL[quantity]
    if canonical in fits:
        fits = {name: stated for name, stated in fits.items() if stated is not None}
    if not fits:
        _refuse_unknown_unit(source, free, quantity)
        _refuse_zenith(source, free, quantity)
        return None
    if len(fits) > 1:
        raise InputError(
            f"{source}: columns {' and '.join(fits)} could each be the {quantity}. "
            f"Say which one it is with --columns {quantity}={next(iter(fits))}."
        )
    name, stated = next(iter(fits.items()))
    _refuse_twice(source, names, name)
    if stated and unit and stated.name != unit:
        raise InputError(
            f'{source}: the name of column "{name}" says {stated.name}, but --units says {quantity}={unit}. '
            f"Leave --units out for it, or insist with --columns {quantity}={name} --units {quantity}={unit}."
        )
    chosen = stated or (UNITS[quantity][unit] if unit else si_unit(quantity))
    return Column(quantity, names.index(name), name, chosen, unit is not None, stated is not None)


def _fits(quantity: str, name: str) -> bool:
    return name.lower() in ALIASES[quantity] or _unit_in_name(quantity, name) is not None


def _unit_in_name(quantity: str, name: str) -> Unit | None:
    """The unit that a name such as `az_deg` states, or None."""
    stem, suffix = _stem_and_suffix(name)
    return UNITS[quantity].get(suffix) if stem in ALIASES[quantity] else None


def _stem_and_suffix(name: str) -> tuple[str, str]:
    """`az_deg`, `Az (deg)` or `AZ [deg]` -> az and deg; a name without a unit has the suffix ""."""
    bracketed = re.fullmatch(r"(.*?)\s*[(\[]\s*(\S+?)\s*[)\]]", name)
    stem, _, suffix = (f"{bracketed[1]}_{bracketed[2]}" if bracketed else name).lower().rpartition("_")
    return (stem, suffix) if stem else (suffix, "")


def _refuse_twice(source: str, names: Sequence[str], name: str) -> None:
    if names.count(name) > 1:
        raise InputError(
            f'{source}: column "{name}" is there {names.count(name)} times; '
            f"rename or delete all but one. Its columns are: {listed(names)}."
        )


def _refuse_unknown_unit(source: str, names: Sequence[str], quantity: str) -> None:
    """A log without a range may be angles-only; one with `range_yd` is not."""
    for name in names:
        stem, suffix = _stem_and_suffix(name)
        if len(stem) > 1 and suffix and stem in ALIASES[quantity] and suffix not in NOT_UNITS:
            raise InputError(
                f'{source}: "{suffix}" in column "{name}" is not a unit of {quantity}; understood are '
                f"{', '.join(UNITS[quantity])}. Convert the column and rename it, "
                f"or say --columns {quantity}={name} --units {quantity}=UNIT{_or_absent(quantity)}."
            )


def _refuse_zenith(source: str, names: Sequence[str], quantity: str) -> None:
    """A log with zenith angles does not lack elevations."""
    for name in names:
        if quantity == "elevation" and name.lower().partition("_")[0] in ZENITH_NAMES:
            raise InputError(
                f'{source}: column "{name}" looks like a zenith angle. Say --columns elevation={name} '
                f"--elevation-from zenith{_or_absent(quantity)}."
            )


def _or_absent(quantity: str) -> str:
    return "" if quantity == "time" else f", or --columns {quantity}={ABSENT} if it is something else"


def _check_complete(source: str, names: Sequence[str], found: Mapping[str, Column], columns: Mapping[str, str]) -> None:
    if "time" in found and len(found) > 1:
        return
    if names and all(_is_number(name) for name in names):
        raise InputError(
            f"{source}: the first line holds numbers where the column names should be. "
            f"Put a header line above it, such as {','.join(CANONICAL.values())}."
        )
    wanted = "time" if "time" not in found else "range"
    what = "no time column" if wanted == "time" else "neither range nor azimuth nor elevation"
    if wanted == "range" and {"x_m", "y_m", "z_m"} <= set(names):
        what = f"x_m, y_m, z_m are columns of a truth or a trajectory, for `ftproc score`, not of a log: it has {what}"
    hint = nearest(CANONICAL[wanted], [name for name in names if name not in columns.values()]) or "."
    raise InputError(
        f"{source}: {what} (expected {CANONICAL[wanted]} or {' or '.join(ALIASES[wanted])}){hint} "
        f"Its columns are: {listed(names)}. "
        f"Name the right ones with --columns {','.join(f'{q}=NAME' for q in QUANTITIES if q not in found)}."
    )


def _is_number(name: str) -> bool:
    try:
        float(name)
    except ValueError:
        return False
    return True
