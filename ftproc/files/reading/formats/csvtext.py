"""CSV: encoding, header, separator -> Arrow table; messages for what is wrong with the text.

The separator is the comma, semicolon or tab that is most frequent in the header line. Lines end in LF, CRLF or CR;
empty lines are skipped and not counted as rows, as in pandas. In a semicolon file numbers may have decimal commas.
"""

from __future__ import annotations

import csv
import io
import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ftproc.errors import InputError, first_line, row_named
from ftproc.files.reading.formats import content
from ftproc.files.reading.formats.header import Blocks, TableHeader

if TYPE_CHECKING:
    import pyarrow as pa

#: Cells that mean "no reading", beside the empty cell.
MISSING_WORDS = (
    *("", "NaN", "nan", "NAN", "-NaN", "-nan", "NA", "N/A", "n/a", "#NA", "#N/A", "#N/A N/A", "<NA>"),
    *("NULL", "Null", "null", "None", "none", "1.#IND", "-1.#IND", "1.#QNAN", "-1.#QNAN"),
)

_HEAD = 1 << 20  # bytes of a large file that contain its header line
_BLOCK = 8 << 20  # bytes of a large file that are parsed at once

_PARSED, _PARSED_OF_A_COLUMN = 1 << 20, 256  # bytes that pyarrow parses at once, the more the more columns there are

_MAGIC = {
    b"\xff\xfe": "is UTF-16 text; save it as UTF-8 (iconv -f UTF-16 -t UTF-8)",
    b"\xfe\xff": "is UTF-16 text; save it as UTF-8 (iconv -f UTF-16 -t UTF-8)",
    b"PAR1": "is a Parquet file; give it the name .parquet",
    b"PK\x03\x04": "is a zip archive or an Excel workbook; unpack it, or export the sheet as CSV",
}


def csv_file(name: str, path: Path) -> TableHeader:
    """A .csv file, even gzipped. Of a large one only the header is read now. Raises InputError."""
    if content.read(name, path, limit=2) != content.GZIP_MAGIC and path.stat().st_size > content.LARGE:
        return _large_file(name, path)
    return csv_bytes(name, content.read(name, path))


def gzipped_csv(name: str, path: Path) -> TableHeader:
    """A .csv.gz file. Raises InputError."""
    return _whole(split(name, content.gunzip(name, content.read(name, path))))


def csv_bytes(name: str, data: bytes) -> TableHeader:
    """The bytes of a CSV file, even gzipped. Raises InputError."""
    return _whole(split(name, content.gunzip(name, data) if data.startswith(content.GZIP_MAGIC) else data))


def _whole(text: CsvText) -> TableHeader:
    return TableHeader(text.source, text.names, text.load, decimal_comma=text.delimiter == ";")


def _large_file(name: str, path: Path) -> TableHeader:
    before = path.stat()
    head = split(name, content.read(name, path, limit=_HEAD))

    def load(numeric: Sequence[int], others: Sequence[int]) -> pa.Table:
        return split(name, content.read(name, path, known=before)).load(numeric, others)

    def blocks(numeric: Sequence[int]) -> Blocks:
        rows = max(bytes(head.body).count(b"\n"), 1) * before.st_size // _HEAD
        return Blocks((text.load(numeric, ()) for text in in_blocks(path, head, before)), rows)

    return TableHeader(name, head.names, load, head.delimiter == ";", blocks=blocks)


class CsvText(NamedTuple):
    """The text of one CSV file, its header line parsed."""

    source: str
    names: list[str]
    delimiter: str
    body: memoryview  # the bytes after the header line
    odd_quotes: bool  # an odd number of quotation marks: an unclosed one may swallow all rows after it
    body_offset: int = 0  # of the body in the file, bytes

    def load(self, numeric: Sequence[int], others: Sequence[int]) -> pa.Table:
        """Columns `numeric`, then `others`, by position.

        The numeric ones are all float64, or all text if any of them has a cell that is not a number; the types of
        the others are inferred. Raises InputError, naming the first row with too many or too few cells.
        """
        import pyarrow as pa

        if not re.search(rb"[^\r\n]", self.body):
            raise InputError(f"{self.source}: there are column names but no rows.")
        if self.odd_quotes:
            self._refuse_ragged()
        try:
            return self._parse(numeric, others, pa.float64())
        except pa.ArrowInvalid:  # a word, a timestamp, a decimal comma, or rows that do not fit at all
            pass
        try:
            return self._parse(numeric, others, pa.binary())
        except pa.ArrowInvalid as error:
            self._refuse_ragged()
            reason = first_line(error)
            raise InputError(f"{self.source}: cannot be read as CSV ({reason}). Save it as CSV again.") from error

    def _parse(self, numeric: Sequence[int], others: Sequence[int], wanted: pa.DataType) -> pa.Table:
        import pyarrow as pa
        import pyarrow.csv

        keys = [str(position) for position in range(len(self.names))]
        chosen = [*numeric, *others]
        table = pyarrow.csv.read_csv(
            pa.BufferReader(pa.py_buffer(self.body)),
            read_options=pyarrow.csv.ReadOptions(
                column_names=keys, block_size=max(_PARSED, _PARSED_OF_A_COLUMN * len(keys))
            ),
            parse_options=pyarrow.csv.ParseOptions(delimiter=self.delimiter),
            convert_options=pyarrow.csv.ConvertOptions(
                include_columns=[keys[position] for position in chosen],
                column_types={keys[position]: wanted for position in numeric},
                null_values=MISSING_WORDS,
                strings_can_be_null=True,
            ),
        )
        table = table.rename_columns([self.names[position] for position in chosen])
        for field in list(table.schema)[len(numeric) :]:
            if pa.types.is_binary(field.type):  # the type that pyarrow infers for text it cannot decode
                raise InputError(
                    f'{self.source}: column "{field.name}" is not UTF-8 text, so it cannot be kept; '
                    "save the file as UTF-8, or leave --keep-columns out."
                )
        return table

    def _refuse_ragged(self) -> None:
        """Raise InputError for the first row with a wrong number of cells, found in plain Python."""
        text = io.TextIOWrapper(io.BytesIO(self.body), encoding="utf-8", errors="replace", newline="")
        rows = (cells for cells in csv.reader(text, delimiter=self.delimiter) if cells)
        row = -1
        try:
            for row, cells in enumerate(rows):
                if len(cells) != len(self.names) or (self.odd_quotes and _spans_lines(cells)):
                    raise InputError(self._ragged(row, cells))
        except csv.Error as error:
            place = f"{self.source}: {row_named(row + 1)}"
            raise InputError(f"{place} cannot be read as CSV ({error}). Correct the row or delete it.") from error

    def _ragged(self, row: int, cells: list[str]) -> str:
        expected = len(self.names)
        if _spans_lines(cells):
            return (
                f"{self.source}: {row_named(row)} opens a quotation mark and does not close it on its line; correct it."
            )
        if self.delimiter == "," and len(cells) == 2 * expected:
            hint = "If these are decimal commas, write decimal points or separate the cells with semicolons."
        else:
            hint = "Complete the row or delete it."
        cell = "cell" if len(cells) == 1 else "cells"
        return f"{self.source}: {row_named(row)} has {len(cells)} {cell} where the header has {expected}. {hint}"


def split(source: str, data: bytes) -> CsvText:
    """Parse the header line of `data`. Raises InputError unless it is UTF-8 text with a header line."""
    for magic, reason in _MAGIC.items():
        if data.startswith(magic):
            raise InputError(f"{source}: this {reason}.")
    start = 3 if data.startswith(b"\xef\xbb\xbf") else 0
    found = re.compile(rb"[\r\n]*([^\r\n]*)(?:\r\n|\r|\n)?").match(data, start)
    header = found.group(1) if found else b""
    if b"\0" in data[:4096]:
        raise InputError(f"{source}: this is not text in UTF-8 (it has NUL bytes); save it as UTF-8 CSV.")
    if found is None or not header.strip():
        raise InputError(f"{source}: the file is empty; expected a header line and rows.")
    names, delimiter = _names(source, header)
    odd = data.count(b'"', found.end()) % 2 == 1
    return CsvText(source, names, delimiter, memoryview(data)[found.end() :], odd, found.end())


def in_blocks(path: Path, head: CsvText, before: os.stat_result) -> Iterator[CsvText]:
    """The rows of a file in blocks of whole lines; `head` comes from `split` of its beginning, when it was as `before`.

    Raises Changed when it is not so any more; InputError where a row may span lines, or only the whole file can tell
    what a point means.
    """
    with path.open("rb") as stream, content.unchanged(head.source, stream, before):
        stream.seek(head.body_offset)
        rest, marks = b"", set()
        while data := stream.read(_BLOCK):
            data = rest + data
            end = data.rfind(b"\n") + 1
            rest = data[end:]
            if len(rest) > _BLOCK:
                raise InputError(f"{head.source}: a line of more than {_BLOCK >> 20} MiB is no row of a log.")
            if head.delimiter == ";":  # points separate thousands if there is a comma anywhere in the file
                marks |= {mark for mark in (b",", b".") if mark in data}
                if len(marks) > 1:
                    raise InputError(f"{head.source}: decimal commas and points.")
            yield from _block(head, memoryview(data)[:end])
        yield from _block(head, memoryview(rest))


def _block(head: CsvText, body: memoryview) -> Iterator[CsvText]:
    if not re.search(rb"[^\r\n]", body):
        return
    if b'"' in bytes(body):
        raise InputError(f"{head.source}: quotation marks, in which a line may end.")
    yield head._replace(body=body, odd_quotes=False)


def _spans_lines(cells: list[str]) -> bool:
    return any("\n" in cell or "\r" in cell for cell in cells)


def _names(source: str, header: bytes) -> tuple[list[str], str]:
    try:
        line = header.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(
            f"{source}: the header line is not UTF-8 (Latin-1 or Windows text?); "
            "save the file as UTF-8 (iconv -f LATIN1 -t UTF-8)."
        ) from error
    delimiter = max(",;\t", key=line.count)  # the comma if there is none
    try:
        names = [name.strip() for name in next(csv.reader([line], delimiter=delimiter))]
    except csv.Error as error:
        raise InputError(
            f"{source}: the header line cannot be read as CSV ({error}); correct it, or delete the lines before it."
        ) from error
    if len(names) == 1 and re.search(r"\S[ |]+\S", names[0]):
        raise InputError(
            f'{source}: the header line "{line[:80]}" has no separator; '
            "separate the cells with commas, semicolons or tabs."
        )
    return names, delimiter
