"""What columns of Arrow unpack to, and what the messages of an Arrow file claim before they are unpacked."""

from __future__ import annotations

import contextlib
import struct
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    import pyarrow as pa

_DICTIONARY, _RECORDS = 2, 3  # kinds of messages
_SLOT = 16  # bytes of a view


class Claim(NamedTuple):
    """Of a message: bytes that its buffers unpack to, and its rows."""

    size: int
    rows: int
    is_dictionary: bool


def is_text(kind: pa.DataType) -> bool:
    import pyarrow as pa

    t = pa.types
    return bool(t.is_string(kind) or t.is_binary(kind) or t.is_large_string(kind) or t.is_large_binary(kind))


def is_structure(kind: pa.DataType) -> bool:
    import pyarrow as pa

    return bool(pa.types.is_struct(kind))


def is_number(kind: pa.DataType) -> bool:
    """Whether a value takes eight bytes at most, wherever it stands."""
    import pyarrow as pa

    t = pa.types
    tests = (t.is_integer, t.is_floating, t.is_boolean, t.is_timestamp, t.is_date, t.is_time, t.is_duration)
    return any(test(kind) for test in tests)


def unpacked(column: pa.ChunkedArray) -> int:
    """Bytes of the values of a column, of which several may share their memory."""
    return sum(_of_chunk(chunk) for chunk in column.chunks)


def _of_chunk(chunk: pa.Array) -> int:
    import pyarrow as pa
    import pyarrow.compute as pc

    if pa.types.is_dictionary(chunk.type):
        if not is_text(chunk.type.value_type):
            return int(len(chunk) * (chunk.dictionary.nbytes // max(len(chunk.dictionary), 1)))
        lengths = pc.binary_length(chunk.dictionary).cast(pa.int64())
        return int(pc.sum(lengths.take(chunk.indices)).as_py() or 0)
    if str(chunk.type) in ("string_view", "binary_view"):  # each has the length of its text first
        slots = np.frombuffer(chunk.buffers()[1], np.int32)[4 * chunk.offset :: _SLOT // 4][: len(chunk)]
        return int(slots.astype(np.int64).sum())
    return int(chunk.nbytes)


def claims(data: bytes) -> Iterator[Claim]:
    """The claims of the messages of an Arrow file or stream. A message that is damaged claims nothing: pyarrow refuses
    it."""
    for message in _messages(data):
        try:
            yield _claim(bytes(message.metadata), message.body)
        except (struct.error, IndexError):
            continue


def _messages(data: bytes) -> Iterator[pa.Message]:
    import pyarrow as pa

    damaged = (pa.ArrowException, OSError, EOFError)
    if not data.startswith(b"ARROW1"):
        with contextlib.suppress(*damaged):
            yield from pa.ipc.MessageReader.open_stream(pa.py_buffer(data))
        return
    for offset in _blocks(data):
        with contextlib.suppress(*damaged):
            yield pa.ipc.read_message(pa.BufferReader(pa.py_buffer(data).slice(offset)))


def _blocks(data: bytes) -> Iterator[int]:
    """Where the messages of a file begin, as its footer says: the dictionaries, then the batches."""
    try:
        (length,) = struct.unpack_from("<i", data, len(data) - 10)
        footer = data[len(data) - 10 - length : len(data) - 10]
        root = _root(footer)
        for field in (2, 3):
            start, count = _vector(footer, root, field)
            for entry in range(start, start + 24 * count, 24):
                (offset,) = struct.unpack_from("<q", footer, entry)
                if 0 < offset < len(data):
                    yield offset
    except (struct.error, IndexError):
        return


def _claim(metadata: bytes, body: pa.Buffer | None) -> Claim:
    """Of one message, which is a flatbuffer."""
    message = _root(metadata)
    field = _field(metadata, message, 1)
    kind = metadata[field] if field else 0
    header = _table(metadata, message, 2)
    if kind == _DICTIONARY:
        header = _table(metadata, header, 1)
    elif kind != _RECORDS:
        return Claim(0, 0, False)
    field = _field(metadata, header, 0)
    rows = struct.unpack_from("<q", metadata, field)[0] if field else 0
    start, count = _vector(metadata, header, 2)
    packed = _field(metadata, header, 3) > 0
    size = 0
    for entry in range(start, start + 16 * count, 16):
        offset, length = struct.unpack_from("<qq", metadata, entry)
        claimed = length
        if packed and body is not None and length >= 8 and 0 <= offset <= body.size - 8:
            (claimed,) = struct.unpack("<q", body.slice(offset, 8).to_pybytes())
        size += max(claimed, length, 0)
    return Claim(size, max(rows, 0), kind == _DICTIONARY)


def _root(data: bytes) -> int:
    return int(struct.unpack_from("<I", data, 0)[0])


def _field(data: bytes, table: int, number: int) -> int:
    """Where a field of a table of a flatbuffer is; 0 if it is not there."""
    vtable = table - struct.unpack_from("<i", data, table)[0]
    slot = 4 + 2 * number
    if vtable < 0 or slot + 2 > struct.unpack_from("<H", data, vtable)[0]:
        return 0
    offset = struct.unpack_from("<H", data, vtable + slot)[0]
    return int(table + offset) if offset else 0


def _table(data: bytes, table: int, number: int) -> int:
    """Where a table in a field begins."""
    field = _field(data, table, number)
    return field + int(struct.unpack_from("<I", data, field)[0]) if field else len(data)


def _vector(data: bytes, table: int, number: int) -> tuple[int, int]:
    """Where a vector in a field begins, and how many elements it has."""
    field = _field(data, table, number)
    if not field:
        return 0, 0
    start = field + struct.unpack_from("<I", data, field)[0]
    return int(start + 4), int(struct.unpack_from("<I", data, start)[0])
