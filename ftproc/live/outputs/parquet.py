"""A Parquet file that is whole after each moment: rows since the last whole row group make up a last one, which is
written again with the footer until it is large enough to stay."""

from __future__ import annotations

import contextlib
import io
import os
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from ftproc.files.layout import METADATA_KEY
from ftproc.files.writing import trajectories
from ftproc.records import Trajectory

if TYPE_CHECKING:
    import pyarrow as pa

GROUP = 8192  # rows of a row group that stays
_MAGIC = b"PAR1"
_ROOM = (2, 1 << 20)  # for a row group and a footer: times its size in memory, and bytes


class GrowingParquet:
    """A file on an open stream that can be sought."""

    def __init__(self, stream: BinaryIO, known: Mapping[str, Any] | None) -> None:
        """known: of a run whose work is now done again, as `known` gave it."""
        self._stream = stream
        self._end, self._groups, self._tables = len(_MAGIC), list[Any](), list[Any]()
        self._tail = _MAGIC
        if known is None:
            stream.write(_MAGIC)
            return
        import pyarrow as pa
        import pyarrow.parquet as pq

        self._end, self._tail = known["size"], known["tail"]
        self._groups = [pq.read_metadata(pa.BufferReader(each)) for each in known["groups"]]
        self._tables = [pa.ipc.open_stream(each).read_all() for each in known["tables"]]

    def add(self, part: Trajectory) -> None:
        self._tables.append(trajectories.to_table(part).replace_schema_metadata(None))

    def show(self, metadata: Callable[[], Mapping[str, Any]]) -> None:
        """Make the file whole, with all rows so far."""
        import pyarrow as pa

        if not self._tables:
            return
        self._tables = [pa.concat_tables(self._tables).combine_chunks()]
        (table,) = self._tables
        data, group = _row_group(table, self._end)
        footer = _footer(table.schema, [*self._groups, group], metadata())
        try:
            self._end_with(data + footer)
        except OSError:
            with contextlib.suppress(OSError):  # without the rows for which there is no room
                self._end_with(_footer(table.schema, self._groups, metadata()))
            raise
        if table.num_rows >= GROUP:
            self._end, self._tail, self._tables = self._end + len(data), data[-len(_MAGIC) :], []
            self._groups.append(group)

    def _end_with(self, data: bytes) -> None:
        self._stream.seek(self._end)
        self._stream.write(data)
        self._stream.truncate(self._end + len(data))

    def known(self) -> Mapping[str, Any]:
        """All that goes on from here."""
        import pyarrow as pa

        def stream(table: pa.Table) -> bytes:
            sink = pa.BufferOutputStream()
            with pa.ipc.new_stream(sink, table.schema) as writer:
                writer.write_table(table)
            return bytes(sink.getvalue().to_pybytes())

        groups = [_MAGIC + _alone(each) for each in self._groups]
        tables = [stream(each) for each in self._tables]
        return {"size": self._end, "tail": self._tail, "groups": groups, "tables": tables}


def _writer(sink: Any, schema: pa.Schema) -> Any:
    import pyarrow as pa
    import pyarrow.parquet as pq

    texts = [field.name for field in schema if not pa.types.is_floating(field.type)]
    # With Arrow's schema in the file, readers ignore key-value pairs that are added at the end.
    return pq.ParquetWriter(sink, schema, compression="snappy", use_dictionary=texts, store_schema=False)


def _row_group(table: pa.Table, begin: int) -> tuple[bytes, Any]:
    """The bytes of a row group that begins at a place of the file, and what the footer says of it. The writer counts
    from where its file is, and begins at 0 only: so it writes into a file of holes, that is moved on in between."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    descriptor, name = tempfile.mkstemp(prefix="ftproc-")
    try:
        os.truncate(descriptor, begin + _ROOM[0] * table.nbytes + _ROOM[1])
        with pa.memory_map(name, "r+") as file:
            with _writer(file, table.schema) as writer:
                file.seek(begin)
                writer.write_table(table, row_group_size=table.num_rows)
                size = file.tell() - begin
            end = file.tell()
            file.seek(begin)
            data = file.read(end - begin)
        length = int.from_bytes(data[-8:-4], "little") + 8
        return data[:size], pq.read_metadata(pa.BufferReader(_MAGIC + data[-length:]))
    finally:
        os.close(descriptor)
        Path(name).unlink()


def _footer(schema: pa.Schema, groups: list[Any], metadata: Mapping[str, Any]) -> bytes:
    """The end of a file of these row groups."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    sink = io.BytesIO()
    with _writer(sink, schema.with_metadata({METADATA_KEY: trajectories.to_json(metadata, indent=None)})):
        pass
    found = pq.read_metadata(pa.BufferReader(sink.getvalue()))
    for each in groups:
        found.append_row_groups(each)
    return _alone(found)


def _alone(metadata: Any) -> bytes:
    """Of a footer, the bytes at the end of a file."""
    sink = io.BytesIO()
    metadata.write_metadata_file(sink)
    return sink.getvalue()[len(_MAGIC) :]
