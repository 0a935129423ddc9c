"""Logs as text that are wrong in every way we could think of; most are tables of one wrong thing each."""

from __future__ import annotations

import codecs
import gzip
import io
import math
from collections.abc import Callable, Iterator

import numpy as np

from ftproc.records import MeasurementLog
from tests.trust.cases import HEADER, Case, flight, rows, same, same_but, text, with_cell, with_column, written

COLUMNS = HEADER.split(",")
ROW = 17  # where the bad cell is

#: Cells that are no number, and words of their refusal.
_NO_NUMBER = (
    *("abc", "12x4", "1.2.3", "1_000", "0x1F", "1d5", "5 m", "12°", "--5", "5-", "e5", "1e", "+"),
    *("true", "FALSE", "=1+1", "'5", "@SUM(A1)", "1/2", "∞", "١٢", "１２"),
    *("2024-05-31", "12:34:56", "1;5", "nan nan", "5..", "1e+", "1e5.5", "0b1", "x" * 5000),
)
#: Cells that are no time, and among readings mean that there is none, which is said.
_SAID_MISSING = ("-", "--", "***", ".", "..", "?", "NIL", "\\N", "no data", "missing", "#VALUE!", "#DIV/0!")
_NOT_FINITE = ("inf", "-inf", "INF", "Infinity", "-Infinity", "1e999", "-1e400")
_MISSING = ("", " ", "NaN", "nan", "NA", "N/A", "null", "None", "#N/A", "1.#QNAN", "NaN(0)", '""')
_ODD_NUMBERS = (
    "1e308",
    "-1e308",
    "1e-320",
    "-0.0",
    "1E2",
    "5.",
    ".5",
    " 5 ",
    '"5"',
    "1e1",
    "007",
    "+5",
    "1e150",
    "1 000",
)


def cells() -> Iterator[Case]:
    """One bad cell in each of the four columns."""
    for column, name in enumerate(COLUMNS):
        place = (f"row {ROW} (the first data row is 0)", f'column "{name}"', "expected a")
        for cell in _NO_NUMBER:
            content = text(with_cell(ROW, column, cell))
            yield Case("log", f"{name} cell {cell[:12]}", written(content), (*place, "is not a number"))
        for cell in _NOT_FINITE:
            content = text(with_cell(ROW, column, cell))
            yield Case("log", f"{name} cell {cell}", written(content), (*place, "is not finite"))
    for cell in _SAID_MISSING:
        says = (f"row {ROW} (the first data row is 0)", 'column "time_s"', "is not a number")
        yield Case("log", f"time_s cell {cell}", written(text(with_cell(ROW, 0, cell))), says)
    for column, name in enumerate(COLUMNS[1:], 1):
        for cell in _SAID_MISSING:
            check = _said_missing(column, cell)
            yield Case("log", f"{name} cell {cell}", written(text(with_cell(ROW, column, cell))), None, check)
        for cell in _MISSING:
            check = same_but(ROW, column, np.nan)
            yield Case("log", f"{name} cell {cell!r}", written(text(with_cell(ROW, column, cell))), None, check)
        for cell in _ODD_NUMBERS:
            check = same_but(ROW, column, float(cell.strip('" ').replace(" ", "")))
            yield Case("log", f"{name} cell {cell}", written(text(with_cell(ROW, column, cell))), None, check)


def _said_missing(column: int, cell: str) -> Callable[[MeasurementLog], bool]:
    note = f'"{COLUMNS[column]}" is "{cell}" once, which is taken for a missing reading'
    return lambda log: same_but(ROW, column, np.nan)(log) and log.remarks == (note,)


def timeless(log: MeasurementLog) -> bool:
    return log.rows_without_time == (ROW,) and len(log) == len(rows()) - 1


def encodings() -> Iterator[Case]:
    """Separators, line ends, byte order marks and encodings."""
    for separator, comma in ((",", "."), (";", "."), ("\t", "."), (";", ",")):
        for end in ("\n", "\r\n", "\r"):
            for bom in (b"", codecs.BOM_UTF8):
                cells_ = [[cell.replace(".", comma) for cell in row] for row in rows()]
                content = bom + text(cells_, separator=separator, end=end).encode()
                yield Case("log", f"{separator!r} {comma} {end!r} {bom!r}", written(content), None, same)
    for encoding in ("utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-32-le"):
        yield Case("log", encoding, written(text().encode(encoding)), None, same)
        packed = written(gzip.compress(text().encode(encoding)), "log.csv.gz")
        yield Case("log", f"{encoding} packed", packed, None, same)
        cut = written(text().encode(encoding)[:-3])
        yield Case("log", f"{encoding} cut", cut, either=True)
    latin = text(header=HEADER + ",Höhe", cells=[[*row, "1"] for row in rows()]).encode("latin-1")
    yield Case("log", "latin-1 header", written(latin), None, same)
    notes = text(header=HEADER + ",note", cells=[[*row, "Höhe"] for row in rows()])
    yield Case("log", "latin-1 in a column not asked for", written(notes.encode("latin-1")), None, same)
    keep = {"keep_columns": True}
    kept = lambda log: same(log) and log.extra.column("note")[0].as_py() == "Höhe"  # noqa: E731
    yield Case("log", "latin-1 in a column kept", written(notes.encode("latin-1")), None, kept, options=keep)
    yield Case("log", "utf-8 in a column kept", written(notes), None, same, options=keep)
    yield Case("log", "EBCDIC", written(text().encode("cp037")), ())


def bytes_() -> Iterator[Case]:
    """Bytes that are no text, and files of another kind than their name."""
    good = text().encode()
    for place in (0, 3, len(HEADER) + 5, len(good) // 2, len(good) - 2):
        content = good[:place] + b"\0" + good[place:]
        yield Case("log", f"NUL at {place}", written(content), ("",))
    yield Case("log", "NULs at the end", written(good + b"\0" * 4096), ("",))
    yield Case("log", "NULs only", written(b"\0" * 100_000), ("NUL bytes",))
    rng = np.random.default_rng(5)
    for length in (1, 10, 1000, 100_000):
        content = rng.integers(0, 256, length).astype(np.uint8).tobytes()
        yield Case("log", f"{length} random bytes", written(content), ())
        yield Case("log", f"{length} random bytes packed", written(gzip.compress(content), "log.csv.gz"), ())
    for content, what in (
        (b"PK\x03\x04rest", "zip archive"),
        (b"PAR1rest", "Parquet file"),
        (b"", "empty"),
        (b"\n", "empty"),
        (b"\r\n\r\n \n", "empty"),
        (codecs.BOM_UTF8, "empty"),
        (b"\x1f\x8b", "gzip"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600), "NUL"),
        (b"%PDF-1.4\n%\xe2\xe3\n", "PDF document"),
        (b'{"a": 1}', "no line of column names"),
        (b"<html><body>", "a page of HTML"),
        (b"Rar!\x1a\x07\x01\x00", "NUL"),
    ):
        yield Case("log", f"file of {content[:12]!r}", written(content), (what,))
    packed = gzip.compress(good)
    for length in (1, 2, 9, 10, 11, len(packed) // 2, len(packed) - 9, len(packed) - 8, len(packed) - 1):
        yield Case("log", f"gzip cut at {length}", written(packed[:length], "log.csv.gz"), ("gzip", "copy it again"))
    for place in np.linspace(10, len(packed) - 1, 12).astype(int):
        flipped = bytearray(packed)
        flipped[place] ^= 0x10
        yield Case("log", f"gzip flipped at {place}", written(bytes(flipped), "log.csv.gz"), ("gzip", "copy it again"))
    yield Case("log", "gzip, rubbish behind", written(packed + b"rubbish", "log.csv.gz"), ("gzip",))
    yield Case(
        "log",
        "two gzip members",
        written(gzip.compress(good[:500]) + gzip.compress(good[500:]), "log.csv.gz"),
        None,
        same,
    )
    yield Case("log", "gzip, zeros behind", written(packed + bytes(64), "log.csv.gz"), None, same)
    yield Case("log", "packed but called .csv", written(packed), None, same)
    yield Case("log", "text called .csv.gz", written(good, "log.csv.gz"), ("gzip",))
    yield Case("log", "text called .parquet", written(good, "log.parquet"), ("Parquet",))
    yield Case("log", "gzip called .parquet", written(packed, "log.parquet"), ("Parquet",))
    for suffix in ("txt", "CSV.bak", "dat", "tsv", "trk"):
        yield Case("log", f"called .{suffix}", written(good, f"log.{suffix}"), None, same)
    for suffix, words in (
        ("xlsx", "not an Excel workbook"),
        ("json", "line 1 is not JSON"),
        ("parquet.gz", "not a gzip file"),
        ("csv.zip", "not a zip file"),
        ("csv.bz2", "not a bzip2 file"),
        ("csv.xz", "not a xz file"),
        ("csv.zst", "not a zstd file"),
        ("h5", "not an HDF5 file"),
        ("mat", "not a Matlab file"),
        ("toml", "--config"),
        ("safetensors", "--model"),
    ):
        yield Case("log", f"called .{suffix}", written(good, f"log.{suffix}"), (words,))
    yield Case("log", "called .CSV", written(good, "LOG.CSV"), None, same)
    yield Case("log", "gzip bomb", written(_bomb(), "log.csv.gz"), ("unpack to more than",))
    yield Case("log", "gzip bomb called .csv", written(_bomb()), ("unpack to more than",))


def _bomb() -> bytes:
    """A gzip file of some 600 KB that becomes 600 MB."""
    head = gzip.compress((HEADER + "\n").encode())
    member = gzip.compress(b"0,1,1,1\n" * 2_500_000)
    sink = io.BytesIO()
    sink.write(head)
    for _ in range(30):
        sink.write(member)
    return sink.getvalue()


def shapes() -> Iterator[Case]:
    """Rows and headers: too few, too many, ragged, wide."""
    good = rows()
    one = ",".join(good[0])
    yield Case("log", "header only", written(HEADER + "\n"), ("no rows",))
    yield Case("log", "header without end", written(HEADER), ("no rows",))
    yield Case("log", "header and empty lines", written(HEADER + "\n\n\r\n\n"), ("no rows",))
    yield Case("log", "header and commas", written(HEADER + "\n,,,\n,,,\n"), ("no row has a time",))
    yield Case(
        "log",
        "rows only",
        written("\n".join(",".join(row) for row in good)),
        ("no line of column names", "--columns time="),
    )
    yield Case("log", "1 row", written(text(good[:1])), None, lambda log: len(log) == 1)
    for count in (2, 3, 4, 7, 8):
        yield Case("log", f"{count} rows", written(text(good[:count])), None, lambda log, n=count: len(log) == n)
    for place in (0, 1, ROW, len(good) - 1):
        for cells_ in (good[place][:1], good[place][:3], [*good[place], "1"], [*good[place], ""]):
            ragged = [*good[:place], cells_, *good[place + 1 :]]
            says = (f"row {place} (", f"has {len(cells_)} cell", "Complete the row or delete it")
            yield Case("log", f"row {place} of {len(cells_)} cells, last {cells_[-1]!r}", written(text(ragged)), says)
    left_out = lambda log: len(log) == len(good) - 1 and "is cut off" in " ".join(log.remarks)  # noqa: E731
    yield Case("log", "last line cut", written(text()[:-30]), None, left_out)
    yield Case(
        "log", "decimal commas", written(text([[c.replace(".", ",") for c in r] for r in good])), ("decimal commas",)
    )
    yield Case(
        "log",
        "mixed decimals",
        written(text([[c.replace(".", ",") if i else c for c in r] for i, r in enumerate(good)], separator=";")),
        ("decimal comma", "row 0"),
    )
    for mark in ('"', '"0', 'a"b'):
        yield Case("log", f"quotation {mark}", written(text(with_cell(ROW, 1, mark))), (f"row {ROW} (",))
    for name in COLUMNS:
        header = HEADER + "," + name
        yield Case("log", f"{name} twice", written(text([[*r, "1"] for r in good], header)), ("there 2 times",))
        other = name.partition("_")[0]
        both = HEADER.replace(name, other) + "," + other.upper()
        says = ("could each be", f"--columns {other}=")
        yield Case("log", f"two {other}s", written(text([[*r, "1"] for r in good], both)), says)
        gone = HEADER.replace(name, "something")
        if other == "time":
            yield Case("log", "no time", written(text(header=gone)), ("no time column", "--columns time=something"))
        elif other == "range":
            lacks = lambda log: bool(np.isnan(log.measurement).all(0).sum() == 1)  # noqa: E731
            yield Case("log", "no range", written(text(header=gone)), None, lacks)
        else:
            yield Case("log", f"no {other}", written(text(header=gone)), ("may be the", f"--columns {other}=something"))
    for header, words in (
        ("a;b;c;d", "no line of column names"),
        ("time_s,x,y,z", "neither range"),
        (",,,", "no time column"),
        ("time_s,range_furlong,az,el", "not a unit"),
        ("time_fortnight,range_m,az,el", "not a unit"),
        ("Zeit,Weite,Seite,Höhe", "neither range"),
        ("time_s,range_m,azimuth_rad", "has 4 cells"),
        ("\x1b[31mt,\x07R,A,E", "no time column"),
        ("q\u202e,R,A,E", "no time column"),
        ("=cmd|' /C calc'!A0,R,A,E", "no time column"),
    ):
        content = text(good).replace(HEADER, header)
        yield Case("log", f"header {header[:24]!r}", written(content), (words,))
    blanks = text(good).replace(HEADER, HEADER.replace(",", " "))
    yield Case("log", "header apart by blanks", written(blanks), None, lambda log: len(log) == len(good))
    yield Case("log", "huge header", written("t" * 1_000_000 + ",R\n0,1\n"), ("no line of column names",))
    keep = {"keep_columns": True}
    wide = HEADER + "," + ",".join(f"c{i}" for i in range(3000))
    cells_ = [[*row, *["1"] * 3000] for row in good]
    yield Case("log", "3000 columns kept", written(text(cells_, wide)), None, same, options=keep)
    wide = HEADER + "," + ",".join(f"c{i}" for i in range(1000))
    cells_ = [[*row, *["1"] * 1000] for row in good]
    yield Case("log", "1000 columns", written(text(cells_, wide)), None, same)
    yield Case(
        "log",
        "1000 columns of one name, kept",
        written(text(cells_, HEADER + ",c" * 1000)),
        ('"c" is there twice',),
        options=keep,
    )
    yield Case(
        "log",
        "1000 columns, none fits",
        written(",".join(f"c{i}" for i in range(1000)) + "\n" + one),
        ("has 4 cells where the header has 1000",),
    )
    yield Case("log", "one endless line", written(HEADER + "\n" + "1" * 5_000_000), ("row 0 (",))
    yield Case("log", "one endless cell", written(HEADER + "\n0,1," + "1" * 3_000_000 + ",1\n"), ("row 0 (",))
    yield Case("log", "quoted newlines", written(text(with_cell(ROW, 1, '"5\n6"'))), (f"row {ROW} (",))


def values() -> Iterator[Case]:
    """Columns of readings that no flight has; single outliers are for the editing."""
    for column, name in enumerate(COLUMNS[1:], 1):
        for label, change in (
            ("all NaN", lambda v: np.nan),
            ("constant", lambda v: 0.5),
            ("zero", lambda v: 0.0),
            ("huge", lambda v: 1e308 * np.sign(v or 1)),
            ("large", lambda v: v * 1e200),
            ("tiny", lambda v: 1e-310),
            ("negative", lambda v: -v - 1),
            ("doubled", lambda v: 2 * v + 1),
        ):
            if name != "range_m" and label in ("constant", "zero", "tiny", "negative"):
                continue
            content = text(with_column(column, change))
            yield Case("log", f"{name} {label}", written(content), either=True)
    negative = written(text(with_column(1, lambda v: -v)))
    yield Case("log", "every range negative", negative, ("negative", "check"))
    yield Case("log", "every range zero", written(text(with_column(1, lambda v: 0.0))), ("zero", "check"))
    yield Case("log", "one range negative", written(text(with_cell(9, 1, "-500"))), None, same_but(9, 1, -500.0))
    degrees = written(text(with_column(2, lambda v: math.degrees(v) + 90)))
    yield Case("log", "azimuth in degrees", degrees, ("--units azimuth=deg",))
    above = written(text(with_column(3, lambda v: v + 1.5)))
    yield Case("log", "elevations past 90 degrees", above, ("no elevation",))
    past = written(text(with_cell(9, 3, "1.7")))
    yield Case("log", "one elevation past 90 degrees", past, None, same_but(9, 3, 1.7))
    nothing = [[row[0], "", "", ""] for row in rows()]
    yield Case("log", "no reading at all", written(text(nothing)), ("nothing to process",))
    lonely = [[*row[:1], *(row[1:] if i == 5 else ["", "", ""])] for i, row in enumerate(rows())]
    yield Case("log", "a single reading", written(text(lonely)), either=True)
    rng = np.random.default_rng(3)
    for scale in (1.0, 1e10, 1e100):
        noise = [[row[0], *(repr(float(v)) for v in rng.standard_normal(3) * [scale, 1, 0.5])] for row in rows()]
        yield Case("log", f"noise only, {scale:g}", written(text(noise)), either=True)
    assert flight().log.measurement[:, 0].min() > 0


def all_cases() -> Iterator[Case]:
    """Every text log."""
    for table in (cells, encodings, bytes_, shapes, values):
        yield from table()
