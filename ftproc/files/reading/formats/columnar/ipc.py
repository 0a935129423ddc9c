"""Feather and Arrow, by pyarrow; messages for damaged files."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ftproc.errors import InputError, first_line
from ftproc.files.limits import Room
from ftproc.files.reading.formats import content
from ftproc.files.reading.formats.columnar import sizes
from ftproc.files.reading.formats.header import TableHeader, units_of

if TYPE_CHECKING:
    import pyarrow as pa

_ARROW_MAGIC = b"ARROW1"


def read(name: str, path: Path, room: Room) -> TableHeader:
    """A Feather file (version 2), or an Arrow file or stream. Raises InputError if it is none or damaged."""
    data = content.read(name, path)
    with _undamaged(name):
        schema, _ = _opened(data)
        for field in schema:
            _check_type(name, field)
        names = list(schema.names)
        _check_claims(data, room)

    def load(numeric: Sequence[int], others: Sequence[int]) -> pa.Table:
        import pyarrow as pa

        indices = sorted({*numeric, *others})
        some = indices if len(indices) < len(names) else []
        with _undamaged(name):
            wanted, batches = _opened(data, some)
            held = []
            for batch in batches:
                batch.validate(full=True)  # a damaged length would be read past the end of the memory
                held.append(batch)
            table = pa.Table.from_batches(held, wanted)
            room.check(sum(map(sizes.unpacked, table.columns)), table.num_rows)
            return table.select([indices.index(index) for index in (*numeric, *others)])

    return TableHeader(name, names, load, metadata=schema.metadata or {}, units=units_of(schema), form="Arrow")


@contextlib.contextmanager
def _undamaged(name: str) -> Iterator[None]:
    import pyarrow as pa

    try:
        yield
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"{name}: not a Feather file (version 2) or Arrow file, or one cut short or damaged; copy it again "
            f"({first_line(error)})."
        ) from error


def _opened(data: bytes, indices: Sequence[int] = ()) -> tuple[pa.Schema, Iterator[pa.RecordBatch]]:
    """Schema and batches of an Arrow file, or else of an Arrow stream. indices: of the columns that are read; all if
    there are none."""
    import pyarrow as pa

    options = pa.ipc.IpcReadOptions(included_fields=list(indices))
    if not data.startswith(_ARROW_MAGIC):
        stream = pa.ipc.open_stream(pa.py_buffer(data), options=options)
        return stream.schema, iter(stream)
    file = pa.ipc.open_file(pa.py_buffer(data), options=options)
    return file.schema, (file.get_batch(number) for number in range(file.num_record_batches))


def _check_claims(data: bytes, room: Room) -> None:
    """Raise InputError for a file whose messages unpack to too much; each batch is checked with the dictionaries."""
    size = rows = dictionaries = 0
    for claim in sizes.claims(data):
        size += claim.size + dictionaries
        if claim.is_dictionary:
            dictionaries += claim.size
        else:
            rows += claim.rows
        room.check(size, rows)


def _check_type(name: str, field: pa.Field) -> None:
    if not _is_understood(field.type):  # such as unions and intervals of months, on which pyarrow crashes
        raise InputError(
            f'{name}: column "{field.name}" is of type {field.type}, which is not understood; convert or delete it.'
        )


def _is_understood(kind: pa.DataType) -> bool:
    """Whether a column holds numbers, texts or times, or lists and records of them."""
    import pyarrow as pa

    t = pa.types
    if t.is_dictionary(kind):
        return _is_understood(kind.value_type)
    if t.is_nested(kind):
        return not t.is_union(kind) and all(_is_understood(kind.field(k).type) for k in range(kind.num_fields))
    known = (t.is_null, t.is_boolean, t.is_integer, t.is_floating, t.is_decimal, t.is_date, t.is_time, t.is_timestamp)
    texts = (t.is_string, t.is_large_string, t.is_binary, t.is_large_binary, t.is_fixed_size_binary)
    views = (getattr(t, name) for name in ("is_string_view", "is_binary_view") if hasattr(t, name))  # since pyarrow 16
    return any(test(kind) for test in (*known, t.is_duration, *texts, *views))
