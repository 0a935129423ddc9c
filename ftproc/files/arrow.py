"""numpy <-> Arrow by their buffers. pyarrow's own conversions import pandas, which takes longer than a small log."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ftproc.records import FloatArray

if TYPE_CHECKING:
    import pyarrow as pa


def to_numpy(column: pa.ChunkedArray) -> FloatArray:
    """(n,) float64 of a float64 column, NaN where missing; shares the memory of one chunk without missing values."""
    parts = [_chunk(chunk) for chunk in column.chunks if len(chunk)]
    if len(parts) == 1:
        return parts[0]
    return np.concatenate(parts) if parts else np.empty(0)


def to_numbers(column: pa.ChunkedArray) -> NDArray[Any] | None:
    """(n,) float64 or int64 of a column of numbers, NaN where missing; None of another one, or of missing integers."""
    import pyarrow as pa

    if pa.types.is_float64(column.type):
        return to_numpy(column)
    whole = pa.types.is_integer(column.type) and not column.null_count
    return np.array(column.to_pylist(), np.int64) if whole else None


def _chunk(chunk: pa.Array) -> FloatArray:
    validity, data = chunk.buffers()
    rows = slice(chunk.offset, chunk.offset + len(chunk))
    values: FloatArray = np.frombuffer(data, np.float64, len(chunk), 8 * chunk.offset)  # the buffer may be longer
    if not chunk.null_count:
        return values
    present = np.unpackbits(np.frombuffer(validity, np.uint8), bitorder="little")[rows]
    return np.where(present == 1, values, np.nan)


def nan_as_missing(column: pa.ChunkedArray) -> pa.ChunkedArray:
    """A float64 column with NaN as missing."""
    import pyarrow as pa

    values = to_numpy(column)
    present = np.packbits(~np.isnan(values), bitorder="little")
    buffers = [pa.py_buffer(present), pa.py_buffer(np.ascontiguousarray(values))]
    return pa.chunked_array([pa.Array.from_buffers(pa.float64(), len(values), buffers)])


def _from_numpy(values: NDArray[Any]) -> pa.Array:
    """An Arrow array over the memory of a (n,) array of float64, int64 or uint8; or the same of bool or text."""
    import pyarrow as pa

    if values.dtype.kind == "U":
        cells = [cell.encode() for cell in values.tolist()]
        ends = np.cumsum([0, *map(len, cells)]).astype(np.int32)
        return pa.StringArray.from_buffers(len(cells), pa.py_buffer(ends), pa.py_buffer(b"".join(cells)))
    if values.dtype.kind == "b":
        bits = pa.py_buffer(np.packbits(values, bitorder="little"))
        return pa.Array.from_buffers(pa.bool_(), len(values), [None, bits])
    kinds = {"f8": pa.float64(), "i8": pa.int64(), "u1": pa.uint8()}
    plain = np.ascontiguousarray(values)
    return pa.Array.from_buffers(kinds[plain.dtype.str[1:]], len(plain), [None, pa.py_buffer(plain)])


def as_text(values: FloatArray) -> list[str]:
    """Numbers (n,) as a CSV file has them, nothing for NaN."""
    import pyarrow as pa

    missing = np.isnan(values).tolist()
    cells = _from_numpy(values).cast(pa.string()).to_pylist()
    return ["" if none else cell for cell, none in zip(cells, missing, strict=True)]


def table(columns: Mapping[str, NDArray[Any]]) -> pa.Table:
    """A table of named (n,) arrays."""
    import pyarrow as pa

    return pa.Table.from_arrays([_from_numpy(values) for values in columns.values()], names=list(columns))
