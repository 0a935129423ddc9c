"""Logs as text that are wrong in every way we could think of; most are tables of one wrong thing each."""

from __future__ import annotations

import codecs
import gzip
import io
import math
from collections.abc import Iterator

import numpy as np

from ftproc.records import MeasurementLog
from tests.trust import cases
from tests.trust.cases import HEADER, Case, flight, rows, same, same_but, text, with_cell, with_column, written

COLUMNS = HEADER.split(",")
_ROW = 17  # where the bad cell is

#: Cells that are no number, and words of their refusal.
_NO_NUMBER = (
    *("abc", "12x4", "1.2.3", "1_000", "0x1F", "1d5", "5 m", "12°", "--5", "5-", "-", "e5", "1e", "+", ".", "?"),
    *("true", "FALSE", "=1+1", "'5", "@SUM(A1)", "#VALUE!", "#DIV/0!", "#REF!", "1/2", "∞", "١٢", "１２", "1 000"),
    *("2024-05-31", "12:34:56", "1;5", "nan nan", "NIL", "\\N", "..", "5..", "1e+", "1e5.5", "0b1", "x" * 5000),
)
_NOT_FINITE = ("inf", "-inf", "INF", "Infinity", "-Infinity", "1e999", "-1e400")
_MISSING = ("", " ", "NaN", "nan", "NA", "N/A", "null", "None", "#N/A", "1.#QNAN", "NaN(0)", '""')
_ODD_NUMBERS = ("1e308", "-1e308", "1e-320", "-0.0", "1E2", "5.", ".5", " 5 ", '"5"', "1.0e+01", "007", "+5", "1e150")


def cells() -> Iterator[Case]:
    """One bad cell in each of the four columns."""
    for column, name in enumerate(COLUMNS):
        place = (f"row {_ROW} (the first data row is 0)", f'column "{name}"', "expected a")
        for cell in _NO_NUMBER:
            content = text(with_cell(_ROW, column, cell))
            yield Case("log", f"{name} cell {cell[:12]}", written(content), (*place, "is not a number"))
        for cell in _NOT_FINITE:
            content = text(with_cell(_ROW, column, cell))
            yield Case("log", f"{name} cell {cell}", written(content), (*place, "is not finite"))
    for column, name in enumerate(COLUMNS[1:], 1):
        for cell in _MISSING:
            check = same_but(_ROW, column, np.nan)
            yield Case("log", f"{name} cell {cell!r}", written(text(with_cell(_ROW, column, cell))), None, check)
        for cell in _ODD_NUMBERS:
            check = same_but(_ROW, column, float(cell.strip('" ')))
            yield Case("log", f"{name} cell {cell}", written(text(with_cell(_ROW, column, cell))), None, check)


def _timeless(log: MeasurementLog) -> bool:
    return log.rows_without_time == (_ROW,) and len(log) == len(rows()) - 1


def encodings() -> Iterator[Case]:
    """Separators, line ends, byte order marks and encodings."""
    for separator, comma in ((",", "."), (";", "."), ("\t", "."), (";", ",")):
        for end in ("\n", "\r\n", "\r"):
            for bom in (b"", codecs.BOM_UTF8):
                cells_ = [[cell.replace(".", comma) for cell in row] for row in rows()]
                content = bom + text(cells_, separator=separator, end=end).encode()
                yield Case("log", f"{separator!r} {comma} {end!r} {bom!r}", written(content), None, same)
    for encoding in ("utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-32-le"):
        says = ("save it as UTF-8",)
        yield Case("log", encoding, written(text().encode(encoding)), says)
        packed = written(gzip.compress(text().encode(encoding)), "log.csv.gz")
        yield Case("log", f"{encoding} packed", packed, says)
    latin = text(header=HEADER + ",Höhe", cells=[[*row, "1"] for row in rows()]).encode("latin-1")
    yield Case("log", "latin-1 header", written(latin), ("not UTF-8", "iconv"))
    notes = text(header=HEADER + ",note", cells=[[*row, "Höhe"] for row in rows()])
    yield Case("log", "latin-1 in a column not asked for", written(notes.encode("latin-1")), None, same)
    keep = {"keep_columns": True}
    says = ('column "note" is not UTF-8',)
    yield Case("log", "latin-1 in a column kept", written(notes.encode("latin-1")), says, options=keep)
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
        (b"%PDF-1.4\n%\xe2\xe3\n", "Its columns are"),
        (b'{"a": 1}', "no separator"),
        (b"<html><body>", "Its columns are"),
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
    for suffix in ("txt", "xlsx", "json", "CSV.bak", "parquet.gz", "csv.zip", "csv.bz2", "h5", "mat", "dat"):
        yield Case("log", f"called .{suffix}", written(good, f"log.{suffix}"), ("supported are",))
    yield Case("log", "called .CSV", written(good, "LOG.CSV"), None, same)
    yield Case("log", "gzip bomb", written(_bomb(), "log.csv.gz"), ("times its packed size",))
    yield Case("log", "gzip bomb called .csv", written(_bomb()), ("times its packed size",))


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
    yield Case("log", "rows only", written("\n".join(",".join(row) for row in good)), ("Put a header line",))
    yield Case("log", "1 row", written(text(good[:1])), None, lambda log: len(log) == 1)
    for count in (2, 3, 4, 7, 8):
        yield Case("log", f"{count} rows", written(text(good[:count])), None, lambda log, n=count: len(log) == n)
    for place in (0, 1, _ROW, len(good) - 1):
        for cells_ in (good[place][:1], good[place][:3], [*good[place], "1"], [*good[place], ""]):
            ragged = [*good[:place], cells_, *good[place + 1 :]]
            says = (f"row {place} (", f"has {len(cells_)} cell", "Complete the row or delete it")
            yield Case("log", f"row {place} of {len(cells_)} cells, last {cells_[-1]!r}", written(text(ragged)), says)
    yield Case("log", "last line cut", written(text()[:-30]), ("row 39",))
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
        yield Case("log", f"quotation {mark}", written(text(with_cell(_ROW, 1, mark))), (f"row {_ROW} (",))
    for name in COLUMNS:
        header = HEADER + "," + name
        yield Case("log", f"{name} twice", written(text([[*r, "1"] for r in good], header)), ("there 2 times",))
        other = name.partition("_")[0]
        both = HEADER.replace(name, other) + "," + other.upper()
        says = ("could each be", f"--columns {other}=")
        yield Case("log", f"two {other}s", written(text([[*r, "1"] for r in good], both)), says)
        gone = HEADER.replace(name, "something")
        if other == "time":
            yield Case("log", "no time", written(text(header=gone)), ("no time column", "--columns time=NAME"))
        else:
            yield Case(
                "log",
                f"no {other}",
                written(text(header=gone)),
                None,
                lambda log: bool(np.isnan(log.measurement).all(0).sum() == 1),
            )
    for header, words in (
        ("a;b;c;d", "no time column"),
        ("time_s,x,y,z", "neither range"),
        (",,,", "no time column"),
        ("time_s range_m azimuth_rad elevation_rad", "has no separator"),
        ("time_s,range_yd,az,el", "not a unit"),
        ("time_h,range_m,az,el", "not a unit"),
        ("Zeit,Weite,Seite,Höhe", "no time column"),
        ("time_s,range_m,azimuth_rad", "has 4 cells"),
        ("\x1b[31mt,\x07R,A,E", "no time column"),
        ("t\u202e,R,A,E", "no time column"),
        ("=cmd|' /C calc'!A0,R,A,E", "no time column"),
    ):
        content = text(good).replace(HEADER, header)
        yield Case("log", f"header {header[:24]!r}", written(content), (words,))
    yield Case("log", "huge header", written("t" * 1_000_000 + ",R\n0,1\n"), ("header line", "correct it"))
    wide = HEADER + "," + ",".join(f"c{i}" for i in range(10_000))
    cells_ = [[*row, *["1"] * 10_000] for row in good]
    yield Case("log", "10,000 columns", written(text(cells_, wide)), None, same)
    yield Case("log", "10,000 columns kept", written(text(cells_, wide)), None, same, options={"keep_columns": True})
    yield Case(
        "log",
        "10,000 columns of one name, kept",
        written(text(cells_, HEADER + ",c" * 10_000)),
        ('"c" is there twice',),
        options={"keep_columns": True},
    )
    yield Case(
        "log",
        "10,000 columns, none fits",
        written(",".join(f"c{i}" for i in range(10_000)) + "\n" + one),
        ("and 9980 more",),
    )
    yield Case("log", "one endless line", written(HEADER + "\n" + "1" * 5_000_000), ("row 0 (",))
    yield Case("log", "one endless cell", written(HEADER + "\n0,1," + "1" * 3_000_000 + ",1\n"), ("row 0 (",))
    yield Case("log", "quoted newlines", written(text(with_cell(_ROW, 1, '"5\n6"'))), (f"row {_ROW} (",))


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
    yield Case("log", "azimuth in degrees", degrees, ("looks like degrees", "--units azimuth=deg"))
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


def times() -> Iterator[Case]:
    """Time columns: backwards, standing still, far away, of several zones, through midnight."""
    good = rows()
    yield Case("log", "times reversed", written(text(good[::-1])), None, same)
    yield Case("log", "times constant", written(text(with_column(0, lambda t: 5.0))), either=True)
    yield Case("log", "one time missing", written(text(with_cell(_ROW, 0, ""))), None, _timeless)
    yield Case("log", "all times missing", written(text([["", *r[1:]] for r in good])), ("no row has a time",))
    yield Case(
        "log",
        "every row twice",
        written(text([r for row in good for r in (row, row)])),
        None,
        lambda log: log.duplicate_times == len(good),
    )
    for label, cell in (("1e308", "1e308"), ("-1e308", "-1e308"), ("1e18", "1e18"), ("1e9", "1e9"), ("-1e9", "-1e9")):
        yield Case("log", f"one time {label}", written(text(with_cell(_ROW, 0, cell))), either=True)
    for scale in (1e-300, 1e-12, 1e-6, 1e6, 1e12, 1e300, 4e306):
        yield Case(
            "log", f"times {scale:g} apart", written(text(with_column(0, lambda t, s=scale: t * s))), either=True
        )
    for origin in (1.7e9, -1e7, 1e15, 1e17, 1e308):
        yield Case(
            "log", f"times from {origin:g}", written(text(with_column(0, lambda t, o=origin: t + o))), either=True
        )
    span = with_column(0, lambda t: -1.7e308 if t < 20 else 1.7e308)
    yield Case("log", "times that overflow", written(text(span)), either=True)
    yield from _stamps()
    yield from _midnight()


def _stamps() -> Iterator[Case]:
    def stamped(stamps: list[str]) -> cases.Make:
        return written(text([[stamp, *row[1:]] for stamp, row in zip(stamps, rows(), strict=True)], "t,R,A,E"))

    seconds = [f"{k // 60:02d}:{k % 60:02d}" for k in range(len(rows()))]
    plain = [f"2024-05-31T12:{s}" for s in seconds]
    count = len(rows())

    def counted(log: MeasurementLog) -> bool:
        return np.array_equal(log.time_s - log.time_s[0], np.arange(count))

    for label, stamps in (
        ("plain", plain),
        ("Z", [s + "Z" for s in plain]),
        ("+02:00", [s + "+02:00" for s in plain]),
        ("blank", [s.replace("T", " ") for s in plain]),
        ("fraction", [s + ".000" for s in plain]),
        ("comma", [f'"{s},000"' for s in plain]),
        ("year 2500", [s.replace("2024", "2500") for s in plain]),
        ("year 0001", [s.replace("2024", "0001") for s in plain]),
        ("year 9999", [s.replace("2024", "9999") for s in plain]),
        (
            "through midnight",
            [f"2024-05-31T23:59:{k:02d}" for k in range(40, 60)] + [f"2024-06-01T00:00:{k:02d}" for k in range(20)],
        ),
        (
            "two offsets",
            [f"2024-05-31T12:{s}+02:00" if k % 2 else f"2024-05-31T10:{s}Z" for k, s in enumerate(seconds)],
        ),
    ):
        yield Case("log", f"timestamps {label}", stamped(stamps), None, counted)
    for label, stamps in (
        ("zone once", [*plain[:9], plain[9] + "Z", *plain[10:]]),
        ("zone but once", [s + "Z" for s in plain[:-1]] + plain[-1:]),
        ("a number among them", [*plain[:9], "17.5", *plain[10:]]),
        ("a word", [*plain[:9], "later", *plain[10:]]),
        ("month 13", [s.replace("-05-", "-13-") for s in plain]),
        ("second 61", [s[:-2] + "61" for s in plain]),
        ("time of day", [f"12:{s}" for s in seconds]),
        ("German", [f"31.05.2024 12:{s}" for s in seconds]),
        ("American", [f"05/31/2024 12:{s}" for s in seconds]),
        ("day 30 of February", [s.replace("05-31", "02-30") for s in plain]),
        ("named zone", [s + " CEST" for s in plain]),
        ("hour 25", [s.replace("T12", "T25") for s in plain]),
    ):
        yield Case("log", f"timestamps {label}", stamped(stamps), ('column "t"', "row ", "expected a time"))


def _midnight() -> Iterator[Case]:
    says = ("midnight", "row 20", "add 86400 s")
    for start in (86380.0, 86380.5, 86380.999):
        turned = text(with_column(0, lambda t, s=start: (t + s) % 86400))
        yield Case("log", f"midnight from {start}", written(turned), says)
    turned = text(with_column(0, lambda t: (t * 1e3 + 86_380_000) % 86_400_000), HEADER.replace("time_s", "time_ms"))
    yield Case("log", "midnight in ms", written(turned), says)
    turned = text(with_column(0, lambda t: (t + 604_780) % 604_800))
    yield Case("log", "end of the GPS week", written(turned), ("week", "row 20", "add 604800 s"))
    for cell, what in (("0.0", "to 0"), ("5.5", "back a little"), ("16.999", "by a millisecond")):
        yield Case(
            "log",
            f"glitch {what}",
            written(text(with_cell(_ROW, 0, cell))),
            None,
            lambda log: log.rows_out_of_order <= 1 and len(log) == len(rows()),
        )
    late = with_column(0, lambda t: t + 86_300)
    late[_ROW][0] = "0.0"
    yield Case("log", "glitch to 0 before midnight", written(text(late)), None, lambda log: log.rows_out_of_order > 0)
    mixed = [rows()[k] for k in np.random.default_rng(1).permutation(len(rows()))]
    yield Case("log", "rows shuffled", written(text(mixed)), None, same)


def all_cases() -> Iterator[Case]:
    """Every text log."""
    for table in (cells, encodings, bytes_, shapes, values, times):
        yield from table()
