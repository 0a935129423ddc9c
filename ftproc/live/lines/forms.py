"""Lines of other forms as lines of a table: an object of JSON, or a sentence of NMEA 0183, in each. What their names
and units mean is then understood as of any table."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Sequence
from typing import Any

from ftproc.errors import InputError
from ftproc.files.reading.formats.documents import flat
from ftproc.live.lines.growing import Block

DAY_S = 86_400.0
#: Distances of a TTM sentence in m: nautical miles, kilometres, statute miles.
DISTANCES = {"N": 1852.0, "K": 1000.0, "S": 1609.344}
TTM = ("time_s", "target", "range_m", "azimuth_deg")
_SENTENCE = re.compile(r"[$!]([A-Z0-9]+),([^*]*)(?:\*([0-9A-Fa-f]{2}))?\s*")


def of(line: str) -> Form | None:
    """The form of a log by a line of it; None where the line is empty."""
    bare = line.strip()
    return None if not bare else Json() if bare.startswith("{") else Nmea() if _SENTENCE.fullmatch(bare) else Form()


class Form:
    """The form of lines; here that of a table, whose lines stay what they are. damaged: lines left out by their own
    checksum."""

    damaged = 0

    def table(self, source: str, block: Block) -> Block:
        """The lines of a table for some lines. Raises InputError for what is not of this form."""
        return block


class Json(Form):
    """An object in each line. The names are those of the first one; values inside objects get names such as
    `position.range_m`."""

    def __init__(self) -> None:
        self.names: list[str] = []

    def table(self, source: str, block: Block) -> Block:
        lines = list[str]()
        for number, line in enumerate(block.texts, block.first):
            found = _values(f"{source}: line {number}", line) if line.strip() else {}
            if not found:
                lines.append("")
                continue
            if not self.names:
                self.names = list(found)
                lines.append(_row(self.names))
            lines.append(_row([_cell(found.get(name)) for name in self.names]))
        return block._replace(texts=lines)


def _values(where: str, line: str) -> dict[str, Any]:
    try:
        found = json.loads(line)
        if isinstance(found, dict):
            return dict(flat(where, found, "", 0))
        why = "it is no object"
    except (ValueError, RecursionError) as error:
        why = str(error)
    raise InputError(f'{where} is no object of JSON ({why}); expected such as {{"time_s": 0.5, "range_m": 5000}}.')


def _cell(value: Any) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    return repr(value) if isinstance(value, float | int) else str(value)


def _row(cells: Sequence[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="").writerow([cell.replace("\n", " ").replace("\r", " ") for cell in cells])
    return text.getvalue()


class Cycle:
    """A clock that begins again after a period, such as a day."""

    def __init__(self, period_s: float) -> None:
        self.period_s, self.begun_s, self.latest_s = period_s, 0.0, 0.0

    def unfolded(self, time_s: float) -> float:
        """Its times as they go on; rows may be late across its beginning."""
        if time_s + self.begun_s < self.latest_s - self.period_s / 2:
            self.begun_s += self.period_s
        found = time_s + self.begun_s
        if self.begun_s and found > self.latest_s + self.period_s / 2:
            found -= self.period_s
        self.latest_s = max(self.latest_s, found)
        return found


class Nmea(Form):
    """Tracked targets (TTM: number, distance, true bearing, UTC), each a row; or, where the first sentence is
    another, the fields of those of its kind as columns that are numbered from 1. Sentences with a wrong checksum are
    dropped, other ones passed over."""

    def __init__(self) -> None:
        self.kind, self.cycle, self.damaged = "", Cycle(DAY_S), 0

    def table(self, source: str, block: Block) -> Block:
        lines = list[str]()
        for line in block.texts:
            found = _SENTENCE.fullmatch(line.strip())
            if found is None or not _is_sound(found):
                self.damaged += found is not None
                lines.append("")
                continue
            kind = "TTM" if found[1].endswith("TTM") else found[1]
            if not self.kind:
                self.kind = kind
                lines += [",".join(TTM)] if kind == "TTM" else []
            fields = found[2].split(",")
            own = kind == self.kind
            lines.append("" if not own else self._target(fields) if kind == "TTM" else ",".join(fields))
        return block._replace(texts=lines)

    def _target(self, fields: list[str]) -> str:
        """The row of a TTM sentence; empty where its bearing is not true, or it has no time."""
        fields += [""] * (14 - len(fields))
        time_s = _seconds(fields[13])
        if fields[3] != "T" or time_s is None:
            return ""
        return _row([repr(self.cycle.unfolded(time_s)), fields[0], _metres(fields[1], fields[9]), fields[2]])


def _metres(text: str, unit: str) -> str:
    """A distance in m; empty where there is none."""
    try:
        range_m = float(text) * DISTANCES[unit]
    except (ValueError, KeyError):
        return ""
    return repr(range_m) if math.isfinite(range_m) else ""


def _is_sound(found: re.Match[str]) -> bool:
    """Whether the checksum of a sentence is right, if it has one."""
    code = 0
    for byte in f"{found[1]},{found[2]}".encode():
        code ^= byte
    return found[3] is None or int(found[3], 16) == code


def _seconds(text: str) -> float | None:
    """The seconds of the day of hhmmss.ss."""
    found = re.fullmatch(r"(\d\d)(\d\d)(\d\d(?:\.\d*)?)", text)
    return None if found is None else int(found[1]) * 3600 + int(found[2]) * 60 + float(found[3])
