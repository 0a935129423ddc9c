"""What is no row of a text: comment lines among the rows, and lines below them."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ftproc.files.reading.formats import layout

_FOOTER = 30  # lines at the end of a file, at most
_COMMENT = re.compile(rb"(?m)^[ \t]*(?:#|%|//|!)[^\r\n]*(?:\r\n|\r|\n|\Z)")
_LAST = 4096  # bytes in which the last line is looked for


def rows_only(body: memoryview, names: Sequence[str], separator: str, widths: Sequence[int]) -> tuple[memoryview, str]:
    """The rows without comment lines among them and lines of text below them; and in words what was left out."""
    words, comments = "", 0
    if _has_comments(body):
        found = [line for line in _COMMENT.finditer(body) if not _is_row(line[0], names, separator, widths)]
        ends = [0, *(line.end() for line in found)]
        starts = [*(line.start() for line in found), len(body)]
        comments = len(found)
        if comments:
            body = memoryview(b"".join(body[low:high] for low, high in zip(ends, starts, strict=True)))
            words += f", {comments} comment lines among the rows"
    end = len(body)
    footer = 0
    while footer < _FOOTER:
        tail = bytes(body[max(end - _LAST, 0) : end])
        line = re.search(rb"(?:\A|[\r\n])([^\r\n]+)[\r\n]*\Z", tail)
        if line is None or not _is_footer(line[1].decode("utf-8", "replace"), names, separator, widths):
            break
        end -= len(tail) - line.start(1)
        footer += 1
    words += f", {footer} lines below the table" if footer else ""
    return body[:end], words


def _is_row(line: bytes, names: Sequence[str], separator: str, widths: Sequence[int]) -> bool:
    """Whether a line that begins as comments do is a row with a bad first cell, such as #VALUE!."""
    cells = layout.split(line.decode("utf-8", "replace").strip(), separator, widths)
    return len(cells) == len(names) and layout.is_data(cells[1:])


def _has_comments(body: memoryview) -> bool:
    """Whether a line of the rows is a comment."""
    whole = body.tobytes()
    marks = [mark for mark in (b"#", b"%", b"/", b"!") if mark in whole]
    return bool(marks) and re.search(rb"(?m)^[ \t]*(?:#|%|//|!)", body) is not None


def _is_footer(line: str, names: Sequence[str], separator: str, widths: Sequence[int]) -> bool:
    """Whether a line below the rows is none: another number of cells, words in front, and not mostly numbers."""
    cells = layout.split(line, separator, widths)
    if not line.strip(" \x1a\0"):
        return "\x1a" in line
    if widths:
        return not layout.is_data(cells) and bool(re.match(r"\s*[A-Za-z#*=-]", line))
    different = len(cells) != len(names)
    return different and bool(re.match(r"\s*[A-Za-z#*=<-]", line)) and not layout.is_data(cells, strictly=True)
