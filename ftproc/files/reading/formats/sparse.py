"""Rows that need not have all columns, such as objects or lines of names and values: what is absent takes no memory."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ftproc.errors import encodable
from ftproc.files import limits
from ftproc.files.reading.formats.header import TableHeader

if TYPE_CHECKING:
    import pyarrow as pa

_CELL = 32  # bytes


class Sparse:
    """The columns of rows that are added one by one. Raises InputError where they become too many or too large."""

    def __init__(self, room: limits.Room, names: Iterable[str] = ()) -> None:
        self.room, self.rows, self.cells = room, 0, 0
        #: The rows that have a cell, and the cells, by the name of the column.
        self.columns: dict[str, tuple[list[int], list[Any]]] = {name: ([], []) for name in names}

    def add(self, row: Iterable[tuple[str, Any]]) -> None:
        """Names and values of the next row; of a name that comes twice the first value counts."""
        for name, value in row:
            column = self.columns.get(name)
            if column is None:
                if len(self.columns) >= limits.MOST_COLUMNS:
                    raise limits.too_many_columns(self.room.name)
                column = self.columns[name] = ([], [])
            rows, cells = column
            if not rows or rows[-1] != self.rows:
                rows.append(self.rows)
                cells.append(value)
                self.cells += 1
        self.rows += 1
        self.room.check(_CELL * self.cells, self.rows)

    def header(self, form: str, called: Mapping[str, str] | None = None, decimal_comma: bool = False) -> TableHeader:
        """The table. called: other names of some columns."""
        names = list(self.columns)
        shown = [encodable((called or {}).get(name, name)) for name in names]

        def load(numeric: Sequence[int], others: Sequence[int]) -> pa.Table:
            import pyarrow as pa

            chosen = [*numeric, *others]
            self.room.check(8 * self.rows * len(chosen))
            arrays = [self._array(names[index]) for index in chosen]
            return pa.Table.from_arrays(arrays, names=[shown[index] for index in chosen])

        return TableHeader(self.room.name, shown, load, decimal_comma, form=form)

    def _array(self, name: str) -> pa.Array:
        import pyarrow as pa

        rows, cells = self.columns[name]
        self.room.check(sum(len(cell) for cell in cells if isinstance(cell, str)))  # one text may stand in many rows
        if len(cells) < self.rows:
            present = dict(zip(rows, cells, strict=True))
            cells = [present.get(row) for row in range(self.rows)]
        try:
            return pa.array(cells)
        except (pa.ArrowException, OverflowError, UnicodeError):  # numbers and words in one column; half a character
            return pa.array([None if cell is None else encodable(str(cell)) for cell in cells], pa.string())
