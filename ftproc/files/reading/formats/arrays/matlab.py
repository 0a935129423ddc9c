"""Matlab files: vectors of one length, structures and cells of such, arrays of structures, and matrices."""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ftproc.errors import InputError
from ftproc.files.limits import Room
from ftproc.files.reading.formats import content
from ftproc.files.reading.formats.arrays import hdf5, vectors
from ftproc.files.reading.formats.arrays.rehearsal import rehearse
from ftproc.files.reading.formats.header import TableHeader

_HEADER = 128  # bytes
_COMPRESSED, _MATRIX = 15, 14  # types of elements
_DEEPEST = 50  # structures and cells inside each other
_ELEMENT = 64  # bytes that an element takes; an array of any size has five


def read(name: str, path: Path, room: Room, variable: str = "") -> TableHeader:
    """A .mat file. variable: its name, else the top level. Raises InputError."""
    head = content.read(name, path, limit=_HEADER)
    if head.startswith(b"\x89HDF") or b"MATLAB 7.3" in head:
        return hdf5.read(name, path, room, variable)
    from scipy.io import loadmat, whosmat

    with content.undamaged(name, "a Matlab file", "save it as CSV"):
        if 0 in head[:4]:  # version 4: no header of text, but a matrix, whose type has a zero byte
            room.check(sum(8 * math.prod(shape) for _, shape, _ in whosmat(path)))
        else:
            _survey(content.read(name, path), room)
        rehearse(path, name, "a Matlab file", lambda: loadmat(path, squeeze_me=True, struct_as_record=False))
        found = loadmat(path, squeeze_me=True, struct_as_record=False)
        tables = dict(_tables("", {key: value for key, value in found.items() if not key.startswith("__")}))
    return vectors.chosen(room, tables, variable, "Matlab")


def _tables(title: str, value: Any) -> Iterator[tuple[str, vectors.Table]]:
    """Title and table of a value and of what is in it: structures, arrays of them, cells and matrices."""
    fields = _fields(value)
    if fields is not None:
        yield title, _of_fields(fields)
        parts = ((f"{title}.{name}".strip("."), each, _names_beside(fields, each)) for name, each in fields.items())
        for name, each, names in parts:
            if isinstance(each, np.ndarray) and vectors.is_matrix(each):
                yield name, vectors.in_memory(vectors.columns(each, names))
            else:
                yield from _tables(name, each)
    elif isinstance(value, np.ndarray) and value.dtype == object and value.size:
        table = _of_cells(value)
        yield title, table
        for k, each in enumerate(value.flat if not table.columns else ()):
            yield from _tables(f"{title}({k + 1})", each)


def _fields(value: Any) -> dict[str, Any] | None:
    """The fields of a structure; None of anything else."""
    if isinstance(value, dict):
        return value
    return {name: getattr(value, name) for name in value._fieldnames} if hasattr(value, "_fieldnames") else None


def _of_fields(fields: dict[str, Any]) -> vectors.Table:
    """The vectors of a structure, and the columns of a matrix that is as long as they are."""
    plain = {name: _cells(each.tolist()) if each.dtype.kind == "O" and each.ndim == 1 else each
             for name, each in fields.items() if isinstance(each, np.ndarray)}  # fmt: skip
    arrays = {name: each for name, each in plain.items() if each is not None}
    lengths = {max(each.shape) for each in arrays.values() if vectors.is_vector(each.shape)}
    wide = {name: each for name, each in arrays.items() if vectors.is_matrix(each) and max(each.shape) in lengths}
    parts = ({f"{name}.{k}": column for k, column in vectors.columns(each).items()} for name, each in wide.items())
    columns = vectors.vectors({**arrays, **{name: each for part in parts for name, each in part.items()}})
    numeric = any(each.dtype.kind in "iuf" for each in columns.values())
    return vectors.in_memory(columns if numeric else {}, _units(fields, columns))


def _units(fields: dict[str, Any], columns: Iterable[str]) -> dict[str, str]:
    """The unit of each column that a structure beside them states, `trk.units.range`."""
    stated = _fields(fields.get("units", fields.get("unit"))) or {}
    return {name: unit if isinstance(unit := stated.get(name), str) else "" for name in columns} if stated else {}


def _of_cells(cells: Any) -> vectors.Table:
    """An array of structures of single values, a row of each; cells below a row of names; or a vector in each cell."""
    rows = [_fields(each) for each in cells.flat]
    first = rows[0]
    if first is not None:
        columns = {name: _cells([(row or {}).get(name) for row in rows]) for name in first}
    elif cells.ndim == 2 and all(isinstance(name, str) for name in cells[0]):
        columns = {name: _cells(list(column[1:])) for name, column in zip(cells[0], cells.T, strict=True)}
    else:
        columns = {str(k + 1): each for k, each in enumerate(cells.flat) if isinstance(each, np.ndarray)}
        columns = columns if len({each.shape for each in columns.values()}) == 1 else {}
    return vectors.in_memory(vectors.vectors({name: each for name, each in columns.items() if each is not None}))


def _names_beside(fields: dict[str, Any], matrix: Any) -> list[str]:
    """Texts beside a matrix, as many as it has columns."""
    if not isinstance(matrix, np.ndarray) or not vectors.is_matrix(matrix):
        return []
    count = min(matrix.shape)
    found = (each for each in fields.values() if isinstance(each, np.ndarray) and each.size == count)
    return next((each.tolist() for each in found if all(isinstance(name, str) for name in each.flat)), [])


def _cells(values: list[Any]) -> Any:
    """A column of single values: numbers (NaN where there is none) or texts; None where some are arrays."""
    plain = [np.nan if each is None or (isinstance(each, np.ndarray) and not each.size) else each for each in values]
    if all(isinstance(each, int | float | np.integer | np.floating) for each in plain):
        return np.array([float(each) for each in plain])
    if all(isinstance(each, str) or each is np.nan for each in plain):
        return np.array([*(each if isinstance(each, str) else None for each in plain), None], object)[:-1]
    return None


def _survey(data: bytes, room: Room) -> None:
    """Raise InputError for arrays that unpack to too much, or lie too deep inside each other for a reader."""
    order = ">" if data[126:128] == b"MI" else "<"
    size = 0
    for element in _unpacked(data, order, room):
        size += len(element)
        for count, depth in enumerate(_depths(element, order), 1):
            room.check(size + _ELEMENT * count)
            if depth > _DEEPEST:
                raise InputError(f"{room.name}: its structures nest too deeply; save the log's vectors by themselves.")
        size += _ELEMENT * count


def _unpacked(data: bytes, order: str, room: Room) -> Iterator[bytes]:
    """The elements of a file with their types and lengths, unpacked."""
    offset = _HEADER
    while offset + 8 <= len(data):
        kind, length = struct.unpack_from(f"{order}II", data, offset)
        if kind == _COMPRESSED:
            yield zlib.decompressobj().decompress(data[offset + 8 : offset + 8 + length], room.limit + 1)
        else:
            yield data[offset : offset + 8 + length]
        offset += 8 + length


def _depths(data: bytes, order: str) -> Iterator[int]:
    """How many arrays each element of an element lies in; 0 first."""
    yield 0
    ends: list[int] = []
    offset = 0
    while offset + 8 <= len(data):
        while ends and offset >= ends[-1]:
            ends.pop()
        yield len(ends)
        kind, length = struct.unpack_from(f"{order}II", data, offset)
        if kind == _MATRIX:
            ends.append(offset + 8 + length)
        small = kind >> 16  # a small element has its length, type and data in 8 bytes
        offset += 8 if small or kind == _MATRIX else 8 + (length + 7) // 8 * 8
