"""CSV bytes -> Arrow table: encoding, header, separator, and sentences for what is wrong with the text.

Separators are comma, semicolon or tab, told by the header line. Lines may end in LF, CRLF or CR; empty lines
are skipped and not counted as rows, as pandas does. In a semicolon file numbers may have decimal commas.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ftproc.errors import InputError

if TYPE_CHECKING:
    import pyarrow as pa

#: Cells that mean "no reading", beside the empty cell.
MISSING_WORDS = (
    *("", "NaN", "nan", "NAN", "-NaN", "-nan", "NA", "N/A", "n/a", "#NA", "#N/A", "#N/A N/A", "<NA>"),
    *("NULL", "Null", "null", "None", "none", "1.#IND", "-1.#IND", "1.#QNAN", "-1.#QNAN"),
)

_BLOCK = 8 << 20  # bytes that are parsed at once of a large file

_MAGIC = {
    b"\xff\xfe": "is UTF-16 text; save it as UTF-8 (iconv -f UTF-16 -t UTF-8)",
    b"\xfe\xff": "is UTF-16 text; save it as UTF-8 (iconv -f UTF-16 -t UTF-8)",
    b"PAR1": "is a Parquet file; give it the name .parquet",
    b"PK\x03\x04": "is a zip archive or an Excel workbook; unpack it, or export the sheet as CSV",
}


def row_named(row: int) -> str:
    """How every message names a row: as the `row` column of a trajectory does, and saying so."""
    return f"row {row} (the first data row is 0)"


class CsvText(NamedTuple):
    """The text of one CSV file, its header already taken apart."""

    source: str
    names: list[str]
    delimiter: str
    body: memoryview  # the bytes after the header line
    open_quotation: bool  # an odd number of quotation marks: one may swallow all rows after it
    begins: int = 0  # the byte after the header line

    def load(self, numeric: Sequence[int], others: Sequence[int]) -> pa.Table:
        """Columns `numeric`, then `others`, by position.

        The numeric ones are all float64, or all text when any of them has a cell that is not a number; the
        types of the others are inferred. Raises InputError naming the first row that has too many or too few
        cells.
        """
        import pyarrow as pa

        if not re.search(rb"[^\r\n]", self.body):
            raise InputError(f"{self.source}: there are column names but no rows.")
        if self.open_quotation:
            self._refuse_ragged()
        try:
            return self._parse(numeric, others, pa.float64())
        except pa.ArrowInvalid:  # a word, a timestamp, a decimal comma, or rows that do not fit at all
            pass
        try:
            return self._parse(numeric, others, pa.binary())
        except pa.ArrowInvalid as error:
            self._refuse_ragged()
            reason = str(error).splitlines()[0][:200]
            raise InputError(f"{self.source}: cannot be read as CSV ({reason}). Save it as CSV anew.") from error

    def _parse(self, numeric: Sequence[int], others: Sequence[int], wanted: pa.DataType) -> pa.Table:
        import pyarrow as pa
        import pyarrow.csv

        keys = [str(position) for position in range(len(self.names))]
        chosen = [*numeric, *others]
        table = pyarrow.csv.read_csv(
            pa.BufferReader(pa.py_buffer(self.body)),
            read_options=pyarrow.csv.ReadOptions(column_names=keys),
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
            if pa.types.is_binary(field.type):  # what pyarrow makes of text it cannot decode
                raise InputError(
                    f'{self.source}: column "{field.name}" is not UTF-8 text, so it cannot be kept; '
                    "save the file as UTF-8, or leave --keep-columns out."
                )
        return table

    def _refuse_ragged(self) -> None:
        """Raise InputError for the first row with a wrong number of cells, read slowly in plain Python."""
        text = io.TextIOWrapper(io.BytesIO(self.body), encoding="utf-8", errors="replace", newline="")
        rows = (cells for cells in csv.reader(text, delimiter=self.delimiter) if cells)
        row = -1
        try:
            for row, cells in enumerate(rows):
                if len(cells) != len(self.names) or (self.open_quotation and _spans_lines(cells)):
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
    """Take the header line off `data`. Raises InputError for what is not UTF-8 text with a header line."""
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


def in_blocks(path: Path, head: CsvText) -> Iterator[CsvText]:
    """The rows of a file in blocks that end with a line; `head` is what its beginning was split into.

    Raises InputError where rows and lines may not be the same.
    """
    with path.open("rb") as stream:
        stream.seek(head.begins)
        rest, marks = b"", set()
        while data := stream.read(_BLOCK):
            data = rest + data
            end = data.rfind(b"\n") + 1
            rest = data[end:]
            if len(rest) > _BLOCK:
                raise InputError(f"{head.source}: a line of more than {_BLOCK >> 20} MiB is no row of a log.")
            if head.delimiter == ";":  # what a point means hangs on whether there is a comma anywhere
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
    yield head._replace(body=body, open_quotation=False)


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
    delimiter = max(",;\t", key=line.count)  # the first of them when none is there
    try:
        names = [name.strip() for name in next(csv.reader([line], delimiter=delimiter))]
    except csv.Error as error:
        raise InputError(
            f"{source}: the header line cannot be read as CSV ({error}); correct it, or delete what stands before it."
        ) from error
    if len(names) == 1 and re.search(r"\S[ |]+\S", names[0]):
        raise InputError(
            f'{source}: the header line "{line[:80]}" has no separator; '
            "separate the cells with commas, semicolons or tabs."
        )
    return names, delimiter
