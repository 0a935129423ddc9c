"""Which column may be which, by the values of a log whose names do not say so: for a question, not for a guess."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ftproc.files.reading.clocks import notations
from ftproc.files.reading.clocks.clock import DAY_S
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.meaning.numbers import as_text, parsed, without_text
from ftproc.files.reading.meaning.questions import Propose
from ftproc.records import FloatArray

if TYPE_CHECKING:
    import pyarrow as pa

_UNNAMED = ("", "index", "__index_level_0__", "Unnamed: 0")
_COUNTERS = ("", *"nik", *("no", "nr", "num", "number", "row", "index", "idx", "id", "sample", "count", "seq", "frame"))
_ROWS = 2000
_MOST_COLUMNS = 60
_RISES = 0.98  # of the steps of a time are forward


def by_values(header: TableHeader) -> Propose:
    """How columns of a table are proposed: the time goes forward, the others vary and are numbers."""
    return partial(_proposed, header)


def the_moments(header: TableHeader, free: Sequence[int]) -> int | None:
    """The column of timestamps or durations among those that have no name, as pandas writes its index; or None."""
    places = [place for place in free if header.names[place] in _UNNAMED]
    table = header.load([], places) if places else None
    found = [place for k, place in enumerate(places) if table is not None and _are_moments(table.column(k))]
    return found[0] if len(found) == 1 else None


def _are_moments(column: pa.ChunkedArray) -> bool:
    import pyarrow as pa

    if pa.types.is_temporal(column.type):
        return True
    return without_text(column) is None and bool(notations.matching(as_text(column), notations.STAMPS))


def _proposed(header: TableHeader, free: Sequence[int], sought: Sequence[str]) -> Mapping[str, int]:
    places = list(free)[:_MOST_COLUMNS]
    if not places:
        return {}
    table = header.load([], places).slice(0, _ROWS)
    read = {place: _values(table.column(k), header.decimal_comma) for k, place in enumerate(places)}
    varied = {place: values for place, values in read.items() if len(values) > 1 and values.max() > values.min()}
    forward = [place for place, values in varied.items() if np.mean(values[1:] > values[:-1]) > _RISES]
    spare = len(varied) > len(sought) and len(forward) > 1
    steady = [place for place in forward if (varied[place][1:] == varied[place][:-1] + 1).all()]
    counters = [place for place in steady if spare or header.names[place].lower().strip("#. ") in _COUNTERS]
    found: dict[str, int] = {}
    if "time" in sought:
        if not forward or set(forward) == set(counters):
            return {}
        found["time"] = next((place for place in forward if place not in counters), forward[0])
    rest = [place for place in varied if place not in (*found.values(), *counters)]
    others = [quantity for quantity in sought if quantity != "time"]
    return {**found, **dict(zip(others, rest, strict=False))}


def _values(column: pa.ChunkedArray, decimal_comma: bool) -> FloatArray:
    """The numbers or times of a column, those that are there; none of others."""
    values = without_text(column)
    if values is None:
        text = as_text(column)
        values = parsed(text, decimal_comma)
        if values is None:
            moments = next(iter(notations.matching(text, notations.STAMPS).values()), None)
            values = np.zeros(0) if moments is None else moments.day * DAY_S + moments.second
    return values[np.isfinite(values)]
