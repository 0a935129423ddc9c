"""What is known of a table when only its header was looked at, and how large it may be."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import pyarrow as pa

#: What a packed file may grow to, lest a few bytes fill the memory: real readings shrink to a half, not to a 200th.
MOST_GROWTH = 200
_ALWAYS_ALLOWED = 64 << 20  # bytes
#: Bytes of a CSV file, or of what is read of a Parquet file, from which on it is read in blocks.
LARGE = 32 << 20


class Blocks(NamedTuple):
    """tables: columns of a file, block by block in its order. rows: roughly how many there are in all."""

    tables: Iterator[pa.Table]
    rows: int


def _not_large(numeric: Sequence[int]) -> Blocks | None:
    return None


@dataclass(frozen=True)
class OpenTable:
    """A table of which so far only the header was looked at.

    source: what the user called it, for messages. names: its columns in file order, possibly with repeats.
    load: (numeric positions, other positions) -> table with these columns; see `CsvText.load`.
    decimal_comma: numbers may have decimal commas. metadata: key-value pairs of a Parquet file. blocks: numeric
    positions -> these columns block by block, when the file is so large that they should be read so, else None.
    """

    source: str
    names: list[str]
    load: Callable[[Sequence[int], Sequence[int]], pa.Table]
    decimal_comma: bool = False
    metadata: Mapping[bytes, bytes] = field(default_factory=dict)
    blocks: Callable[[Sequence[int]], Blocks | None] = field(default=_not_large)


def of_arrow(table: pa.Table, name: str) -> OpenTable:
    """A table in memory."""
    return OpenTable(
        name,
        list(table.column_names),
        lambda numeric, others: table.select([*numeric, *others]),
        metadata=table.schema.metadata or {},
    )


def most_bytes(packed: int) -> int:
    """What a file of so many packed bytes may become in memory."""
    return max(_ALWAYS_ALLOWED, MOST_GROWTH * packed)
