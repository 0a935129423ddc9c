"""Arrow tables out: .csv, .csv.gz, .parquet, .feather, or CSV on standard output. Same table, same bytes."""

from __future__ import annotations

import base64
import contextlib
import gzip
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, BinaryIO, Protocol, cast

from ftproc.errors import OutputError, UsageError
from ftproc.files import layout
from ftproc.files.layout import Target
from ftproc.files.writing import atomic, csvtext

if TYPE_CHECKING:
    import pyarrow as pa

_GZIP_LEVEL = 4  # higher levels only take longer: numbers get no smaller


def kind_of(target: Target) -> str:
    """`.csv`, `.csv.gz`, `.parquet` or `.feather`; `-` is CSV. Raises OutputError for any other name."""
    kind = ".csv" if str(target) == "-" else layout.table_kind(target)
    if kind is None:
        raise OutputError(
            f"{target}: not a kind of file that can be written; end the name in {', '.join(layout.TABLES)}."
        )
    return kind


def write_table(table: pa.Table, target: Target) -> None:
    """Write `table` complete or not at all; `-` goes to standard output. Raises OutputError.

    A closed standard output raises BrokenPipeError, which the caller handles.
    """
    kind = kind_of(target)
    if str(target) == "-":
        with atomic.standard_output() as stream:
            stream.writelines(csvtext.pieces(table))
        return
    with atomic.replacing(target) as stream:
        write_stream(table, stream, kind)


def write_stream(table: pa.Table, stream: BinaryIO, kind: str) -> None:
    """Write `table` to an open stream as a file of that kind."""
    if kind == ".parquet":
        import pyarrow.parquet as pq

        # A dictionary costs time, and readings rarely repeat. Snappy is the fastest codec that every reader has.
        pq.write_table(table, stream, compression="snappy", use_dictionary=_not_floating(table))
    elif kind == ".feather":
        import pyarrow as pa

        with pa.ipc.new_file(stream, table.schema, options=pa.ipc.IpcWriteOptions(compression="lz4")) as file:
            file.write_table(table)
    elif kind == ".csv.gz":
        with _gzip(stream) as packed:
            packed.writelines(csvtext.pieces(table))
    else:
        stream.writelines(csvtext.pieces(table))


def _gzip(stream: BinaryIO) -> gzip.GzipFile:
    """Without a file name and a time inside, so that the same table gives the same bytes."""
    return gzip.GzipFile("", "wb", _GZIP_LEVEL, stream, mtime=0)


def can_grow(kind: str) -> bool:
    """Whether `growing` writes that kind of file."""
    import pyarrow.parquet as pq

    return kind in (".csv", ".csv.gz") or (kind == ".parquet" and hasattr(pq.ParquetWriter, "add_key_value_metadata"))


class Growing(Protocol):
    """A file that is written table by table."""

    def append(self, table: pa.Table) -> None:
        """Append these rows; the columns are always the same."""

    def add_metadata(self, metadata: Mapping[bytes, bytes]) -> None:
        """Add key-value pairs to the file; CSV cannot hold them."""


@contextlib.contextmanager
def growing(stream: BinaryIO, kind: str) -> Iterator[Growing]:
    """A file of numbers on an open stream; see `can_grow`."""
    if kind == ".parquet":
        parquet = _Parquet(stream)
        try:
            yield parquet
            parquet.close()
        finally:
            parquet.abandon()
    elif kind == ".csv.gz":
        with _gzip(stream) as packed:
            yield _Csv(packed)
    else:
        yield _Csv(stream)


class _Csv:
    def __init__(self, stream: BinaryIO | gzip.GzipFile) -> None:
        self.stream, self.with_header = stream, True

    def append(self, table: pa.Table) -> None:
        self.stream.writelines(csvtext.pieces(table, self.with_header))
        self.with_header = False

    def add_metadata(self, metadata: Mapping[bytes, bytes]) -> None:
        pass


class _Parquet:
    def __init__(self, stream: BinaryIO) -> None:
        self.stream, self.file = stream, cast(Any, None)

    def append(self, table: pa.Table) -> None:
        import pyarrow.parquet as pq

        if self.file is None:
            # Readers take the metadata from Arrow's schema where there is one, so it is added with them at the end.
            how = {"compression": "snappy", "use_dictionary": _not_floating(table), "store_schema": False}
            self.file = pq.ParquetWriter(self.stream, table.schema, **how)
        self.file.write_table(table)

    def add_metadata(self, metadata: Mapping[bytes, bytes]) -> None:
        schema = base64.b64encode(self.file.schema.with_metadata(metadata).serialize())
        self.file.add_key_value_metadata({**metadata, b"ARROW:schema": schema})

    def close(self) -> None:
        self.file.close()

    def abandon(self) -> None:
        """Close a file that was not closed; else its destructor would try and print an error."""
        if self.file is not None and self.file.is_open:
            with contextlib.suppress(Exception):
                self.file.close()
            self.file.is_open = False


def with_extra(table: pa.Table, extra: pa.Table | None) -> pa.Table:
    """`table` followed by the columns of `extra`. Raises UsageError if both have a column of the same name."""
    import pyarrow as pa

    if extra is None:
        return table
    names = set(table.column_names)
    for name in extra.column_names:
        if name in names:
            raise UsageError(
                f'the log\'s column "{name}" has the name of an output column; rename it, or leave --keep-columns out.'
            )
    return pa.Table.from_arrays([*table.columns, *extra.columns], [*table.column_names, *extra.column_names])


def _not_floating(table: pa.Table) -> list[str]:
    import pyarrow as pa

    return [field.name for field in table.schema if not pa.types.is_floating(field.type)]
