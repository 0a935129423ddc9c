"""Tables inside another language, such as HTML, SQL or LaTeX, or with a line for each column, made plain ones."""

from __future__ import annotations

import csv
import html
import itertools
import re
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from ftproc.files.limits import Room
from ftproc.files.reading.formats.header import is_log

_HEAD = 1 << 16  # characters in which a language is recognised
_HELD = 16  # bytes that a character takes while its table is made
_TUPLE = re.compile(r"\(((?:'(?:[^']|'')*+'|[^()'])*+)\)")
_COLUMN = re.compile(r"\s*[`\"\[]?(?P<name>\w+)")
_NO_COLUMNS = ("primary", "key", "constraint", "unique", "index", "foreign", "check")
_TABULAR = r"\\(?:begin|end)\{(?:tabular|longtable|array)\*?\}(?:\[[^\[\]]*\])?(?:\{(?:[^{}]|\{[^{}]*\})*+\})?"
_MATRIX = re.compile(r"(?m)^[^\n=#%]{1,80}=[ \t]*(?:np\.array\()?[\[({][ \t]*(?:%.*)?\n(?=[ \t]*[\[({]?[ \t]*[-+.\d])")
_CLOSING = re.compile(r"[\])}]")
_ITS_END = re.compile(r"(?m)^[ \t]*[\])}]|[\])}][ \t]*[\])}]")
#: The beginning of a line that is a column: its name, perhaps its unit in a cell of its own, before its first number.
_NAMED_LINE = re.compile(
    r"[ \t]{0,20}[\"']?(?P<name>[^\W\d][^=:\[\],;\t|]{0,60}?(?:[(\[][^)\]]{1,20}[)\]])?)[\"']?[ \t]{0,20}"
    r"(?:[=:][ \t]{0,20})?(?P<open>[,;\t|]|[\[({]|[ ])[ \t]{0,20}"
    r"(?:(?P<unit>[^\W\d]{1,8}|°)[ \t]{0,20}[,;\t|][ \t]{0,20})?(?=[-+.\d])"
)
_LONGEST_START = 250  # characters of it
_MOST_ACROSS, _FEWEST_ACROSS = 200, 4  # lines that are columns, and cells in them
#: Lines of boxes -> those that are drawn with letters.
_BOXES = str.maketrans(
    dict.fromkeys("─━═╌┄", "-")
    | dict.fromkeys("│┃║", "|")
    | dict.fromkeys("┌┬┐├┼┤└┴┘╒╤╕╞╪╡╘╧╛╔╦╗╠╬╣╚╩╝╭╮╰╯┏┳┓┣╋┫┗┻┛╇╈╟╫╢┡┩", "+")
)


class Language(NamedTuple):
    """name: for the user. mark: what stands among the first lines. plain: the text -> a plain table; "" if it holds
    none."""

    name: str
    mark: re.Pattern[str]
    plain: Callable[[str], str]


def unwrapped(text: str, room: Room) -> tuple[str, str]:
    """The table of a text in one of LANGUAGES, and the name of the language; "" of others. Raises InputError where the
    table becomes too large."""
    for language in LANGUAGES:
        if language.mark.search(text, 0, _HEAD):
            room.check(_HELD * len(text))
            if plain := language.plain(text):
                return plain, language.name
    return "", ""


def _lines(rows: Iterable[Sequence[str]]) -> str:
    """Rows of cells, with tabs between these."""
    return "".join("\t".join(re.sub(r"\s+", " ", cell).strip() for cell in row) + "\n" for row in rows)


def _html(text: str) -> str:
    rows = (re.split(r"(?i)<t[dh]\b[^<>]*>", row)[1:] for row in re.split(r"(?i)<tr\b[^<>]*>", text))
    cells = ([html.unescape(re.sub(r"<[^<>]*>", " ", re.split(r"(?i)</t", cell)[0])) for cell in row] for row in rows)
    return _lines(row for row in cells if row)


def _sql(text: str) -> str:
    """The rows that are inserted into one table, if there is one."""
    copied = re.search(r"(?im)^COPY\s+\S+\s*\((.*)\)\s*FROM\s+stdin.*\n", text)
    if copied:
        rows = text[copied.end() :].partition("\\.")[0]
        return _lines([re.split(r"\s*,\s*", copied[1])]) + rows
    plain = re.sub(r"(?i)\bCAST\(([^()]{0,80}?)\s+AS\s+\w+(?:\([^()]{0,20}\))?\)", r"\1", re.sub(r"\bN'", "'", text))
    before, *inserts = re.split(r"(?i)\bINSERT\s+(?:INTO\s+|(?=\[))", plain)
    created = re.search(r"(?is)\bCREATE\s+TABLE\b[^(]*\((.*?)\)[^,()]*;", before[-_HEAD // 4 :])
    found = (_COLUMN.match(part) for part in re.split(r",(?![^(]*\))", created[1] if created else ""))
    names_of_created = [each["name"] for each in found if each and each["name"].lower() not in _NO_COLUMNS]
    tables: dict[str, tuple[list[str], list[list[str]]]] = {}
    for insert in inserts:
        head, _, values = re.sub(r"(?i)\bVALUES\b", "\0", insert, count=1).partition("\0")
        table, _, columns = head.partition("(")
        names, rows_of = tables.setdefault(table.strip(), (re.findall(r"\w+", columns) or names_of_created, []))
        rows_of += csv.reader(_TUPLE.findall(values), quotechar="'", skipinitialspace=True)
    filled = [each for each in tables.values() if len(tables) == 1 or is_log(each[0], {})]
    if len(filled) != 1 or len(widths := {len(row) for row in filled[0][1]}) != 1:
        return ""
    names, rows_of = filled[0]
    return _lines([*([names] if {len(names)} == widths else []), *rows_of])


def _latex(text: str) -> str:
    body = re.split(_TABULAR, text)[1]
    plain = re.sub(r"\\(?:[a-z]*line|[a-z]*rule)\b(?:\{[^{}]*\})?|\\[,;!]|\$", "", body)
    plain = re.sub(r"\\(?:textbf|textit|mathrm|text|multicolumn\{\d+\}\{[^{}]*\})\{([^{}]*)\}", r"\1", plain)
    rows = (row.split("&") for row in re.split(r"\\\\(?:\[[^\]]*\])?|\\tabularnewline", plain))
    return _lines(row for row in rows if len(row) > 1)


def _matrix(text: str) -> str:
    """A matrix of a program, its rows on lines of their own, with what stands above it."""
    found = _MATRIX.search(text)
    if found is None:
        return ""
    nested = text[found.end() :].lstrip()[:1] in "[({"  # each row in brackets too
    closed = (_ITS_END if nested else _CLOSING).search(text, found.end())
    end = closed.start() if closed else -1
    rows = re.sub(r"(?m)[ \t]*[\])}]?[ \t]*(?:;|\.\.\.|,)?[ \t]*$|^[ \t]*[\[({]", "", text[found.end() : end])
    return text[: found.start()] + rows + "\n" if end > 0 else ""


def _across(text: str) -> str:
    """Lines of which each is a column: a name before its cells."""
    lines = [line for line in text.splitlines() if line.strip() and line[0] not in "#%"]
    if not 2 <= len(lines) <= _MOST_ACROSS:
        return ""
    starts = itertools.takewhile(bool, (_NAMED_LINE.match(line[:_LONGEST_START]) for line in lines))
    columns = [_cells(start, line) for start, line in zip(starts, lines, strict=False) if start]
    lengths = {len(column) for column in columns}
    names = [column[0] for column in columns]
    alike = len(columns) == len(lines) and len(lengths) == 1 and lengths.pop() > _FEWEST_ACROSS
    return _lines(zip(*columns, strict=True)) if alike and is_log(names, {}) else ""


def _cells(start: re.Match[str], line: str) -> list[str]:
    """The name of a column and its cells."""
    cells = line[start.end() :].strip().rstrip(";").rstrip("])}, ")
    mark = next((mark for mark in (start["open"], "\t", ";", ",") if mark in cells and not mark.isspace()), None)
    name = start["name"].strip() + (f" [{start['unit']}]" if start["unit"] else "")
    return [name, *(cells.split(mark) if mark else cells.split())]


def _boxed(text: str) -> str:
    return text.translate(_BOXES)


def _of_a_wiki(text: str) -> str:
    return re.sub(r"(?m)^\|\|(.*)\|\|[ \t]*$", lambda line: f"|{line[1].replace('||', '|')}|", text)


def _of_mediawiki(text: str) -> str:
    rows = [
        line for line in map(str.strip, text.splitlines()) if line[:1] in ("!", "|") and line[:2] not in ("|-", "|}")
    ]
    return _lines(re.split(r"\|\||!!", line.lstrip("!|")) for line in rows)


def _language(name: str, mark: str, plain: Callable[[str], str]) -> Language:
    return Language(name, re.compile(mark, re.MULTILINE | re.IGNORECASE), plain)


LANGUAGES = (
    _language("HTML", r"<tr\b[^<>]*>\s*<t[dh]\b", _html),
    _language("SQL", r"^[ \t]*INSERT\s+(?:INTO\s|\[)|^COPY\s.*FROM\s+stdin", _sql),
    _language("LaTeX", r"\\begin\{(?:tabular|longtable|array)", _latex),
    _language("a matrix", _MATRIX.pattern, _matrix),
    _language("a drawn table", r"^[ \t]*[│┃║┌╒╔╭┏]", _boxed),
    _language("a table of a wiki", r"^\|\|.*\|\|[ \t]*$", _of_a_wiki),
    _language("a table of MediaWiki", r"^\{\|.*$", _of_mediawiki),
    _language(
        "a line for each column",
        r"\A(?:[#%].*\n)*[ \t]{0,20}[\"']?[^\W\d].{0,60}?[=:,;\t|\[ ][ \t]{0,20}[-+.\d].{8}",
        _across,
    ),
)
