"""HDF5 files, of which only the datasets that are needed are read, and nothing that lies in another file.

Links to other files, datasets with external storage and virtual datasets are refused by name before they are opened or
read: behind them may be any file of this machine.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ftproc.errors import InputError
from ftproc.files.limits import Room
from ftproc.files.reading.formats import content
from ftproc.files.reading.formats.arrays import saved, vectors
from ftproc.files.reading.formats.arrays.rehearsal import rehearse
from ftproc.files.reading.formats.header import TableHeader

_NAMES = ("columns", "names", "column_names", "fields")  # attributes in which those of a matrix stand
_MOST_NAMES = 64
_DEEPEST = 20  # soft links that point to each other, and groups in groups
#: What h5py raises for a link to nothing, and for a type that numpy does not know.
_UNKNOWN = (OSError, RuntimeError, ValueError, KeyError, TypeError, AttributeError)
_SLICE, _MOST_SLICE = 256, 256 << 20  # rows of texts that are read at once at least, and bytes of them at most


class Stored(NamedTuple):
    """An array that is not read yet: a dataset, a field of a compound one, or a column of a matrix.

    path: of the dataset in the file. chunk: bytes that must be unpacked at once.
    """

    path: str
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    chunk: int
    field: str = ""
    column: int | None = None


class Group(NamedTuple):
    """columns and units of a table in a group, and why some of its arrays cannot be read."""

    columns: Mapping[str, Stored]
    units: Mapping[str, str]
    elsewhere: Sequence[str] = ()


def read(name: str, path: Path, room: Room, group: str = "") -> TableHeader:
    """An .h5 file, or a .mat file of version 7.3: datasets of one length, or a compound dataset. Raises InputError."""
    if content.read(name, path, limit=3) == b"CDF":
        return saved.netcdf(name, path, room)
    try:
        import h5py
    except ImportError as error:
        raise InputError(f'{name}: reading HDF5 needs h5py: pip install "ftproc[hdf5]"; or save it as CSV.') from error

    def survey() -> dict[str, Group]:
        with h5py.File(path, "r") as file:
            return dict(_groups(file["/"], "", 0))

    rehearse(path, name, "an HDF5 file", survey)
    with content.undamaged(name, "an HDF5 file", "copy it again"):
        groups = survey()
    wanted = group.strip("/")
    title = wanted or ("" if groups[""].columns else next((key for key in groups if groups[key].columns), ""))
    foreign = groups[title].elsewhere if title in groups else ()
    foreign = foreign or (() if any(each.columns for each in groups.values()) else
                          [why for each in groups.values() for why in each.elsewhere])  # fmt: skip
    if foreign:
        raise InputError(
            f"{name}: {foreign[0]}, which is not read, because a log must lie in its own file; copy the values into it."
        )
    tables = {
        key: vectors.Table(each.columns, _reader(name, path, room, each.columns), each.units)
        for key, each in groups.items()
    }
    return vectors.chosen(room, tables, wanted, "HDF5")


def _groups(node: Any, title: str, depth: int) -> Iterator[tuple[str, Group]]:
    """Title and content of a group, of its compound datasets, and of the groups in it."""
    import h5py

    datasets: dict[str, Any] = {}
    below: list[tuple[str, Any]] = []
    elsewhere: list[str] = []
    for raw in node.id:
        key = raw.decode("utf-8", "replace")
        try:
            item = _inside(node, raw, 0)
            why = _stored_elsewhere(item) if isinstance(item, h5py.Dataset) else ""
        except _Elsewhere as error:
            why, item = str(error), None
        except _UNKNOWN:  # a link to nothing
            continue
        if why:
            elsewhere.append(f'"{title}/{key}" {why}')
        elif isinstance(item, h5py.Group):
            below.append((key, item))
        elif isinstance(item, h5py.Dataset):
            datasets[key] = item
    stored = {key: one for key, item in datasets.items() if (one := _stored(item)) is not None}
    yield title, _of_group(datasets, stored, elsewhere)
    for key, one in stored.items():
        if one.dtype.names:
            yield f"{title}/{key}".strip("/"), Group(vectors.vectors(_fields(one)), {})
    for key, group in below if depth < _DEEPEST else ():
        yield from _groups(group, f"{title}/{key}".strip("/"), depth + 1)


class _Elsewhere(Exception):
    pass


def _inside(node: Any, path: bytes, depth: int) -> Any:
    """What lies at a path, through links within the file. Raises _Elsewhere for what a link to another file is on the
    way to."""
    from h5py import h5l

    if depth > _DEEPEST:
        raise KeyError(path)
    node = node.file["/"] if path.startswith(b"/") else node
    for part in filter(None, path.split(b"/")):
        kind = node.id.links.get_info(part).type
        if kind == h5l.TYPE_EXTERNAL:
            file, _ = node.id.links.get_val(part)
            raise _Elsewhere(f"lies in another file, {file.decode('utf-8', 'replace')}")
        node = node[part] if kind != h5l.TYPE_SOFT else _inside(node, node.id.links.get_val(part), depth + 1)
    return node


def _stored_elsewhere(dataset: Any) -> str:
    """Why the values of a dataset are not in the file, or "". Nothing else of it is asked before."""
    if dataset.is_virtual:
        return "is a virtual dataset of other files"
    if dataset.external:
        return f"keeps its values in another file, {dataset.external[0][0]}"
    return ""


def _stored(dataset: Any) -> Stored | None:
    """None for a dataset without values, or of a type that numpy does not know."""
    try:
        shape, dtype, chunks = dataset.shape, dataset.dtype, dataset.chunks
    except _UNKNOWN:
        return None
    if not shape or not (dtype.names or _is_plain(dtype)):
        return None
    chunk = int(np.prod([float(side) for side in chunks or (0,)])) * dtype.itemsize
    return Stored(dataset.name, shape, dtype, chunk)


def _is_plain(dtype: np.dtype[Any]) -> bool:
    """Whether values are numbers or texts, not arrays or references."""
    import h5py

    return dtype.kind in "iufSU" or (dtype.kind == "O" and h5py.check_string_dtype(dtype) is not None)


def _fields(stored: Stored) -> Mapping[str, Stored]:
    kinds = {field: stored.dtype[field] for field in stored.dtype.names or ()}
    return {field: stored._replace(dtype=kind, field=field) for field, kind in kinds.items() if _is_plain(kind)}


def _of_group(datasets: Mapping[str, Any], stored: Mapping[str, Stored], elsewhere: Sequence[str]) -> Group:
    plain = {key: one for key, one in stored.items() if not one.dtype.names}
    columns = vectors.vectors(plain)
    if columns:
        return Group(columns, {key: _unit(datasets[key]) for key in columns}, elsewhere)
    matrices = {key: one for key, one in plain.items() if vectors.is_matrix(one)}
    if len(matrices) != 1:
        return Group({}, {}, elsewhere)
    key, one = next(iter(matrices.items()))
    count = one.shape[0] if vectors.lies(one.shape) else one.shape[1]
    names = vectors.numbered(count, _names(datasets[key]))
    return Group({name: one._replace(column=k) for k, name in enumerate(names)}, {}, elsewhere)


def _attribute(dataset: Any, key: str, most: int) -> Any:
    """The value of an attribute of at most so many elements, or None."""
    try:
        if key in dataset.attrs and np.prod([float(side) for side in dataset.attrs.get_id(key).shape or ()]) <= most:
            return dataset.attrs[key]
    except _UNKNOWN:  # of a type that numpy does not know, or damaged
        pass
    return None


def _unit(dataset: Any) -> str:
    return next((word for key in ("units", "unit") if (word := vectors.word(_attribute(dataset, key, 1)))), "")


def _names(dataset: Any) -> list[str]:
    found = next((value for key in _NAMES if (value := _attribute(dataset, key, _MOST_NAMES)) is not None), None)
    return [vectors.word(each) or str(each) for each in found] if isinstance(found, np.ndarray) and found.ndim else []


def _reader(name: str, path: Path, room: Room, columns: Mapping[str, Stored]) -> Any:
    """The function that reads some of the columns."""

    def load(names: Sequence[str]) -> Sequence[Any]:
        import h5py

        wanted = [columns[each] for each in names]
        whole = {one.path: one for one in wanted}.values()
        room.check(sum(int(np.prod([float(side) for side in one.shape])) * one.dtype.itemsize for one in whole))
        room.check(max((one.chunk for one in whole), default=0))

        def values() -> list[Any]:
            matrices: dict[str, Any] = {}
            with h5py.File(path, "r") as file:
                return [_values(file, one, room, matrices) for one in wanted]

        rehearse(path, name, "an HDF5 file", values)
        with content.undamaged(name, "an HDF5 file", "copy it again"):
            return values()

    return load


def _values(file: Any, one: Stored, room: Room, matrices: dict[str, Any]) -> Any:
    """The values of a column. matrices: those that are read already."""
    dataset = file[one.path]
    if one.column is not None:
        if one.path not in matrices:
            matrices[one.path] = dataset[()]
        matrix = matrices[one.path]
        return matrix[one.column] if vectors.lies(matrix.shape) else matrix[:, one.column]
    selected = dataset.fields(one.field) if one.field else dataset
    if one.dtype.kind != "O":
        values = np.asarray(selected[()]).reshape(-1)
        return values if one.field else vectors.unpacked(values, lambda key: _attribute(dataset, key, 1))
    return _texts(selected, one, room)


def _texts(selected: Any, one: Stored, room: Room) -> Any:
    """Texts of any length, a few at a time: many rows may share one long text."""
    axis = max(range(len(one.shape)), key=lambda k: one.shape[k])
    length, size = one.shape[axis], 0
    step = max(_SLICE, _MOST_SLICE // max(room.packed, 1))
    found: list[Any] = []
    for start in range(0, length, step):
        part_of = tuple(slice(start, start + step) if k == axis else slice(None) for k in range(len(one.shape)))
        part = np.asarray(selected[part_of], object).reshape(-1).tolist()
        size += sum(len(cell) for cell in part if isinstance(cell, bytes | str))
        room.check(size)
        found += part
    return np.array([*found, None], object)[:-1]
