"""Files of numpy and netCDF files of version 3."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ftproc.files.limits import Room
from ftproc.files.reading.formats import content
from ftproc.files.reading.formats.arrays import vectors
from ftproc.files.reading.formats.header import TableHeader


def by_numpy(name: str, path: Path, room: Room) -> TableHeader:
    """An .npy file, of a matrix or of records, or an .npz file with arrays of one length. Raises InputError."""
    content.read(name, path, limit=1)  # for its messages
    with content.undamaged(name, "a numpy file of numbers", "save it as CSV"):
        arrays = _arrays(path, room)
        tables = {"": vectors.in_memory(vectors.vectors(arrays))}
        for key, array in arrays.items():
            if array.dtype.names:
                fields = {field: array[field] for field in array.dtype.names}
                tables[key] = vectors.in_memory(vectors.vectors(fields))
            elif vectors.is_matrix(array):
                tables[key] = vectors.in_memory(vectors.columns(array))
    return vectors.chosen(room, tables, "", "numpy")


def _arrays(path: Path, room: Room) -> Mapping[str, Any]:
    if zipfile.is_zipfile(path):
        with zipfile.ZipFile(path) as archive:
            room.check(sum(member.file_size for member in archive.infolist()))
    else:
        np.load(path, mmap_mode="r")  # fails where the header claims more than the file holds
    found = np.load(path)
    if isinstance(found, np.ndarray):
        return {"": found}
    with found:
        return {key: array for key in found.files if (array := _plain(found, key)) is not None}


def _plain(found: Any, key: str) -> Any:
    """An array of an .npz file; None for one of Python's objects, which are never read."""
    try:
        return found[key]
    except ValueError as error:
        if "allow_pickle" in str(error):
            return None
        raise


def netcdf(name: str, path: Path, room: Room) -> TableHeader:
    """A netCDF file of version 3."""
    with content.undamaged(name, "a netCDF file", "copy it again"):
        columns, units = _variables(path, room)
    return vectors.chosen(room, {"": vectors.in_memory(columns, units)}, "", "netCDF")


def _variables(path: Path, room: Room) -> tuple[Mapping[str, Any], Mapping[str, str]]:
    """The vectors of a file and their units; variables may share the bytes of the file."""
    from scipy.io import netcdf_file

    with netcdf_file(path, mmap=True) as file:
        room.check(sum(each.data.nbytes for each in file.variables.values() if vectors.is_vector(each.data.shape)))
        copied = {
            key: (vectors.unpacked(np.array(each.data), vars(each).get), vectors.word(getattr(each, "units", "")))
            for key, each in file.variables.items()
            if vectors.is_vector(each.data.shape)
        }
    columns = vectors.vectors({key: values for key, (values, _) in copied.items()})
    return columns, {key: copied[key][1] for key in columns}
