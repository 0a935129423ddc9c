"""Leica's GSI format: words of 8 or 16 digits with index and unit; `21.322+27912345` is a horizontal angle in gon."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Sequence

from ftproc.errors import InputError
from ftproc.files import limits
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.formats.sparse import Sparse

_SAMPLE = 200  # lines by which a text is known
_WORD = re.compile(r"(?P<index>\d\d)[\d.]{3}(?P<unit>[\d.])(?P<sign>[+-])(?P<digits>[\w.+-]{16}|[\w.+-]{8})")
_NAMES = {"11": "point", "18": "clock", "19": "date", "21": "Hz", "22": "V", "31": "SD"}
#: Digit of the unit -> the unit and its counts.
_UNITS = {
    "0": ("m", 1e3), "6": ("m", 1e4), "8": ("m", 1e5), "1": ("ft", 1e3), "7": ("ft", 1e4), "2": ("gon", 1e5),
    "3": ("deg", 1e5), "4": ("dddmmss", 1e1), "5": ("mil", 1e4),
}  # fmt: skip


def read(text: str, room: limits.Room) -> TableHeader | None:
    """The words of each line; None of other texts. Raises InputError for points without times."""
    blocks = _blocks(text)
    head = list(itertools.islice(blocks, _SAMPLE))
    if not head or not all(all(block) for block in head):
        return None
    columns = Sparse(room)
    for block in itertools.chain(head, blocks):
        columns.add(_of_block([word for word in block if word]).items())
    if "time" not in columns.columns:
        raise InputError(
            f"{room.name}: this is a field book of a total station (GSI), points of a survey without times (words 18 "
            "and 19), not readings of a moving target."
        )
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
        name, digits = _NAMES.get(word["index"], f"WI{word['index']}"), word["sign"] + word["digits"]
        unit, scale = _UNITS.get(word["unit"], ("", 0.0))
        if name in ("Hz", "V", "SD") and scale and digits[1:].isdigit():
            found[f"{name} ({unit})"] = f"{int(digits) / scale:.9g}"
        else:
            found[name] = word["digits"][-8:]
    if {"clock", "date"} <= found.keys():  # year, seconds and ms; month, day, hour and minute
        clock, date = found.pop("clock"), found.pop("date")
        day = f"20{clock[:2]}-{date[:2]}-{date[2:4]}"
        found["time"] = f"{day} {date[4:6]}:{date[6:]}:{clock[2:4]}.{clock[4:7]}"
    return found
