"""Fractions of a second that were written as whole numbers, 10:00:00.50 for 10:00:00.050."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pyarrow as pa

_PARTS = r"^(?P<head>.*:\d{2})(?P<mark>[.,])(?P<number>\d{1,6})(?P<tail>\D*)$"
_FIRST = 2000  # cells in which some are longer than others, if any are
NOTE = "fractions of a second without their leading zeros, as .50 beside .100: taken for .050"


def padded(text: pa.ChunkedArray) -> tuple[pa.ChunkedArray, str]:
    """The times with their leading zeros, and a note; the same and "" where none are missing.

    They are if some numbers are longer than others, none of several digits begins with a zero, and a shorter one ends
    with a zero: who leaves out the last zeros of a fraction writes no .50, and who leaves out none no .100 beside it.
    """
    import pyarrow.compute as pc

    if not _vary(text.slice(0, _FIRST)):
        return text, ""
    parts = pc.extract_regex(text, pattern=_PARTS)
    number = pc.struct_field(parts, "number")
    length = pc.utf8_length(number)
    longest = pc.max(length).as_py() or 0
    begins = pc.match_substring_regex(number, r"^0\d")
    ends = pc.and_(pc.less(length, longest), pc.match_substring_regex(number, r"[1-9]0$"))
    if parts.null_count > text.null_count or pc.any(begins).as_py() or not pc.any(ends).as_py():
        return text, ""
    number = pc.utf8_lpad(number, longest, "0")
    head, mark, tail = (pc.struct_field(parts, name) for name in ("head", "mark", "tail"))
    return pc.binary_join_element_wise(head, mark, number, tail, ""), NOTE


def _vary(text: pa.ChunkedArray) -> bool:
    """Whether the fractions of some times have more digits than others."""
    import pyarrow.compute as pc

    lengths = pc.utf8_length(pc.struct_field(pc.extract_regex(text, pattern=_PARTS), "number"))
    shortest, longest = pc.min_max(lengths).as_py().values()
    return shortest is not None and shortest < longest
