"""Parquet and Feather files -> their columns, by pyarrow; sentences for what is damaged, or no such file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ftproc.errors import InputError
from ftproc.files.reading import header
from ftproc.files.reading.header import MOST_GROWTH, Blocks, OpenTable, most_bytes, of_arrow

if TYPE_CHECKING:
    import pyarrow as pa

_BATCH_ROWS = 1 << 18  # of a Parquet file that is read in blocks


def parquet(name: str, path: Path) -> OpenTable:
    """A Parquet file. Raises InputError, here or when its columns are asked for, if it is none or damaged."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    def damaged(error: Exception) -> InputError:
        return InputError(
            f"{name}: no Parquet file, or one cut short or damaged; copy it again ({_first_line(error)})."
        )

    def refuse_bomb(columns: int) -> None:
        if 8 * described.num_rows * columns > most_bytes(path.stat().st_size):
            raise InputError(
                f"{name}: it says that it holds {described.num_rows} rows in so small a file, which no log does; "
                "write it anew."
            )

    def refuse_loss(rows: int) -> None:
        """Of a file that ends early, the last rows are merely missing."""
        if rows != described.num_rows:
            raise EOFError(f"{rows} rows where it says {described.num_rows}")

    def load(numeric: Sequence[int], others: Sequence[int]) -> pa.Table:
        chosen = [schema.names[position] for position in (*numeric, *others)]
        refuse_bomb(len(numeric))
        try:
            table = pq.read_table(path, columns=chosen, partitioning=None, page_checksum_verification=True)
            table.validate(full=True)  # text that is not UTF-8 would break whoever looks at it
            refuse_loss(table.num_rows)
            return table.select(chosen)
        except (pa.ArrowException, OSError, KeyError, EOFError) as error:
            raise damaged(error) from error

    try:
        described = pq.read_metadata(path)
        schema = described.schema.to_arrow_schema()
        names = list(schema.names)
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        raise damaged(error) from error

    def blocks(numeric: Sequence[int]) -> Blocks | None:
        chosen = [schema.names[position] for position in numeric]
        if 8 * described.num_rows * len(chosen) <= header.LARGE or len(set(schema.names)) < len(schema.names):
            return None
        refuse_bomb(len(chosen))
        return Blocks(batches(chosen), described.num_rows)

    def batches(chosen: list[str]) -> Iterator[pa.Table]:
        rows = 0
        try:
            with pq.ParquetFile(path, page_checksum_verification=True) as file:
                for batch in file.iter_batches(_BATCH_ROWS, columns=chosen):
                    batch.validate(full=True)
                    rows += len(batch)
                    yield pa.Table.from_batches([batch]).select(chosen)
            refuse_loss(rows)
        except (pa.ArrowException, OSError, KeyError, EOFError) as error:
            raise damaged(error) from error

    return OpenTable(name, names, load, metadata=schema.metadata or {}, blocks=blocks)


def feather(name: str, data: bytes) -> OpenTable:
    """A Feather file (version 2). Raises InputError if it is none or damaged."""
    import pyarrow as pa

    try:
        reader = pa.ipc.open_file(pa.py_buffer(data))
        for field in reader.schema:
            _check_kind(name, field)
        batches: list[pa.RecordBatch] = []
        room = most_bytes(len(data))
        for number in range(reader.num_record_batches):
            batches.append(reader.get_batch(number))
            batches[-1].validate(full=True)  # a damaged length would be read past the end of the memory
            room -= batches[-1].nbytes
            if room < 0:
                raise InputError(f"{name}: unpacks to more than {MOST_GROWTH} times its packed size; write it anew.")
        return of_arrow(pa.Table.from_batches(batches, reader.schema), name)
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"{name}: no Feather file (version 2), or one cut short or damaged; copy it again ({_first_line(error)})."
        ) from error


def _check_kind(name: str, field: pa.Field) -> None:
    if not _is_understood(field.type):  # such as unions and intervals of months, on which pyarrow breaks down
        raise InputError(
            f'{name}: column "{field.name}" is of the kind {field.type}, which is not understood; convert or delete it.'
        )


def _is_understood(kind: pa.DataType) -> bool:
    """Whether a column is of numbers, texts or times, or of lists and records of them."""
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


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0][:200] if str(error) else type(error).__name__
