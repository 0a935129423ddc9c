"""Parquet, Feather and Arrow, by pyarrow; messages for damaged files."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ftproc.errors import InputError, first_line
from ftproc.files.reading.formats import content
from ftproc.files.reading.formats.header import Blocks, TableHeader, of_arrow

if TYPE_CHECKING:
    import pyarrow as pa

_ARROW_MAGIC = b"ARROW1"
_BATCH_ROWS = 1 << 18  # of a Parquet file that is read in blocks


def parquet(name: str, path: Path) -> TableHeader:
    """A Parquet file. Raises InputError, here or when its columns are loaded, if it is none or damaged."""
    content.read(name, path, limit=1)  # for its messages
    file = _Parquet(name, path)
    metadata = file.schema.metadata or {}
    return TableHeader(name, file.names, file.load, metadata=metadata, blocks=file.blocks, form="Parquet")


class _Parquet:
    """A Parquet file whose footer is read."""

    def __init__(self, name: str, path: Path) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        self.name, self.path = name, path
        try:
            with self._opened() as file:
                footer = pq.read_metadata(file)
            self.rows, self.schema = footer.num_rows, footer.schema.to_arrow_schema()
            self.names: list[str] = list(self.schema.names)
        except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
            raise self._damaged(error) from error

    def _opened(self) -> pa.OSFile:
        """The file, whose name need not be UTF-8."""
        import pyarrow as pa

        return pa.OSFile(os.fsencode(self.path))

    def load(self, numeric: Sequence[int], others: Sequence[int]) -> pa.Table:
        import pyarrow as pa
        import pyarrow.parquet as pq

        chosen = [self.names[position] for position in (*numeric, *others)]
        self._refuse_bomb(len(numeric))
        try:
            # Without threads: where there is no memory for them, pyarrow would wait for ever.
            with self._opened() as file:
                table = pq.ParquetFile(file, page_checksum_verification=True).read(chosen, use_threads=False)
            table.validate(full=True)  # finds text that is not UTF-8, on which later steps would fail
            self._refuse_loss(table.num_rows)
            return table.select(chosen)
        except (pa.ArrowException, OSError, KeyError, EOFError) as error:
            raise self._damaged(error) from error

    def blocks(self, numeric: Sequence[int]) -> Blocks | None:
        chosen = [self.names[position] for position in numeric]
        if 8 * self.rows * len(chosen) <= content.LARGE or len(set(self.names)) < len(self.names):
            return None
        self._refuse_bomb(len(chosen))
        return Blocks(self._batches(chosen), self.rows)

    def _batches(self, chosen: list[str]) -> Iterator[pa.Table]:
        import pyarrow as pa
        import pyarrow.parquet as pq

        rows = 0
        try:
            with self._opened() as file:
                parquet = pq.ParquetFile(file, page_checksum_verification=True)
                for batch in parquet.iter_batches(_BATCH_ROWS, columns=chosen):
                    batch.validate(full=True)
                    rows += len(batch)
                    yield pa.Table.from_batches([batch]).select(chosen)
            self._refuse_loss(rows)
        except (pa.ArrowException, OSError, KeyError, EOFError) as error:
            raise self._damaged(error) from error

    def _damaged(self, error: Exception) -> InputError:
        return InputError(
            f"{self.name}: not a Parquet file, or one cut short or damaged; copy it again ({first_line(error)})."
        )

    def _refuse_bomb(self, columns: int) -> None:
        if 8 * self.rows * columns > content.unpacked_limit(self.path.stat().st_size):
            raise InputError(
                f"{self.name}: it claims {self.rows} rows in so small a file, which no log has; write it again."
            )

    def _refuse_loss(self, rows: int) -> None:
        """A file that ends early may lack its last rows without an error from pyarrow."""
        if rows != self.rows:
            raise EOFError(f"{rows} rows where it says {self.rows}")


def feather(name: str, path: Path) -> TableHeader:
    """A Feather file (version 2), or an Arrow file or stream. Raises InputError if it is none or damaged."""
    import pyarrow as pa

    data = content.read(name, path)
    try:
        schema, read = _ipc(data)
        for field in schema:
            _check_type(name, field)
        batches: list[pa.RecordBatch] = []
        room = content.unpacked_limit(len(data))
        for batch in read:
            batches.append(batch)
            batches[-1].validate(full=True)  # a damaged length would be read past the end of the memory
            room -= batches[-1].nbytes
            if room < 0:
                raise InputError(
                    f"{name}: unpacks to more than {content.MAX_GROWTH} times its packed size; write it again."
                )
        return of_arrow(pa.Table.from_batches(batches, schema), name, "Arrow")
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"{name}: not a Feather file (version 2) or Arrow file, or one cut short or damaged; copy it again "
            f"({first_line(error)})."
        ) from error


def _ipc(data: bytes) -> tuple[pa.Schema, Iterator[pa.RecordBatch]]:
    """Schema and batches of an Arrow file, or else of an Arrow stream."""
    import pyarrow as pa

    if not data.startswith(_ARROW_MAGIC):
        stream = pa.ipc.open_stream(pa.py_buffer(data))
        return stream.schema, iter(stream)
    file = pa.ipc.open_file(pa.py_buffer(data))
    return file.schema, (file.get_batch(number) for number in range(file.num_record_batches))


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
