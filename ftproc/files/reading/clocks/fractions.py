"""Fractions of a second that were written as whole numbers, 10:00:00.50 for 10:00:00.050."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ftproc.files.reading.meaning.numbers import as_text, without_text
from ftproc.records import FloatArray

if TYPE_CHECKING:
    import pyarrow as pa

    from ftproc.files.reading.formats.header import TableHeader
    from ftproc.files.reading.meaning.schema import Column

_PARTS = r"^(?P<head>.*:\d{2}|\d+)(?P<mark>[.,])(?P<number>\d{1,9})(?P<tail>\D*)$"
_FIRST = 2000  # cells in which some are longer than others, if any are
_FEWEST = 50  # numbers of several digits, of which one in ten begins with a zero where zeros are written
_EXACT = 1e-4  # of a tenth of a second
_APART_S = 0.5  # from row to row; nearer ones without their zeros fall somewhere
_ROLES = ("value", "time", "second")  # of columns with fractions of a second
_NOTE = "fractions of a second without their leading zeros, as .50 beside .100: taken for .050"


def restored(header: TableHeader, described: Column, table: pa.Table) -> tuple[pa.Table, tuple[str, ...]]:
    """The columns of a log, those of the time first, with the leading zeros of fractions, and a note; the same
    where none are missing."""
    import pyarrow as pa

    notes: tuple[str, ...] = ()
    for index, (role, position) in enumerate(zip(described.roles, described.positions, strict=True)):
        column = table[index]
        if role not in _ROLES or pa.types.is_temporal(column.type):
            continue
        values = without_text(column)
        written = column if values is None else header.written(position) if _lack(values) else None
        vary = written is not None and _vary(as_text(written.slice(0, _FIRST)))
        whole = _padded(as_text(written)) if vary else None
        if whole is not None:
            table, notes = table.set_column(index, table.field(index).name, whole), (_NOTE,)
    return table, notes


def _lack(values: FloatArray) -> bool:
    """Whether no fraction is below 0.1, though they have more digits than one, and times fall or are far apart."""
    steps = np.diff(values)
    if not (steps < 0).any() and np.nanmin(steps, initial=np.inf) < _APART_S:
        return False
    tenths = 10 * (values - np.floor(values))
    small = (tenths > _EXACT) & (tenths < 1 - _EXACT)
    return not small.any() and bool((np.abs(tenths - np.round(tenths)) > _EXACT).any())


def _padded(text: pa.ChunkedArray) -> pa.ChunkedArray | None:
    """The times with their leading zeros; None where none are missing.

    They are if some numbers are longer than others, none of several digits begins with a zero, and one ends with a
    zero: who leaves out the last zeros of a fraction writes no .50, and who leaves out none no .100 beside it. Then
    fewer times fall within a second than as they stand, or none do and the numbers are many.
    """
    import pyarrow.compute as pc

    parts = pc.extract_regex(text, pattern=_PARTS)
    head, mark, number, tail = (pc.struct_field(parts, name) for name in ("head", "mark", "number", "tail"))
    longest = pc.max(pc.utf8_length(number)).as_py() or 0
    begins, ends, several = (pc.match_substring_regex(number, pattern) for pattern in (r"^0\d", r"[1-9]0+$", r"\d\d"))
    if parts.null_count > text.null_count or pc.any(begins).as_py() or not pc.any(ends).as_py():
        return None
    padded = pc.utf8_lpad(number, longest, "0")
    shorter = pc.any(pc.and_(ends, pc.less(pc.utf8_length(number), longest))).as_py()
    before, after = _falls(head, number), _falls(head, padded)
    if after >= before and not (after == before == 0 and shorter and pc.sum(several).as_py() >= _FEWEST):
        return None
    return pc.binary_join_element_wise(head, mark, padded, tail, "")


def _falls(head: pa.ChunkedArray, number: pa.ChunkedArray) -> int:
    """How many fractions of a second are below the one before them in the same second."""
    import pyarrow.compute as pc

    same = pc.equal(head.slice(1), head.slice(0, len(head) - 1))
    return int(pc.sum(pc.and_(same, pc.less(number.slice(1), number.slice(0, len(number) - 1)))).as_py() or 0)


def _vary(text: pa.ChunkedArray) -> bool:
    """Whether all times have fractions, some of more digits than others."""
    import pyarrow.compute as pc

    parts = pc.extract_regex(text, pattern=_PARTS)
    shortest, longest = pc.min_max(pc.utf8_length(pc.struct_field(parts, "number"))).as_py().values()
    return parts.null_count == text.null_count and shortest is not None and shortest < longest
