"""XML of any make: an element for each reading, with attributes or elements in it, or an element for each column."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

from ftproc.files.limits import Room
from ftproc.files.reading.formats import documents
from ftproc.files.reading.formats.header import TableHeader

_HELD = 16  # bytes that a byte of XML takes as a tree
_FEWEST = 3  # values in an element that is a column
_SPACE = re.compile(r"\{[^}]*\}")  # the name space before a name


def read(text: str, room: Room) -> TableHeader | None:
    """The table of a text, up to where it breaks off; None if it holds no readings. Entities are not resolved."""
    if "<!ENTITY" in text:
        return None
    room.check(_HELD * len(text))
    parser: ElementTree.XMLPullParser[Any] = ElementTree.XMLPullParser(["start"])
    cut = ""
    try:
        parser.feed(text.strip().removeprefix("\ufeff"))
        parser.close()
    except ElementTree.ParseError as error:
        cut = f", broken off at line {error.position[0]}"
    roots = (event[-1] for event in parser.read_events() if isinstance(event[-1], ElementTree.Element))
    root = next(roots, None)
    return None if root is None else documents.of_records(_value(root), f"XML{cut}", room)


def _value(element: ElementTree.Element) -> Any:
    """An element as JSON would hold it: its text, a list of the values in it, or an object of what is in it."""
    inside: dict[str, Any] = dict(_attributes(element))
    for child in element:
        name, value = _SPACE.sub("", str(child.tag)), _value(child)
        if isinstance(value, dict) and {*value} == {"unit", "value"}:
            name, value = f"{name} [{value['unit']}]", value["value"]
        earlier = inside.get(name)
        if isinstance(earlier, _Repeated):
            earlier.append(value)
        else:
            inside[name] = value if earlier is None else _Repeated([earlier, value])
    words = (element.text or "").split()
    if not words:
        return inside
    cells: Any = words if len(words) >= _FEWEST and all(map(_is_number, words)) else " ".join(words)
    return {**inside, "value": cells} if inside else cells


class _Repeated(list[Any]):
    """The values of elements of one name."""


def _attributes(element: ElementTree.Element) -> Iterator[tuple[str, str]]:
    for name, value in element.attrib.items():
        plain = _SPACE.sub("", name)
        yield "unit" if plain.lower() in documents.UNIT_KEYS else plain, value


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
