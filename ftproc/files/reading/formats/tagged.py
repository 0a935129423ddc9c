"""Lines that say what each value is: `R=1234.5 AZ=12.3`, as loggers and programs print, sentences with a checksum, as
NMEA instruments send, and words with an index, as total stations store."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from collections.abc import Iterator, Sequence

from ftproc.files import limits
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.formats.sparse import Sparse
from ftproc.files.reading.meaning.names import taken_apart
from ftproc.files.words import QUANTITIES

_SAMPLE = 200  # lines by which a text is known
_MOSTLY = 0.6  # of these hold several pairs
_STAMP = r"(?:\d{4}[-/.]\d{1,2}[-/.]\d{1,2}[T ])?\d{1,2}:\d{2}:\d{2}(?:[.,]\d+)?(?:\s?Z|\s?UTC|[+-]\d{2}:?\d{2})?"
#: Parts of a name are bounded, and taken whole, so that a search takes time by the length of the text.
_NAME = r"[\"']?(?P<name>[^\W\d][\w./°-]{0,100}+(?:\s?[(\[][^)\]=:]{0,100}+[)\]])?)[\"']?"
_VALUE = (
    rf"(?P<value>\"[^\"]*\"|'[^']*'|{_STAMP}"
    r"|[+-]?\.?\d[^\s,;{}\]\"'|]*(?:,\d+(?=\s*;|\s*$|\s+[^\W\d]))?(?:\s[A-Za-z°]{1,4}(?=\s*(?:[,;|]|$)))?"
    r"|(?>[^\s,;{}=:\"'|]+)(?!\s*[=:]))"
)
_PAIR = re.compile(rf"(?<![\w.]){_NAME}\s*[=:]\s*{_VALUE}")
_LEADING = re.compile(rf"\W*({_STAMP}|\d+\.\d+)(?=[\s,;|\])])")
_RECORD = re.compile(r"\n-{3,}\s*\n")  # between records of one pair to a line
_FEWEST = 2  # pairs in a row
_WHOLE = 0.7  # of the records on one line hold each reading
_SENTENCE = re.compile(r"[$!](?P<type>[A-Z][A-Z0-9]{2,7}),(?P<body>[^*]*?),?(?:\*[0-9A-Fa-f]{2})?")
#: The fields of the sentences that a standard describes, without the talker.
_STANDARD = {
    "TTM": (
        *("sentence", "target_number", "range", "bearing", "bearing_ref", "target_speed", "course_speed", "course_ref"),
        *("cpa_min", "tcpa_min", "unit", "name_id", "status", "own_ref", "utc", "acquisition_mode"),
    )
}
_WORD = re.compile(r"(?P<index>\d\d)[\d.]{3}(?P<unit>[\d.])(?P<sign>[+-])(?P<digits>[\dA-Za-z.]{8}|[\dA-Za-z.]{16})")
_GSI = {"11": "point", "18": "clock", "19": "date", "21": "Hz", "22": "V", "31": "SD"}
#: Digit of the unit -> the unit and its counts.
_GSI_UNITS = {
    "0": ("m", 1e3),
    "6": ("m", 1e4),
    "8": ("m", 1e5),
    "1": ("ft", 1e3),
    "7": ("ft", 1e4),
    "2": ("gon", 1e5),
    "3": ("deg", 1e5),
    "4": ("dddmmss", 1e1),
    "5": ("mil", 1e4),
}
_UNITS = {"N": "nmi", "K": "km", "S": "mi"}


def pairs(text: str, room: limits.Room) -> TableHeader | None:
    """The columns of a text whose lines consist of names and values, each line a row; None if it is none."""
    if not _is_tagged(_rows(text[: _SAMPLE * 200])[:_SAMPLE]):
        return None
    columns, others = Sparse(room), 0
    for line in _rows(text):
        for record in _records(line):
            found = _pairs(record)
            if _has_reading(found):
                stamp = _LEADING.match(record)
                columns.add({**found, "Timestamp": stamp[1].replace(",", ".")}.items() if stamp else found.items())
            else:
                others += bool(record.strip())
    again = {key.partition(":")[2] for key in columns.columns if key.startswith("2:")}
    form = "text, names and values in each line" + (f", {others} other lines left out" if others else "")
    return columns.header(form, {key: f"1:{key}" for key in again}, decimal_comma=True)


def sentences(text: str, room: limits.Room) -> TableHeader | None:
    """The fields of sentences such as `$PTRK,120000.05,1234.5*42`, of the type of which there are the most; None if
    the text holds others too."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    found = [_SENTENCE.fullmatch(line) for line in lines]
    kinds = Counter(sentence["type"] for sentence in found if sentence)
    if not kinds or sum(kinds.values()) < _MOSTLY * len(lines):
        return None
    known = [kind for kind in kinds if kind[-3:] in _STANDARD]
    chosen = known[0] if known else kinds.most_common(1)[0][0]
    bodies = [sentence["body"] for sentence in found if sentence and sentence["type"] == chosen]
    width = 2 + max(body.count(",") for body in bodies)
    if width > limits.MOST_COLUMNS:
        raise limits.too_many_columns(room.name)
    names = [str(k + 1) for k in range(width)]
    if known:
        names = [*_STANDARD[chosen[-3:]], *names][:width]
        unit = _UNITS.get([chosen, *bodies[0].split(","), *names][names.index("unit")], "") if "unit" in names else ""
        names = [f"{each}_{unit}" if each == "range" and unit else each for each in names]
    left = len(lines) - kinds[chosen]
    form = f"text, sentences {chosen}" + ("" if known else ", no column names") + (f", {left} others" if left else "")
    columns = Sparse(room, names)
    for body in bodies:
        columns.add((name, cell) for name, cell in zip(names, (chosen, *body.split(",")), strict=False) if cell)
    return columns.header(form, decimal_comma=True)


def survey(text: str, room: limits.Room) -> TableHeader | None:
    """The words of Leica's GSI format, of 8 or 16 digits: `21.322+27912345` is a horizontal angle in gon; None of
    other texts."""
    blocks = _blocks(text)
    head = list(itertools.islice(blocks, _SAMPLE))
    if not head or not all(all(block) for block in head):
        return None
    columns = Sparse(room)
    for block in itertools.chain(head, blocks):
        columns.add(_of_block([word for word in block if word]).items())
    return columns.header("text, words of GSI", decimal_comma=True)


def _blocks(text: str) -> Iterator[list[re.Match[str] | None]]:
    """The words of each line, None where one is none of GSI."""
    for line in text.splitlines():
        if line.strip():
            yield [_WORD.fullmatch(word) for word in line.strip().lstrip("*").split()]


def _of_block(words: Sequence[re.Match[str]]) -> dict[str, str]:
    """Names and values of the words of one line."""
    found: dict[str, str] = {}
    for word in words:
        name, digits = _GSI.get(word["index"], f"WI{word['index']}"), word["sign"] + word["digits"]
        unit, scale = _GSI_UNITS.get(word["unit"], ("", 0.0))
        if name in ("Hz", "V", "SD") and scale and digits[1:].isdigit():
            found[f"{name} ({unit})"] = f"{int(digits) / scale:.9g}"
        else:
            found[name] = word["digits"][-8:]
    if {"clock", "date"} <= found.keys():  # year, seconds and ms; month, day, hour and minute
        clock, date = found.pop("clock"), found.pop("date")
        day = f"20{clock[:2]}-{date[:2]}-{date[2:4]}"
        found["time"] = f"{day} {date[4:6]}:{date[6:]}:{clock[2:4]}.{clock[4:7]}"
    return found


def _rows(text: str) -> list[str]:
    if len(_RECORD.findall(text)) > 2:
        return [record.replace("\n", "; ") for record in _RECORD.split(text)]
    return text.splitlines()


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
