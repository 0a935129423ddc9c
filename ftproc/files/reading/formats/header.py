"""The header of a table: its columns by name, and the functions that load them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from ftproc.files.limits import check_names

if TYPE_CHECKING:
    import pyarrow as pa


class Blocks(NamedTuple):
    """tables: columns of a file, block by block in file order. rows: the approximate number of rows in all."""

    tables: Iterator[pa.Table]
    rows: int


@dataclass(frozen=True)
class TableHeader:
    """A table whose rows are not read yet.

    source: what the user called it, for messages. names: its columns in file order, possibly with repeats.
    load: (numeric positions, other positions) -> table of these columns, the numeric ones first.
    decimal_comma: numbers may have decimal commas. metadata: key-value pairs of the file.
    blocks: numeric positions -> these columns block by block if the file is large, else None.
    units: the cells of a row of units under the names, or nothing. form: the kind of file and how it is laid out.
    """

    source: str
    names: list[str]
    load: Callable[[Sequence[int], Sequence[int]], pa.Table]
    decimal_comma: bool = False
    metadata: Mapping[bytes, bytes] = field(default_factory=dict)
    blocks: Callable[[Sequence[int]], Blocks | None] = lambda numeric: None
    units: Sequence[str] = ()
    form: str = ""

    def __post_init__(self) -> None:
        check_names(self.source, self.names)


def of_arrow(
    table: pa.Table, source: str, form: str = "", units: Sequence[str] = (), decimal_comma: bool = False
) -> TableHeader:
    """The header of a table in memory."""
    return TableHeader(
        source,
        list(table.column_names),
        lambda numeric, others: table.select([*numeric, *others]),
        decimal_comma,
        table.schema.metadata or {},
        units=units,
        form=form,
    )
