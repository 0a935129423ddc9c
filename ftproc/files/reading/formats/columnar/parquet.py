"""Parquet, by pyarrow; messages for damaged files."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ftproc.errors import InputError, first_line
from ftproc.files.limits import Room
from ftproc.files.reading.formats import content
from ftproc.files.reading.formats.arrays.rehearsal import rehearse
from ftproc.files.reading.formats.columnar import sizes
from ftproc.files.reading.formats.header import Blocks, TableHeader, is_log, of_arrow, units_of

if TYPE_CHECKING:
    import pyarrow as pa

_MOST_AT_ONCE = 64 << 20  # bytes
_BATCH_ROWS = 1 << 18  # of a Parquet file that is read in blocks


def read(name: str, path: Path, room: Room) -> TableHeader:
    """A Parquet file. Raises InputError, here or when its columns are loaded, if it is none or damaged."""
    content.read(name, path, limit=1)  # for its messages
    file = _Parquet(name, path, room)
    metadata = file.schema.metadata or {}
    plain = [field.name for field in file.schema if not sizes.is_structure(field.type)]
    if len(plain) < len(file.names) and not is_log(plain, {}):
        return of_arrow(file.load([], range(len(file.names))), name, "Parquet")
    return TableHeader(
        name, file.names, file.load, metadata=metadata, blocks=file.blocks, units=units_of(file.schema), form="Parquet"
    )


class _Part(NamedTuple):
    """Of a column. size: bytes, unpacked. has_prefixes: its texts are written by what they have in common."""

    size: int
    values: int
    has_prefixes: bool


class _Parquet:
    """A Parquet file whose footer is read."""

    def __init__(self, name: str, path: Path, room: Room) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        self.name, self.path, self.room = name, path, room
        try:
            with self._opened() as file:
                self.footer = pq.read_metadata(file)
            self.rows, self.schema = self.footer.num_rows, self.footer.schema.to_arrow_schema()
            self.names: list[str] = list(self.schema.names)
        except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
            raise self._damaged(error) from error

    def _opened(self) -> pa.OSFile:
        """The file, whose name need not be UTF-8."""
        import pyarrow as pa

        return pa.OSFile(os.fsencode(self.path))

    def load(self, numeric: Sequence[int], others: Sequence[int]) -> pa.Table:
        import pyarrow as pa

        chosen = [self.names[position] for position in (*numeric, *others)]
        longest = self._check(chosen)
        try:
            with self._opened() as file:
                table = self._at_once(file, chosen) if not longest else self._few_at_once(file, chosen, longest)
            table.validate(full=True)  # finds text that is not UTF-8, on which later steps would fail
            self._refuse_loss(table.num_rows)
            return table.select(chosen)
        except (pa.ArrowException, OSError, KeyError, EOFError) as error:
            raise self._damaged(error) from error

    def _at_once(self, file: pa.OSFile, chosen: list[str]) -> pa.Table:
        """Columns of text are read as the words and their numbers first, because many rows may share a long word."""
        import pyarrow.parquet as pq

        texts = [name for name in chosen if sizes.is_text(self.schema.field(self.names.index(name)).type)]
        parquet = pq.ParquetFile(file, read_dictionary=texts, page_checksum_verification=True)
        # Without threads: where there is no memory for them, pyarrow would wait for ever.
        table = parquet.read(chosen, use_threads=False)
        self.room.check(sum(map(sizes.unpacked, table.columns)))
        for index, name in enumerate(table.column_names):
            kind = self.schema.field(self.names.index(name)).type
            if name in texts and table.column(index).type != kind:
                table = table.set_column(index, name, table.column(index).cast(kind))
        return table

    def _few_at_once(self, file: pa.OSFile, chosen: list[str], longest: int) -> pa.Table:
        """A text that is written by what it has in common with the one before may be as long as the whole column."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        parquet = pq.ParquetFile(file, page_checksum_verification=True)
        batches, size = [], 0
        for batch in parquet.iter_batches(max(1, _MOST_AT_ONCE // longest), columns=chosen, use_threads=False):
            batches.append(batch)
            size += batch.nbytes
            self.room.check(size)
        return pa.Table.from_batches(batches, batches[0].schema if batches else self.schema)

    def blocks(self, numeric: Sequence[int]) -> Blocks | None:
        chosen = [self.names[position] for position in numeric]
        if 8 * self.rows * len(chosen) <= content.LARGE or len(set(self.names)) < len(self.names):
            return None
        self._check(chosen)
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

    def _check(self, chosen: Sequence[str]) -> int:
        """Raise InputError where the columns unpack to too much, as the footer says. Bytes of the largest part of a
        column of texts that are written by what they have in common, 0 without any."""
        groups = [self.footer.row_group(k) for k in range(self.footer.num_row_groups)]
        self.room.check(max(sum(group.total_byte_size for group in groups), 8 * self.rows * len(chosen)), self.rows)
        kinds = [self.schema.field(self.names.index(name)).type for name in chosen]
        if all(map(sizes.is_number, kinds)):
            return 0
        rehearse(self.path, self.name, "a Parquet file", lambda: self._parts(chosen))
        parts = self._parts(chosen)
        self.room.check(sum(max(part.size, 8 * part.values) for part in parts))
        return max((part.size for part in parts if part.has_prefixes), default=0)

    def _parts(self, chosen: Sequence[str]) -> list[_Part]:
        """What the footer says of each part of the columns. pyarrow ends the process where that is damaged."""
        paths = [self.footer.schema.column(k).path for k in range(self.footer.num_columns)]
        wanted = [k for k, path in enumerate(paths) if any(path == n or path.startswith(f"{n}.") for n in set(chosen))]
        groups = map(self.footer.row_group, range(self.footer.num_row_groups))
        parts = (group.column(k) for group in groups for k in wanted)
        return [_Part(p.total_uncompressed_size, p.num_values, "DELTA_BYTE_ARRAY" in p.encodings) for p in parts]

    def _refuse_loss(self, rows: int) -> None:
        """A file that ends early may lack its last rows without an error from pyarrow."""
        if rows != self.rows:
            raise EOFError(f"{rows} rows where it says {self.rows}")
