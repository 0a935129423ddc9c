"""What the lines of a log that is followed mean: where the table begins, its columns, and the readings of each row.

Names, units and conventions are understood by the code that reads complete logs. What only a whole log shows, such as
a unit that nobody stated, is assumed and said.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ftproc.config.recipe import Recipe
from ftproc.errors import InputError
from ftproc.files import conventions
from ftproc.files.options import parse_columns, parse_units, parse_widths
from ftproc.files.reading import converting, understanding
from ftproc.files.reading.clocks.growing import Stamps
from ftproc.files.reading.formats import layout
from ftproc.files.reading.meaning import schema, several
from ftproc.files.units import UNITS
from ftproc.files.words import DEPRESSIONS, MISSING_WORDS, QUANTITIES
from ftproc.live import beside
from ftproc.live.beside import RATE
from ftproc.live.lines.growing import Block, Say, SeveralTargets, no_row, no_table
from ftproc.quality.sanity import LATEST_S
from ftproc.records import FloatArray, MeasurementLog
from ftproc.settings import Station

_MOST_LINES = 20  # that are no comments, among which the names and the first row must be,
_MOST_HEAD, _LARGEST_HEAD = 2000, 1 << 22  # and of all lines to the first row, and characters
_SAMPLE = 100  # rows that judge assumptions
_OTHERS = {"time": "ms", "range": "km", "azimuth": "deg", "elevation": "deg"}  # units, as examples
_MISSING = frozenset(MISSING_WORDS)

Found = Mapping[str, schema.Column]
Rows = tuple[FloatArray, InputError | None]


class Reader:
    """The readings of lines that come block by block."""

    def __init__(self, source: str, recipe: Recipe, say: Say) -> None:
        self._source, self._recipe, self._say = source, recipe, say
        self._head, self._size = list[str](), 0
        self._why: InputError | None = None
        self._table: _Table | None = None
        self._sample: FloatArray | None = np.empty((0, 5))

    def read(self, block: Block) -> Rows:
        """(n, 5) time s, range m, azimuth rad, elevation rad, range rate m/s in the canonical convention, NaN where
        missing, of the rows up to the first one that is not understood; and the error for that row. Raises InputError
        for a table that is not understood."""
        if self._table is None:
            rows = self._begun(block)
            if rows is None:
                return np.empty((0, 5)), None
            block = rows
        assert self._table is not None
        readings, fault = self._table.read(block)
        if self._sample is not None:
            self._sample = np.vstack([self._sample, readings])[:_SAMPLE]
            if len(self._sample) == _SAMPLE:
                self._judge()
        return self._table.converted(readings), fault

    @property
    def beside(self) -> beside.Columns:
        """What the table has beside range, azimuth and elevation, once it is known."""
        return beside.Columns() if self._table is None else self._table.beside

    @property
    def station(self) -> Station:
        """With what the names say, once they are known."""
        return (self._table or self._recipe).station

    def cell(self, line: str, name: str) -> str | None:
        """The cell of a row in a column, None where it has none. Raises InputError when no column is called so."""
        assert self._table is not None
        if name not in self._table.names:
            raise InputError(
                f'{self._source}: there is no column "{name}"; its columns are {", ".join(self._table.names)}. Name '
                "one of them with --target."
            )
        cells = self._table._cells(line)
        return None if cells is None else cells[self._table.names.index(name)].strip()

    def finish(self) -> None:
        """When no more lines come. Raises InputError when there was no table."""
        if self._table is None:
            raise self._why or no_table(self._source, self._head)
        self._judge()

    def _begun(self, block: Block) -> Block | None:
        """The rows, from the line on with which the table is understood. The lines are read one by one, so that
        it does not matter how they come."""
        if block.first == 1:
            self._head, self._size = [], 0
        for k, line in enumerate(block.texts):
            self._head.append(line)
            self._size += len(line)
            if len(self._head) > _MOST_HEAD or self._size > _LARGEST_HEAD:
                raise self._why or no_row(self._source, self._head)
            if not line.strip() or layout.is_comment(line):
                continue
            first = self._understood()
            if first is not None:
                rows = Block(first + 1, [*self._head[first:], *block.texts[k + 1 :]])
                assert self._table is not None
                self._table.check_clock(rows)
                for remark in self._table.remarks():
                    self._say(f"{self._source}: {remark}.")
                return rows
            if sum(bool(each.strip()) and not layout.is_comment(each) for each in self._head) >= _MOST_LINES:
                raise self._why or no_row(self._source, self._head)
        return None

    def _understood(self) -> int | None:
        """Index of the first row in the head, once its table is understood; else None, with the reason kept."""
        widths = parse_widths(self._recipe.widths)
        found = layout.find(self._head, widths)
        if found is None:
            return None
        try:
            self._table = _Table.of(self._source, found, self._head, self._recipe)
        except InputError as error:
            self._why = error
            return None
        return found.first

    def _judge(self) -> None:
        """Say what the first rows show against what was assumed. Raises InputError for rows of several targets."""
        if self._table is not None and self._sample is not None and np.isfinite(self._sample[:, 0]).any():
            if not self._recipe.target and several.alternate(self._sample[:, 1:4]):
                raise SeveralTargets(several.question(self._source, self._table.names))
            doubt = self._table.doubt(self._sample)
            if doubt:
                self._say(doubt)
        self._sample = None


class _Table(NamedTuple):
    """The columns of a text. above: lines over the table, which are no rows where they stand again. station: with what
    the names say of the convention; given: without."""

    source: str
    names: Sequence[str]
    separator: str
    widths: Sequence[int]
    above: frozenset[str]
    found: Found
    given: Station
    station: Station
    beside: beside.Columns
    stamps: Stamps

    @classmethod
    def of(cls, source: str, text: layout.Layout, head: Sequence[str], recipe: Recipe) -> _Table:
        """Raises InputError for columns that are not understood, or only by reading the whole log."""
        names = [name.strip() for name in text.names]
        found = schema.resolve(source, names, parse_units(recipe.units), parse_columns(recipe.columns), text.units)
        for quantity, column in found.items():
            if len(column.roles) > 1 or column.notation:
                raise InputError(
                    f"{source}: --follow reads one column of numbers in one unit for each quantity, not "
                    f'"{column.name}". Name another with --columns {quantity}=NAME, or filter the log without '
                    "--follow when it is complete."
                )
        above = frozenset(line.strip() for line in head[: text.first])
        station = understanding.as_named(recipe.station, found)
        if recipe.settings.site and not understanding.knows_axis(recipe.station, found):
            raise conventions.axis_question(source, found["azimuth"].name)
        widths = parse_widths(recipe.widths)
        side = beside.Columns.of(names, text.units, found, recipe)
        return cls(source, names, text.separator, widths, above, found, recipe.station, station, side, Stamps())

    def read(self, block: Block) -> Rows:
        """(n, 5) in SI units as the instrument counts, see `Reader.read`."""
        readings, fault = self._numbers(block)
        readings[:, RATE] = self.beside.rates(readings[:, RATE])
        for k, quantity in enumerate(QUANTITIES):
            if quantity in self.found:
                column = self.found[quantity]
                values = column.unit.to_si(readings[:, k])
                readings[:, k] = -values if column.key in DEPRESSIONS else values
        return readings, fault

    def converted(self, readings: FloatArray) -> FloatArray:
        """(n, 5) in the canonical convention, without the station's known errors."""
        measurement, above_m = self.beside.split(readings)
        log = MeasurementLog(self.source, readings[:, 0], measurement, np.arange(len(readings)))
        log = conventions.apply(log, self.station)
        return np.column_stack([log.time_s, self.beside.joined(log.measurement, above_m), readings[:, RATE]])

    def _numbers(self, block: Block) -> Rows:
        """(n, 5) in the units of the log."""
        rows, fault = list[list[float]](), None
        try:
            each = [(number, self._cells(line)) for number, line in enumerate(block.texts, block.first)]
            time, width = self.found["time"].position, len(self.names)
            moments = self.stamps.seconds([cells[time] for _, cells in each if cells and len(cells) == width])
            rows += (self._row(number, cells, moments) for number, cells in each if cells is not None)
        except InputError as error:
            fault = error
        return np.array(rows, float).reshape(-1, RATE + 1), fault

    def _cells(self, line: str) -> list[str] | None:
        """None for what is no row: an empty line, a comment, a line that stands above the table too."""
        bare = line.strip()
        if not bare or bare in self.above:
            return None
        cells = layout.split(line, self.separator, self.widths)
        if layout.is_comment(line) and not (len(cells) == len(self.names) and layout.is_data(cells[1:])):
            return None
        return cells

    def _row(self, number: int, cells: Sequence[str], moments: Mapping[str, float]) -> list[float]:
        where = f"{self.source}: line {number}"
        if len(cells) != len(self.names):
            cells_are = f"{len(cells)} cell{'s' * (len(cells) != 1)} where the header has {len(self.names)}"
            raise InputError(f"{where} has {cells_are}. Complete the row, or delete it.")
        row, decimal = [np.nan] * (RATE + 1), "," if self.separator == "," else "."
        self.beside.fill(row, cells)
        for k, quantity in enumerate(QUANTITIES):
            column = self.found.get(quantity)
            if column is None or (text := cells[column.position]) in _MISSING:
                continue
            try:
                row[k] = moments[text] if k == 0 and text in moments else float(text.replace(",", decimal, 1))
            except ValueError:
                raise InputError(
                    f'{where}: the {quantity} is "{text[:40]}", which is no number; expected a number of '
                    f"{column.unit.name}. Correct it, or leave the cell empty."
                ) from None
            if k == 0 and not abs(row[0]) * column.unit.multiply / column.unit.divide <= LATEST_S:
                raise InputError(
                    f"{where}: the time {text[:40]} {column.unit.name} is not that of a flight; state another unit, "
                    "such as --units time=ms, or correct it."
                )
        return row

    def check_clock(self, rows: Block) -> None:
        """Raise InputError for times that the reader of complete logs does not take for numbers in one unit."""
        said = self._other_clock(self._numbers(rows)[0][:, 0])
        self.stamps.begin_again()
        if said:
            raise InputError(said)

    def _other_clock(self, times: FloatArray) -> str:
        """What is wrong with times (n,) in the unit of the log, which are no numbers in one unit; or ""."""
        column, known = self.found["time"], np.isfinite(times)
        clock = self.stamps.clock(times, column)
        if not known.any() or clock.notes or (clock.time_s == column.unit.to_si(times))[known].all():
            return ""
        unit = next((word for word in re.findall(r"\w+", clock.words) if word in UNITS["time"] and word != "s"), "")
        cure = f"Say --units time={unit}, or" if unit else "Leave --follow out when the log is complete, or"
        return (
            f'{self.source}: the times in column "{column.name}" look like {clock.words}, and --follow reads numbers '
            f"in one stated unit. {cure} write the times in seconds."
        )

    def remarks(self) -> Iterator[str]:
        """What is assumed, or follows from the names."""
        stamps = bool(self.stamps.pattern)
        bare = [q for q, column in self.found.items() if not (column.unit_is_stated or (stamps and q == "time"))]
        names = self.names if self.beside.height is None else ()
        for remark in schema.remarks(names, self.found, stamps):
            other = ",".join(f"{quantity}={_OTHERS[quantity]}" for quantity in bare)
            yield f"{remark}; state others with --units, such as --units {other}" if bare else remark
            bare = []
        if said := conventions.in_words(self.station):
            yield f"readings: {', '.join(said)}"
        if (height := self.beside.height) is not None:
            yield f'"{height.name}" in {height.unit.name} stands for the elevation'
        if name := self.beside.unused:
            yield f'"{name}" is not used: --follow uses no heights beside elevations'
        yield from (
            f'"{column.name}" counts downwards and is turned round'
            for column in self.found.values()
            if column.key in DEPRESSIONS
        )

    def doubt(self, readings: FloatArray) -> str:
        """The question that these readings (n, 4) raise in a complete log, or the units that they show; else ""."""
        readings = np.where(np.isinf(readings), np.nan, readings)
        quantities = {quantity: readings[:, k] for k, quantity in enumerate(QUANTITIES) if quantity in self.found}
        unit = self.found["time"].unit
        times = readings[:, 0] * unit.divide / unit.multiply
        clock = self.stamps.clock(times, self.found["time"])
        try:
            judged = converting.judged(self.source, quantities, self.found, clock, self.given).found
        except InputError as error:
            return str(error)
        shown = ",".join(f"{q}={judged[q].unit.name}" for q, column in self.found.items() if judged[q] != column)
        if shown:
            rows = f"{self.source}: the first {len(readings)} rows look like other units than those assumed"
            return f"{rows}: if so, say --units {shown}."
        return self._other_clock(times)
