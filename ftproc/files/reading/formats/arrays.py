"""HDF5, Matlab and numpy files: arrays of one length, in the group or structure named after #, or a matrix."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ftproc.errors import InputError, first_line
from ftproc.files.reading.formats import content
from ftproc.files.reading.formats.header import TableHeader, of_arrow
from ftproc.files.units import unit_named

_SINCE = re.compile(r"(\w+) since (\d{4}-\d\d-\d\d)(?:[T ](\d\d:\d\d(?::\d\d(?:\.\d+)?)?))?[ Z]*(?:UTC)?")
_FEWEST = 2  # arrays that make a table
_MOST_COLUMNS = 64  # of a matrix
_NAMES = ("columns", "names", "column_names", "fields")  # attributes in which those of a matrix stand


def hdf5(name: str, path: Path, group: str = "") -> TableHeader:
    """An .h5 file, or a .mat file of version 7.3: datasets of one length, or a compound dataset. Raises InputError."""
    if content.read(name, path, limit=3) == b"CDF":
        return _netcdf(name, path)
    try:
        import h5py
    except ImportError as error:
        raise InputError(f'{name}: reading HDF5 needs h5py: pip install "ftproc[hdf5]"; or save it as CSV.') from error
    try:
        with h5py.File(path, "r") as file:
            groups = {"/": file} | {node.name: node for node in _groups(file)}
            tables = {title.strip("/"): _of_group(node) for title, node in groups.items()}
    except (OSError, RuntimeError, ValueError, KeyError, TypeError) as error:
        reason = first_line(error)
        raise InputError(f"{name}: not an HDF5 file, or a damaged one ({reason}); copy it again.") from error
    return _chosen(name, {title: table for title, table in tables.items() if table}, group.strip("/"), "HDF5")


def _netcdf(name: str, path: Path) -> TableHeader:
    """A netCDF file of version 3."""
    from scipy.io import netcdf_file

    try:
        with netcdf_file(path, mmap=False) as file:
            found: dict[str, tuple[Any, bytes]] = {
                key: (np.array(each[:]), getattr(each, "units", b"")) for key, each in file.variables.items()
            }
    except Exception as error:  # scipy raises many kinds for damaged files
        reason = first_line(error)
        raise InputError(f"{name}: not a netCDF file, or a damaged one ({reason}); copy it again.") from error
    units = {key: unit.decode("utf-8", "replace") for key, (_, unit) in found.items()}
    columns = _vectors({key: values for key, (values, _) in found.items()})
    dated = {key: _dated(values, units[key]) for key, values in columns.items()}
    return _chosen(name, {"": (dated, units)} if dated else {}, "", "netCDF")


def matlab(name: str, path: Path, variable: str = "") -> TableHeader:
    """A .mat file: vectors of one length, or a structure of such. Raises InputError."""
    head = content.read(name, path, limit=128)
    if head.startswith(b"\x89HDF") or b"MATLAB 7.3" in head:
        return hdf5(name, path, variable)
    from scipy.io import loadmat

    try:
        found = loadmat(path, squeeze_me=True, struct_as_record=False)
    except Exception as error:  # scipy raises many kinds for damaged files
        reason = first_line(error)
        raise InputError(f"{name}: not a Matlab file, or a damaged one ({reason}); save it as CSV.") from error
    plain = {key: value for key, value in found.items() if not key.startswith("__")}
    tables: dict[str, Table] = {"": (_vectors(plain), {})}
    for key, value in plain.items():
        first = value.flat[0] if isinstance(value, np.ndarray) and value.dtype == object and value.size else value
        if hasattr(value, "_fieldnames"):
            tables[key] = (_vectors({field: getattr(value, field) for field in value._fieldnames}), {})
        elif hasattr(first, "_fieldnames"):  # an array of structures, one for each row
            fields = {field: [getattr(each, field) for each in value.flat] for field in first._fieldnames}
            tables[key] = (_vectors({field: np.array(cells) for field, cells in fields.items()}), {})
        elif isinstance(value, np.ndarray) and _is_matrix(value):
            tables[key] = (_columns(value), {})
    return _chosen(name, {title: table for title, table in tables.items() if table[0]}, variable, "Matlab")


def saved_by_numpy(name: str, path: Path) -> TableHeader:
    """An .npy file, of a matrix or of records, or an .npz file with arrays of one length. Raises InputError."""
    content.read(name, path, limit=1)  # for its messages
    try:
        found = np.load(path)
        arrays = {"": found} if isinstance(found, np.ndarray) else {key: found[key] for key in found.files}
    except Exception as error:  # numpy raises many kinds for damaged files
        reason = first_line(error)
        raise InputError(
            f"{name}: not a numpy file of numbers, or a damaged one ({reason}); save it as CSV."
        ) from error
    tables: dict[str, Table] = {"": (_vectors(arrays), {})}
    for key, array in arrays.items():
        if array.dtype.names:
            tables[key] = (_vectors({field: array[field] for field in array.dtype.names}), {})
        elif _is_matrix(array):
            tables[key] = (_columns(array), {})
    return _chosen(name, {title: table for title, table in tables.items() if table[0]}, "", "numpy")


Table = tuple[Mapping[str, Any], Mapping[str, str]]


def _chosen(name: str, tables: Mapping[str, Table | None], wanted: str, kind: str) -> TableHeader:
    import pyarrow as pa

    titles = ", ".join(title or "/" for title in tables) or "none"
    if wanted and wanted not in tables:
        raise InputError(f'{name}: there is no "{wanted}" with arrays of one length; those that have are: {titles}.')
    if not tables:
        raise InputError(f"{name}: it holds no two arrays of one length, which could be columns of a log.")
    if not wanted and len(tables) > 1 and "" not in tables:
        first = next(iter(tables))
        raise InputError(f"{name}: it holds several tables: {titles}. Name one behind #, such as {name}#{first}.")
    title = wanted or next(iter(tables))
    table = tables[title]
    assert table is not None
    columns, units = table
    arrays = pa.table({key: _arrow(values) for key, values in columns.items()})
    written = ["" if values.dtype.kind == "M" else units.get(key, "") for key, values in columns.items()]
    return of_arrow(arrays, name, f"{kind}, {title or 'top level'}", written)


def _arrow(values: Any) -> Any:
    import pyarrow as pa

    if values.dtype.kind == "M":
        return pa.array(values, pa.timestamp("us"))
    if values.dtype.kind in "SO":
        cells = [cell.decode("utf-8", "replace") if isinstance(cell, bytes) else cell for cell in values.tolist()]
        return pa.array([None if cell is None else str(cell) for cell in cells], pa.string())
    return pa.array(values.astype(values.dtype.newbyteorder("=")))


def _groups(file: Any) -> Iterator[Any]:
    import h5py

    found: list[Any] = []
    file.visititems(lambda _, node: found.append(node))
    yield from (node for node in found if isinstance(node, h5py.Group) or node.dtype.names)


def _of_group(node: Any) -> Table | None:
    """The vectors of a group, or the fields of a compound dataset; and the units in their attributes."""
    import h5py

    if isinstance(node, h5py.Dataset):
        whole = node[()]
        return _vectors({field: whole[field] for field in node.dtype.names}), {}
    datasets = {key: item for key, item in node.items() if isinstance(item, h5py.Dataset) and not item.dtype.names}
    columns = _vectors({key: np.squeeze(item[()]) for key, item in datasets.items() if _is_vector(item.shape)})
    units = {key: _unit(datasets[key]) for key in columns}
    if columns:
        return {key: _dated(values, units[key]) for key, values in columns.items()}, units
    matrices = [item for item in datasets.values() if _is_matrix(item)]
    if len(matrices) != 1:
        return None
    names = next((matrices[0].attrs[key] for key in _NAMES if key in matrices[0].attrs), ())
    return _columns(matrices[0][()], [each.decode() if isinstance(each, bytes) else str(each) for each in names]), {}


def _is_matrix(array: Any) -> bool:
    return len(array.shape) == 2 and 1 < min(array.shape) <= _MOST_COLUMNS and array.dtype.kind in "iuf"


def _columns(matrix: Any, names: Sequence[str] = ()) -> Mapping[str, Any]:
    """The columns of a matrix by these names, or else by their numbers from 1."""
    columns = matrix if matrix.shape[0] <= _MOST_COLUMNS < matrix.shape[1] else matrix.T
    names = names if len(names) == len(columns) else [str(k + 1) for k in range(len(columns))]
    return dict(zip(names, columns, strict=True))


def _dated(values: Any, unit: str) -> Any:
    """Moments, where the unit is such as `seconds since 2024-05-31 12:00:00` (CF conventions); else the values."""
    found = re.fullmatch(
        r"(\w+) since (\d{4}-\d{1,2}-\d{1,2})(?:[T ](\d{1,2}:\d{2}(?::\d{2}(?:\.\d+)?)?))?\D*", unit.strip()
    )
    step = unit_named("time", found[1]) if found else None
    if found is None or step is None:
        return values
    start = np.datetime64(f"{found[2]}T{found[3] or '00:00'}", "us")
    return start + np.round(step.to_si(np.asarray(values, float)) * 1e6).astype("timedelta64[us]")


def _is_vector(shape: tuple[int, ...]) -> bool:
    return sum(side > 1 for side in shape) == 1


def _unit(dataset: Any) -> str:
    value = dataset.attrs.get("units", dataset.attrs.get("unit", ""))
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _vectors(arrays: Mapping[str, Any]) -> Mapping[str, Any]:
    """The vectors of numbers or texts of the most frequent length, if there are two."""
    vectors = {key: np.asarray(a) for key, a in arrays.items() if np.ndim(a) == 1 and np.size(a) > 1}
    vectors = {key: array for key, array in vectors.items() if array.dtype.kind in "iufSUO"}
    lengths = [len(array) for array in vectors.values()]
    if not lengths:
        return {}
    usual = max(lengths, key=lengths.count)
    found = {key: array for key, array in vectors.items() if len(array) == usual}
    return found if len(found) >= _FEWEST else {}
