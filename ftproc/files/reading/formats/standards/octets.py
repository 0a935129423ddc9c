"""ASTERIX as octets (EUROCONTROL-SPEC-0149): data blocks in a file or in the UDP packets of a capture -> items.

Of the categories with plots the octets of every item are counted, and those decoded that a track needs. The other
categories are skipped by the length of their blocks.
"""

from __future__ import annotations

import functools
import struct
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

Row = Mapping[str, float | str]
Values = tuple[float | str, ...]
Decode = Callable[[bytes], Values]

#: Items of a record in the order of its field specification: the item, and its length. 2: octets; x: extended as long
#: as the last bit is set; r8: repeated, of 8 octets each; e: the first octet is the length; c: compound.
_PLAN = {
    48: (
        "010:2 140:3 020:x 040:4 070:2 090:2 130:c1,1,1,1,1,1,1 220:3 240:6 250:r8 161:2 042:4 200:4 170:x 210:4 "
        "030:x 080:2 100:4 110:2 120:c2,r6 230:2 260:7 055:1 050:2 065:1 060:2 SP:e RE:e"
    ),
    10: (
        "010:2 000:1 020:x 140:3 041:8 040:4 042:4 200:4 202:4 161:2 170:x 060:2 220:3 245:7 250:r8 300:1 090:2 091:2 "
        "270:x 550:1 310:1 500:4 280:r2 131:1 210:2 -:0 SP:e RE:e"
    ),
    1: (
        "010:2 020:x 040:4 070:2 090:2 130:x 141:2 050:2 120:1 131:1 080:2 100:4 060:2 030:x 150:1 -:0 -:0 -:0 -:0 "
        "SP:e RE:e"
    ),
    -1: (  # category 001, tracks
        "010:2 020:x 161:2 040:4 042:4 200:4 070:2 090:2 141:2 130:x 131:1 120:1 170:x 210:x 050:2 080:2 100:4 060:2 "
        "030:x SP:e RE:e 150:1"
    ),
}
CATEGORIES = (1, 2, 8, 10, 19, 20, 21, 34, 48, 62, 63, 65)  # with which files begin
_HEADER, _FRAME = 3, 6  # octets: category and length; length and clock of a recorder
_LETTERS = " ABCDEFGHIJKLMNOPQRSTUVWXYZ     " + " " * 16 + "0123456789      "
_LINKS = {1: 14, 113: 16, 276: 20, 101: 0, 228: 0, 0: 4}  # type of link -> octets before the IP packet
_VLAN, _UDP = (b"\x81\x00", b"\x88\xa8"), 17
CAPTURES = (b"\xd4\xc3\xb2\xa1", b"\xa1\xb2\xc3\xd4", b"\x4d\x3c\xb2\xa1", b"\xa1\xb2\x3c\x4d", b"\n\r\r\n")


class Record(NamedTuple):
    """category: of the block. row: the values that are decoded, such as I040.RHO; none of other categories."""

    category: int
    row: Row


def records(data: bytes) -> Iterator[Record]:
    """The records of a capture or of data blocks that follow each other; none of anything else."""
    packets = _packets(data) if data.startswith(CAPTURES) else [data]
    return (record for packet in packets for part in _parts(packet) for record in _records(part))


def _parts(packet: bytes) -> list[bytes]:
    """The data blocks of a packet, or those in frames of a recorder: length, four octets of its clock, blocks."""
    if are_blocks(packet):
        return [packet]
    parts, offset = list[bytes](), 0
    while offset < len(packet):
        end = offset + max(_number(packet[offset : offset + 2]), _FRAME)
        parts.append(packet[offset + _FRAME : end])
        offset = end
    return parts if offset == len(packet) and all(map(are_blocks, parts)) else []


def _blocks(data: bytes | bytearray) -> Iterator[tuple[int, int, int]]:
    """Category, start and end of each block; the end is beyond the data where that is none."""
    offset = 0
    while offset < len(data):
        length = int.from_bytes(data[offset + 1 : offset + _HEADER], "big")
        yield data[offset], offset + _HEADER, offset + max(length, _HEADER + 1)
        offset += max(length, _HEADER + 1)


def are_blocks(data: bytes) -> bool:
    """Whether data are blocks that follow each other, and nothing else."""
    end = 0
    for category, _, end in _blocks(data):
        if not category or end > len(data):
            return False
    return end == len(data) > 0


def whole_blocks(data: bytes | bytearray) -> int:
    """The length of the blocks with which data begin that are complete."""
    ends = [0, *(end for _, _, end in _blocks(data) if end <= len(data))]
    return ends[-1]


def _records(data: bytes) -> Iterator[Record]:
    for category, offset, end in _blocks(data):
        if category not in PLANS:
            yield Record(category, {})
            continue
        try:
            while offset < end:
                found, offset = _record(data, offset, category)
                if offset <= end:
                    yield Record(category, found)
        except IndexError:  # a field specification beyond the plan: the rest of the block is unknown
            yield Record(0, {})


def _record(data: bytes, offset: int, category: int) -> tuple[Row, int]:
    """The values of the record at an offset, and where it ends."""
    first, offset = offset, _extended(data, offset)
    found: dict[str, float | str] = {}
    plan = PLANS[category]
    for number in _set(data[first:offset]):
        item = plan[number]
        end = _end(data, offset, item.length)
        if item.number == "020" and category == 1 and data[offset] & 0x80:
            plan = PLANS[-1]
        if item.decode is not None:
            found.update(zip(item.names, item.decode(data[offset:end]), strict=True))
        offset = end
    return found, offset


@functools.lru_cache(maxsize=4096)
def _set(octets: bytes) -> tuple[int, ...]:
    """The numbers of the bits that are set, of seven in each octet: the last says that another follows."""
    return tuple(7 * k + bit for k, octet in enumerate(octets) for bit in range(7) if octet & (0x80 >> bit))


def _extended(data: bytes, offset: int) -> int:
    """Where octets end of which the last bit says that another follows."""
    while data[offset] & 1:
        offset += 1
    return offset + 1


def _end(data: bytes, offset: int, length: int | str) -> int:
    """Where an item ends. Raises IndexError beyond the data."""
    if isinstance(length, int):
        return offset + length
    kind = length[0]
    if kind == "x":
        return _extended(data, offset)
    if kind == "r":
        return offset + 1 + data[offset] * int(length[1:])
    if kind == "e":
        return offset + max(data[offset], 1)
    parts, first = length[1:].split(","), offset  # compound
    offset = _extended(data, first)
    for number in _set(data[first:offset]):
        offset = _end(data, offset, _length(parts[number]))
    return offset


def _length(text: str) -> int | str:
    return int(text) if text.isdigit() else text


def _number(data: bytes) -> int:
    return int.from_bytes(data, "big")


def _level(data: bytes) -> Values:
    """A flight level: 14 bits with a sign, in quarters; before it, whether it is garbled or not validated."""
    value = _number(data) & 0x3FFF
    return data[0] >> 7, data[0] >> 6 & 1, (value - 0x4000 * (value >> 13)) / 4


def _polar(count: float) -> Decode:
    """Range in counts of so much, azimuth in counts of 360 / 65536 degrees."""
    return lambda data: (_number(data[:2]) * count, _number(data[2:]) * 360 / 65536)


def _code(data: bytes) -> Values:
    return data[0] >> 7, f"{_number(data) & 0xFFF:04o}"


def _letters(data: bytes) -> Values:
    bits = _number(data)
    return ("".join(_LETTERS[bits >> shift & 63] for shift in range(42, -1, -6)).strip(),)


#: Category (0: any) and item -> the names that decoders give its values, and the values.
_DECODED: Mapping[tuple[int, str], tuple[str, Decode]] = {
    (0, "010"): ("SAC SIC", tuple),
    (0, "140"): ("ToD", lambda data: (_number(data) / 128,)),
    (1, "141"): ("TToD", lambda data: (_number(data) / 128,)),
    (48, "020"): ("TYP SIM", lambda data: (data[0] >> 5, data[0] >> 4 & 1)),
    (48, "040"): ("RHO THETA", _polar(1 / 256)),
    (10, "040"): ("RHO THETA", _polar(1.0)),
    (1, "040"): ("RHO THETA", _polar(1 / 128)),
    (48, "070"): ("V Mode3A", _code),
    (1, "070"): ("V Mode3A", _code),
    (10, "060"): ("V Mode3A", _code),
    (0, "090"): ("V G FL", _level),
    (0, "161"): ("Tn", lambda data: (_number(data) & 0xFFF,)),
    (0, "220"): ("ACAddr", lambda data: (data.hex().upper(),)),
    (48, "240"): ("TId", _letters),
}


class _Item(NamedTuple):
    """length: octets, or how they are counted. names, decode: of its values, if they are read."""

    number: str
    length: int | str
    names: tuple[str, ...]
    decode: Decode | None


def _planned(category: int, plan: str) -> list[_Item]:
    items = []
    for number, _, length in (item.partition(":") for item in plan.split()):
        names, decode = _DECODED.get((abs(category), number)) or _DECODED.get((0, number)) or ("", None)
        items.append(_Item(number, _length(length), tuple(f"I{number}.{name}" for name in names.split()), decode))
    return items


PLANS = {category: _planned(category, plan) for category, plan in _PLAN.items()}


def _packets(data: bytes) -> Iterator[bytes]:
    """What the UDP packets of a capture hold (pcap or pcapng)."""
    frames = _of_sections(data) if data.startswith(b"\n\r\r\n") else _of_capture(data)
    for link, frame in frames:
        if link not in _LINKS:
            continue
        start = _LINKS[link]
        while link == 1 and frame[start - 2 : start] in _VLAN:
            start += 4
        packet = frame[start:]
        if len(packet) > 28 and packet[0] >> 4 == 4 and packet[9] == _UDP:
            begin, end = 4 * (packet[0] & 15), _number(packet[2:4])
            yield packet[begin + 8 : end]


def _of_capture(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Type of link and octets of each frame of a pcap file."""
    order = "<" if data[0] in (0xD4, 0x4D) else ">"
    if len(data) < 24:
        return
    (link,) = struct.unpack_from(f"{order}I", data, 20)
    offset = 24
    while offset + 16 <= len(data):
        (length,) = struct.unpack_from(f"{order}I", data, offset + 8)
        yield link & 0xFFFF, data[offset + 16 : offset + 16 + length]
        offset += 16 + length


def _of_sections(data: bytes) -> Iterator[tuple[int, bytes]]:
    """The same of a pcapng file."""
    order, links, offset = "<", list[int](), 0
    while offset + 12 <= len(data):
        if data.startswith(b"\n\r\r\n", offset):
            order, links = "<" if data[offset + 8] == 0x4D else ">", []
        kind, length = struct.unpack_from(f"{order}II", data, offset)
        body = data[offset + 8 : offset + length - 4]
        if kind == 1 and len(body) >= 2:
            links.append(struct.unpack_from(f"{order}H", body)[0])
        elif kind == 6 and len(body) >= 20:
            which, size = struct.unpack_from(f"{order}I", body)[0], struct.unpack_from(f"{order}I", body, 12)[0]
            yield links[which] if which < len(links) else -1, body[20 : 20 + size]
        elif kind == 3 and links:
            yield links[0], body[4:]
        offset += max(length, 12)
