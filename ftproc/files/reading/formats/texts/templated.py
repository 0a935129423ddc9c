"""Lines of the same words with numbers between them, as programs print: `trackd[311]: range 1234.5 m az 12.3 deg`."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from ftproc.files import limits
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.formats.sparse import Sparse
from ftproc.files.reading.meaning.names import taken_apart
from ftproc.files.units import unit_named
from ftproc.files.words import QUANTITIES

#: A date, a time of day, both, or a number: what may differ from line to line.
_DATE = r"\d{4}[-/.]\d{1,2}[-/.]\d{1,2}"
_CLOCK = r"\d{1,2}:\d{2}:\d{2}(?:[.,]\d+)?(?:Z|[+-]\d{2}:?\d{2}\b)?"
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_VALUE = re.compile(rf"(?<![\w.])(?:{_DATE}(?:[T ]{_CLOCK})?|{_CLOCK}|{_NUMBER}(?=\W|[^\W\d_]{{1,4}}(?!\w)|$))")
_BEFORE = re.compile(r"([^\W\d][\w.]*(?:\s?\([^()]{1,20}\))?)\s*[:=]?\s*$")  # the name of a value
_BEHIND = re.compile(r"\s?([^\W\d_]{1,12}|°)(?![\w(])")  # its unit
_SAMPLE, _MOSTLY = 200, 0.6  # lines by which a text is known, and how many of them are alike
_LONGEST, _MOST_VALUES = 2000, 60  # characters of a line, and values in it
_MONTHS = re.compile(r"(?i)\b(?:jan|feb|mar|apr|may|jun|jul|aug|sep|oct|nov|dec)\w*")
_FEWEST = 2  # readings with names


def read(text: str, room: limits.Room) -> TableHeader | None:
    """The columns of a text of lines of the same words; None if these do not name two readings."""
    lines = [line for line in text.splitlines() if line.strip()]
    parts = Counter(_words(line) for line in lines[:_SAMPLE])
    words, count = parts.most_common(1)[0] if parts else ((), 0)
    if count < max(_MOSTLY * min(len(lines), _SAMPLE), _FEWEST) or not _FEWEST <= len(words) - 1 <= _MOST_VALUES:
        return None
    first = next(line for line in lines if _words(line) == words)
    names = _names(words, _VALUE.findall(first))
    units = [_unit(name, words[k + 1]) for k, name in enumerate(names)]
    readings = {q for name in names for q in QUANTITIES[1:] if taken_apart(name).means(q)}
    nameless = not readings and count == min(len(lines), _SAMPLE) and _is_mixed(first)
    if len(readings) < _FEWEST and not nameless:
        return None
    columns, others = Sparse(room, names), 0
    for line in lines:
        if _words(line) == words:
            columns.add(zip(names, _VALUE.findall(line), strict=True))
        else:
            others += 1
    form = "text, numbers among words" + (f", {others} other lines left out" if others else "")
    return replace(columns.header(form), units=units if any(units) else ())


def _words(line: str) -> tuple[str, ...]:
    """What stands before, between and behind the values of a line."""
    return tuple(_VALUE.split(line)) if len(line) <= _LONGEST else ()


def _names(words: Sequence[str], values: Sequence[str]) -> list[str]:
    """The word before each value that is a name of a quantity; of the first date and time of day that it is one; else
    the number of the value."""
    names: list[str] = []
    for k, value in enumerate(values):
        found = _BEFORE.search(words[k])
        name = found[1] if found and any(map(taken_apart(found[1]).means, QUANTITIES)) else ""
        name = name or ("Timestamp" if ":" in value else str(k + 1))
        names.append(str(k + 1) if name in names else name)
    return names


def _is_mixed(line: str) -> bool:
    """Whether words and values stand together in what commas separate, so that these alone make no table of it."""
    mark = max(",;\t|", key=line.count)
    cells = [_MONTHS.sub("", _VALUE.sub("0", cell)) for cell in line.split(mark)]
    return len(cells) > _FEWEST and any("0" in cell and re.search(r"\s[^\W\d]{2}", cell) for cell in cells)


def _unit(name: str, behind: str) -> str:
    """The unit behind the value of a reading."""
    found = _BEHIND.match(behind)
    quantities: Sequence[str] = [q for q in QUANTITIES if taken_apart(name).means(q)]
    return found[1] if found and any(unit_named(q, found[1]) for q in quantities) else ""
