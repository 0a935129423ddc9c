"""Columns by their exact names, for truths and trajectories."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ftproc.errors import InputError, nearest, row_named
from ftproc.files.layout import OUTLIER, POSITION, TRAJECTORY, VELOCITY
from ftproc.files.reading.clocks.times import seconds
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.meaning.names import Name, taken_apart
from ftproc.files.reading.meaning.numbers import Origin, finite, numbers, without_thousands
from ftproc.files.reading.meaning.questions import listed
from ftproc.files.units import Unit, unit_named
from ftproc.records import FlagArray, FloatArray

if TYPE_CHECKING:
    import pyarrow as pa

#: Columns that may be in other units, and their quantities in `units`; and how such columns are called.
_IN_UNITS = {"time_s": "time", **dict.fromkeys(POSITION, "range"), **dict.fromkeys(VELOCITY, "range_rate")}
_SUCH = {
    "time_s": ("time_ms", "time_us"),
    **{name: (f"{name[0]}_km", f"{name[0]}_ft") for name in POSITION},
    **{name: (f"{name[:2]}_kmh", f"{name[:2]}_kt") for name in VELOCITY},
}
_SPEED = re.compile(r"(v[xyz])[\s_/.,([{<]+(.*?)[)\]}>]?")  # vx_kmh, vx [km/h]


def load(
    header: TableHeader, names: Sequence[str], others: Sequence[str] = ()
) -> tuple[dict[str, FloatArray], pa.Table]:
    """Columns `names` as float64 (n,), NaN where missing, and a table of `others`.

    A time, a position or a velocity may be in another unit: `time_ms`, `x_km`, `vx_kt`. A timestamp becomes seconds as
    in a log. Raises InputError for a column that is absent or there twice, for a cell that is no finite number, and for
    a table without rows.
    """
    called = {name: _called(header, name) for name in names}
    for name in others:
        _require_once(header, name)
    position = header.names.index
    table = header.load([position(called[name].text) for name in names], [position(name) for name in others])
    if table.num_rows == 0:
        raise InputError(f"{header.source}: there are column names but no rows.")
    origins = [_origin(header, name, called[name]) for name in names]
    columns, _ = without_thousands(table.columns[: len(names)], origins)
    units = [_unit(name, called[name]) for name in names]
    found = {name: _numbers(name, *each) for name, *each in zip(names, columns, origins, units, strict=True)}
    return found, table.select(list(range(len(names), table.num_columns)))


def require_present(header: TableHeader, column: FloatArray, name: str) -> None:
    """Raise InputError for the first NaN in `column`, called `name`."""
    missing = np.isnan(column)
    if missing.any():
        raise InputError(
            f'{header.source}: {row_named(int(np.argmax(missing)))}, column "{name}": '
            "the value is missing. Fill it in or delete the row."
        )


def outlier_flags(header: TableHeader, found: Mapping[str, FloatArray], highest: int) -> FlagArray:
    """The `outlier_*` columns of `found` as (n, 3), 0 where one or a cell is missing.

    Raises InputError for a cell that is not a whole number from 0 to `highest`.
    """
    length = len(found["time_s"])
    columns = [_flags(header, found[name], name, highest) if name in found else np.zeros(length) for name in OUTLIER]
    return np.column_stack(columns).astype(np.uint8)


def _flags(header: TableHeader, column: FloatArray, name: str, highest: int) -> FloatArray:
    flags = np.nan_to_num(column)
    wrong = (flags != np.floor(flags)) | (flags < 0) | (flags > highest)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InputError(
            f'{header.source}: {row_named(row)}, column "{name}": '
            f'"{flags[row]:g}" is not a flag; expected a whole number from 0 to {highest}.'
        )
    return flags


def _called(header: TableHeader, wanted: str) -> Name:
    """The column that is called so, or that is the same time, position or velocity in another unit. Raises
    InputError."""
    stem = wanted.rpartition("_")[0]
    apart = [_apart(name) for name in header.names] if wanted not in header.names and wanted in _IN_UNITS else []
    fits = [name for name in apart if name.stem == stem and unit_named(_IN_UNITS[wanted], name.unit)]
    name = fits[0].text if len(fits) == 1 else wanted
    _require_once(header, name)
    return _apart(name)


def has_velocities(header: TableHeader) -> bool:
    """Whether a column has the name of a velocity along an axis, in whatever unit."""
    return any(_SPEED.fullmatch(name.lower()) for name in header.names)


def _apart(text: str) -> Name:
    """A name with its unit; speeds are none of a log's readings, so their units are nothing to `taken_apart`."""
    speed = _SPEED.fullmatch(text.lower())
    return Name(text, speed[1], (speed[1],), speed[2]) if speed else taken_apart(text)


def _unit(wanted: str, called: Name) -> Unit:
    quantity = _IN_UNITS.get(wanted)
    return (quantity and unit_named(quantity, called.unit)) or Unit("")


def _origin(header: TableHeader, wanted: str, called: Name) -> Origin:
    expected = "seconds or an ISO-8601 timestamp" if wanted == "time_s" else "a number"
    if wanted != called.text:
        expected = f"a number in {called.unit}"
    return Origin(header.source, called.text, expected, header.decimal_comma, cure="Correct the cell.")


def _numbers(wanted: str, column: pa.ChunkedArray, origin: Origin, unit: Unit) -> FloatArray:
    with np.errstate(over="ignore", invalid="ignore"):
        is_time = wanted == "time_s"
        values = seconds(column, origin, unit.to_si)[0] if is_time else unit.to_si(numbers(column, origin))
    return finite(values, origin)


def _require_once(header: TableHeader, name: str) -> None:
    if name not in header.names:
        free = [other for other in header.names if other not in TRAJECTORY]
        in_units = f", or to {', '.join(_SUCH[name])} if it is in such a unit" if name in _SUCH else ""
        raise InputError(
            f'{header.source}: there is no column "{name}"{nearest(name, free) or "."} '
            f"Its columns are: {listed(header.names)}. Rename the right one to {name}{in_units}."
        )
    if header.names.count(name) > 1:
        raise InputError(f'{header.source}: column "{name}" is there twice; rename or delete all but one.')
