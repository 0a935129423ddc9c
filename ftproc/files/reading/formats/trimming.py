"""What is no row of a text: comments, words and repeated names among the rows, lines below them, and drawn boxes."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence

import numpy as np

from ftproc.errors import InputError
from ftproc.files import limits
from ftproc.files.reading.formats import layout

#: Between cells; and how many may be in a line, of which some may stand at its ends.
_MARKS, MOST_MARKS = (b",", b";", b"\t", b"|"), limits.MOST_COLUMNS + 2
_FOOTER = 30  # lines at the end of a file, at most
_COMMENT = re.compile(rb"(?m)^[ \t]*(?:#|%|//|!)[^\r\n]*(?:\r\n|\r|\n|\Z)")
#: A comment behind a row, of which the last cell is a number.
_BEHIND_A_NUMBER = re.compile(
    rb"(?m)^([ \t]*[-+.]?\d(?:[^\r\n,;|\t]{0,400}?|[^\r\n]{0,400}?[,;|\t] *[-+]?[\d.][\d.eE+-]{0,30}?)(?<=\d))"
    rb"[ \t]+(?:#|//|!)[ \t][^\r\n]*"
)
#: First cells of rows below the table that sum it up, in small letters.
_SUMS = frozenset(
    [
        *("mean", "average", "avg", "median", "min", "minimum", "max", "maximum", "sum", "total", "totals", "count"),
        *("std", "stdev", "std dev", "stddev", "sigma", "standard deviation", "rms", "variance", "var"),
        *("mittelwert", "mittel", "summe", "anzahl", "moyenne", "promedio", "media", "平均", "平均值", "среднее"),
    ]
)
_COUNTED = re.compile(r"\W*\d[\d,.]*\s+(rows?|records?|lines?|samples?|points?|entries|zeilen)\b.*", re.IGNORECASE)
_FEW = 0.2  # of the lines, that may be words among the rows
_LETTERS, _MARKING = np.arange(ord("a"), ord("z") + 1), np.frombuffer(b'*-;"=_', np.uint8)
_UNDER = 3  # lines under repeated names, at most, such as units and a rule
_LAST = 4096  # bytes in which the last line is sought
_ALIKE, _MOST_ALIKE = 1 << 16, 500  # bytes and lines before a cut line that show what its cells should be
_NUMBER_MARKS = re.compile("[.,:eE]")
_FEWEST, _MOST_FREE = 3, 20  # rows that show how many digits a cell should have, and where these differ


def refuse_wide(source: str, head: bytes) -> None:
    """Raise InputError for a line of too many cells, before it is split into them."""
    for line in head.splitlines():
        if len(line) > limits.MOST_COLUMNS and max(len(line.split()) - 1, *map(line.count, _MARKS)) >= MOST_MARKS:
            raise limits.too_many_columns(source)


def is_boxed(data: bytes) -> bool:
    """Whether a text begins with a bar or a rule of a drawn table."""
    return re.match(rb"\s*(?:\||\+[-=+]+\+)", data) is not None


def unboxed(data: bytes) -> bytes:
    """A table without the bars at the ends of its lines and the rules that databases and Markdown draw round it."""
    if not is_boxed(data):
        return data
    without_rules = re.sub(rb"(?m)^[ \t]*+[|+](?=[=+|: \t]*+-)[-=+|: \t]*+(?:\r\n|\r|\n|\Z)", b"", data)
    return re.sub(rb"(?m)^[ \t]*\|(.*)\|[ \t]*(?=\r?$)", rb"\1", without_rules)


def without_comments_behind(data: bytes) -> tuple[bytes, str]:
    """A text without the comments that stand behind rows, `12.5, 1000 # lock lost`, and in words what was left out."""
    if not any(mark in data for mark in (b"# ", b"// ", b"! ", b"#\t")):
        return data, ""
    plain, count = _BEHIND_A_NUMBER.subn(rb"\1", data)
    return plain, f", {count} comments behind rows" if count else ""


def rows_only(
    source: str, body: memoryview, names: Sequence[str], separator: str, widths: Sequence[int]
) -> tuple[memoryview, str, str]:
    """The rows without lines of text among and below them and without a last one that is cut off, in words what was
    left out, and a note on the cut one. Raises InputError where other names stand among them."""
    whole, words = body.tobytes(), ""
    if _has_comments(whole):
        comments = [m.span() for m in _COMMENT.finditer(whole) if not _is_row(m[0], names, separator, widths)]
        whole = _without(whole, comments)
        words += f", {len(comments)} comment lines among the rows" if comments else ""
    repeated = _repeated_names(source, whole, names, separator, widths)
    if repeated:
        whole = _without(whole, repeated)
        words += f", the names repeated {len(repeated)} times"
    sentences = _sentences(whole, names, separator, widths)
    if sentences:
        whole = _without(whole, sentences)
        words += f", {len(sentences)} lines of words among the rows"
    if zeros := len(whole) - len(whole.rstrip(b"\0")):  # of a file that was made longer beforehand
        whole = whole[:-zeros]
        words += f", {zeros} zeros behind the rows"
    end, footer = _end(whole, names, separator, widths)
    words += f", {footer} lines below the table" if footer else ""
    rows = memoryview(whole)[:end]
    cut, note = cut_off(rows, len(names), separator, widths)
    return rows[: end - cut], words, note


def cut_off(rows: bytes | memoryview, width: int, separator: str, widths: Sequence[int] = ()) -> tuple[int, str]:
    """How many bytes at the end of rows of `width` cells are one that was cut off while it was written, and a note on
    it: it has no end, and fewer cells than the rows above or fewer digits in its last cell than any of them."""
    above, ended, line = bytes(rows[-_ALIKE:]).replace(b"\r", b"\n").rpartition(b"\n")
    if not ended or not line.strip():
        return 0, ""
    texts = [each.decode("utf-8", "replace") for each in (line, *above.split(b"\n")[-_MOST_ALIKE:])]
    cells, *others = (layout.split(text, separator, widths) for text in texts)
    others = [each for each in others if len(each) == width]
    others = [each for each in others if each[0] == cells[0]] or others
    last = max((k for k, cell in enumerate(cells) if cell), default=0)
    alike = [each[last] for each in others if layout.is_data(each[last : last + 1])]
    begins_alike = others and (cells[0] == others[-1][0] or layout.is_data(cells[:1]))
    if not (begins_alike and len(cells) < width) and not (alike and _is_shorter(cells[last], alike)):
        return 0, ""
    return len(line), cut_off_note(texts[0])


def cut_off_note(line: str) -> str:
    return f'the last line, "{line.strip()[:80]}", is cut off, so it is left out'


def words_cut_off(text: bytes) -> tuple[int, str]:
    """As `cut_off`, of lines of names and values."""
    words = re.sub(rb"[^\r\n\w.+-]", b" ", text[-_ALIKE:])
    _, _, before = words.replace(b"\r", b"\n").rpartition(b"\n")[0].rstrip(b"\n").rpartition(b"\n")
    gone, _ = cut_off(words, len(before.split()), layout.BLANKS) if before.strip() else (0, "")
    return gone, cut_off_note(text[-gone:].decode("utf-8", "replace")) if gone else ""


def _is_shorter(last: str, above: Sequence[str]) -> bool:
    """Whether a number has fewer digits behind its last mark than any of those above it, or, without a mark, is much
    shorter than the one above it."""
    parts, *others = (re.split(_NUMBER_MARKS, cell) for cell in (last, *above))
    digits = [len(each[-1]) for each in others]
    if len(above) < (_MOST_FREE if min(digits) < max(digits) else _FEWEST):
        return False
    if min(map(len, others)) > 1:
        return len(parts) < min(map(len, others)) or len(parts[-1]) < min(digits)
    plain = last.isdecimal() and above[-1].isdecimal()
    return plain and len(last) < min(map(len, above)) and 2 * int(last) < int(above[-1])


def _without(whole: bytes, spans: Sequence[tuple[int, int]]) -> bytes:
    ends, starts = [0, *(end for _, end in spans)], [*(start for start, _ in spans), len(whole)]
    return b"".join(whole[low:high] for low, high in zip(ends, starts, strict=True))


def _end(whole: bytes, names: Sequence[str], separator: str, widths: Sequence[int]) -> tuple[int, int]:
    """Where the last row ends, and the number of lines below it."""
    begins_with_number = _begins_with_number(whole, separator, widths)
    end, footer = len(whole), 0
    while footer < _FOOTER:
        tail = whole[max(end - _LAST, 0) : end]
        line = re.search(rb"(?:\A|[\r\n])([^\r\n]+)[\r\n]*\Z", tail)
        text = "" if line is None else line[1].decode("utf-8", "replace")
        cells = layout.split(text, separator, widths)
        summed = begins_with_number and len(cells) == len(names) and is_sum(cells)
        if line is None or not (summed or _is_footer(text, names, separator, widths)):
            break
        end -= len(tail) - line.start(1)
        footer += 1
    return end, footer


def _sentences(whole: bytes, names: Sequence[str], separator: str, widths: Sequence[int]) -> list[tuple[int, int]]:
    """Where lines of words and rules stand among the rows, such as `*** LOST TRACK ***`, if they are few."""
    if widths or len(names) < 2:
        return []
    letters = np.frombuffer(whole, np.uint8)
    ruled = any(b"\n" + mark in whole for mark in (b"--", b"==", b"__"))
    if not len(letters) or (letters.max() < ord("A") and not ruled):  # digits and marks only
        return []
    starts = np.flatnonzero(letters == ord("\n")) + 1
    begins = starts[starts < len(letters)]
    if separator == layout.BLANKS:  # which rows may begin with too
        filled = np.flatnonzero(letters != ord(" "))
        begins = filled[np.searchsorted(filled[:-1], begins)]
    first = letters[begins]
    odd = starts[: len(first)][np.isin(first | 0x20, _LETTERS) | np.isin(first, _MARKING)]
    if not 0 < len(odd) <= _FEW * len(starts):
        return []
    found = []
    for start in odd.tolist():
        line = layout.LINE.match(whole, start)
        assert line is not None
        text = line[1].decode("utf-8", "replace")
        cells = layout.split(text, separator)
        other = len(cells) != len(names) or (separator == layout.BLANKS and not re.search(r"\d|nan", text, re.I))
        words = re.match(r"[\W_]*[^\W\d_]{2}", text) or layout.RULE.fullmatch(text)
        if other and not layout.is_data(cells) and words:
            found.append((start, line.end()))
    return found


def _is_row(line: bytes, names: Sequence[str], separator: str, widths: Sequence[int], whole: bool = False) -> bool:
    """Whether a line is a row; unless `whole`, its first cell may be bad and begin as comments do, such as #VALUE!."""
    cells = layout.split(line.decode("utf-8", "replace").strip(), separator, widths)
    return len(cells) == len(names) and layout.is_data(cells if whole else cells[1:])


def _has_comments(whole: bytes) -> bool:
    """Whether a line of the rows is a comment."""
    marks = [mark for mark in (b"#", b"%", b"/", b"!") if mark in whole]
    return bool(marks) and re.search(rb"(?m)^[ \t]*(?:#|%|//|!)", whole) is not None


def _repeated_names(
    source: str, whole: bytes, names: Sequence[str], separator: str, widths: Sequence[int]
) -> list[tuple[int, int]]:
    """Where the names stand once more among the rows, as on each page of a printout or in files that were put together;
    with the lines around them that are no rows."""
    first = next(filter(None, names), "").encode()
    if not first or first.isdigit() or first not in whole:
        return []
    found: list[tuple[int, int]] = []
    bare = _bare("".join(names))
    for line in re.finditer(rb"(?m)^[^\r\n]*" + re.escape(first) + rb"[^\r\n]*(?:\r\n|\r|\n|\Z)", whole):
        text = line[0].decode("utf-8", "replace").strip()
        if _bare(text) != bare:
            _refuse_other_names(source, layout.split(text, separator, widths), names)
            continue
        start, end = line.span()
        floor = found[-1][1] if found else 0
        for _ in range(_FOOTER):
            tail = whole[max(start - _LAST, floor) : start]
            above = re.search(rb"(?:\A|(?<=[\r\n]))[^\r\n]*(?:\r\n|\r|\n)\Z", tail)
            if above is None or _is_row(above[0], names, separator, widths, whole=True):
                break
            start -= len(above[0])
        for _ in range(_UNDER):
            below = layout.LINE.match(whole, end)
            if below is None or below.end() == end or _is_row(below[0], names, separator, widths, whole=True):
                break
            end = below.end()
        found.append((start, end))
    return found


def _refuse_other_names(source: str, cells: Sequence[str], names: Sequence[str]) -> None:
    """Raise InputError for names that stand among the rows, and are not those above them."""
    if len(cells) == len(names) and not any(map(layout.is_data, ([cell] for cell in cells if cell))):
        raise InputError(
            f"{source}: names of columns stand among the rows, and are not those above: {', '.join(cells)[:200]}. Two "
            "logs were put together; make a file of each, and join their trajectories."
        )


def _bare(line: str) -> str:
    return re.sub(r"[\s,;|\"']", "", line)


def _begins_with_number(body: bytes, separator: str, widths: Sequence[int]) -> bool:
    """Whether the first cell of the first row is a number or a time, so that a word there is a summary."""
    line = layout.LINE.match(body[:_LAST])
    cells = layout.split(line[1].decode("utf-8", "replace"), separator, widths) if line else []
    filled = [cell for cell in cells if cell]
    return bool(filled) and layout.is_data(filled[:1])


def is_sum(cells: Sequence[str]) -> bool:
    """Whether as many cells as in a row sum up the rows, or a word stands alone: the mean, EOF, the number of rows."""
    filled = [cell for cell in cells if cell]
    if not filled or layout.is_data(filled[:1]):
        return False
    alone = len(filled) < len(cells) and (len(filled) == 1 or (len(filled) == 2 and filled[1].isdigit()))
    return filled[0].strip(" :.").lower() in _SUMS or (alone and filled[0][0].isalpha())


def _is_footer(line: str, names: Sequence[str], separator: str, widths: Sequence[int]) -> bool:
    """Whether a line below the rows is none: another number of cells, words in front, and not mostly numbers."""
    cells = layout.split(line, separator, widths)
    if not line.strip(" \x1a\0"):
        return "\x1a" in line
    if layout.RULE.fullmatch(line):
        return True
    if widths:
        return not layout.is_data(cells) and bool(re.match(r"\s*[A-Za-z#*=-]", line))
    different = len(cells) != len(names)
    if different and _COUNTED.fullmatch(line.strip()):
        return True
    return different and bool(re.match(r"\s*[A-Za-z#*=<-]", line)) and not layout.is_data(cells, strictly=True)


def first_line(source: str, data: bytes) -> tuple[list[str], str, int]:
    """Names and separator of a file in which no line is like a row: of its first line."""
    found = layout.LINE.match(data)
    assert found is not None
    line = found[1].decode("utf-8", "replace")
    delimiter = max(",;\t", key=line.count)  # the comma if there is none
    try:
        names = [name.strip() for name in next(csv.reader([line], delimiter=delimiter))]
    except (csv.Error, StopIteration) as error:
        raise InputError(
            f"{source}: the header line cannot be read as CSV ({error}); correct it, or delete the lines before it."
        ) from error
    if len(names) == 1 and re.search(r"\S[ |]+\S", names[0]):
        raise InputError(
            f'{source}: the header line "{line[:80]}" has no separator, and no line looks like a row of a log; '
            "separate the cells with commas, semicolons or tabs."
        )
    return names, delimiter, found.end()
