"""Attacks on the readers of text, JSON, archives, station files and times."""

from __future__ import annotations

import json
import random
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tests.trust.attacks.attack import HEAD, LINES, ROWS, TEXT, A, Attack, E, Make, N, R, T, file, packed

_MB = 1_000_000


def names(draw: random.Random) -> Iterator[Attack]:
    """Long names of one kind of letter; many long names; very many columns."""
    for letter in (
        "[",
        "]",
        "{",
        "-",
        " ",
        "_",
        ".",
        "/",
        "a b ",
        "x*",
        "1.",
        "±",
        "(m",
        "in ",
        "\u0301",
        "°",
        "#",
        "=:",
    ):
        long = "range" + letter * draw.randrange(20_000, 40_000)
        yield Attack(
            f"a name of {letter!r}",
            file("a.csv", TEXT.replace("range_m", long)),
            reads=None if letter == " " else False,
        )
        many = ",".join(f"n{k}" + (letter * 990)[:980] for k in range(900))
        row = ",".join(["1"] * 900)
        yield Attack(f"many names of {letter!r}", file("a.csv", f"{HEAD},{many}\n" + f"{LINES[0]},{row}\n" * 20))
    for mark, word in ((",", "commas"), (";", "semicolons"), ("\t", "tabs"), ("|", "bars"), (" ", "blanks")):
        wide = mark.join(f"c{k}" for k in range(90_000))
        yield Attack(f"90,000 columns by {word}", file("a.txt", wide + "\n" + mark.join("1" * 90_000)), reads=False)
        yield Attack(f"a line of {word}", file("a.csv", TEXT + mark * 900_000 + "\n"))
        yield Attack(f"a line of {word} first", file("a.csv", mark * 900_000 + "\n" + TEXT))


def lines(draw: random.Random) -> Iterator[Attack]:
    """Lines and cells on which a pattern may go back and forth."""
    n = 900_000
    for label, bad in {
        "a rule": "|" + "-" * n + "x",
        "rules of two kinds": "|" + "-=" * (n // 2) + "x",
        "blanks and a cell": "1" + " " * n + "2",
        "blanks before a column": " " * n + "column 1",
        "a number and letters": "1" + "a" * n + "! !",
        "a unit": "unit " + "a " * (n // 2),
        "units stated": "units: " + "range " * (n // 6),
        "brackets": "a(" * (n // 2),
        "quotes": '"' * n,
        "quotes and commas": '",' * (n // 2),
        "comments": "#" * n,
        "names and dashes": "a-" * (n // 2),
        "names and signs": "a=" * (n // 2),
        "names and quotes": 'a="' * (n // 3),
        "one name again": "r=1 " + " ".join(f"r={k}" for k in range(110_000)),
        "different names": " ".join(f"r{k}=1" for k in range(90_000)),
        "a sentence of blanks": "$PTRK," + " " * n + "x",
        "a sentence of commas": "$PTRK" + "," * n,
        "stars": "*" * n,
        "empty records": "\n---" * (n // 4),
        "words of a survey": "21.322+27912345 " * (n // 16),
        "combining letters": "e" + "\u0301\u0323" * (n // 5),
    }.items():
        yield Attack(f"{label} above", file("a.txt", bad + "\n" + TEXT))
        yield Attack(f"{label} below", file("a.txt", TEXT + bad + "\n"))
        if draw.random() < 0.4:
            yield Attack(f"{label} alone", file("a.txt", bad))
    repeated = "time_s,range_m\n" * 60_000
    yield Attack("names again and again", file("a.csv", TEXT + f"{HEAD}\n" * 20_000))
    yield Attack("nothing but names", file("a.csv", repeated))
    tagged = "".join(f"T={k} R=5000 AZ=1 EL=1 x{k}=1\n" for k in range(20_000))
    yield Attack("a name more in each line", file("a.txt", tagged), reads=False)
    yield Attack("blank lines", file("a.csv", TEXT + "\n" * 900_000), reads=True)


def documents(draw: random.Random) -> Iterator[Attack]:
    """JSON."""
    keys = HEAD.split(",")
    rows = [dict(zip(keys, row, strict=True)) for row in ROWS]
    good = [json.dumps(row) for row in rows]
    short = '{"time_s":1}\n'
    wide = json.dumps({f"k{k}": k for k in range(4900)})

    def lined(*more: str) -> Make:
        return file("a.jsonl", "\n".join([*good, *more]))

    yield Attack("one wide row among many", file("a.jsonl", short * 60_000 + wide))
    yield Attack("4,900 keys above rows", file("a.json", wide[:-1] + ',"rows":[' + ",".join(["{}"] * 200_000) + "]}"))
    noted = {"note": "x" * 400_000, "rows": [*rows, *({"time_s": k, "range_m": 1} for k in range(15_000))]}
    yield Attack("a long text above rows", file("a.json", json.dumps(noted)), ("--keep-columns",))
    yield Attack(
        "a long key above keys", file("a.json", json.dumps({"x" * 400_000: {f"k{k}": 1 for k in range(4000)}}))
    )
    for digits in (4299, 4301, 20_000, 400_000):
        yield Attack(f"{digits} digits", lined(good[0].replace("0.0", "1" * digits)))
        yield Attack(f"{digits} digits behind a point", lined(good[0].replace("0.0", "0." + "1" * digits)))
    for label, text in {
        "half a letter in a key": '{"\\ud800": 1, "time_s": 99, "range_m": 1}',
        "half a letter in a value": '{"time_s": 99, "range_m": 5000, "note": "\\udc00x"}',
        "half a letter for a range": '{"time_s": 99, "range_m": "\\udfff"}',
        "a range that is no number": '{"time_s": 99, "range_m": Infinity}',
        "a range that is a list": '{"time_s": 99, "range_m": [[[5]]]}',
        "an empty key": '{"": 1, "time_s": 99, "range_m": 5000}',
        "NUL in a key": '{"\\u0000": 1, "time_s": 99, "range_m": 5000}',
        "a truth": '{"time_s": true, "range_m": false}',
        "1e400": '{"time_s": 1e400, "range_m": 1e-400}',
        "nested": '{"a":' * 900 + "1" + "}" * 900,
        "nested far": "[" * 100_000,
    }.items():
        yield Attack(f"JSON, {label}", lined(text))
        yield Attack(f"JSON, {label}, kept", lined(text), ("--keep-columns",))
    for kind in ("gz", "xz", "zst", "zip"):
        for label, unit in (("lists", "[],"), ("objects", "{},"), ("zeros", "0,"), ("rows", "[0,1],")):

            def content(kind: str = kind, unit: str = unit) -> bytes:
                return packed(kind, ("[" + unit * (40 * _MB // len(unit)) + "0]").encode(), "a.json")

            yield Attack(f"JSON {label} in .{kind}", file(f"a.json.{kind}", content), reads=False)


def archives(draw: random.Random) -> Iterator[Attack]:
    """Archives."""
    for kind in ("gz", "bz2", "xz", "zst", "zip"):
        for label, piece in {
            "zeros": bytes(1),
            "line ends": b"\n",
            "rows": b"1,5000,1,1\n",
            "commas": b",",
            "tags": b"T=1 R=5000 AZ=1 EL=1\n",
        }.items():

            def content(
                kind: str = kind, head: bytes = HEAD.encode() * (label == "rows"), piece: bytes = piece
            ) -> bytes:
                return packed(kind, head + b"\n" + piece * (80 * _MB // len(piece)))

            yield Attack(f"{label} in .{kind}", file(f"a.csv.{kind}", content), reads=False)
        inner = file(f"a.csv.gz.{kind}", lambda k=kind: packed(k, packed("gz", bytes(90 * _MB)), "log.csv.gz"))
        yield Attack(f".gz in .{kind}", inner, reads=False)
    for member in (
        "x" * 300 + ".csv",
        "a\\b.csv",
        "../../a.csv",
        "/etc/a.csv",
        "a\x01.csv",
        ".csv",
        "a.csv.zip",
        "\U0001f600.csv",
    ):
        whole = packed("zip", TEXT.encode(), member)
        yield Attack(f"a member {member[:20]!r}", file("a.zip", whole))
        broken = bytearray(whole)
        broken[len(whole) // 3] ^= 1
        yield Attack(f"a damaged member {member[:20]!r}", file("a.zip", bytes(broken)))


def addresses(draw: random.Random) -> Iterator[Attack]:
    """Files by URI."""
    import os

    def bomb(name: str, member: str, content: bytes) -> Make:
        return lambda d: file(name, packed("zip", content, member))(d)

    def uri(made: Make, address: str) -> Make:
        def make(directory: Path) -> str:
            made(directory)
            return address.format(d=directory)

        return make

    zeros = bomb("a.zip", "a.csv", bytes(400 * _MB))
    for label, made, address, reads in (
        ("zip://", zeros, "zip://a.csv::{d}/a.zip", False),
        ("zip:// of file://", zeros, "zip://a.csv::file://{d}/a.zip", False),
        ("zip:// of local://", zeros, "zip://a.csv::local://{d}/a.zip", False),
        ("simplecache", zeros, "simplecache::zip://a.csv::file://{d}/a.zip", False),
        ("zip://, a log", bomb("a.zip", "a.csv", TEXT.encode()), "zip://a.csv::{d}/a.zip", True),
        ("an endless device", file("x", b""), "local:///dev/zero", False),
        ("an endless device by file", file("x", b""), "file:///dev/zero", False),
        ("random", file("x", b""), "local:///dev/urandom", False),
        ("a directory", file("x", b""), "local://{d}", False),
        ("nothing there", file("x", b""), "zip://b.csv::{d}/none.zip", False),
        ("no scheme", file("x", b""), "xyz://a.csv", False),
        ("a pipe", lambda d: os.mkfifo(d / "a.csv") or "", "local://{d}/a.csv", False),
        ("a pipe in a zip", lambda d: os.mkfifo(d / "a.zip") or "", "zip://a.csv::{d}/a.zip", False),
    ):
        yield Attack(f"URI, {label}", uri(made, address), reads=reads)


def times(draw: random.Random) -> Iterator[Attack]:
    """Times and readings that no calendar and no instrument has."""
    for name in (
        "jd",
        "mjd",
        "datenum",
        "excel",
        "gps",
        "unix",
        "tow",
        "tod",
        "utc",
        "timestamp",
        "time",
        "time_ms",
        "doy",
    ):
        for value in ("1e300", "-1e300", "1e18", "-1e17", "9.3e8", "3.65e6", "1e-320"):
            body = "".join(f"{value},{5000 + k},0.3,0.2\n" for k in range(20))
            yield Attack(f"{name} of {value}", file("a.csv", f"{name},range_m,azimuth_rad,elevation_rad\n{body}"))
    for head, first in {
        "GPS_week,TOW": ("1e18", "-3e9", "1e300", "99999"),
        "year,doy,sod": ("1e18", "-3", "99999", "1e300"),
        "doy,time": ("1e300", "-1e17", "4e4"),
        "year,month,day,hour,minute,second": ("1e308", "-1", "1e17"),
        "date,time": ("1e300", "43000", "99999999"),
    }.items():
        for value in first:
            rest = ",".join(["1"] * head.count(","))
            body = "".join(f"{value},{rest},{5000 + k},0.3,0.2\n" for k in range(20))
            yield Attack(f"{head} of {value}", file("a.csv", f"{head},range_m,azimuth_rad,elevation_rad\n{body}"))
    for unit in ("km", "nmi", "kyd"):
        yield Attack(
            f"1e308 {unit}", file("a.csv", TEXT.replace("range_m", f"range_{unit}").replace("5000.0", "1e308"))
        )
    yield Attack("1e308 turns", file("a.csv", TEXT.replace("azimuth_rad", "azimuth_turn").replace("0.3,", "1e308,")))


def stations(draw: random.Random) -> Iterator[Attack]:
    """Station files with values that no instrument has, and noise."""
    for section, key in (("azimuth", "zero"), ("azimuth", "bias"), ("elevation", "bias"), ("azimuth", "sigma")):
        for unit in ("rad", "deg", "turn", "arcsec"):
            for value in ("1e308", "-1e300", "1e12"):

                def make(d: Path, text: str = f"[{section}]\n{key}_{unit} = {value}\n") -> str:
                    (d / "s.toml").write_text(text)
                    return file("a.csv", TEXT)(d)

                yield Attack(f"{section} {key}_{unit} = {value}", make, ("--config", "s.toml"), reads=False)
    for noise in ("1e-12,1e-12,1e-12", "auto,auto,1e-30", "3,1e-15,1e-4", "1e-320,1,1"):
        yield Attack(f"noise {noise}", file("a.csv", TEXT), ("--noise", noise), reads=False)


def readings(draw: random.Random) -> Iterator[Attack]:
    """Single numbers that no instrument reads, in every channel."""
    rate, above = 40.0 + 0.0 * T, R * np.sin(E)
    for absent in ("", "elevation_rad"):
        columns = dict(zip(HEAD.split(","), (T, R, A, E), strict=True), range_rate_mps=rate, height_m=above)
        columns.pop(absent or "height_m")
        for name in list(columns)[1:]:
            for value in ("1e300", "-1e300", "1e18", "-3e11", "7e9"):
                rows = [[f"{v!r}" for v in row] for row in np.stack(list(columns.values()), 1).tolist()]
                for k in draw.sample(range(N), 4):
                    rows[k][list(columns).index(name)] = value
                text = "\n".join([",".join(columns), *(",".join(row) for row in rows), ""])
                for way in ((), ("--editing", "forward")):
                    label = f"{name} of {value}{', without elevations' if absent else ''} {' '.join(way)}".strip()
                    yield Attack(label, file("a.csv", text), way, reads=True)


ALL = (names, lines, documents, archives, addresses, times, stations, readings)
