"""The header of a table: its columns by name, and the functions that load them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

from ftproc.files.limits import check_names
from ftproc.files.reading.meaning.names import taken_apart
from ftproc.files.words import QUANTITIES

if TYPE_CHECKING:
    import pyarrow as pa


class Blocks(NamedTuple):
    """tables: columns of a file, block by block in file order. rows: the approximate number of rows in all."""

    tables: Iterator[pa.Table]
    rows: int


class Stated(NamedTuple):
    """What the standard of a file says of its columns, so that nobody is asked.

    columns: {quantity: name of its column, or none}. azimuth_from: as in `Station`. target, station: the columns that
    tell targets and stations apart. questions: {quantity: what the standard leaves open}, asked unless the user states
    its column or unit. notes: what the file holds beside.
    """

    columns: Mapping[str, str] = {}
    azimuth_from: str = ""
    target: str = ""
    station: str = ""
    questions: Mapping[str, str] = {}
    notes: tuple[str, ...] = ()


_NOTHING = Stated()


@dataclass(frozen=True)
class TableHeader:
    """A table whose rows are not read yet.

    source: what the user called it, for messages. names: its columns in file order, possibly with repeats.
    load: (numeric positions, other positions) -> table of these columns, the numeric ones first.
    decimal_comma: numbers may have decimal commas. metadata: key-value pairs of the file.
    blocks: numeric positions -> these columns block by block if the file is large, else None.
    units: the cells of a row of units under the names, or nothing. above: the lines above the
    names. form: the kind of file and how it is laid out. stated: by the standard of the file. sha256: of the bytes of
    the file, as it is stored; "" of a table in memory. written: a position -> the cells of the column as they stand;
    None where the file holds numbers.
    """

    source: str
    names: list[str]
    load: Callable[[Sequence[int], Sequence[int]], pa.Table]
    decimal_comma: bool = False
    metadata: Mapping[bytes, bytes] = field(default_factory=dict)
    blocks: Callable[[Sequence[int]], Blocks | None] = lambda numeric: None
    units: Sequence[str] = ()
    form: str = ""
    above: Sequence[str] = ()
    stated: Stated = _NOTHING
    sha256: Callable[[], str] = lambda: ""
    written: Callable[[int], pa.ChunkedArray | None] = lambda index: None

    @property
    def is_of_a_standard(self) -> bool:
        """Whether nothing is left to be asked about its columns but what `stated` says."""
        return self.stated._replace(notes=()) != _NOTHING

    def noting(self, note: str) -> TableHeader:
        """The same with one more note on what the file holds; itself without one."""
        notes = (*self.stated.notes, note)
        return replace(self, stated=self.stated._replace(notes=notes)) if note else self

    def __post_init__(self) -> None:
        check_names(self.source, self.names)


def of_arrow(
    table: pa.Table, source: str, form: str = "", units: Sequence[str] = (), decimal_comma: bool = False
) -> TableHeader:
    """The header of a table in memory, the values inside structures as columns of their own: `polar.rho`."""
    import pyarrow as pa

    while any(pa.types.is_struct(field.type) for field in table.schema):
        table, units = table.flatten(), ()
    return TableHeader(
        source,
        list(table.column_names),
        lambda numeric, others: table.select([*numeric, *others]),
        decimal_comma,
        table.schema.metadata or {},
        units=units,
        form=form,
    )


def units_of(schema: pa.Schema) -> list[str]:
    """The units that the metadata of each field states, "" where none; nothing if none does."""
    stated = [{key.lower(): text for key, text in (field.metadata or {}).items()} for field in schema]
    units = [(each.get(b"unit") or each.get(b"units") or b"").decode("utf-8", "replace") for each in stated]
    return units if any(units) else []


def is_log(names: Sequence[str], units: Mapping[str, str]) -> bool:
    """Whether columns have the names of a time and of a reading. units: of some of them."""
    apart = [taken_apart(name, units.get(name, "")) for name in names]
    found = {quantity for quantity in QUANTITIES for name in apart if name.means(quantity)}
    return "time" in found and len(found) > 1
