"""ASTERIX in octets, in captures, and as decoders write it, made here from the specifications of the categories."""

from __future__ import annotations

import gzip
import json
import struct
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from tests.files.zoo.flight import MIDNIGHT_START, START, Animal, Flight, flight, written

NO_ELEVATION = (False, False, True)
COARSE = {"tolerance": 9.0, "absent": NO_ELEVATION, "clock": 8e-3}  # half of the counts: 3.6 m, 5e-5 rad, 4 ms
FINE = {"absent": NO_ELEVATION}
SOD = float(flight().sod()[0])
ICAO = (0x3C660C, 0x4BAACD)


def octets(value: float, count: int) -> bytes:
    return round(value).to_bytes(count, "big")


def record(fields: Mapping[int, bytes]) -> bytes:
    """The octets of a record. fields: by their number in the field specification, from 1."""
    bits = [number in fields for number in range(1, 7 * -(-max(fields) // 7) + 1)]
    sevens = [bits[k : k + 7] for k in range(0, len(bits), 7)]
    head = [sum(bit << (7 - k) for k, bit in enumerate(part)) | (part is not sevens[-1]) for part in sevens]
    return bytes(head) + b"".join(fields[number] for number in sorted(fields))


def block(category: int, *records: bytes) -> bytes:
    body = b"".join(records)
    return bytes([category]) + octets(3 + len(body), 2) + body


def theta(azimuth: float) -> bytes:
    return octets(azimuth / (2 * np.pi) * 65536 % 65536, 2)


def plot_048(tod: float, r: float, a: float, icao: int = ICAO[0], sic: int = 1) -> bytes:
    """With a compound item of two parts, two registers of Mode S, and a status of two octets."""
    return record({
        1: bytes([25, sic]), 2: octets(tod % 86400 * 128, 3), 3: b"\xa0", 4: octets(r / 1852 * 256, 2) + theta(a),
        5: b"\x02\x00", 6: octets(1320, 2), 7: b"\x60\x07\xf0", **({8: octets(icao, 3)} if icao else {}),
        10: b"\x02" + b"\x01" * 16, 11: octets(3562, 2), 14: b"\x41\x00", 20: b"\x40\x01" + bytes(6), 21: b"\x20\xf5",
    })  # fmt: skip


def plot_010(tod: float, r: float, a: float) -> bytes:
    return record({1: b"\x01\x02", 2: b"\x01", 3: b"\x41\x00", 4: octets(tod * 128, 3), 6: octets(r, 2) + theta(a),
                   7: b"\x00\x01\x00\x02", 10: octets(77, 2), 13: octets(ICAO[0], 3)})  # fmt: skip


def track_001(tod: float, r: float, a: float) -> bytes:
    return record({1: b"\x19\xc9", 2: b"\xa0", 3: octets(12, 2), 4: octets(r / 1852 * 128, 2) + theta(a),
                   7: b"\x03\x34", 8: octets(1480, 2), 9: octets(tod * 128 % 65536, 2)})  # fmt: skip


def sector(tod: float) -> bytes:
    """Of category 034."""
    return block(34, record({1: b"\x19\x01", 2: b"\x02", 3: octets(tod % 86400 * 128, 3), 4: b"\x40"}))


def captured(blocks: list[bytes], link: int = 1, head: bytes = b"\x00" * 12 + b"\x08\x00") -> bytes:
    """A capture of UDP packets, and of one that is none of ours."""

    def frame(payload: bytes, protocol: int = 17) -> bytes:
        ip = bytes([0x45, 0]) + octets(28 + len(payload), 2) + bytes(4) + bytes([64, protocol]) + bytes(10)
        return head + ip + bytes(4) + octets(8 + len(payload), 2) + bytes(2) + payload

    out = struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, link)
    for k, payload in enumerate([b"\x48\x00", *(frame(each) for each in blocks), frame(b"GET / HTTP", 6)]):
        out += struct.pack("<IIII", k, 0, len(payload), len(payload)) + payload
    return out


def sections(blocks: list[bytes]) -> bytes:
    """The same as pcapng, of raw IP packets."""

    def part(kind: int, body: bytes) -> bytes:
        body += bytes(-len(body) % 4)
        return struct.pack("<II", kind, 12 + len(body)) + body + struct.pack("<I", 12 + len(body))

    out = part(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1)) + part(1, struct.pack("<HHI", 101, 0, 65535))
    for each in blocks:
        ip = bytes([0x45, 0]) + octets(28 + len(each), 2) + bytes(5) + bytes([17]) + bytes(10)
        packet = ip + bytes(4) + octets(8 + len(each), 2) + bytes(2) + each
        out += part(6, struct.pack("<IIIII", 0, 0, 0, len(packet), len(packet)) + packet)
    return out


def readings(which: int = 0, start: np.datetime64 = START) -> Iterator[tuple[float, float, float]]:
    """Second of the day, range m and azimuth rad of each row."""
    f: Flight = flight(which)
    return zip((f.sod(start)).tolist(), f.r.tolist(), f.a.tolist(), strict=True)


def in_octets() -> Iterator[Animal]:
    """Blocks in a file and in captures."""
    one = [block(48, plot_048(*row)) for row in readings()]
    beside = b"".join(each + sector(k) + block(21, bytes(9)) for k, each in enumerate(one))
    yield Animal("ASTERIX 048", written("a.ast", b"".join(one)), first_s=SOD, **COARSE)
    yield Animal("ASTERIX 048 beside others", written("radar", beside), first_s=SOD, **COARSE)
    yield Animal("ASTERIX 048, packed", written("a.bin.gz", gzip.compress(b"".join(one))), first_s=SOD, **COARSE)
    yield Animal("ASTERIX 048 in pcap", written("a.pcap", captured(one)), first_s=SOD, **COARSE)
    vlan = captured(one, head=b"\x00" * 12 + b"\x81\x00\x00\x07\x08\x00")
    yield Animal("ASTERIX 048 in a VLAN", written("a.cap", vlan), first_s=SOD, **COARSE)
    frames = [octets(6 + len(each), 2) + bytes(4) + each for each in one]
    recorder = captured([a + b for a, b in zip(frames[::2], frames[1::2], strict=True)])
    yield Animal("ASTERIX 048 in a recorder's frames", written("a.pcap", recorder), first_s=SOD, **COARSE)
    yield Animal("ASTERIX 048 in pcapng", written("a.pcapng", sections(one)), first_s=SOD, **COARSE)
    midnight = b"".join(block(48, plot_048(*row)) for row in readings(start=MIDNIGHT_START))
    first = float(flight().sod(MIDNIGHT_START)[0])
    yield Animal("ASTERIX 048 over midnight", written("a.raw", midnight), first_s=first, **COARSE)
    both = [block(48, plot_048(*a), plot_048(*b, ICAO[1])) for a, b in zip(readings(), readings(1), strict=True)]
    ask = {"asks": "--target I220.ACAddr=3C660C", "answer": {"target": "I220.ACAddr=4BAACD"}, "which": 1}
    yield Animal("ASTERIX 048, two aircraft", written("a.ast", b"".join(both)), first_s=SOD, **ask, **COARSE)
    two = [
        block(48, plot_048(*a)) + block(48, plot_048(*b, sic=2)) for a, b in zip(readings(), readings(1), strict=True)
    ]
    ask = {"asks": "--where I010.SIC=NAME", "answer": {"where": "I010.SIC=2"}, "which": 1}
    yield Animal("ASTERIX 048, two radars", written("a.ast", b"".join(two)), first_s=SOD, **ask, **COARSE)
    no_address = b"".join(block(48, plot_048(*row, icao=0)) for row in readings())
    yield Animal("ASTERIX 048 without Mode S", written("a.ast", no_address), first_s=SOD, **COARSE)
    surface = b"".join(block(10, plot_010(*row)) for row in readings())
    yield Animal("ASTERIX 010", written("a.ast", surface), first_s=SOD, **COARSE)
    old = b"".join(block(1, track_001(*row)) for row in readings(start=START + np.timedelta64(250, "s")))
    yield Animal("ASTERIX 001 over 512 s", written("a.ast", old), **{**COARSE, "tolerance": 17.0})


def _items(tod: float, r: float, a: float, address: str) -> dict[str, Any]:
    return {"I010": {"SAC": 25, "SIC": 201}, "I140": {"ToD": tod}, "I020": {"TYP": 5},
            "I040": {"RHO": r / 1852, "THETA": float(np.degrees(a))}, "I070": {"V": 0, "Mode3A": "1000"},
            "I090": {"V": 0, "FL": 330.0}, "I220": {"ACAddr": address},
            "I250": [{"MCP_ALT": 33008.0}, {"BDS": "50"}, {"BDS": "60"}], "I161": {"Tn": 3563}}  # fmt: skip


def _valued(items: Any) -> Any:
    if isinstance(items, list):
        return [_valued(each) for each in items]
    return {key: _valued(each) if isinstance(each, dict | list) else {"val": each} for key, each in items.items()}


def decoded() -> Iterator[Animal]:
    """As decoders write them."""
    rows = [_items(*row, "3C660C") for row in readings()]
    service = {"I010": {"SAC": 25, "SIC": 201}, "I000": {"TYP": 2}, "I030": {"ToD": 1.0}, "I020": {"SECTOR": 90.0}}
    pairs = (({"category": 48, "ts": 1795.0, **_valued(row)}, {"category": 34, **_valued(service)}) for row in rows)
    listed = [each for pair in pairs for each in pair]
    yield Animal("ASTERIX, lists in JSON", written("a.json", json.dumps(listed)), first_s=SOD, **FINE)
    each_line = "\n".join(json.dumps({"id": 1, "cat": 48, "timestamp": 7.0, "CAT048": row}) for row in rows)
    yield Animal("ASTERIX, JSON lines", written("a.jsonl", each_line), first_s=SOD, **FINE)
    other = [_items(*row, "4BAACD") for row in readings(1)]
    mixed = json.dumps([{"category": 48, **item} for pair in zip(rows, other, strict=True) for item in pair])
    ask = {"asks": "--target I220.ACAddr=3C660C", "answer": {"target": "I220.ACAddr=4BAACD"}, "which": 1}
    yield Animal("ASTERIX, two aircraft in JSON", written("a.json", mixed), first_s=SOD, **ask, **FINE)
    text = "\n".join(_text(row) for row in rows)
    yield Animal("ASTERIX in text", written("a.txt", text), first_s=SOD, **{**FINE, "tolerance": 0.05})
    xml = "".join(_xml(row) for row in rows)
    yield Animal("ASTERIX in XML", written("a.xml", f'<?xml version="1.0"?>\n<log>{xml}</log>'), first_s=SOD, **FINE)
    head = "TIME;SIC;RHO;THETA;MODE 3/A;FL;TA"
    cells = [f"{t:.3f};201;{r / 1852:.6f};{np.degrees(a):.6f};5307;380;7380C0" for t, r, a in readings()]
    table = "\n".join([head, *(row.replace(".", ",") for row in cells)])
    yield Animal("ASTERIX in a table", written("a.csv", table), first_s=SOD, **FINE)


def _text(row: Mapping[str, Any]) -> str:
    tod, rho, theta = row["I140"]["ToD"], row["I040"]["RHO"], row["I040"]["THETA"]
    return (
        "-------------------------\nData Block 1\nCategory: 48\nLen: 45\n-------------------------\nData Record 1\n"
        "\nItem 010 : Data Source Identifier\n[ 19 C9 ]\n\tSystem Area Code: 25\n\tSystem Identification Code: 201\n"
        f"\nItem 140 : Time Of Day\n\tTime Of Day: {round(tod * 128)} ({tod:.7f} s)\n"
        f"\nItem 040 : Measured Position in Polar Coordinates\n\tRHO: 1 ({rho:.7f} NM)\n\tTHETA: 2 ({theta:.7f} deg)\n"
        "\nItem 220 : Aircraft Address\n\tAircraftAddress: 3C660C\n\nItem 020 : Descriptor\n\tTYP: 5 (Roll-Call (S))\n"
    )


def _xml(row: Mapping[str, Any]) -> str:
    inside = "".join(
        f"<I{item[1:]}>" + "".join(f"<{k}>{v}</{k}>" for k, v in row[item].items()) + f"</I{item[1:]}>"
        for item in ("I010", "I140", "I040", "I220")
    )
    return f'<ASTERIX ver="1" cat="48" length="45">{inside}</ASTERIX>\n'


def all_radars() -> Iterator[Animal]:
    yield from in_octets()
    yield from decoded()
