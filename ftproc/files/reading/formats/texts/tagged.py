"""Lines that say what each value is: `R=1234.5 AZ=12.3`, as loggers and programs print."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from collections.abc import Sequence

from ftproc.files import limits
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.formats.sparse import Sparse
from ftproc.files.reading.meaning.names import taken_apart
from ftproc.files.words import QUANTITIES

_SAMPLE = 200  # lines by which a text is known
_MOSTLY = 0.6  # of these hold several pairs
_STAMP = r"(?:\d{4}[-/.]\d{1,2}[-/.]\d{1,2}[T ])?\d{1,2}:\d{2}:\d{2}(?:[.,]\d+)?(?:\s?Z|\s?UTC|[+-]\d{2}:?\d{2})?"
_DMS = r"[+-]?\d{1,3}\s?[°dD]\s?\d{1,2}\s?['′m]\s?\d{1,2}(?:[.,]\d+)?(?:''|[\"″s])?"  # 320°42'38.6", 320d42'38.6
#: Parts of a name are bounded, and taken whole, so that a search takes time by the length of the text.
_NAME = r"[\"']?(?P<name>[^\W\d][\w./°-]{0,100}+(?:\s?[(\[][^)\]=:]{0,100}+[)\]])?)[\"']?"
_VALUE = (
    rf"(?P<value>\"[^\"]*\"|'[^']*'|{_STAMP}|{_DMS}"
    r"|[+-]?\.?\d[^\s,;{}\]\"'|]*(?:,\d+(?=\s*;|\s*$|\s+[^\W\d]))?(?:\s[A-Za-z°]{1,4}(?=\s*(?:[,;|]|$)))?"
    r"|(?>[^\s,;{}=:\"'|]+)(?!\s*[=:]))"
)
_PAIR = re.compile(rf"(?<![\w.]){_NAME}\s*[=:]\s*{_VALUE}")
_LEADING = re.compile(rf"\W*(?:[A-Z][a-z]{{2}} +\d{{1,2}} +)?({_STAMP}|\d+\.\d+)(?=[\s,;|\])]|:\s)")  # Jun  3 of syslog
_TRAILING = re.compile(r"\s(\d{10,19})\s*$")  # since 1970, at the end of a point of a database
_COUNTED = re.compile(r"[+-]?\d+[iu]")  # whole numbers there
#: Between records of one pair to a line: a rule; before an item of a list, as in YAML, a section, or a message of
#: protobuf; an empty line.
_BETWEEN_RECORDS = (
    re.compile(r"\n-{3,}\s*\n"),
    re.compile(r"\n(?=[ \t]*- +[^\W\d]\w*:)"),
    re.compile(r"\n(?=\[[^\]\n]*\]+[ \t]*\n)"),
    re.compile(r"\n(?=\w+[ \t]*\{[ \t]*\n)"),
    re.compile(r"\n[ \t]*\n"),
)
_ALONE = 0.9  # of the pairs in such a text are alone in their line
_FEWEST = 2  # pairs in a row
_WHOLE = 0.7  # of the records on one line hold each reading


def pairs(text: str, room: limits.Room) -> TableHeader | None:
    """The columns of a text whose lines consist of names and values, each line a row; None if it is none."""
    if not _is_tagged(_rows(text[: _SAMPLE * 200])[:_SAMPLE]):
        return None
    columns, others = Sparse(room), 0
    for line in _rows(text):
        for record in _records(line):
            found = _pairs(record)
            if _has_reading(found):
                columns.add(_stamped(record, found).items())
            else:
                others += bool(record.strip())
    again = {key.partition(":")[2] for key in columns.columns if key.startswith("2:")}
    form = "text, names and values in each line" + (f", {others} other lines left out" if others else "")
    return columns.header(form, {key: f"1:{key}" for key in again}, decimal_comma=True)


def _stamped(record: str, found: dict[str, str]) -> dict[str, str]:
    """The values of a record with the time that stands in front of it, or behind it."""
    if leading := _LEADING.match(record):
        return {**found, "Timestamp": leading[1].replace(",", ".")}
    if trailing := _TRAILING.search(record):
        plain = {name: cell[:-1] if _COUNTED.fullmatch(cell) else cell for name, cell in found.items()}
        return {**plain, "Timestamp": trailing[1]}
    return found


def _rows(text: str) -> list[str]:
    """The records of a text, or its lines."""
    for between in _BETWEEN_RECORDS:
        if len(between.findall(text)) > 2 and _one_to_a_line(text[: _SAMPLE * 200]):
            return [record.replace("\n", "; ") for record in between.split(text)]
    return _repeated(text) or text.splitlines()


def _one_to_a_line(text: str) -> bool:
    found = [len(_PAIR.findall(line)) for line in text.splitlines()]
    return found.count(1) >= _ALONE * sum(map(bool, found)) > 0


def _repeated(text: str) -> list[str]:
    """The records of a text of one pair to a line in which the same names come again and again, all as often."""
    sample = text[: _SAMPLE * 200].splitlines()
    if len(sample) < _FEWEST or not _one_to_a_line("\n".join(sample[: 2 * _SAMPLE])):
        return []
    lines = [(pair["name"].strip(), line) for line in text.splitlines() if (pair := _PAIR.search(line))]
    counts = Counter(name for name, _ in lines)
    width = len(counts)
    if not _FEWEST <= width <= limits.MOST_COLUMNS or max(counts.values()) < _FEWEST:
        return []
    records = ["; ".join(line for _, line in lines[k : k + width]) for k in range(0, len(lines), width)]
    order = [name for name, _ in lines[:width]]
    in_order = all(name == order[k % width] for k, (name, _) in enumerate(lines))
    return records if in_order else []


def _is_tagged(lines: Sequence[str]) -> bool:
    filled = [line for line in lines if line.strip()]
    return bool(filled) and sum(_has_reading(_pairs(line)) for line in filled) >= _MOSTLY * len(filled)


def _pairs(line: str) -> dict[str, str]:
    """Names and values; a name that comes again with another value gets its number: `2:range`."""
    found: dict[str, str] = {}
    numbers: dict[str, dict[str, int]] = {}
    for pair in _PAIR.finditer(line):
        name, value = pair["name"].strip(), pair["value"].strip("\"'")
        number = numbers.setdefault(name, {}).setdefault(value, len(numbers[name]) + 1)
        found[name if number == 1 else f"{number}:{name}"] = value
    return found


def _records(line: str) -> list[str]:
    """The line, or its parts if the same readings with their time stand in it again and again."""
    pairs = list(_PAIR.finditer(line))
    counts = Counter(pair["name"] for pair in pairs)
    most = max(counts.values(), default=0)
    if most < 2 or len(counts) > limits.MOST_COLUMNS:
        return [line]
    quantities = [name for name in counts if any(map(taken_apart(name).means, QUANTITIES))]
    if any(counts[name] < _WHOLE * most for name in quantities):
        return [line]
    first = next(name for name in counts if counts[name] == most)
    ends = [0, *(before.end() for before, pair in itertools.pairwise(pairs) if pair["name"] == first)]
    ends = ends if pairs[0]["name"] == first else ends[:1] + ends[2:]  # what stands before the first one is its own
    parts = [line[low:high] for low, high in itertools.pairwise([*ends, len(line)])]
    stamped = {_LEADING.match(part) is not None for part in parts}
    return parts if len(stamped) == 1 else [line]


def _has_reading(found: dict[str, str]) -> bool:
    """Whether several pairs stand in a line, one of them a range or an angle."""
    if len(found) < _FEWEST:
        return False
    names = (taken_apart(key) for key, value in found.items() if re.match(r"[+-]?\.?\d", value))
    return any(name.means(quantity) for name in names for quantity in QUANTITIES[1:])
