"""HDF5 and Matlab files: arrays of one length, in the group or structure named after #."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ftproc.errors import InputError, first_line
from ftproc.files.reading.formats import content
from ftproc.files.reading.formats.header import TableHeader, of_arrow

_FEWEST = 2  # arrays that make a table


def hdf5(name: str, path: Path, group: str = "") -> TableHeader:
    """An .h5 file, or a .mat file of version 7.3: datasets of one length, or a compound dataset. Raises InputError."""
    content.read(name, path, limit=1)  # for its messages
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
        if hasattr(value, "_fieldnames"):
            tables[key] = (_vectors({field: getattr(value, field) for field in value._fieldnames}), {})
    return _chosen(name, {title: table for title, table in tables.items() if table[0]}, variable, "Matlab")


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
    return of_arrow(arrays, name, f"{kind}, {title or 'top level'}", [units.get(key, "") for key in columns])


def _arrow(values: Any) -> Any:
    import pyarrow as pa

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
    return (columns, units) if columns else None


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
