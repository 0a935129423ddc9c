"""Any source the user may name -> its column names, and on demand its columns as Arrow arrays."""

from __future__ import annotations

import gzip
import io
import shutil
import stat
import sys
import tempfile
import weakref
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from ..errors import InputError
from . import csvtext, remote

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

Source: TypeAlias = "str | Path | pa.Table | pd.DataFrame"

SUFFIXES = (".csv", ".csv.gz", ".parquet", ".feather")
_GZIP_MAGIC = b"\x1f\x8b"

#: What a packed file may grow to, lest a few bytes fill the memory: real readings shrink to a half, not to a 200th.
_MOST_GROWTH = 200
_ALWAYS_ALLOWED = 64 << 20  # bytes
#: Bytes of a CSV file, or of what is read of a Parquet file, from which on it is read in blocks ...
LARGE = 32 << 20
_HEAD, _BATCH_ROWS = 1 << 20, 1 << 18  # ... bytes that are sure to have the header; rows of a Parquet block
#: Of text on standard input, which may never end.
MOST_ON_STDIN = 4 << 30


class Blocks(NamedTuple):
    """tables: columns of a file, block by block in its order. rows: roughly how many there are in all."""

    tables: Iterator[pa.Table]
    rows: int


def _not_large(numeric: Sequence[int]) -> Blocks | None:
    return None


@dataclass(frozen=True)
class OpenTable:
    """A table of which so far only the header was looked at.

    source: what the user called it, for messages. names: its columns in file order, possibly with repeats.
    load: (numeric positions, other positions) -> table with these columns; see `CsvText.load`.
    decimal_comma: numbers may have decimal commas. metadata: key-value pairs of a Parquet file. blocks: numeric
    positions -> these columns block by block, when the file is so large that they should be read so, else None.
    """

    source: str
    names: list[str]
    load: Callable[[Sequence[int], Sequence[int]], pa.Table]
    decimal_comma: bool = False
    metadata: Mapping[bytes, bytes] = field(default_factory=dict)
    blocks: Callable[[Sequence[int]], Blocks | None] = field(default=_not_large)


def open_table(source: Source) -> OpenTable:
    """Open a .csv, .csv.gz, .parquet or .feather file, `-` (CSV on standard input, even gzipped), or a table in memory.

    A file may be named by a URI (see `remote`); then the copy that is read lasts as long as what is returned.
    Raises InputError with a plain sentence when there is no such file, it cannot be read, is damaged or
    empty.
    """
    if not isinstance(source, str | Path):
        return _in_memory(source)
    if str(source) == "-":
        return _csv("<stdin>", _stdin())
    name, path = str(source), remote.local(source)
    if path is not None:
        return _open(name, path)
    directory = tempfile.mkdtemp()
    try:
        opened = _open(name, remote.fetch(name, Path(directory)))
    except BaseException:
        shutil.rmtree(directory, ignore_errors=True)
        raise
    weakref.finalize(opened, shutil.rmtree, directory, ignore_errors=True)
    return opened


def _open(name: str, path: Path) -> OpenTable:
    kind = kind_of(path)
    if kind is None:
        raise InputError(f"{name}: this kind of file is not understood; supported are {', '.join(SUFFIXES)}.")
    if kind == ".parquet":
        _read(path, limit=1)  # the plain sentences for a file that is not there
        return _parquet(name, path)
    if kind == ".feather":
        return _feather(name, _read(path))
    if kind == ".csv" and _read(path, limit=2) != _GZIP_MAGIC and path.stat().st_size > LARGE:
        return _large_csv(name, path)
    return _csv(name, _read(path), must_be_gzip=kind == ".csv.gz")


def kind_of(path: Path) -> str | None:
    """The one of SUFFIXES that `path` ends in, whatever its case, or None."""
    return next((suffix for suffix in SUFFIXES if path.name.lower().endswith(suffix)), None)


def _read(path: Path, limit: int = -1) -> bytes:
    try:
        if not is_ordinary(path):
            raise InputError(f"{path}: not an ordinary file (a pipe or a device); give it as - on standard input.")
        with path.open("rb") as stream:
            data = stream.read(limit)
    except FileNotFoundError as error:
        raise InputError(f"{path}: there is no such file.") from error
    except IsADirectoryError as error:
        raise InputError(f"{path}: this is a directory; name a file in it.") from error
    except PermissionError as error:
        raise InputError(f"{path}: no permission to read it.") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}); check the file.") from error
    if not data:
        raise InputError(f"{path}: the file is empty; expected a header line and rows.")
    return data


def is_ordinary(path: Path) -> bool:
    """Whether it can be read to an end without waiting for anybody. A directory is left to `open`'s own complaint."""
    mode = path.stat().st_mode
    return stat.S_ISREG(mode) or stat.S_ISDIR(mode)


def _stdin() -> bytes:
    data = sys.stdin.buffer.read(MOST_ON_STDIN + 1)
    if len(data) > MOST_ON_STDIN:
        raise InputError(
            f"<stdin>: more than {MOST_ON_STDIN >> 20} MiB without an end; give a Parquet file, or split it."
        )
    return data


def most_bytes(packed: int) -> int:
    """What a file of so many packed bytes may become in memory."""
    return max(_ALWAYS_ALLOWED, _MOST_GROWTH * packed)


def _csv(name: str, data: bytes, must_be_gzip: bool = False) -> OpenTable:
    if must_be_gzip or data.startswith(_GZIP_MAGIC):
        data = _gunzip(name, data)
    text = csvtext.split(name, data)
    return OpenTable(name, text.names, text.load, decimal_comma=text.delimiter == ";")


def _large_csv(name: str, path: Path) -> OpenTable:
    """The header from the file's beginning; the rest only when it is asked for, as a whole or in blocks."""
    head = csvtext.split(name, _read(path, limit=_HEAD))

    def load(numeric: Sequence[int], others: Sequence[int]) -> pa.Table:
        return csvtext.split(name, _read(path)).load(numeric, others)

    def blocks(numeric: Sequence[int]) -> Blocks:
        size = path.stat().st_size
        rows = max(bytes(head.body).count(b"\n"), 1) * size // _HEAD
        return Blocks((text.load(numeric, ()) for text in csvtext.in_blocks(path, head)), rows)

    return OpenTable(name, head.names, load, head.delimiter == ";", blocks=blocks)


def _gunzip(name: str, data: bytes) -> bytes:
    most = most_bytes(len(data))
    try:
        text = gzip.GzipFile(fileobj=io.BytesIO(data)).read(most + 1)
    except EOFError as error:
        raise InputError(f"{name}: the gzip file is cut short; copy it again.") from error
    except (gzip.BadGzipFile, zlib.error) as error:
        raise InputError(f"{name}: not a gzip file, or a damaged one ({error}); copy it again.") from error
    if len(text) > most:
        raise InputError(
            f"{name}: unpacks to more than {_MOST_GROWTH} times its packed size, which no log does. "
            "If it is one all the same, unpack it first (gunzip)."
        )
    return text


def _parquet(name: str, path: Path) -> OpenTable:
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

    def load(numeric: Sequence[int], others: Sequence[int]) -> pa.Table:
        chosen = [schema.names[position] for position in (*numeric, *others)]
        refuse_bomb(len(numeric))
        try:
            table = pq.read_table(path, columns=chosen, partitioning=None, page_checksum_verification=True)
            table.validate(full=True)  # text that is not UTF-8 would break whoever looks at it
            return table.select(chosen)
        except (pa.ArrowException, OSError, KeyError) as error:
            raise damaged(error) from error

    try:
        described = pq.read_metadata(path)
        schema = described.schema.to_arrow_schema()
        names = list(schema.names)
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        raise damaged(error) from error

    def blocks(numeric: Sequence[int]) -> Blocks | None:
        chosen = [schema.names[position] for position in numeric]
        if 8 * described.num_rows * len(chosen) <= LARGE or len(set(schema.names)) < len(schema.names):
            return None
        refuse_bomb(len(chosen))
        return Blocks(batches(chosen), described.num_rows)

    def batches(chosen: list[str]) -> Iterator[pa.Table]:
        try:
            with pq.ParquetFile(path, page_checksum_verification=True) as file:
                for batch in file.iter_batches(_BATCH_ROWS, columns=chosen):
                    batch.validate(full=True)
                    yield pa.Table.from_batches([batch]).select(chosen)
        except (pa.ArrowException, OSError, KeyError) as error:
            raise damaged(error) from error

    return OpenTable(name, names, load, metadata=schema.metadata or {}, blocks=blocks)


def _feather(name: str, data: bytes) -> OpenTable:
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
                raise InputError(f"{name}: unpacks to more than {_MOST_GROWTH} times its packed size; write it anew.")
        return replace(_in_memory(pa.Table.from_batches(batches, reader.schema)), source=name)
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


def _in_memory(table: Any) -> OpenTable:
    import pyarrow as pa

    name = "<table>"
    if isinstance(table, pa.Table):
        return OpenTable(
            name,
            list(table.column_names),
            lambda numeric, others: table.select([*numeric, *others]),
            metadata=table.schema.metadata or {},
        )
    pandas = sys.modules.get("pandas")  # whoever has a DataFrame has imported it
    if pandas is None or not isinstance(table, pandas.DataFrame):
        raise InputError(f"{name}: expected a path, a pandas DataFrame or a pyarrow Table, not {type(table).__name__}.")
    names = [str(column) for column in table.columns]

    def load(numeric: Sequence[int], others: Sequence[int]) -> pa.Table:
        chosen = [*numeric, *others]
        arrays = [_from_pandas(table.iloc[:, position]) for position in chosen]
        return pa.Table.from_arrays(arrays, names=[names[position] for position in chosen])

    return OpenTable(name, names, load)


def _from_pandas(series: Any) -> pa.Array:
    import pyarrow as pa

    try:
        return pa.array(series, from_pandas=True)
    except (pa.ArrowException, TypeError):  # numbers and words in one column: as text, the words can be named
        missing = series.isna()
        return pa.array([None if gone else str(cell) for cell, gone in zip(series, missing, strict=True)])
