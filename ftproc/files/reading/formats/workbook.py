"""Excel workbooks, by pandas and openpyxl: the sheet named after #, or the first that holds a table."""

from __future__ import annotations

import datetime as dt
import warnings
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ftproc.errors import InputError, first_line, quoted
from ftproc.files.reading.formats import content, layout, trimming
from ftproc.files.reading.formats.header import TableHeader, of_arrow
from ftproc.files.reading.meaning.names import taken_apart
from ftproc.files.words import QUANTITIES


def workbook(name: str, path: Path, sheet: str = "") -> TableHeader:
    """An .xlsx file. sheet: its name, else the first with rows. Raises InputError."""
    content.read(name, path, limit=1)  # for its messages
    _refuse_bomb(name, path)
    read = {title: _table(name, title, cells) for title, cells in _sheets(name, path, sheet)}
    tables = {title: table for title, table in read.items() if table is not None}
    logs = [title for title, table in tables.items() if _is_log(table)]
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

    columns = [_column([row[place] for row in rows[:last]]) for place in range(found.cells)]
    below = f", {len(rows) - last} lines below the table" if last < len(rows) else ""
    table = pa.Table.from_arrays(columns, names=found.names)
    return of_arrow(table, name, f'Excel workbook, sheet "{title}"{below}', found.units, decimal_comma=True)


def _is_log(header: TableHeader) -> bool:
    """Whether a table has the names of a time and of a reading."""
    units = header.units or [""] * len(header.names)
    names = [taken_apart(name, unit) for name, unit in zip(header.names, units, strict=True)]
    found = {quantity for quantity in QUANTITIES for name in names if name.means(quantity)}
    return "time" in found and len(found) > 1


def _sheets(name: str, path: Path, sheet: str) -> Iterator[tuple[str, list[tuple[Any, ...]]]]:
    """Title and cells of the sheets."""
    import pandas as pd

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of openpyxl, on styles
            with pd.ExcelFile(path, engine="openpyxl") as book:
                titles = [str(title) for title in book.sheet_names]
                if sheet and sheet not in titles:
                    raise InputError(f'{name}: there is no sheet "{sheet}"; its sheets are {", ".join(titles)}.')
                for title in [sheet] if sheet else titles:
                    frame = book.parse(title, header=None, dtype=object, keep_default_na=False)
                    yield title, list(frame.itertuples(index=False, name=None))
    except ImportError as error:
        raise InputError(f"{name}: reading .xlsx needs openpyxl: pip install openpyxl; or save it as CSV.") from error
    except InputError:
        raise
    except Exception as error:  # openpyxl raises many kinds for damaged files
        reason = first_line(error)
        raise InputError(
            f"{name}: not an Excel workbook (.xlsx), or a damaged one ({reason}); save it as CSV."
        ) from error


def _refuse_bomb(name: str, path: Path) -> None:
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(member.file_size for member in archive.infolist())
    except (zipfile.BadZipFile, OSError) as error:
        raise InputError(f"{name}: not an Excel workbook (.xlsx), or a damaged one; save it as CSV.") from error
    if size > content.unpacked_limit(path.stat().st_size):
        raise InputError(f"{name}: unpacks to more than {content.MAX_GROWTH} times its packed size; save it as CSV.")


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
