"""Text: encoding, layout, separator -> Arrow table; messages for what is wrong with the text.

Lines end in LF, CRLF or CR; empty lines and comment lines are skipped and not counted as rows. Where the separator is
no comma, numbers may have decimal commas.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ftproc.errors import InputError, first_line, row_named
from ftproc.files import limits
from ftproc.files.reading.formats import blocks, content, encoding, layout, trimming
from ftproc.files.reading.formats.header import Blocks, TableHeader
from ftproc.files.reading.formats.layout import BLANKS
from ftproc.files.reading.formats.standards import catalogue
from ftproc.files.reading.formats.texts import wrapped
from ftproc.files.reading.meaning import preamble
from ftproc.files.words import MISSING_WORDS

if TYPE_CHECKING:
    import pyarrow as pa

_QUOTED_COMMA = re.compile(rb'"[+-]?\d+,(?:\d{1,2}|\d{4,})"')  # a decimal comma, that does not separate thousands
_HEAD = 1 << 20  # bytes of a large file that contain its header line
_PLAIN_ROWS = 20  # under the names, that are read before a file counts as plain
_SEPARATOR_NAMES = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "bars", BLANKS: "blanks", "": "fixed widths"}
_PARSED, _PARSED_OF_A_COLUMN = 1 << 20, 256  # bytes that pyarrow parses at once, the more the more columns there are


def text_file(name: str, path: Path, room: limits.Room, widths: Sequence[int] = ()) -> TableHeader:
    """A text file. widths: of its columns, in characters. Of a large file only the head is read. Raises InputError."""
    large = path.stat().st_size > content.LARGE and not widths
    if large:
        head = content.read(name, path, limit=_HEAD)
        lines = head[: head.rfind(b"\n") + 1 or len(head)]
        if (
            not (trimming.is_boxed(head) or _unwrapped(lines, room, cut=True)[1])
            and _described(lines, room, cut=True) is None
        ):
            return _large_file(name, path)
    return text_bytes(content.read(name, path), room, widths)


def text_bytes(data: bytes, room: limits.Room, widths: Sequence[int] = ()) -> TableHeader:
    """The bytes of a text file. Raises InputError."""
    name = room.name
    plain, language = ("", "") if widths else _unwrapped(data, room)
    data = plain.encode() if language else data
    if not (widths or language) and (known := _described(data, room)) is not None:
        return known
    text = split(name, data, widths)
    text = text._replace(form=f"{language}, {text.form}" if language else text.form)
    commas = text.delimiter != "," or len(_QUOTED_COMMA.findall(text.body, 0, _HEAD)) > 2
    return text.header(lambda: text, commas)


def _unwrapped(data: bytes, room: limits.Room, cut: bool = False) -> tuple[str, str]:
    """The table that stands in another language, and the name of that; "" of other texts. cut: `data` is only the
    beginning."""
    if _plain(data[:_HEAD]) is not None:
        return "", ""
    return wrapped.unwrapped(encoding.as_utf8(room.name, data, cut).data.decode("utf-8", "replace"), room)


def _described(data: bytes, room: limits.Room, cut: bool = False) -> TableHeader | None:
    """A text of a format that `catalogue` lists; None if it is none. cut: `data` is only the beginning."""
    head = data[:_HEAD]
    trimming.refuse_wide(room.name, head)
    if not head.lstrip().startswith(b"[[") and _plain(head) is not None:
        return None
    sample = encoding.as_utf8(room.name, head, cut or len(data) > len(head)).data.decode("utf-8", "replace")
    gone, note = (0, "") if cut else trimming.words_cut_off(data)
    data = data[: len(data) - gone]
    found = catalogue.read(sample, lambda: encoding.as_utf8(room.name, data, cut).data.decode("utf-8", "replace"), room)
    return found and found.noting(note)


def _large_file(name: str, path: Path) -> TableHeader:
    before = path.stat()
    head = split(name, content.read(name, path, limit=_HEAD), cut=True)
    _, note = trimming.cut_off(blocks.end(path, _HEAD), len(head.names), head.delimiter)

    def whole() -> CsvText:
        return split(name, content.read(name, path, known=before))

    def in_blocks(numeric: Sequence[int]) -> Blocks | None:
        if head.encoding or note:  # in which the rows are elsewhere than in UTF-8, or end before the file
            return None
        rows = max(bytes(head.body).count(b"\n"), 1) * before.st_size // _HEAD
        bodies = blocks.of_file(path, head.source, head.body_offset, head.delimiter, before)
        return Blocks((head._replace(body=body, odd_quotes=False).load(numeric, ()) for body in bodies), rows)

    return replace(head._replace(note=note).header(whole, head.delimiter != ","), blocks=in_blocks)


class CsvText(NamedTuple):
    """The text of one file, its layout known.

    body: the rows in UTF-8. odd_quotes: an odd number of quotation marks: an unclosed one may swallow all rows after
    it. body_offset: of the body in the file, bytes. widths: of the columns, or nothing. units: a row of units.
    encoding: if it is not UTF-8. form: the layout in words. above: the lines above the names. note: on
    a row that is left out.
    """

    source: str
    names: list[str]
    delimiter: str
    body: memoryview
    odd_quotes: bool
    body_offset: int = 0
    widths: Sequence[int] = ()
    units: Sequence[str] = ()
    encoding: str = ""
    form: str = ""
    above: Sequence[str] = ()
    note: str = ""

    def header(self, whole: Callable[[], CsvText], decimal_comma: bool) -> TableHeader:
        known = TableHeader(
            self.source, self.names, lambda numeric, others: whole().load(numeric, others), decimal_comma,
            units=self.units, form=self.form, above=self.above, written=lambda k: whole().load([k], (), False)[0],
        )  # fmt: skip
        return known.noting(self.note)

    def load(self, numeric: Sequence[int], others: Sequence[int], as_numbers: bool = True) -> pa.Table:
        """Columns `numeric`, then `others`, by position.

        The numeric ones are all float64, or all text if any of them has a cell that is not a number, or not
        `as_numbers`; the types of the others are inferred. Raises InputError, naming the first row with too many or too
        few cells."""
        import pyarrow as pa

        if not re.search(rb"[^\r\n]", self.body):
            raise InputError(f"{self.source}: there are column names but no rows.")
        if self.widths:
            return self._of_widths([*numeric, *others])
        if self.odd_quotes:
            self._refuse_ragged()
        with suppress(pa.ArrowInvalid):  # a word, a timestamp, a decimal comma, or rows that do not fit at all
            if as_numbers:
                return self._parse(numeric, others, pa.float64())
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
        body, delimiter = blocks.delimited(self.body, self.delimiter)
        large = len(body) > _HEAD  # a process that ends as soon as threads have begun would be aborted by them
        size = max(_PARSED, _PARSED_OF_A_COLUMN * len(keys))
        table = pyarrow.csv.read_csv(
            pa.BufferReader(pa.py_buffer(body)),
            read_options=pyarrow.csv.ReadOptions(use_threads=large, column_names=keys, block_size=size),
            parse_options=pyarrow.csv.ParseOptions(delimiter=delimiter),
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

    def _of_widths(self, chosen: Sequence[int]) -> pa.Table:
        import pandas as pd
        import pyarrow as pa

        frame = pd.read_fwf(
            io.BytesIO(self.body), widths=list(self.widths), header=None, dtype=str, keep_default_na=False
        )
        arrays = [pa.array([str(cell) for cell in frame[index]], pa.string()) for index in chosen]
        return pa.Table.from_arrays(arrays, names=[self.names[index] for index in chosen])

    def _refuse_ragged(self) -> None:
        """Raise InputError for the first row with a wrong number of cells, found in plain Python."""
        body, delimiter = blocks.delimited(self.body, self.delimiter)
        text = io.TextIOWrapper(io.BytesIO(body), encoding="utf-8", errors="replace", newline="")
        rows = (cells for cells in csv.reader(text, delimiter=delimiter) if cells)
        row = -1
        try:
            for row, cells in enumerate(rows):
                if len(cells) != len(self.names) or (self.odd_quotes and _spans_lines(cells)):
                    raise InputError(self._ragged(row, cells))
        except csv.Error as error:
            where = f"{self.source}: {row_named(row + 1)}"
            raise InputError(f"{where} cannot be read as CSV ({error}). Correct the row or delete it.") from error

    def _ragged(self, row: int, cells: list[str]) -> str:
        expected = len(self.names)
        if _spans_lines(cells):
            return (
                f"{self.source}: {row_named(row)} opens a quotation mark and does not close it on its line; correct it."
            )
        if self.delimiter == "," and len(cells) == 2 * expected:
            hint = "If these are decimal commas, write decimal points or separate the cells with semicolons."
        elif self.delimiter == BLANKS:
            hint = "Complete the row, or name the widths of the columns in characters, such as --widths 10,12,10,10."
        else:
            hint = "Complete the row or delete it."
        there = f"{len(cells)} cell{'s' * (len(cells) != 1)}"
        return f"{self.source}: {row_named(row)} has {there} where the header has {expected}. {hint}"


def split(source: str, data: bytes, widths: Sequence[int] = (), cut: bool = False) -> CsvText:
    """The layout of `data`, of a whole file or the beginning of one (`cut`). Raises InputError unless it is text."""
    text = encoding.as_utf8(source, data, cut and len(data) >= _HEAD)
    if not (cut or text.was):
        text = text._replace(data=trimming.unboxed(text.data))
    whole, behind = (text.data, "") if cut else trimming.without_comments_behind(text.data)
    text = text._replace(data=whole)
    if not text.data.strip():
        raise InputError(f"{source}: the file is empty; expected a header line and rows.")
    if (plain := None if widths else _plain(text.data)) is not None:
        names, delimiter, start = plain
        found = CsvText(source, names, delimiter, memoryview(b""), False)
    else:
        found, start = _searched(source, text.data, widths)
    widths = found.widths
    body = memoryview(text.data)[start:]
    if not cut:
        body, dropped, note = trimming.rows_only(source, body, found.names, found.delimiter, widths)
        found = found._replace(form=found.form + behind + dropped, note=note)
    odd = text.data.count(b'"', start) % 2 == 1
    separated = f"text, separated by {_SEPARATOR_NAMES[found.delimiter]}" if not widths else "text in fixed widths"
    form = ", ".join(part for part in (text.was and f"{text.was}", separated, found.form) if part)
    return found._replace(body=body, odd_quotes=odd, body_offset=text.skipped + start, encoding=text.was, form=form)


def _plain(data: bytes) -> tuple[list[str], str, int] | None:
    """Names, separator and start of the rows of a file whose first line holds the names; None if that is not plain."""
    found = layout.LINE.match(data)
    if found is None:
        return None
    line = found[1].decode("utf-8", "replace")
    below = layout.LINE.match(data, found.end())
    first = below[1].decode("utf-8", "replace") if below else ""
    alike = (mark for mark in "\t;" if 0 < line.count(mark) == first.count(mark))  # before decimal commas
    delimiter = next(alike, max(",;\t", key=line.count))
    if line.count(delimiter) >= trimming.MOST_MARKS:
        return None
    names = layout.split(line, delimiter)
    if len(names) < 2 or layout.is_comment(line) or any(re.match(r"[+-]?\.?\d", name) for name in names):
        return None
    offset = found.end()
    for _ in range(_PLAIN_ROWS):
        row = layout.LINE.match(data, offset)
        if row is None or not row[1].strip():
            break
        if row[1].count(delimiter.encode()) >= trimming.MOST_MARKS:
            return None
        cells = layout.split(row[1].decode("utf-8", "replace"), delimiter)
        if len(cells) != len(names) or not (layout.is_data(cells) or layout.is_data(cells[:1])):
            return None
        offset = row.end()
    return None if offset == found.end() else (names, delimiter, found.end())


def _searched(source: str, data: bytes, widths: Sequence[int]) -> tuple[CsvText, int]:
    """The text with its layout, and the start of its rows."""
    lines = re.split(rb"(\r\n|\r|\n)", data[:_HEAD])
    texts = [line.decode("utf-8", "replace") for line in lines[::2]]
    found = layout.find(texts, widths)
    if found and not found.named and (widths := widths or preamble.ruled(texts, found.first)):
        found = layout.find(texts, widths)
    if found is None:
        names, delimiter, start = trimming.first_line(source, data)
        return CsvText(source, names, delimiter, memoryview(b""), False), start
    start = sum(map(len, lines[: 2 * found.first]))
    names = [name.strip() for name in found.names]
    parts = [] if found.named else ["no column names"]
    parts += [f"{found.above} lines above the table"] if found.above else []
    parts += ["a row of units" if found.row_of_units else "units stated above the table"] if found.units else []
    text = CsvText(source, names, found.separator, memoryview(b""), False, widths=widths, units=found.units)
    return text._replace(above=found.said, form=", ".join(parts)), start


def _spans_lines(cells: list[str]) -> bool:
    return any("\n" in cell or "\r" in cell for cell in cells)
