"""Which column of a file is the time, the range, the azimuth and the elevation, and in what unit.

The rules, first to last:
1. a column named by `--columns`, by its name or its number from 1; `time=Date+Time` names several;
2. the canonical name, exactly: `time_s`, `range_m`, `azimuth_rad`, `elevation_rad`. It has priority over bare names,
   because these may be something else, such as a temperature `T` or an acceleration `A`;
3. columns that are one quantity together: date and time, GPS week and seconds, degrees, minutes and seconds;
4. one column by name (`R`, `az`: the unit of `--units`, else judged by its values) or by name and unit (`az_deg`);
5. one column by a name that other things have too (`DIST`, `V`).
Two columns that could be the same quantity are an error, not a guess.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ftproc.errors import InputError, nearest, quoted
from ftproc.files.layout import CANONICAL
from ftproc.files.options import ABSENT
from ftproc.files.reading.meaning import parts, questions, wording
from ftproc.files.reading.meaning.names import Name, taken_apart
from ftproc.files.reading.meaning.questions import Propose, answer, listed
from ftproc.files.units import Unit, si_unit, unit_named
from ftproc.files.words import ALIASES, CORRECTED, GERMAN, QUANTITIES, WEAK_ALIASES, ZENITH_ALIASES

_OF_A_TRAJECTORY = ("row", "x_m", "vx_mps", "sigma_x_m", "outlier_range", "nis")

_MOST_ALIKE = 3  # columns by a name that other things have too


class Column(NamedTuple):
    """The column (or columns) of a quantity, its unit, and who stated the unit.

    positions: in the file, one for each of `roles`: ("value",), ("date", "time"), ("deg", "min", "sec"), ...
    key: the stem of the name, by which clocks are distinguished. notation: from the name, such as `dms`. why: the
    column was taken. others: columns that could be the quantity too. zenith: the name is that of a zenith angle.
    written:
    the units in the names of several columns. fraction: the unit of a fraction of the second beside the time.
    """

    quantity: str
    positions: tuple[int, ...]
    name: str
    unit: Unit
    unit_stated_by_user: bool
    unit_in_name: bool
    roles: tuple[str, ...] = ("value",)
    key: str = ""
    notation: str = ""
    why: str = "its name"
    others: tuple[str, ...] = ()
    zenith: bool = False
    written: tuple[str, ...] = ()
    fraction: str = ""

    @property
    def position(self) -> int:
        return self.positions[0]

    @property
    def unit_is_stated(self) -> bool:
        whole = len(self.roles) > 1 and "added" not in self.roles
        return self.unit_stated_by_user or self.unit_in_name or whole


def resolve(
    source: str,
    names: Sequence[str],
    units: Mapping[str, str],
    columns: Mapping[str, str],
    unit_row: Sequence[str] = (),
    propose: Propose = questions.nothing,
) -> dict[str, Column]:
    """The columns of the log among `names` of file `source`: {quantity: column}, the time first.

    units, columns: as `parse_units` and `parse_columns` return them. unit_row: the cells under the names, if there is
    such a row. propose: of the columns that are left, for the question which is which.
    Raises InputError if the time or every component is missing, if two columns fit one quantity, if a column of
    `--columns` is absent, and if a column's name and `--units` contradict each other.
    """
    if not columns and set(_OF_A_TRAJECTORY) <= set(names):
        raise InputError(f"{source}: this is a trajectory that ftproc wrote, no log: ftproc score {source}.")
    apart = [taken_apart(name, unit) for name, unit in zip(names, unit_row or [""] * len(names), strict=True)]
    if any(name.stem in GERMAN for name in apart):  # whose Grad are degrees, unless the values say otherwise
        apart = [
            name._replace(unit="") if re.search(r"(?<![^\W_])grad *[)\]]?$", name.text, re.I) else name
            for name in apart
        ]
        apart = [name._replace(unit="nmi") if name.unit.lower() == "sm" else name for name in apart]
    table = _Table(source, names, apart, units)
    questions.refuse_side_by_side(source, apart, columns)
    found: dict[str, Column] = {}
    taken = {index for name in columns.values() if name != ABSENT for index in table.indices(name)}
    for quantity in QUANTITIES:
        if columns.get(quantity) == ABSENT:
            continue
        if quantity in columns:
            column: Column | None = _named(table, quantity, columns[quantity])
        else:
            column = _recognised(table, quantity, [k for k in range(len(names)) if k not in taken])
        if column is not None:
            found[quantity] = column
            taken |= set(column.positions)
    if not {"range", "azimuth"} & {*found, *columns}:
        questions.refuse_positions(source, apart)
    questions.check_complete(source, names, {q: column.positions for q, column in found.items()}, propose)
    absent = [q for q in QUANTITIES[2:] if q not in found and columns.get(q) != ABSENT]
    free = [k for k in range(len(names)) if k not in taken]
    proposed = propose(free, {q: column.positions for q, column in found.items()}) if absent and free else None
    if proposed and set(absent) >= set(proposed.columns):
        questions.refuse_left_out(source, names, proposed)
    free = [k for k in free if not proposed or k not in proposed.idle]
    for quantity in QUANTITIES:
        if quantity not in found and columns.get(quantity) != ABSENT:
            azimuth = found.get("azimuth") if quantity == "elevation" and "azimuth" not in columns else None
            doubtful = azimuth is not None and apart[azimuth.position].means("azimuth") == 2
            questions.refuse_alike(source, apart, free, quantity, doubtful)
    return found


def has_time(names: Sequence[str], unit_row: Sequence[str] = ()) -> bool:
    """Whether a column has a name of the time."""
    apart = [taken_apart(name, unit) for name, unit in zip(names, unit_row or [""] * len(names), strict=True)]
    return any(name.means("time") for name in apart) or parts.found("time", dict(enumerate(apart))) is not None


class _Table(NamedTuple):
    source: str
    names: Sequence[str]
    apart: Sequence[Name]
    units: Mapping[str, str]

    def indices(self, name: str) -> list[int]:
        """The positions of a column that the user names, by its name, its number, or several joined by +."""
        if name in self.names:
            return [self.names.index(name)]
        if name.isdecimal() and 1 <= int(name) <= len(self.names):
            return [int(name) - 1]
        several = [part.strip() for part in name.split("+")]
        found = [self.indices(part) for part in several] if len(several) > 1 else []
        return [index for part in found for index in part] if all(found) else []

    def column(self, quantity: str, position: int, why: str, others: Sequence[str] = ()) -> Column:
        name, unit = self.apart[position], self.units.get(quantity)
        stated = unit_named(quantity, name.unit) if name.unit else None
        chosen = (unit_named(quantity, unit) if unit else stated) or si_unit(quantity)
        if unit is None:
            questions.refuse_hours(self.source, name, quantity)
            wording.refuse_factor(self.source, name, quantity)
        return Column(
            quantity, (position,), self.names[position], chosen, unit is not None, stated is not None,
            key=wording.key_of(name.text, quantity, name.stem if name.means(quantity) != 2 else name.core()),
            notation=name.notation, why=why, others=tuple(others), zenith=quantity == "elevation" and name.is_zenith(),
        )  # fmt: skip

    def joint(self, quantity: str, roles: Mapping[str, int], why: str) -> Column:
        indices = tuple(roles.values())
        unit = self.units.get(quantity)
        chosen = (unit and unit_named(quantity, unit)) or si_unit(quantity)
        name = " + ".join(self.names[index] for index in indices)
        written = tuple(
            (parts.unit_of_day(self.apart[index]) or self.apart[index].unit)
            if role == "time"
            else self.apart[index].unit or (self.apart[index].stem if quantity == "range" else "")
            for role, index in roles.items()
        )
        time = self.apart[roles["time"]] if "time" in roles else self.apart[indices[0]]
        fraction = parts.unit_of_fraction(self.apart[roles["fraction"]]) if "fraction" in roles else ""
        return Column(
            quantity, indices, name, chosen, unit is not None, False, tuple(roles), time.stem, time.notation, why,
            zenith=quantity == "elevation" and self.apart[indices[0]].stem in ZENITH_ALIASES,
            written=written, fraction=fraction,
        )  # fmt: skip


def remarks(names: Sequence[str], found: Mapping[str, Column], timestamps: bool) -> tuple[str, ...]:
    """Remarks for the user: units that are assumed, and unused columns that may hold an absent quantity.

    timestamps: the time needs no unit.
    """
    lines = []
    assumed = [
        f'"{column.name}" in {column.unit.name}'
        for column in found.values()
        if not (column.unit_is_stated or (timestamps and column.quantity == "time"))
    ]
    if assumed:
        lines.append(f"no unit is stated, so these are taken to be: {', '.join(assumed)}")
    absent = [quantity for quantity in QUANTITIES if quantity not in found]
    used = {index for column in found.values() for index in column.positions}
    unused = [name for index, name in enumerate(names) if index not in used]
    if absent and unused:
        lines.append(f"no column is taken for {' and '.join(absent)}; not used: {listed(unused)}")
    return tuple(lines)


def _named(table: _Table, quantity: str, name: str) -> Column:
    indices = table.indices(name)
    if not indices:
        raise InputError(
            f'{table.source}: there is no column "{name}", which --columns or the station file names for {quantity}'
            f"{nearest(name, table.names) or '.'} Its columns are: {listed(table.names)}."
        )
    if len(indices) == 1:
        if not name.isdecimal():
            questions.refuse_twice(table.source, table.names, name)
        if quantity not in table.units:
            questions.refuse_unknown_unit(table.source, table.apart, indices, quantity)
            if quantity == "time" and not name.isdecimal() and questions.counts_frames(table.apart[indices[0]]):
                questions.refuse_frames(table.source, table.names, indices[0])
        return table.column(quantity, indices[0], "--columns")
    roles = parts.together(quantity, [table.apart[index] for index in indices])
    if roles is None:
        raise InputError(
            f'{table.source}: the columns "{name}" do not make up one {quantity}; understood are '
            "Date+Time, Week+Seconds, Day+Time, Hour+Minute+Second and Degrees+Minutes+Seconds."
        )
    return table.joint(quantity, {role: indices[k] for role, k in roles.items()}, "--columns")


def _is_corrected(name: Name, quantity: str) -> bool:
    """Whether a column may hold the readings of the quantity after a correction."""
    rest = name._replace(words=tuple(word for word in name.words if word not in CORRECTED))
    return quantity != "time" and len(rest.words) < len(name.words) and not name.foreign \
        and rest.core() in (*ALIASES[quantity], *WEAK_ALIASES[quantity])  # fmt: skip


def _recognised(table: _Table, quantity: str, free: Sequence[int]) -> Column | None:
    names, canonical = table.names, CANONICAL[quantity]
    free = wording.preferred(table.apart, free) if quantity == "azimuth" else free
    fits = [index for index in free if table.apart[index].means(quantity) == 1]
    if any(names[index] == canonical for index in fits):
        fits = [index for index in fits if table.apart[index].unit]
    elif (roles := parts.found(quantity, {index: table.apart[index] for index in free})) is not None:
        questions.refuse_course(table.source, table.apart, roles)
        return table.joint(quantity, roles, f"their names: {', '.join(roles)}")
    if not fits and quantity == "azimuth":
        questions.refuse_either(table.source, table.apart, free)
    fits = fits or [index for index in free if table.apart[index].means(quantity) == 2]
    if not fits:
        zenith = [index for index in free if quantity == "elevation" and table.apart[index].is_zenith()]
        if zenith:
            questions.refuse_twice(table.source, names, names[zenith[0]])
            return table.column(quantity, zenith[0], "its name, that of a zenith angle")
        questions.refuse_unknown_unit(table.source, table.apart, free, quantity)
        return None
    for index in fits:
        questions.refuse_twice(table.source, names, names[index])
    kinds = {(name.stem, name.unit, name.notation) for name in (table.apart[index] for index in fits)}
    corrected = [index for index in free if index not in fits and _is_corrected(table.apart[index], quantity)]
    if corrected:  # or what was corrected
        fits, kinds = [fits[0], *corrected], set()
    weak = all(table.apart[index].means(quantity) == 2 for index in fits)
    if weak and len(fits) > _MOST_ALIKE:  # v1, v2, v3, ...
        return None
    if len(fits) > 1 and (quantity != "time" or weak or len(kinds) < len(fits)):
        raise InputError(
            f"{table.source}: columns {' and '.join(names[index] for index in fits)} could each be the {quantity}. "
            f"Say which one it is: {' or '.join(answer(names, {quantity: index}) for index in fits[:3])}."
        )
    name, unit = table.apart[fits[0]], table.units.get(quantity)
    column = table.column(quantity, fits[0], "its name", [names[index] for index in fits[1:]])
    stated = unit_named(quantity, name.unit) if name.unit else None
    if stated and unit and stated.name != unit:
        raise InputError(
            f'{table.source}: the name of column "{column.name}" says {stated.name}, but --units says '
            f"{quantity}={unit}. Leave --units out for it, or insist with {answer(names, {quantity: fits[0]})} "
            f"--units {quoted(f'{quantity}={unit}')}."
        )
    return column
