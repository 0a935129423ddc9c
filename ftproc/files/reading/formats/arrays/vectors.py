"""Arrays that are the columns of a table: the vectors of the most frequent length, or the columns of a matrix."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from ftproc.errors import InputError, encodable
from ftproc.files.limits import Room
from ftproc.files.reading.formats.header import TableHeader, is_log
from ftproc.files.units import Unit, unit_named

_FEWEST = 2  # arrays that make a table
_MOST_COLUMNS = 64  # of a matrix
_KINDS = "iufSUO"  # of numpy's types: numbers and texts
_SINCE = re.compile(r"(\w+) since (\d{4}-\d{1,2}-\d{1,2})(?:[T ](\d{1,2}:\d{2}(?::\d{2}(?:\.\d+)?)?))?\D*")
_PACKING = "scale_factor", "add_offset", "_FillValue", "missing_value"
_LAST_S = 2.0**62 / 1e6  # of 64-bit microseconds


class Array(Protocol):
    """A numpy array, or one that is not read yet."""

    @property
    def shape(self) -> tuple[int, ...]: ...
    @property
    def dtype(self) -> np.dtype[Any]: ...


class Table(NamedTuple):
    """columns: by name, in order. units: of some of them. read: names -> their values."""

    columns: Mapping[str, Array]
    read: Callable[[Sequence[str]], Sequence[Any]]
    units: Mapping[str, str] = {}


def in_memory(columns: Mapping[str, Any], units: Mapping[str, str] | None = None) -> Table:
    """The table of arrays that are read."""
    return Table(columns, lambda names: [columns[name] for name in names], units or {})


def chosen(room: Room, tables: Mapping[str, Table], wanted: str, kind: str) -> TableHeader:
    """The header of the table called `wanted`, or of the one at the top (""), or of the only one. Raises InputError."""
    name = room.name
    tables = {title: table for title, table in tables.items() if table.columns}
    titles = ", ".join(title or "/" for title in tables) or "none"
    if wanted and wanted not in tables:
        raise InputError(f'{name}: there is no "{wanted}" with arrays of one length; those that have are: {titles}.')
    if not tables:
        raise InputError(
            f"{name}: it holds no two arrays of one length, which could be columns; save the vectors side by side."
        )
    logs = [title for title, table in tables.items() if is_log(list(table.columns), table.units)]
    if not wanted and len(logs) == 1:
        wanted = logs[0]
    if not wanted and len(tables) > 1 and "" not in tables:
        first = next(iter(tables))
        raise InputError(f"{name}: it holds several tables: {titles}. Name one behind #, such as {name}#{first}.")
    title = wanted if wanted in tables else ("" if "" in tables else next(iter(tables)))
    return _header(room, tables[title], f"{kind}, {title or 'top level'}")


def _header(room: Room, table: Table, form: str) -> TableHeader:
    names = list(table.columns)
    units = [table.units.get(name, "") for name in names]

    def load(numeric: Sequence[int], others: Sequence[int]) -> Any:
        import pyarrow as pa

        wanted = [*numeric, *others]
        sizes = [_size(table.columns[names[index]]) for index in wanted]
        room.check(sum(sizes), max((max(table.columns[names[index]].shape) for index in wanted), default=0))
        values = table.read([names[index] for index in wanted])
        cells = [_arrow(_dated(each, units[index])) for index, each in zip(wanted, values, strict=True)]
        return pa.Table.from_arrays(cells, names=[encodable(names[index]) for index in wanted])

    written = ["" if _since(unit) else unit for unit in units]
    return TableHeader(room.name, [encodable(name) for name in names], load, units=written, form=form)


def _size(array: Array) -> int:
    """Bytes of the values of a vector, or of a column of a matrix."""
    return max(array.shape) * max(array.dtype.itemsize, 8)


def vectors(arrays: Mapping[str, Array]) -> Mapping[str, Any]:
    """The vectors of numbers or texts of the most frequent length, if there are two."""
    found = {key: a for key, a in arrays.items() if is_vector(a.shape) and a.dtype.kind in _KINDS}
    lengths = [max(array.shape) for array in found.values()]
    if not lengths:
        return {}
    usual = max(lengths, key=lengths.count)
    found = {key: array for key, array in found.items() if max(array.shape) == usual}
    return found if len(found) >= _FEWEST else {}


def is_vector(shape: tuple[int, ...]) -> bool:
    return sum(side > 1 for side in shape) == 1 and 0 not in shape


def is_matrix(array: Array) -> bool:
    return len(array.shape) == 2 and 1 < min(array.shape) <= _MOST_COLUMNS and array.dtype.kind in "iuf"


def lies(shape: tuple[int, ...]) -> bool:
    """Whether the columns of a log are the rows of a matrix."""
    return shape[0] <= _MOST_COLUMNS < shape[1]


def columns(matrix: Any, names: Sequence[str] = ()) -> Mapping[str, Any]:
    """The columns of a matrix by these names, or else by their numbers from 1."""
    parts = matrix if lies(matrix.shape) else matrix.T
    return dict(zip(numbered(len(parts), names), parts, strict=True))


def numbered(count: int, names: Sequence[str] = ()) -> Sequence[str]:
    """The names, or numbers from 1 unless there are as many different names."""
    return names if len(set(names)) == len(names) == count else [str(k + 1) for k in range(count)]


def word(value: Any) -> str:
    """The text of an attribute; "" for what is none."""
    if isinstance(value, np.ndarray | np.generic) and value.size == 1:
        value = value.item()
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else value if isinstance(value, str) else ""


def unpacked(values: Any, attribute: Callable[[str], Any]) -> Any:
    """Numbers as the CF conventions pack them, with a factor, an offset, and a number that stands for none."""
    if values.dtype.kind not in "iuf":
        return values
    factor, offset, *empty = (_number(attribute(key)) for key in _PACKING)
    if factor is None and offset is None and not any(np.any(values == each) for each in empty if each is not None):
        return values
    found = np.asarray(values, float) * (1.0 if factor is None else factor) + (offset or 0.0)
    for each in empty:
        found[values == each] = np.nan
    return found


def _number(value: Any) -> float | None:
    """The number that an attribute is, or None."""
    value = value.item() if isinstance(value, np.ndarray | np.generic) and value.size == 1 else value
    return float(value) if isinstance(value, int | float) and np.isfinite(value) else None


def _since(unit: str) -> tuple[Unit, np.datetime64] | None:
    """Unit and start of a time such as `seconds since 2024-05-31 12:00:00` (CF conventions)."""
    found = _SINCE.fullmatch(unit.strip()) if len(unit) < 100 else None
    step = unit_named("time", found[1]) if found else None
    if found is None or step is None:
        return None
    date, clock = "-".join(f"{int(part):02d}" for part in found[2].split("-")), found[3] or "00:00"
    try:
        return step, np.datetime64(f"{date}T{'0' * (clock[1] == ':')}{clock}", "us")
    except ValueError:  # such as a month 13
        return None


def _dated(values: Any, unit: str) -> Any:
    """Moments, where the unit says so; else the values."""
    since = _since(unit)
    if since is None or values.dtype.kind not in "iuf":
        return values
    seconds = since[0].to_si(np.asarray(values, float))
    if not (np.abs(np.nan_to_num(seconds)) < _LAST_S).all():
        return values
    missing = ~np.isfinite(seconds)
    moments = since[1] + np.round(np.where(missing, 0.0, seconds) * 1e6).astype("timedelta64[us]")
    return np.where(missing, np.datetime64("NaT"), moments)


def _arrow(values: Any) -> Any:
    """An Arrow array of a vector of numbers, moments or texts."""
    import pyarrow as pa

    values = np.asarray(values).reshape(-1)
    if values.dtype.kind == "M":
        return pa.array(values, pa.timestamp("us"))
    if values.dtype.kind in "iuf":
        # longer floats than those of 64 bits are none of Arrow's
        return pa.array(values.astype(np.float64 if values.dtype.itemsize > 8 else values.dtype.newbyteorder("=")))
    if values.dtype.kind == "U":  # numpy keeps characters that are none
        values = np.where(_is_text(values), values, "?")
    return pa.array([_cell(cell) for cell in values.tolist()], pa.string())


def _is_text(values: Any) -> Any:
    """(n,) whether the characters of numpy's texts are possible ones."""
    codes = np.ascontiguousarray(values).view(np.uint32).reshape(len(values), -1)
    if values.dtype.byteorder == ">" or (values.dtype.byteorder == "=" and np.dtype(">U1") == np.dtype("U1")):
        codes = codes.byteswap()
    return (codes < 0x110000).all(axis=1)


def _cell(value: Any) -> str | None:
    if value is None or (isinstance(value, float) and np.isnan(value)):
        return None
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else encodable(str(value))
