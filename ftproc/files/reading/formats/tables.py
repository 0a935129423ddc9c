"""Any source that the user may name -> its table header."""

from __future__ import annotations

import hashlib
import re
import shutil
import sys
import tempfile
import weakref
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from ftproc.errors import InputError
from ftproc.files import layout, remote
from ftproc.files.limits import Room
from ftproc.files.reading.formats import content, csvtext, documents, packing, workbook
from ftproc.files.reading.formats.arrays import hdf5, matlab, saved
from ftproc.files.reading.formats.columnar import ipc, parquet
from ftproc.files.reading.formats.header import TableHeader, of_arrow
from ftproc.files.reading.formats.standards import asterix, octets
from ftproc.files.reading.formats.texts import upright

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

Source: TypeAlias = "str | Path | pa.Table | pd.DataFrame"


class How(NamedTuple):
    """room: how large the content may become. part: the sheet, group or structure named behind #. widths: of the
    columns of a text, in characters."""

    room: Room
    part: str = ""
    widths: Sequence[int] = ()


def _plots(name: str, path: Path, how: How) -> TableHeader:
    """ASTERIX, or else a text."""
    found = asterix.binary(content.read(name, path), how.room)
    if found is None and content.read(name, path, limit=4).startswith(octets.CAPTURES):
        raise InputError(f"{name}: no packet of this capture holds whole blocks of ASTERIX; name a log.")
    return _text(name, path, how) if found is None else found


def _text(name: str, path: Path, how: How) -> TableHeader:
    return csvtext.text_file(name, path, how.room, how.widths)


#: What a name ends in -> the reader of that kind of file, from its name (for messages) and path.
FORMATS: Mapping[str, Callable[[str, Path, How], TableHeader]] = {
    **dict.fromkeys((".csv", ".txt", ".tsv", ".dat", ".asc", ".log", ".prn", ".gsi"), _text),
    ".parquet": lambda name, path, how: parquet.read(name, path, how.room),
    **dict.fromkeys((".feather", ".arrow", ".arrows", ".ipc"), lambda name, path, how: ipc.read(name, path, how.room)),
    **dict.fromkeys((".jsonl", ".ndjson", ".json"), lambda name, path, how: documents.json_file(name, path, how.room)),
    **dict.fromkeys((".xlsx", ".xlsm"), lambda name, path, how: workbook.workbook(name, path, how.room, how.part)),
    **dict.fromkeys(
        (".h5", ".hdf5", ".hdf", ".nc", ".nc4"), lambda name, path, how: hdf5.read(name, path, how.room, how.part)
    ),
    ".mat": lambda name, path, how: matlab.read(name, path, how.room, how.part),
    **dict.fromkeys((".npy", ".npz"), lambda name, path, how: saved.by_numpy(name, path, how.room)),
    **dict.fromkeys((".pcap", ".pcapng", ".cap", ".ast", ".raw", ".bin"), _plots),
}
#: How files begin whose kind the name may not say.
_MAGIC = {
    b"PAR1": ".parquet", b"ARROW1": ".arrow", b"PK\x03\x04": ".xlsx", b"\x89HDF": ".h5", b"MATLAB": ".mat",
    **dict.fromkeys(octets.CAPTURES, ".pcap"), **{bytes([category, 0]): ".ast" for category in octets.CATEGORIES},
}  # fmt: skip
_DEEPEST = 3  # of packed files inside each other

_SMALL = 1 << 16  # bytes of a range file
_RANGE = re.compile(rb"(?m)^\s*\[(?:origin|station\.)")  # tables of a range file

#: Endings of files that are no logs -> the command line that takes them.
_OTHERS = {
    ".toml": "this is a station file: ftproc filter LOG --config {name}",
    ".safetensors": "this is a correction model: ftproc filter LOG --model {name}",
    **dict.fromkeys((".html", ".htm"), "this is a page; save the table in it as .csv, or name the log that a report "
                    "was made of: ftproc filter LOG --report {name}"),
    ".kml": "this is a map, an output; name the log it was made of: ftproc filter LOG -o {name}",
    ".geojson": "this is a map, an output; name the log it was made of: ftproc filter LOG -o {name}",
    ".czml": "this is a map, an output; name the log it was made of: ftproc filter LOG -o {name}",
    **dict.fromkeys((".ods", ".numbers"), "this spreadsheet is not understood; save it as .xlsx or .csv"),
    **dict.fromkeys((".pdf", ".doc", ".docx", ".rtf"), "this is a document; save the table in it as .csv"),
    **dict.fromkeys(
        (".db", ".sqlite", ".bag", ".db3", ".mcap", ".tdms", ".mf4", ".mdf", ".pkl", ".pickle", ".7z", ".rar"),
        "this kind of file is not understood; export the track to .csv, .parquet, .xlsx, .h5 or .mat",
    ),
}  # fmt: skip
_OLD_WORKBOOK = b"\xd0\xcf\x11\xe0"  # a .xls that begins otherwise is a text


def read_header(source: Source, widths: Sequence[int] = ()) -> TableHeader:
    """The header of a file of one of FORMATS, even packed; of `-` (text on standard input, even packed); or of a table
    in memory.

    A file may be named by a URI (see `remote`), and a sheet or group in it behind #. Copies of packed and remote files
    last as long as the header. widths: of the columns of a text, in characters.
    Raises InputError for a file that does not exist, cannot be read, is damaged or empty.
    """
    if not isinstance(source, str | Path):
        return _in_memory(source)
    scratch = _Scratch()
    try:
        header = _opened(str(source), widths, scratch)
    except BaseException:
        scratch.remove()
        raise
    if not header.is_of_a_standard:
        header = upright.upright(asterix.by_names(header))
    weakref.finalize(header, scratch.remove)
    return header


class _Scratch:
    """A directory for copies, made when one is needed."""

    def __init__(self) -> None:
        self.directory: Path | None = None

    def path(self) -> Path:
        """A new directory in it."""
        if self.directory is None:
            self.directory = Path(tempfile.mkdtemp(prefix="ftproc-"))
        return Path(tempfile.mkdtemp(dir=self.directory))

    def remove(self) -> None:
        if self.directory is not None:
            shutil.rmtree(self.directory, ignore_errors=True)


def _opened(name: str, widths: Sequence[int], scratch: _Scratch) -> TableHeader:
    if name == "-":
        data = content.stdin()
        how = How(Room("<stdin>", len(data)), "", widths)
        digest = hashlib.sha256(data).hexdigest()
        if packing.ending("", data[:8]) is None and not data.startswith(tuple(_MAGIC)):
            return replace(csvtext.text_bytes(data, how.room, widths), sha256=lambda: digest)
        path = scratch.path() / "stdin"
        path.write_bytes(data)
        return replace(_of_file("<stdin>", path, how, scratch), sha256=lambda: digest)
    here, part = remote.local(name), ""
    if here is None:
        copy = remote.fetch(name, scratch.path())
        found = _of_file(name, copy.path, How(Room(name, copy.packed), part, widths), scratch)
        return replace(found, sha256=partial(content.sha256, copy.path))
    whole, mark, behind = name.rpartition("#")
    if mark and not here.exists() and (inner := remote.local(whole)) is not None and inner.exists():
        here, part = inner, behind
    found = _of_file(name, here, How(Room(name, content.size(here)), part, widths), scratch)
    return replace(found, sha256=partial(content.sha256, here))


def _of_file(name: str, path: Path, how: How, scratch: _Scratch, deep: int = 0) -> TableHeader:
    lower = path.name.lower()
    other = next((cure for ending, cure in _OTHERS.items() if lower.endswith(ending)), None)
    if lower.endswith(".toml") and path.is_file() and _RANGE.search(_beginning(path)):
        other = "this is a range file, of several stations: ftproc filter --fuse {name}"
    if other is not None:
        raise InputError(f"{name}: {other.format(name=name)}.")
    head = content.read(name, path, limit=8)
    if lower.endswith(".xls") and head.startswith(_OLD_WORKBOOK):
        raise InputError(f"{name}: this is an old Excel workbook; save it as .xlsx or .csv.")
    packed = packing.ending(path.name, head)
    if packed is not None:
        if deep > _DEEPEST:
            raise InputError(f"{name}: packed more than {_DEEPEST} times over; unpack it first.")
        inner = packing.unpacked(name, path, packed, scratch.path(), how.room, how.part)
        named = packed == ".zip" and how.part and packing.is_member(path, how.part)
        return _of_file(name, inner, how._replace(part="") if named else how, scratch, deep + 1)
    by_bytes = next((kind for magic, kind in _MAGIC.items() if head.startswith(magic)), ".csv")
    return FORMATS[layout.ending(path, FORMATS) or by_bytes](name, path, how)


def _beginning(path: Path) -> bytes:
    with path.open("rb") as stream:
        return stream.read(_SMALL)


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
