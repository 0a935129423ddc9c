"""Arrow tables out: .csv, .csv.gz, .parquet, .feather, or CSV on standard output. Same table, same bytes."""

from __future__ import annotations

import contextlib
import csv
import gzip
import io
import re
import sys
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, BinaryIO, Protocol, cast

from ftproc.errors import OutputError, UsageError
from ftproc.files import layout
from ftproc.files.layout import Target
from ftproc.files.writing import atomic

if TYPE_CHECKING:
    import pyarrow as pa

_ROWS_AT_ONCE = 65536  # of CSV text held in memory
_NUMBER = r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?"
_BEGINNING = r"^[=+\-@\t\r]"
_GZIP_LEVEL = 4  # numbers hardly get smaller above it, only slower


def kind_of(target: Target) -> str:
    """`.csv`, `.csv.gz`, `.parquet` or `.feather`; `-` is CSV. Raises OutputError for any other name."""
    kind = ".csv" if str(target) == "-" else layout.table_kind(target)
    if kind is None:
        raise OutputError(
            f"{target}: not a kind of file that can be written; end the name in {', '.join(layout.TABLES)}."
        )
    return kind


def write_table(table: pa.Table, target: Target) -> None:
    """Write `table` whole or not at all; `-` goes to standard output. Raises OutputError.

    A closed standard output raises BrokenPipeError, for the caller to judge.
    """
    kind = kind_of(target)
    if str(target) == "-":
        for piece in _csv_pieces(table):
            sys.stdout.buffer.write(piece)
        sys.stdout.buffer.flush()
        return
    with atomic.replacing(target) as stream:
        write_stream(table, stream, kind)


def write_stream(table: pa.Table, stream: BinaryIO, kind: str) -> None:
    """Write `table` to an open stream in one of the kinds of file."""
    if kind == ".parquet":
        import pyarrow.parquet as pq

        # Readings hardly repeat, so a dictionary only costs time. Of the codecs every reader has, snappy was
        # fastest.
        pq.write_table(table, stream, compression="snappy", use_dictionary=_words(table))
    elif kind == ".feather":
        import pyarrow as pa

        with pa.ipc.new_file(stream, table.schema, options=pa.ipc.IpcWriteOptions(compression="lz4")) as file:
            file.write_table(table)
    elif kind == ".csv.gz":
        # No name and no time of day inside, or the same log would never give the same bytes.
        with gzip.GzipFile("", "wb", _GZIP_LEVEL, stream, mtime=0) as packed:
            packed.writelines(_csv_pieces(table))
    else:
        stream.writelines(_csv_pieces(table))


def can_grow(kind: str) -> bool:
    """Whether `growing` writes that kind of file."""
    import pyarrow.parquet as pq

    return kind in (".csv", ".csv.gz") or (kind == ".parquet" and hasattr(pq.ParquetWriter, "add_key_value_metadata"))


class Growing(Protocol):
    """A file that is written table by table."""

    def add(self, table: pa.Table) -> None:
        """Write these rows behind the others; the columns are always the same."""

    def tell(self, metadata: Mapping[bytes, bytes]) -> None:
        """Key-value pairs for the file; CSV has no place for them."""


@contextlib.contextmanager
def growing(stream: BinaryIO, kind: str) -> Iterator[Growing]:
    """A file of numbers on an open stream; see `can_grow`."""
    if kind == ".parquet":
        parquet = _Parquet(stream)
        try:
            yield parquet
            parquet.close()
        finally:
            parquet.give_up()
    elif kind == ".csv.gz":
        with gzip.GzipFile("", "wb", _GZIP_LEVEL, stream, mtime=0) as packed:
            yield _Csv(packed)
    else:
        yield _Csv(stream)


class _Csv:
    def __init__(self, stream: BinaryIO | gzip.GzipFile) -> None:
        self.stream, self.header = stream, True

    def add(self, table: pa.Table) -> None:
        self.stream.writelines(_csv_pieces(table, self.header))
        self.header = False

    def tell(self, metadata: Mapping[bytes, bytes]) -> None:
        pass


class _Parquet:
    def __init__(self, stream: BinaryIO) -> None:
        self.stream, self.file = stream, cast(Any, None)

    def add(self, table: pa.Table) -> None:
        import pyarrow.parquet as pq

        if self.file is None:
            # Arrow's own description of the columns would hide key-value pairs that are told at the end.
            how = {"compression": "snappy", "use_dictionary": _words(table), "store_schema": False}
            self.file = pq.ParquetWriter(self.stream, table.schema, **how)
        self.file.write_table(table)

    def tell(self, metadata: Mapping[bytes, bytes]) -> None:
        self.file.add_key_value_metadata(metadata)

    def close(self) -> None:
        self.file.close()

    def give_up(self) -> None:
        """Of a file that was not closed, lest it be tried once more when nobody listens."""
        if self.file is not None and self.file.is_open:
            with contextlib.suppress(Exception):
                self.file.close()
            self.file.is_open = False


def with_extra(table: pa.Table, extra: pa.Table | None) -> pa.Table:
    """`table` with the columns of `extra` behind its own.

    Raises UsageError when a name is in both: two columns of one name cannot be told apart in a file.
    """
    if extra is None:
        return table
    for name, column in zip(extra.column_names, extra.columns, strict=True):
        if name in table.column_names:
            raise UsageError(
                f'the log\'s column "{name}" has the name of an output column; rename it, or leave --keep-columns out.'
            )
        table = table.append_column(name, column)
    return table


def _words(table: pa.Table) -> list[str]:
    import pyarrow as pa

    return [field.name for field in table.schema if not pa.types.is_floating(field.type)]


def _csv_pieces(table: pa.Table, with_header: bool = True) -> Iterator[bytes]:
    import pyarrow as pa
    import pyarrow.csv

    if with_header:
        header = io.StringIO()
        csv.writer(header, lineterminator="\n").writerow(map(no_formula, table.column_names))
        yield header.getvalue().encode()
    options = pyarrow.csv.WriteOptions(include_header=False, batch_size=_ROWS_AT_ONCE)
    for start in range(0, table.num_rows, _ROWS_AT_ONCE):
        sink = pa.BufferOutputStream()
        try:
            pyarrow.csv.write_csv(_for_csv(table.slice(start, _ROWS_AT_ONCE)), sink, options)
        except pa.ArrowException as error:  # a kept column of lists, say
            raise OutputError(f"This cannot be written as CSV ({error}); give the output the name .parquet.") from error
        yield cast(bytes, sink.getvalue().to_pybytes())


def no_formula(text: str) -> str:
    """`text` for a CSV cell: with an apostrophe before what a spreadsheet would take for a formula and run.

    That is text that begins with = + - @, a tab or a carriage return, and is no number; numbers stay numbers.
    """
    risky = re.match(_BEGINNING, text) and not re.fullmatch(_NUMBER, text, re.ASCII)
    return f"'{text}" if risky else text


def _for_csv(table: pa.Table) -> pa.Table:
    """NaN as empty cells, formulas as text."""
    import pyarrow as pa
    import pyarrow.compute as pc

    for index, field in enumerate(table.schema):
        if pa.types.is_floating(field.type):
            column = table.column(index)
            table = table.set_column(index, field.name, pc.if_else(pc.is_nan(column), None, column))
        elif pa.types.is_string(field.type) or pa.types.is_large_string(field.type):
            column = table.column(index)
            number = pc.match_substring_regex(column, rf"^{_NUMBER}$")
            risky = pc.and_not(pc.match_substring_regex(column, _BEGINNING), number)
            if pc.any(risky).as_py():
                marked = pc.binary_join_element_wise(pa.scalar("'", field.type), column, pa.scalar("", field.type))
                table = table.set_column(index, field.name, pc.if_else(risky, marked, column))
    return table
