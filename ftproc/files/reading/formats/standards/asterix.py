"""ASTERIX plots of radars (categories 048, 010 and 001): binary, in captures, and as decoders write them in JSON, XML,
text and tables.

What the specifications of the categories settle is stated: the columns, their units, azimuths clockwise from north, and
the column by which targets are distinguished.
"""

from __future__ import annotations

import functools
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from ftproc.errors import InputError
from ftproc.files import limits
from ftproc.files.options import ABSENT
from ftproc.files.reading.formats import content
from ftproc.files.reading.formats.header import Stated, TableHeader
from ftproc.files.reading.formats.sparse import Sparse
from ftproc.files.reading.formats.standards import octets
from ftproc.files.reading.meaning.names import taken_apart

Row = Mapping[str, Any]
Flatten = Callable[[Any], Row]

#: Category -> the unit of its ranges.
_PLOTS = {48: "nmi", 10: "m", 1: "nmi"}
_FARTHEST_NMI = 300.0  # of category 048; a decoder that writes larger numbers converts them
#: What the other categories hold.
_OTHERS = {
    **dict.fromkeys((2, 8, 9, 19, 23, 25, 34, 63, 65), "status of a sensor or service"),
    20: "positions by multilateration",
    21: "positions that aircraft broadcast (ADS-B)",
    **dict.fromkeys((11, 30, 62), "tracks of a tracker, as positions"),
}


class _Role(NamedTuple):
    """Item of a column, and how decoders call what is in it; the first of several columns counts."""

    item: str
    name: str


_QUANTITIES = {
    "time": (_Role("140", ""), _Role("141", "")),
    "range": (_Role("040", r"rho|range|distance"),),
    "azimuth": (_Role("040", r"theta|azimuth"),),
}
_TARGETS = (
    *(_Role("220", "addr|ta"), _Role("161", "t.?n|number"), _Role("070", "mode|code|squawk")),
    _Role("060", "mode|code|squawk"),
)
_STATION = _Role("010", "sic|identification")
_ITEM = re.compile(r"(?:^|[^A-Za-z0-9])I?(\d{3})(?:[^A-Za-z0-9]+|$)(.*)")
_CATEGORY = re.compile(r"^(?:CAT)?I?0?48[/_.: -](?=I?\d{3})", re.IGNORECASE)
_KEY = re.compile(r"I?\d{3}")
_FEW = 20  # rows by which a column holds numbers
_BLOCK = re.compile(r"CAT(\d{3})")
#: Names of columns, without marks, by which a target is known; and those that stand beside RHO and THETA.
_OF_TARGETS = ("acaddr", "aircraftaddress", "targetaddress", "ta", "icao", "icao24", "tn", "trackno", "tracknumber")
_BESIDE = frozenset((*_OF_TARGETS, "sac", "sic", "mode3a", "fl", "flightlevel", "ti", "tid", "tod", "cat", "category"))
_ENOUGH = 0.5  # of the plots have what tells targets apart
_DEEPEST = 12  # objects inside each other


def binary(data: bytes, room: limits.Room) -> TableHeader | None:
    """The plots of a capture or of data blocks; None of anything else. Raises InputError without plots."""
    found = octets.records(data)
    with content.undamaged(room.name, "ASTERIX", "copy it again"):
        return _table(found, room, "ASTERIX, binary")


def document(found: Any, flatten: Flatten, room: limits.Room) -> TableHeader | None:
    """The plots of a JSON document; None if its objects are no records of ASTERIX. flatten: an object -> its plain
    values by their paths."""
    plots = ((category, flatten(record)) for category, record in _records(found, 0, 0))
    return _table(plots, room, "ASTERIX in JSON")


def text(whole: str, room: limits.Room) -> TableHeader | None:
    """The records of a decoder that writes `Item 040 : ...` and below it a line for each value; None of others."""
    return _table(_of_text(whole), room, "ASTERIX in text")


def xml(whole: str, room: limits.Room) -> TableHeader | None:
    """The records of a decoder that writes <ASTERIX cat="48"><I040><RHO>; None of others."""
    return _table(_of_xml(whole), room, "ASTERIX in XML")


def by_names(header: TableHeader) -> TableHeader:
    """A table with RHO and THETA beside other items of category 048, with what the standard states of them."""
    plain = [re.sub(r"[^a-z0-9]", "", name.lower()) for name in header.names]
    words = {word for name in header.names for word in re.split(r"[^a-z0-9]+", name.lower())}
    bare = {_CATEGORY.sub("", name): name for name in header.names}
    if len(bare) < len(header.names):
        return header
    items = [
        name for k, name in enumerate(bare) if _ITEM.match(name) and name != bare[name] and _has_numbers(header, k)
    ]
    beside = len(_BESIDE & {*plain, *words}) > 1 or len(items) > 2 or {"polar", "coordinates"} <= words
    if not ({"rho", "theta"} <= words and beside):
        return header
    indices = {
        quantity: [k for k, name in enumerate(header.names) if word in re.split(r"[^a-z0-9]+", name.lower())]
        for quantity, word in (("range", "rho"), ("azimuth", "theta"))
    }
    if any(len(found) != 1 for found in indices.values()) or header.units:
        return header
    columns = {quantity: header.names[found[0]] for quantity, found in indices.items()}
    time = _named((*items, *header.names), _QUANTITIES["time"])
    time = bare.get(time, time)
    time = header.names[plain.index("tod")] if "tod" in plain and "time" not in plain else time
    level = bare.get(_named(tuple(items), (_Role("090", ""),)), "")
    stated_units = {columns["azimuth"]: "deg", time: "s", level: "fl"}
    units = [name and stated_units.get(name, "") for name in header.names]
    if max(map(_float, header.load([], indices["range"]).column(0).to_pylist()), default=0.0) <= _FARTHEST_NMI:
        units[indices["range"][0]] = "nmi"
    target = next((header.names[plain.index(word)] for word in _OF_TARGETS if word in plain), "")
    target = target or next(filter(None, (bare.get(_named(tuple(items), (role,)), "") for role in _TARGETS[:2])), "")
    columns |= {"height": level} if level else {}
    if not any(taken_apart(name).means("elevation") == 1 for name in header.names):
        columns["elevation"] = ABSENT
    known = Stated(columns | ({"time": time} if time else {}), "north", target)
    return replace(header, stated=known, units=units)


def _records(found: Any, category: int, depth: int) -> Iterator[tuple[int, Mapping[str, Any]]]:
    """Category (0: unknown) and items of the records in a document."""
    if depth > _DEEPEST:
        return
    if isinstance(found, list):
        for each in found:
            yield from _records(each, category, depth + 1)
    elif isinstance(found, Mapping):
        named = found.get("category", found.get("cat", category))
        category = int(named) if str(named).isdecimal() else category
        if sum(bool(_KEY.fullmatch(key)) for key in found) > 1:
            yield category, {key: value for key, value in found.items() if _KEY.fullmatch(key)}
            return
        for key, value in found.items():
            block = _BLOCK.fullmatch(key)
            if isinstance(value, list | Mapping):
                yield from _records(value, int(block[1]) if block else category, depth + 1)


_LINE = re.compile(
    r"Category: *(?P<category>\d+)|(?P<record>Data Record)|Item +(?P<item>\d{3}) *:.*"
    r"|[\t ]{1,8}(?P<name>[^:\s][^:]{0,100}): *(?P<raw>\S*)(?: *\((?P<value>[-+\d.eE]+) +\S+\))?.*"
)


def _of_text(whole: str) -> Iterator[tuple[int, Row]]:
    category, item, row = 0, "", dict[str, Any]()
    for line in whole.splitlines():
        found = _LINE.match(line)
        if found is None:
            continue
        if found["record"] or found["category"]:
            if row:
                yield category, row
            category, item, row = int(found["category"] or category), "", {}
        elif found["item"]:
            item = found["item"]
        elif item:
            row.setdefault(f"I{item}.{found['name'].strip()}", found["value"] or found["raw"])
    if row:
        yield category, row


def _of_xml(whole: str) -> Iterator[tuple[int, Row]]:
    category, item, row = 0, "", dict[str, Any]()
    for tag in re.finditer(r"<(\w++)([^<>]*+)>([^<>]*+)", whole):
        if tag[1] == "ASTERIX":
            if row:
                yield category, row
            found = re.search(r'\bcat="(\d{1,3})"', tag[2])
            category, item, row = int(found[1]) if found else 0, "", {}
        elif _KEY.fullmatch(tag[1]):
            item = tag[1]
        elif item:
            row[f"{item}.{tag[1]}"] = tag[3].strip()
    if row:
        yield category, row


def _table(records: Iterable[tuple[int, Row]], room: limits.Room, form: str) -> TableHeader | None:
    """The rows of the category with the most plots, and what the standard states of them; None without records."""
    columns, held = {category: Sparse(room) for category in _PLOTS}, Counter[int]()
    for category, row in records:
        is_plot = bool(_named(tuple(row), _QUANTITIES["range"]))
        category = category or (48 if is_plot else 0)
        held[category] += 1
        if category in _PLOTS and is_plot:
            columns[category].add(row.items())
    if not held:
        return None
    chosen = max(_PLOTS, key=lambda each: columns[each].rows)
    table = columns[chosen]
    if not table.rows:
        others = ", ".join(f"{n:03d} ({_OTHERS.get(n, 'no readings of a radar')})" for n in sorted(held) if n)
        raise InputError(
            f"{room.name}: no ranges and azimuths of a radar; it holds ASTERIX of category {others or 'none known'}."
        )
    left = sum(held.values()) - table.rows
    if chosen == 1:
        _unfold(table)
    notes = (f"{left} records of ASTERIX are left out, which are no plots of category {chosen:03d}",) if left else ()
    header = stated(table.header(f"{form}, category {chosen:03d}", decimal_comma=False), chosen, table)
    return replace(header, stated=header.stated._replace(notes=notes))


@functools.lru_cache(maxsize=1024)
def _named(names: tuple[str, ...], roles: tuple[_Role, ...]) -> str:
    """The first column that has one of these roles, or ""."""
    for role in roles:
        for name in names:
            item = _ITEM.search(name)
            if item and item[1] == role.item and re.search(role.name, item[2], re.IGNORECASE):
                return name
    return ""


def stated(header: TableHeader, category: int, table: Sparse) -> TableHeader:
    """The header with what the standard states. Raises InputError if no target has two plots."""
    names = tuple(header.names)
    columns = {quantity: _named(names, roles) for quantity, roles in _QUANTITIES.items()}
    columns = {quantity: name for quantity, name in columns.items() if name} | {"elevation": ABSENT}
    unit = {columns.get("range", ""): _PLOTS[category], columns.get("azimuth", ""): "deg", columns.get("time", ""): "s"}
    ranges = (_float(cell) for cell in table.columns[columns["range"]][1])
    if max(ranges, default=0.0) > _FARTHEST_NMI and _PLOTS[category] == "nmi":
        del unit[columns["range"]]
    targets = (_named(names, (role,)) for role in _TARGETS)
    target = next((name for name in targets if name and len(table.columns[name][0]) >= _ENOUGH * table.rows), "")
    if target and max(Counter(map(str, table.columns[target][1])).values()) < 2:
        raise InputError(
            f"{header.source}: {table.rows} {'plot' if table.rows == 1 else 'plots'} of as many targets, of which none "
            "is seen twice: there is no track in it."
        )
    known = Stated(columns, "north", target, _named(names, (_STATION,)))
    return replace(header, stated=known, units=[unit.get(name, "") for name in names])


def _has_numbers(header: TableHeader, index: int) -> bool:
    return any(map(_float, header.load([], [index]).column(0).slice(0, _FEW).to_pylist()))


def _float(cell: Any) -> float:
    try:
        return float(cell)
    except (TypeError, ValueError):
        return 0.0


def _unfold(table: Sparse) -> None:
    """Times of category 001, which start again every 512 s, go on."""
    name = _named(tuple(table.columns), _QUANTITIES["time"])
    turns, before = 0, 0.0
    for k, cell in enumerate(table.columns[name][1] if name else ()):
        value = _float(cell)
        turns += (value < before - 256) - (value > before + 256) * (k > 0)
        before = value
        table.columns[name][1][k] = value + 512 * turns
