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
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from ftproc.errors import InputError
from ftproc.files import layout, remote
from ftproc.files.reading import columnar, csvtext, header
from ftproc.files.reading.header import MOST_GROWTH, Blocks, OpenTable, most_bytes, of_arrow

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

Source: TypeAlias = "str | Path | pa.Table | pd.DataFrame"

_GZIP_MAGIC = b"\x1f\x8b"

_HEAD = 1 << 20  # bytes of a large CSV file that are sure to have its header
#: Of text on standard input, which may never end.
MOST_ON_STDIN = 4 << 30


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
        table = _open(name, remote.fetch(name, Path(directory)))
    except BaseException:
        shutil.rmtree(directory, ignore_errors=True)
        raise
    weakref.finalize(table, shutil.rmtree, directory, ignore_errors=True)
    return table


def _open(name: str, path: Path) -> OpenTable:
    kind = layout.table_kind(path)
    if kind is None:
        raise InputError(f"{name}: this kind of file is not understood; supported are {', '.join(layout.TABLES)}.")
    if kind == ".parquet":
        _read(path, limit=1)  # the plain sentences for a file that is not there
        return columnar.parquet(name, path)
    if kind == ".feather":
        return columnar.feather(name, _read(path))
    if kind == ".csv" and _read(path, limit=2) != _GZIP_MAGIC and path.stat().st_size > header.LARGE:
        return _large_csv(name, path)
    return _csv(name, _read(path), must_be_gzip=kind == ".csv.gz")


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
            f"{name}: unpacks to more than {MOST_GROWTH} times its packed size, which no log does. "
            "If it is one all the same, unpack it first (gunzip)."
        )
    return text


def _in_memory(table: Any) -> OpenTable:
    import pyarrow as pa

    name = "<table>"
    if isinstance(table, pa.Table):
        return of_arrow(table, name)
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
