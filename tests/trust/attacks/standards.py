"""Attacks on the readers of formats of the field: lengths that lie, marks that repeat, and damage."""

from __future__ import annotations

import random
import tempfile
from collections.abc import Iterator
from pathlib import Path

from tests.files.zoo import radars, standards
from tests.trust.attacks.attack import Attack, damaged, file


def octets(draw: random.Random) -> Iterator[Attack]:
    """Blocks, packets and items that claim other lengths than they have."""
    rows = [radars.block(48, radars.plot_048(*row)) for row in radars.readings()]
    whole, capture = b"".join(rows), radars.captured(rows)
    yield Attack("ASTERIX, blocks of no length", file("a.ast", b"\x30\x00\x00" * 200_000))
    yield Attack("ASTERIX, fields without end", file("a.ast", radars.block(48, b"\xff" * 60_000)), reads=False)
    yield Attack("ASTERIX, repetitions", file("a.ast", radars.block(48, b"\x01\x01\x40" + b"\xff" * 9000)), reads=False)
    yield Attack(
        "ASTERIX, very many empty records", file("a.ast", radars.block(48, b"\x00" * 60_000) * 16), reads=False
    )
    yield Attack("a capture of one endless packet", file("a.pcap", capture[:24] + b"\xff" * 900_000), reads=False)
    yield Attack("a capture of empty packets", file("a.pcap", capture[:24] + bytes(16) * 50_000), reads=False)
    yield Attack("sections of no length", file("a.pcapng", b"\n\r\r\n" + bytes(900_000)), reads=False)
    yield from damaged(whole, "a.ast", draw, 8)
    yield from damaged(capture, "a.pcap", draw, 8)


def marks(draw: random.Random) -> Iterator[Attack]:
    """What begins as a format does and goes on for ever."""
    many = draw.randrange(200_000, 300_000)
    for name, content in {
        "empty lines": "\n" * many,
        "CRD comments": "00 a\n" * (many // 5),
        "a CRD pass without passes": "h1 CRD 2\n" + "10 1.0 0.04 std 2\n" * (many // 20),
        "TDM, blanks": "CCSDS_TDM_VERS = 2.0\nDATA_START\nRANGE = " + " x" * many,
        "TDM, one name": "<tdm><data>" + "<" + "a" * many,
        "TDM, open tags": "<tdm><data>" + "<RANGE " * (many // 7),
        "ASTERIX, open tags": '<ASTERIX cat="48">' * (many // 18),
        "ASTERIX, open items": '<ASTERIX cat="48">' + "<I048>" * (many // 6),
        "ASTERIX, blanks": "Item 040 : x\n" + "\t" * many,
        "ASTERIX, nested": '{"CAT048":' * 5000,
        "sentences, blanks": ("$RATTM," + " " * 1000 + "*\n") * 200,
        "sentences, fields": "$RATTM" + "," * many + "\n",
        "FTPdetectinfo, one line": "Meteor Count = 1\nFrame# Col Row RA Dec Azim Elev\n"
        + "FF_20240101_000000_000_" * 9000,
        "GSI, one line": "110001+00000001 " * (many // 16),
        "kinds of lines": "2024-05-31T00:00:00 RANGE " + "9" * many,
        "dates beyond years": "h1 CRD 2\nh4 0 999999999999 1 1 0 0 0\n" + "10 1e300 1e300 std 2\n" * 99,
    }.items():
        yield Attack(name, file("a.txt", content), reads=False)


def damage(draw: random.Random) -> Iterator[Attack]:
    """Bytes changed in one file of each kind."""
    for animal in (*standards.laser(), *standards.messages(), *standards.ships(), *standards.lists()):
        if draw.random() < 0.3:
            with tempfile.TemporaryDirectory() as directory:
                path = animal.write(Path(directory))
                content, name = path.read_bytes(), path.name
            yield from (
                attack._replace(name=f"{animal.name}, {attack.name}") for attack in damaged(content, name, draw, 2)
            )


ALL = (octets, marks, damage)
