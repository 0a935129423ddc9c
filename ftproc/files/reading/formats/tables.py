"""Any source that the user may name -> its table header."""

from __future__ import annotations

import shutil
import sys
import tempfile
import weakref
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from ftproc.errors import InputError
from ftproc.files import layout, remote
from ftproc.files.reading.formats import columnar, content, csvtext
from ftproc.files.reading.formats.header import TableHeader, of_arrow

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

Source: TypeAlias = "str | Path | pa.Table | pd.DataFrame"

#: What a name ends in -> the reader of that kind of file, from its name (for messages) and path.
FORMATS: Mapping[str, Callable[[str, Path], TableHeader]] = {
    ".csv": csvtext.csv_file,
    ".csv.gz": csvtext.gzipped_csv,
    ".parquet": columnar.parquet,
    ".feather": columnar.feather,
}


def read_header(source: Source) -> TableHeader:
    """The header of a file of one of FORMATS, of `-` (CSV on standard input, even gzipped), or of a table in memory.

    A file may be named by a URI (see `remote`); its local copy lasts as long as the header.
    Raises InputError for a file that does not exist, cannot be read, is damaged or empty.
    """
    if not isinstance(source, str | Path):
        return _in_memory(source)
    if str(source) == "-":
        return csvtext.csv_bytes("<stdin>", content.stdin())
    name, path = str(source), remote.local(source)
    if path is not None:
        return _of_file(name, path)
    directory = tempfile.mkdtemp()
    try:
        header = _of_file(name, remote.fetch(name, Path(directory)))
    except BaseException:
        shutil.rmtree(directory, ignore_errors=True)
        raise
    weakref.finalize(header, shutil.rmtree, directory, ignore_errors=True)
    return header


def _of_file(name: str, path: Path) -> TableHeader:
    kind = layout.ending(path, FORMATS)
    if kind is None:
        raise InputError(f"{name}: this kind of file is not understood; supported are {', '.join(FORMATS)}.")
    return FORMATS[kind](name, path)


def _in_memory(table: Any) -> TableHeader:
    import pyarrow as pa

    name = "<table>"
    if isinstance(table, pa.Table):
        return of_arrow(table, name)
    pandas = sys.modules.get("pandas")  # a DataFrame exists only if pandas is imported
    if pandas is None or not isinstance(table, pandas.DataFrame):
        raise InputError(f"{name}: expected a path, a pandas DataFrame or a pyarrow Table, not {type(table).__name__}.")
    names = [str(column) for column in table.columns]

    def load(numeric: Sequence[int], others: Sequence[int]) -> pa.Table:
        chosen = [*numeric, *others]
        arrays = [_from_pandas(table.iloc[:, position]) for position in chosen]
        return pa.Table.from_arrays(arrays, names=[names[position] for position in chosen])

    return TableHeader(name, names, load)


def _from_pandas(series: Any) -> pa.Array:
    import pyarrow as pa

    try:
        return pa.array(series, from_pandas=True)
    except (pa.ArrowException, TypeError):  # numbers and words in one column: as text, so that a message can quote them
        missing = series.isna()
        return pa.array([None if gone else str(cell) for cell, gone in zip(series, missing, strict=True)])
