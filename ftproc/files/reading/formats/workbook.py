"""Excel workbooks, by pandas and openpyxl: the sheet named after #, or the first that holds a table."""

from __future__ import annotations

import datetime as dt
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ftproc.errors import InputError, quoted
from ftproc.files import limits
from ftproc.files.reading.formats import content, layout, trimming
from ftproc.files.reading.formats.header import TableHeader, is_log, of_arrow

_CELL, _ROW = 32, 64  # bytes of a cell and a row at least
_XML = 4  # bytes that a byte of XML takes
_MOST_WHOLE = 2.0**53


def workbook(name: str, path: Path, room: limits.Room, sheet: str = "") -> TableHeader:
    """An .xlsx file. sheet: its name, else the first with rows. Raises InputError."""
    content.read(name, path, limit=1)  # for its messages
    _refuse_bomb(name, path, room)
    read = {title: _table(name, title, cells) for title, cells in _sheets(name, path, room, sheet)}
    tables = {title: table for title, table in read.items() if table is not None}
    logs = [
        title
        for title, table in tables.items()
        if is_log(table.names, dict(zip(table.names, table.units, strict=False)))
    ]
    if len(logs) > 1:
        raise InputError(
            f"{name}: it holds several logs, in the sheets {', '.join(logs)}. Name one behind #, such as "
            f"{quoted(f'{name}#{logs[0]}')}."
        )
    if tables:
        return tables[logs[0]] if logs else next(iter(tables.values()))
    which = f'sheet "{sheet}" holds' if sheet else "no sheet holds"
    raise InputError(f"{name}: {which} {'no ' if sheet else 'a '}table of numbers under a line of names.")


def _table(name: str, title: str, cells: list[tuple[Any, ...]]) -> TableHeader | None:
    """The table of a sheet, or None."""
    found = layout.find(["\t".join(_text(cell) for cell in row) for row in cells])
    if found is None or found.separator != "\t":
        return None
    rows = [row for row in cells[found.first :] if any(_text(cell) for cell in row)]
    last = len(rows)
    while last > 1 and trimming.is_sum([_text(cell) for cell in rows[last - 1][: found.cells]]):
        last -= 1
    import pyarrow as pa

    columns = [_column([row[index] for row in rows[:last]]) for index in range(found.cells)]
    below = f", {len(rows) - last} lines below the table" if last < len(rows) else ""
    table = pa.Table.from_arrays(columns, names=found.names)
    return of_arrow(table, name, f'Excel workbook, sheet "{title}"{below}', found.units, decimal_comma=True)


def _sheets(name: str, path: Path, room: limits.Room, sheet: str) -> Iterator[tuple[str, list[tuple[Any, ...]]]]:
    """Title and cells of the sheets."""
    try:
        from openpyxl import load_workbook  # type: ignore[import-untyped, unused-ignore]
    except ImportError as error:
        raise InputError(f"{name}: reading .xlsx needs openpyxl: pip install openpyxl; or save it as CSV.") from error
    with content.undamaged(name, "an Excel workbook (.xlsx)", "save it as CSV"):
        book = load_workbook(path, read_only=True, data_only=True, keep_links=False)
        try:
            titles = [str(title) for title in book.sheetnames]
            if sheet and sheet not in titles:
                raise InputError(f'{name}: there is no sheet "{sheet}"; its sheets are {", ".join(titles)}.')
            held = _Held(room)
            for title in [sheet] if sheet else titles:
                if hasattr(book[title], "reset_dimensions"):  # a sheet, not a chart
                    yield title, held.cells(book[title])
        finally:
            book.close()


class _Held:
    """The cells of sheets, as long as they are not too many or too large together: the empty ones, which a single cell
    far out makes, and texts, of which many cells may share one, count too."""

    def __init__(self, room: limits.Room) -> None:
        self.room, self.size = room, 0

    def cells(self, sheet: Any) -> list[tuple[Any, ...]]:
        """The rows of a sheet, each as long as the longest, without empty ones at the end."""
        sheet.reset_dimensions()  # which may claim anything
        found: list[tuple[Any, ...]] = []
        empty = width = texts = 0
        for row in sheet.iter_rows():
            values = tuple(_value(cell) for cell in row)
            empty = 0 if any(value is not None for value in values) else empty + 1
            width = max(width, next((k for k in range(len(values), 0, -1) if values[k - 1] is not None), 0))
            if width > limits.MOST_COLUMNS:
                raise limits.too_many_columns(self.room.name)
            texts += sum(len(value) for value in values if isinstance(value, str))
            found.append(values)
            self.room.check(self.size + texts + _CELL * width * (len(found) - empty) + _ROW * len(found))
        found = found[: len(found) - empty]
        self.size += texts + _CELL * width * len(found)
        return [(*row[:width], *(None,) * (width - len(row))) for row in found]


def _value(cell: Any) -> Any:
    """As pandas reads it: whole numbers without a fraction; of an error nothing."""
    value = cell.value
    if isinstance(value, float) and value.is_integer() and abs(value) < _MOST_WHOLE:
        return int(value)
    return float("nan") if cell.data_type == "e" else value


def _refuse_bomb(name: str, path: Path, room: limits.Room) -> None:
    """What is in the archive is text of XML, of which the objects that are made take several times the size."""
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(member.file_size for member in archive.infolist())
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
        raise InputError(f"{name}: not an Excel workbook (.xlsx), or a damaged one; save it as CSV.") from error
    room.check(_XML * size)


def _text(cell: Any) -> str:
    return "" if cell is None else str(cell).replace("\t", " ").strip()


def _column(cells: Sequence[Any]) -> Any:
    """One column: numbers, timestamps, times of day, or else texts."""
    import pyarrow as pa

    present = [None if _text(cell) == "" else cell for cell in cells]
    kinds = {type(cell) for cell in present if cell is not None}
    if kinds <= {int, float}:
        return pa.array([None if cell is None else float(cell) for cell in present], pa.float64())
    if kinds <= {dt.datetime} or {kind.__name__ for kind in kinds} <= {"datetime", "Timestamp"}:
        return pa.array(present, pa.timestamp("us"))
    if kinds == {dt.time}:
        return pa.array(present, pa.time64("us"))
    if kinds == {dt.timedelta}:
        return pa.array(present, pa.duration("us"))
    return pa.array([None if cell is None else _text(cell) for cell in present], pa.string())
