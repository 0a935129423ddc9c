"""JSON: an object per line, an array of objects, columns by name, or records deep in a document."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ftproc.errors import InputError
from ftproc.files import limits
from ftproc.files.reading.formats import content, encoding, trimming
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.formats.sparse import Sparse
from ftproc.files.reading.formats.standards import asterix

_DEEPEST = 12  # objects inside each other
_MOST_OF_A_VECTOR = 6  # numbers in a list inside a record
_HELD, _REFERENCE = 64, 16  # bytes that an object or list takes in memory, and one that is in it
_INNERMOST = re.compile(r"\[([^\[\]]+)\]")
_BETWEEN = re.compile(r"[\s,]*")  # two documents
UNIT_KEYS = ("unit", "units", "uom")  # and its unit
_VALUES = ("val", "value")  # keys under which decoders put the value of an item, beside its meaning


def json_file(name: str, path: Path, room: limits.Room) -> TableHeader:
    """A .json, .jsonl or .ndjson file. Values inside objects get names such as `I040.RHO`. Raises InputError."""
    text, note = _without_cut_off(encoding.as_utf8(name, content.read(name, path)).data.decode())
    room.check(_HELD * (text.count("{") + text.count("[")) + _REFERENCE * text.count(","))
    columns = Sparse(room)
    try:
        found = _parsed(name, text)
        radar = asterix.document(found, lambda record: dict(flat(name, record, "", 0)), room)
        if radar is not None:
            return radar.noting(note)
        for record in _records(found):
            columns.add(flat(name, record, "", 0))
    except RecursionError as error:
        raise InputError(f"{name}: this JSON nests too deeply; write one object for each reading.") from error
    if not columns.rows:
        raise InputError(f"{name}: there are no rows; expected one JSON object for each reading.")
    if not columns.columns:
        raise InputError(f"{name}: it holds no objects with values; expected one object for each reading.")
    return columns.header("JSON objects").noting(note)


def _without_cut_off(text: str) -> tuple[str, str]:
    """The text without a last line that was cut off while it was written, below one that is whole; and a note on it."""
    above, _, last = text.rpartition("\n")
    whole = above.rpartition("\n")[2]
    if not last.lstrip().startswith("{") or last.rstrip().endswith("}") or not whole.rstrip().endswith("}"):
        return text, ""
    return above, trimming.cut_off_note(last)


def of_records(found: Any, form: str, room: limits.Room) -> TableHeader | None:
    """The table of what a document holds, values inside each other; None if it holds no rows."""
    columns = Sparse(room)
    for record in _records(found):
        columns.add(flat(room.name, record, "", 0))
    return columns.header(form) if columns.rows > 1 and len(columns.columns) > 1 else None


def nested_rows(text: str, room: limits.Room) -> TableHeader | None:
    """Rows of numbers in brackets, as programs print arrays."""
    rows = [re.split(r"\s*,\s*|\s+", row.strip(" ,\n")) for row in _INNERMOST.findall(text)]
    return of_records(rows, "rows in brackets", room)


def plots(text: str, room: limits.Room) -> TableHeader | None:
    """The plots of ASTERIX in a JSON text, None if it has none."""
    return asterix.document(_parsed(room.name, text), lambda record: dict(flat(room.name, record, "", 0)), room)


def _parsed(name: str, text: str) -> Any:
    """A document, or a list of those that follow each other, on a line each or with commas between them."""
    try:
        return _loaded(text)
    except json.JSONDecodeError:
        first = text.lstrip().split("\n", 1)[0].strip()
    if not first.endswith(("{", ",")):
        return _by_line(name, text)
    found, offset = [], 0
    while offset < len(text):
        try:
            each, offset = json.JSONDecoder().raw_decode(text, offset)
        except json.JSONDecodeError:
            return _by_line(name, text)
        found.append(each)
        gap = _BETWEEN.match(text, offset)
        offset = gap.end() if gap else offset
    return found


def _records(found: Any) -> Iterable[Mapping[str, Any]]:
    """The objects of a document, one for each reading."""
    inner = [each for each in found.values() if _is_columns(each)] if isinstance(found, Mapping) else []
    units = found.get("units") if isinstance(found, Mapping) else None
    found = inner[0] if len(inner) == 1 and not _is_columns(found) else _without_constants(found)
    records = _of_rows(found) or (_of_columns(found) if _is_columns(found) else _deepest_list(found))
    if not isinstance(units, Mapping) or not all(isinstance(unit, str) for unit in units.values()):
        return records
    called = {name: f"{name} [{unit}]" for name, unit in units.items()}
    return ({called.get(name, name): cell for name, cell in record.items()} for record in records)


def _without_constants(found: Any) -> Any:
    """The columns of an object that holds lists of values, all of one length, beside values of the whole log."""
    if not isinstance(found, Mapping) or any(map(_holds_records, found.values())):
        return found
    columns = {key: value for key, value in found.items() if isinstance(value, list)}
    return columns if _is_columns(columns) else found


def _loaded(text: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        raise
    except ValueError:  # a whole number of thousands of digits
        return json.loads(text, parse_int=float)


def _by_line(name: str, text: str) -> list[Any]:
    found = []
    for number, line in enumerate(text.splitlines(), 1):
        if line.strip():
            try:
                found.append(_loaded(line))
            except ValueError as error:
                raise InputError(
                    f"{name}: line {number} is not JSON ({error}); expected an object on each line, such as "
                    '{"time_s": 0.5, "range_m": 5000}. Correct the line or delete it.'
                ) from error
    return found


def _is_columns(found: Any) -> bool:
    """Whether an object holds a list, or an object of numbered cells, of the same length for each column."""
    if not isinstance(found, Mapping) or len(found) < 2:
        return False
    sizes = {len(cells) if isinstance(cells, list | Mapping) else -1 for cells in found.values()}
    flat = all(not isinstance(cell, list | Mapping) for cells in found.values() for cell in _cells(cells)[:1])
    return len(sizes) == 1 and sizes.pop() > 1 and flat


def _of_rows(found: Any) -> Iterable[Mapping[str, Any]]:
    """The records of lists of values, perhaps beside the names, or of objects by the number of the row, as pandas
    writes them; none of other documents."""
    if (
        isinstance(found, Mapping)
        and found
        and all(key.isdecimal() and isinstance(found[key], Mapping) for key in found)
    ):
        return list(found.values())
    rows, names = found, None
    if isinstance(found, Mapping):
        rows, names = next(
            ((found[of], found.get(by)) for of in ("data", "values", "rows") for by in ("columns", "names", "fields")
             if of in found and (by in found or by == "fields")), (None, None)
        )  # fmt: skip
    if not isinstance(rows, list) or not rows or not all(isinstance(row, list) for row in rows):
        return []
    width = len(rows[0])
    if width < 2 or any(len(row) != width or isinstance(row[0], list | Mapping) for row in rows):
        return []
    if not isinstance(names, list) or len(names) != width:
        names = [str(k + 1) for k in range(width)]
    called = [str(each) for each in names]
    return (dict(zip(called, row, strict=True)) for row in rows)


def _cells(cells: Any) -> list[Any]:
    return list(cells.values()) if isinstance(cells, Mapping) else list(cells) if isinstance(cells, list) else [cells]


def _of_columns(found: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    names = list(found)
    return (dict(zip(names, row, strict=True)) for row in zip(*map(_cells, found.values()), strict=True))


def _deepest_list(found: Any, above: Mapping[str, Any] | None = None, depth: int = 0) -> Iterator[Mapping[str, Any]]:
    """The objects in lists of a document; an object that holds a list of objects gives these, with its plain values."""
    if depth > _DEEPEST:
        return
    if isinstance(found, list):
        for item in found:
            yield from _deepest_list(item, above, depth + 1)
    elif isinstance(found, Mapping):
        lists = [key for key, value in found.items() if _holds_records(value)]
        if not lists:
            yield {**(above or {}), **found}
        plain = {key: value for key, value in found.items() if not isinstance(value, list | Mapping)}
        for key in lists:
            yield from _deepest_list(found[key], {**(above or {}), **plain}, depth + 1)


def _holds_records(value: Any, depth: int = 0) -> bool:
    if depth > _DEEPEST:
        return False
    if isinstance(value, list):
        return any(isinstance(item, Mapping) for item in value)
    return isinstance(value, Mapping) and any(_holds_records(item, depth + 1) for item in value.values())


def flat(source: str, value: Any, prefix: str, depth: int) -> Iterator[tuple[str, Any]]:
    """Name and value of each plain value inside an object."""
    if len(prefix) > limits.LONGEST_NAME:
        raise limits.name_too_long(source, "a value")
    if isinstance(value, Mapping) and depth < _DEEPEST:
        inner = next((key for key in _VALUES if key in value), None)
        if prefix and inner is not None:
            unit = next((value[key] for key in UNIT_KEYS if isinstance(value.get(key), str)), "")
            yield from flat(source, value[inner], f"{prefix} [{unit}]" if unit else prefix, depth + 1)
            return
        for key, item in value.items():
            yield from flat(source, item, f"{prefix}.{key}" if prefix else str(key), depth + 1)
    elif not isinstance(value, list | Mapping):
        yield prefix, value
    elif isinstance(value, Sequence) and len(value) == 1:
        yield from flat(source, value[0], prefix, depth + 1)
    elif prefix and 1 < len(value) <= _MOST_OF_A_VECTOR and all(isinstance(item, float | int) for item in value):
        yield from ((f"{prefix} {k + 1}", item) for k, item in enumerate(value))
