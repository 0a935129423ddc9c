"""Where the table is in a text: comment and title lines, the line of names, a row of units, the separator.

The separator is the one by which the most lines in a row have the same number of cells, most of them numbers or times;
the line of names stands directly above these lines.
"""

from __future__ import annotations

import csv
import itertools
import re
from collections.abc import Callable, Sequence
from typing import NamedTuple

from ftproc.files.reading.formats import headings
from ftproc.files.reading.meaning import parts
from ftproc.files.reading.meaning.names import taken_apart
from ftproc.files.reading.meaning.preamble import are_units, enumerated, spread, units_stated
from ftproc.files.words import QUANTITIES

#: How comment lines begin. A semicolon does so too, where it is not the separator.
COMMENTS = ("#", "%", "//", "!", "*", "REM ", "C ")
BLANKS = " "  # the separator of columns that are apart by blanks
_SEPARATORS = ("\t", ";", "|", ",", BLANKS)  # the first of those that fit as well counts
_MOST_LINES = 2000
_ENOUGH = 0.9  # of the longest table, for a separator earlier in the list
LINE = re.compile(rb"[\r\n]*([^\r\n]*)(?:\r\n|\r|\n)?")
_CELL = re.compile(r'"?\s*[+-]?[.,]?\d\S*\s*"?')
#: Cells with blanks inside: a date and a time of day, degrees, minutes and seconds, a date by name, a number and unit.
_WITH_BLANKS = re.compile(
    r'"?\s*(?:'
    r"[+-]?\d[\d./:-]*[T ]+\d{1,2}:\d\S*(?:\s*[AaPp][Mm]|\s*\S{1,6})?"
    r"|[+-]?\d{1,3}[°d]?\s+\d{1,2}['m]?\s+\d{1,2}(?:[.,]\d*)?[\"s]?"
    r"|\d{1,2}[ -]\w{3,9}[ -]\d{2,4}.*"
    r"|\d\S*\s?[A-Za-z°%/]+"
    r')\s*"?'
)
_LONGEST_HEADING = 20_000  # characters of a line that is taken apart in several ways
_LONGEST_CELL = 200  # characters of a number or a time
RULE = re.compile(r"(?=[+*#|,;:\s]*+(?:[-=_][+*#|,;:\s]++)*+[-=_]{2})[-=_+*#|,;:\s]*+")
_NUMBERED = re.compile(r"^\d+\s*[:=)]\s*(?=[^\W\d])")  # a number before a name: `1:time`
_CALLED = re.compile(
    r"^\s*(?:columns?|fields?|names?|header)\s*[:=]\s*", re.IGNORECASE
)  # before the names in a comment
_NOTHING = re.compile(r"\s*[\"']?(nan|null|none|n/?a|nil|[-*?.]+|)[\"']?\s*", re.IGNORECASE)
_TYPE = re.compile(  # how programs call those of their values
    r"[#(\[<' ]*(?:(?P<number>float|double|real|single|u?int|integer|long|short|number|numeric|decimal)|string|str|text"
    r"|(?:var)?char|object|datetime|timestamp|date|time|bool(?:ean)?)\d*[)\]>' ]*",
    re.IGNORECASE,
)


class Layout(NamedTuple):
    """names: of the columns, numbers from 1 where the file has none. first: number of the first line of data, among
    the lines as `lines` numbers them. separator: one character, or BLANKS. units: cells of a row of units. above:
    lines that are neither. named: there is a line of names. cells: in a row. row_of_units: else lines above state
    the units. said: the lines above the names."""

    names: list[str]
    first: int
    separator: str
    units: list[str]
    above: int
    named: bool
    cells: int
    row_of_units: bool
    said: Sequence[str] = ()


def find(lines: Sequence[str], widths: Sequence[int] = ()) -> Layout | None:
    """The layout of a text from its first lines (the empty ones too), or None if no line is like a row."""
    filled = [number for number, line in enumerate(lines[:_MOST_LINES]) if line.strip()]
    tables = {}
    for separator in ("",) if widths else _SEPARATORS:
        rows = {number: split(lines[number], separator, widths) for number in filled}
        start, length = _longest(filled, rows, _between([lines[number] for number in filled]))
        if length:
            tables[separator] = (start, length, rows)
    if not tables:
        return None
    most = max(length for _, length, _ in tables.values())
    separator = next(s for s, (_, length, _) in tables.items() if length >= _ENOUGH * most)
    start, _, rows = tables[separator]
    start = _first(lines, filled, start, separator, rows, widths)
    return _with_names(lines, filled, start, separator, rows, widths)


def split(line: str, separator: str, widths: Sequence[int] = ()) -> list[str]:
    """The cells of a line."""
    if widths:
        return [line[low:high].strip() for low, high in itertools.pairwise([0, *itertools.accumulate(widths)])]
    if separator == BLANKS:
        return line.split()
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]
    except (csv.Error, StopIteration):
        return [line]


def is_data(cells: Sequence[str], strictly: bool = False) -> bool:
    """Whether at least half (strictly: all) of the cells that hold something are numbers or times."""
    present = [cell for cell in cells if not _is_nothing(cell)]
    short = (cell for cell in present if len(cell) <= _LONGEST_CELL)
    numbers = sum(bool(_CELL.fullmatch(cell) or _WITH_BLANKS.fullmatch(cell)) for cell in short)
    return bool(numbers) and (numbers == len(present) if strictly else 2 * numbers >= len(present))


def _is_nothing(cell: str) -> bool:
    return len(cell) <= _LONGEST_CELL and _NOTHING.fullmatch(cell) is not None


def _between(lines: Sequence[str]) -> list[bool]:
    """Whether each line may stand between rows and is none of them: a comment, or names that stand above them too."""
    return [
        is_comment(line)
        or (line in lines[:index] and not any(is_data(split(line, separator)) for separator in _SEPARATORS))
        for index, line in enumerate(lines)
    ]


def _longest(filled: Sequence[int], rows: dict[int, list[str]], between: Sequence[bool]) -> tuple[int, int]:
    """Index in `filled` of the first of the most consecutive rows with as many cells, and their number; some lines may
    stand between them."""
    best, start, length, width = (0, 0), 0, 0, 0
    for index, number in enumerate(filled):
        if between[index]:
            continue
        cells = rows[number]
        fits = len(cells) > 1 and is_data(cells) and not is_comment(cells[0])
        if fits and len(cells) == width and length:
            length += 1
        elif fits:
            start, length, width = index, 1, len(cells)
        elif length and len(cells) == width and (all(map(_is_nothing, cells)) or is_data(cells[:1])):
            length += 1
        else:
            length = 0
        if length > best[1]:
            best = (start, length)
    return best


def _first(
    lines: Sequence[str], filled: Sequence[int], start: int, separator: str, rows: dict[int, list[str]],
    widths: Sequence[int],
) -> int:  # fmt: skip
    """Index in `filled` of the first row under the names, where other lines than comments stand between rows: of more
    rows under the same names, or under none of their own, those before are the beginning."""
    width, block = len(rows[filled[start]]), [lines[number] for number in filled[start : start + 50]]
    names, top = list[str](), start
    for index in range(start - 1, -1, -1):
        if is_data(rows[filled[index]]):
            continue
        found = _heading(lines[filled[index]], separator, width, block, widths) or []
        if headings.known(found) > 1:
            if names and found != names:
                break
            names, top = found, index
    above = next((index for index in range(top + 1, start) if is_data(rows[filled[index]])), start)
    return above if len(rows[filled[above]]) == width else start


def is_comment(text: str) -> bool:
    """Whether a line that begins so is a comment."""
    return text.lstrip().startswith(COMMENTS)


def _with_names(
    lines: Sequence[str], filled: Sequence[int], start: int, separator: str, rows: dict[int, list[str]],
    widths: Sequence[int],
) -> Layout:  # fmt: skip
    """The names above the rows; lines between them that hold numbers count as rows too, wrong ones."""
    width = len(rows[filled[start]])
    block = [lines[number] for number in filled[start : start + 50]]
    top = start
    while top and not RULE.fullmatch(lines[filled[top - 1]]):
        above = rows[filled[top - 1]]
        if not (is_data(above, strictly=True) or (len(above) == width and all(map(_is_nothing, above)))):
            break
        top -= 1
    units: list[str] = []
    index = top - 1
    while index >= 0 and (RULE.fullmatch(line := lines[filled[index]]) or _are_types(split(line, separator, widths))):
        index -= 1  # a rule, or types of numbers, under the names
    over = [lines[number] for number in filled[: index + 1]]
    index = _above_comments(over, index, lambda line: _heading(line, separator, width, block, widths))
    if index >= 0:
        cells = _heading(lines[filled[index]], separator, width, block, widths)
        if cells is None and index and are_units(few := split(lines[filled[index]], separator, widths)):
            named = _heading(lines[filled[index - 1]], separator, width, block, widths) or []
            stack = headings.stacked([lines[number] for number in filled[max(index - 2, 0) : index + 1]], block, width)
            cells = spread(few, named) if headings.known(named) > headings.known(stack or []) else []
        if cells and are_units(cells) and index:
            units, index = cells, index - 1
    names = None if index < 0 else _heading(lines[filled[index]], separator, width, block, widths)
    groups = (
        headings.groups(lines[filled[index]], names or [], separator == BLANKS, block, width)
        if units and not widths
        else []
    )
    names, units = parts.under(groups, units) or (names, units)
    if names is not None and sum(bool(_CELL.fullmatch(_NUMBERED.sub("", name))) for name in names) > len(names) / 2:
        names = None
    names = enumerated([lines[number] for number in filled[:top]], width) or names
    if names is None and top < start:  # the numbers above belong to something else
        return _with_names(lines, filled, start, separator, {**rows, **{n: [""] for n in filled[top:start]}}, widths)
    if names is None and index >= 0 and top - index == 1 and (cells := _mismatched(lines[filled[index]], separator)):
        names = cells  # the rows have too many or too few cells, and are refused
    over = [lines[number] for number in filled[max(index - 2, 0) : index + 1]]
    if names is None and separator == BLANKS:
        names = headings.stacked(over, block, width)
    elif names is not None and len(over) > 1:
        groups = split(over[-2], separator, widths) if separator != BLANKS else []
        names = headings.under_groups(names, groups) if len(groups) == len(names) else names
    numbers = [str(k + 1) for k in range(width)]
    found = numbers if names is None else names
    if len(units) != len(found):
        units = []
    first, row_of_units = filled[top], bool(units)
    said = [lines[number] for number in filled[: max(index, 0)]]
    if names is not None and not units:
        units = units_stated(said, names)
    return Layout(found, first, separator, units, max(index, 0) if names is not None else top, names is not None, width,
                  row_of_units, said)  # fmt: skip


def _are_types(cells: Sequence[str]) -> bool:
    """Whether all cells are types of values, some of them of numbers: string, float64, (real)."""
    found = [_TYPE.fullmatch(cell) for cell in cells]
    return all(found) and any(each and each["number"] for each in found)


def _above_comments(lines: Sequence[str], index: int, heading: Callable[[str], list[str] | None]) -> int:
    """The index of the line of names, or of units, where comments stand between these and the rows."""
    for above in range(index, -1, -1):
        cells = heading(lines[above]) or []
        if are_units(cells) or sum(any(map(taken_apart(cell).means, QUANTITIES)) for cell in cells) > 1:
            return above
        if not is_comment(lines[above]):
            break
    return index


def _mismatched(line: str, separator: str) -> list[str]:
    """The cells of a line that may be names, though there are not as many as in a row; else nothing."""
    cells = split(line, separator)
    plain = all(re.fullmatch(r"[A-Za-z_]\w*(?: ?[(\[].{1,8}[)\]])?", cell) for cell in cells)
    return cells if plain and separator != BLANKS and len(cells) > 1 else []


def _heading(line: str, separator: str, width: int, block: Sequence[str], widths: Sequence[int]) -> list[str] | None:
    """The cells of a line above the rows if there are as many as in a row; it may begin as comments do. Cells that are
    apart in another way than those of the rows count if they are names; of several ways the one with the most names."""
    bare = line
    mark = next((mark for mark in (*COMMENTS, ";") if line.lstrip().startswith(mark) and mark != separator), "")
    if mark and not widths:
        bare = line.replace(mark, "", 1) if separator != BLANKS else line.replace(mark, " " * len(mark), 1)
        bare = re.sub(r"^(\s*)[#%/]+", r"\1", bare)
    if mark:
        bare = _CALLED.sub("", bare)
    ways = [split(bare, separator, widths)]
    if len(bare) > _LONGEST_HEADING:
        return ways[0] if len(ways[0]) == width else None
    if separator in (BLANKS, "\t"):
        ways += [bare.split(), headings.joined_brackets(bare)]
    if separator == BLANKS:
        ways.append(headings.aligned(bare, block, width))
    others = [] if widths else [split(bare, mark) for mark in _SEPARATORS if mark != separator and mark in bare]
    groups = re.split(r"\s{2,}|\t", bare.strip())
    others += [] if widths else [headings.closed_by_brackets(bare)]
    ways = [way for way in ways if len(groups) < 2 or headings.known(way) >= headings.known(groups)]
    (ways if separator == BLANKS else others).append(groups)
    rows = [split(row, separator, widths) for row in block]
    found = [headings.of_width(way, rows, block if separator == BLANKS else ()) for way in ways]
    more = [headings.of_width(way, rows, ()) for way in others]
    found += [names for names in more if names and (headings.known(names) > 1 or are_units(names))]
    return max(filter(None, found), key=headings.known, default=None)
