"""Names of columns in lines above the rows: words by the column that they stand over, in one line or several."""

from __future__ import annotations

import bisect
import itertools
import re
from collections.abc import Sequence

from ftproc.files.reading.meaning.names import taken_apart
from ftproc.files.words import QUANTITIES

#: Columns without a name above them: the name that they get -> how the rows begin.
_UNNAMED = {
    "Date": r"\s*\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}\s+\d{1,2}:\d{2}",
    "DOY": r"\s*\d{1,3}\s+\d{1,2}:\d{2}",
}
#: What may stand behind the last name and in no row: a separator, or a name of comments, as LabVIEW writes them.
_LAST_OF_NAMES = ("", "comment", "comments", "remark", "remarks", "note", "notes")


def joined_brackets(line: str) -> list[str]:
    """The words of a line, each with the bracket that follows it."""
    cells = re.findall(r"[^\s(\[]+(?:\s*[(\[][^)\]]{0,200}[)\]])?", line)
    return [str(cell) for cell in cells]


def closed_by_brackets(line: str) -> list[str]:
    """The words of a line up to each bracket, `Slant Range (m) Az (deg)`, if these are names."""
    cells = [cell.strip() for cell in re.findall(r"[^()\[\]]{1,200}[(\[][^()\[\]]{0,200}[)\]]", line)]
    names = [taken_apart(cell) for cell in cells]
    whole = line.rstrip().endswith((")", "]"))
    return cells if whole and all(name.foreign or any(map(name.means, QUANTITIES)) for name in names) else []


def aligned(line: str, block: Sequence[str], width: int) -> list[str]:
    """The words of a line by the column of numbers that each stands above, unless these hide names in others."""
    found = above_columns(line, block, width)
    return found if found and all(found) and known(found) >= known(line.split()) else []


def stacked(over: Sequence[str], block: Sequence[str], width: int) -> list[str] | None:
    """The names of columns that stand in two lines or three, one word above the other, in as many as make the most
    names known; None unless several are."""
    parts = [above_columns(line, block, width) for line in over]
    found = [_joined(parts[-count:]) for count in range(2, len(parts) + 1) if all(parts[-count:])]
    names = max((each for each in found if all(each)), key=known, default=[])
    return names if known(names) > 1 else None


def under_groups(names: Sequence[str], groups: Sequence[str]) -> list[str]:
    """The names of columns with the words over them, where these name groups of columns, such as merged cells, or where
    more names are known with them: Slant over Range, Elev over Angle."""
    filled = [name or group for name, group in zip(names, groups, strict=True)]
    whole = _joined([groups, names])
    return whole if known(whole) > known(filled) else filled


def known(names: Sequence[str]) -> int:
    """How many quantities the names are those of, each by one name alone."""
    meant = [tuple(name.means(quantity) > 0 for quantity in QUANTITIES) for name in map(taken_apart, names)]
    return sum(sum(each) == 1 for each in zip(*meant, strict=True))


def _joined(lines: Sequence[Sequence[str]]) -> list[str]:
    return [" ".join(filter(None, words)) for words in zip(*lines, strict=True)]


def above_columns(line: str, block: Sequence[str], width: int) -> list[str]:
    """The words above each column of numbers, "" where there are none; nothing if the rows do not line up."""
    centres = middles(block, width)
    if not centres:
        return []
    cells: list[list[str]] = [[] for _ in range(width)]
    for word in re.finditer(r"[^\s(\[]+ ?[(\[][^)\]]{0,200}[)\]]|\S+", line):
        behind = bisect.bisect(centres, centre := (word.start() + word.end()) / 2)
        beside = range(max(behind - 1, 0), min(behind + 1, width))
        cells[min(beside, key=lambda k: abs(centres[k] - centre))].append(word[0])
    return [" ".join(words) for words in cells]


def groups(line: str, cells: Sequence[str], by_blanks: bool, block: Sequence[str], width: int) -> list[str]:
    """What stands over each column in the line of names: an empty cell belongs to the name before it, and words two
    blanks apart from others to all the columns that they are nearest to; nothing if the rows do not line up."""
    if not by_blanks:
        return [next(filter(None, cells[k::-1]), "") for k in range(len(cells))]
    over = [(found.start() + found.end(), found[0]) for found in re.finditer(r"\S+(?: \S+)*", line)]
    nearest = [min(over, key=lambda each: abs(each[0] - 2 * middle)) for middle in middles(block, width) if over]
    return [words for _, words in nearest] if {*nearest} == {*over} else []


def middles(block: Sequence[str], width: int) -> list[float]:
    """The middle of each column of numbers, in characters; nothing if the rows do not line up."""
    spans = [[(m.start(), m.end()) for m in re.finditer(r"\S+", row)] for row in block]
    spans = [row for row in spans if len(row) == width]
    return [sum(low + high for low, high in column) / (2 * len(spans)) for column in zip(*spans, strict=True)]


def of_width(names: list[str], rows: Sequence[Sequence[str]], block: Sequence[str]) -> list[str] | None:
    """As many names as there are cells in each row; empty ones where all cells are, and for what stands without a name
    before the others."""
    width, empty = len(rows[0]), [not any(column) for column in zip(*rows, strict=False)]
    spare = width - len(names)
    if spare == 0:
        return names
    if spare == -1 and names[-1].lower() in _LAST_OF_NAMES:
        return names[:-1]
    if spare > 0 and all(empty[-spare:]):
        return [*names, *[""] * spare]
    if spare > 0 and all(empty[:spare]):
        return [*[""] * spare, *names]
    first = next((name for name, pattern in _UNNAMED.items() if block and _begin_with(block, pattern)), "")
    if spare == 1 and not first and known(names) > 1 and _are_numbered(rows, names):
        first = "row"
    return [first, *names] if spare == 1 and first else None


def _begin_with(block: Sequence[str], pattern: str) -> bool:
    """Whether all rows begin so."""
    return all(re.match(pattern, row) for row in block)


def _are_numbered(rows: Sequence[Sequence[str]], names: Sequence[str]) -> bool:
    """Whether the first cells count the rows, and are not themselves the time that the first name may be that of."""
    first, second = ([cells[k].strip('" ') for cells in rows] for k in (0, 1))
    if not all(cell.isdecimal() for cell in first) or {int(b) - int(a) for a, b in itertools.pairwise(first)} != {1}:
        return False
    numbers = [float(cell) for cell in second if re.fullmatch(r"\d+(?:\.\d+)?", cell)]
    steps = [later - before for before, later in itertools.pairwise(numbers)]
    evenly = bool(steps) and 0 < max(steps) < 1.001 * min(steps) + 1e-6
    return not taken_apart(names[0]).means("time") or evenly or not numbers
