"""Attacks on the readers of Parquet, Arrow, Excel, numpy, Matlab and netCDF files."""

from __future__ import annotations

import io
import random
import struct
import zipfile
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy.io import netcdf_file, savemat

from tests.trust.attacks.attack import COLUMNS, ROWS, A, Attack, E, N, R, T, damaged, file

_TEXT = "x" * 1_000_000


def _parquet(table: Any, **options: Any) -> bytes:
    sink = io.BytesIO()
    pq.write_table(table if isinstance(table, pa.Table) else pa.table(table), sink, **options)
    return sink.getvalue()


def _feather(table: pa.Table, codec: str | None = None, stream: bool = False, rows: int | None = None) -> bytes:
    sink = pa.BufferOutputStream()
    new = pa.ipc.new_stream if stream else pa.ipc.new_file
    with new(sink, table.schema, options=pa.ipc.IpcWriteOptions(compression=codec)) as out:
        out.write_table(table, max_chunksize=rows)
    return bytes(sink.getvalue())


def _beside(n: int, **more: Any) -> pa.Table:
    """A log of n rows with more columns."""
    grown = {key: pa.array(np.resize(values, n)) for key, values in COLUMNS.items()}
    return pa.table(grown | more)


def _dictionary(text: str, n: int) -> pa.Array:
    return pa.DictionaryArray.from_arrays(pa.array(np.zeros(n, np.int32)), pa.array([text]))


def parquets(draw: random.Random) -> Iterator[Attack]:
    """Parquet."""
    kept = ("--keep-columns",)
    for n in (20_000, 200_000):
        for label, column in {
            "one long word": _dictionary(_TEXT, n),
            "half of it numbers": pa.array(
                [_TEXT if k % 2 else "1" for k in range(min(n, 300))] + ["1"] * (n - min(n, 300))
            ),
            "nothing": pa.nulls(n),
            "lists": pa.array([[1.0] * 20] * n),
            "truths": pa.array([True] * n),
        }.items():
            zstd = {"compression": "zstd"}
            yield Attack(f"Parquet, {n} {label} beside", file("a.parquet", _parquet(_beside(n, note=column), **zstd)))
            yield Attack(
                f"Parquet, {n} {label} kept", file("a.parquet", _parquet(_beside(n, note=column), **zstd)), kept
            )
            changed = _beside(n).set_column(1, "range_m", column)
            yield Attack(f"Parquet, {n} {label} for a range", file("a.parquet", _parquet(changed, **zstd)))
    shared = pa.array([_TEXT[:200_000] + str(k % 7) for k in range(900)])
    table = _beside(900).set_column(0, "time", shared)
    options = {"use_dictionary": False, "column_encoding": {"time": "DELTA_BYTE_ARRAY"}, "compression": "zstd"}
    yield Attack("Parquet, long words in common", file("a.parquet", _parquet(table, **options)))
    same = _beside(40_000_000 // 8)
    ones = pa.table({name: pa.array(np.ones(same.num_rows)) for name in same.column_names})
    yield Attack(
        "Parquet of ones", file("a.parquet", _parquet(ones, compression="zstd", write_statistics=False)), reads=False
    )
    wide = {f"c{k}": [1.0] for k in range(6000)}
    yield Attack(
        "Parquet of 6,000 columns", file("a.parquet", _parquet({k: [1.0] for k in COLUMNS} | wide)), reads=False
    )
    yield Attack("Parquet, a long name", file("a.parquet", _parquet({"r" * 5000: [1.0] * N} | COLUMNS)), reads=False)
    deep: Any = 1.0
    for _ in range(60):
        deep = {"a": deep}
    yield Attack(
        "Parquet, a deep column", file("a.parquet", _parquet(_beside(N, note=pa.array([deep] * N)))), reads=True
    )
    yield from damaged(_parquet(_beside(N), write_page_checksum=True), "a.parquet", draw, 8)


def feathers(draw: random.Random) -> Iterator[Attack]:
    """Arrow files and streams."""
    for stream in (False, True):
        word = "stream" if stream else "file"
        for codec in ("zstd", "lz4"):
            n = 3_000_000
            zeros = pa.table({name: pa.array(np.zeros(n)) for name in COLUMNS})
            yield Attack(
                f"Arrow {word} of zeros, {codec}", file("a.arrow", _feather(zeros, codec, stream)), reads=False
            )
            long = _beside(N, note=pa.array(["y" * 2_000_000] * N))
            yield Attack(
                f"Arrow {word}, long words, {codec}", file("a.arrow", _feather(long, codec, stream)), reads=False
            )
            shared = _beside(N, note=_dictionary("z" * 30_000_000, N))
            yield Attack(
                f"Arrow {word}, a dictionary for each row, {codec}", file("a.arrow", _feather(shared, codec, stream, 1))
            )
        for label, column in {"range": "range_m", "time": "time_s", "note": "note"}.items():
            table = _beside(20_000)
            place = table.column_names.index(column) if column in table.column_names else -1
            words = _dictionary(_TEXT[:700_000], 20_000)
            table = table.append_column(column, words) if place < 0 else table.set_column(place, column, words)
            yield Attack(
                f"Arrow {word}, one long word for {label}",
                file("a.feather", _feather(table, "zstd", stream)),
                ("--keep-columns",),
            )
        many = pa.table({"time_s": pa.nulls(2**31 - 2)})
        yield Attack(f"Arrow {word}, nothing 2^31 times", file("a.arrow", _feather(many, None, stream)), reads=False)
        slots = pa.py_buffer(struct.pack("<i4sii", 900_000, b"vvvv", 0, 0) * 20_000)
        views = pa.Array.from_buffers(pa.string_view(), 20_000, [None, slots, pa.py_buffer(b"v" * 900_000)])
        seen = _beside(20_000).set_column(1, "range_m", views)
        yield Attack(f"Arrow {word}, views of one word", file("a.arrow", _feather(seen, None, stream)))
        yield from damaged(_feather(_beside(N, note=_dictionary("abc", N)), "zstd", stream), f"a{word}.arrow", draw, 8)


_SHEET = '<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main">{}<sheetData>{}</sheetData></worksheet>'


def _book(cells: str, before: str = "", **more: str) -> bytes:
    """An .xlsx file whose one sheet holds these rows. more: its other parts, without their ending."""
    import openpyxl

    empty = io.BytesIO()
    openpyxl.Workbook().save(empty)
    sink = io.BytesIO()
    with zipfile.ZipFile(empty) as old, zipfile.ZipFile(sink, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            stem = name.rpartition("/")[2].removesuffix(".xml")
            content = more.get(stem, old.read(name).decode())
            new.writestr(name, _SHEET.format(before, cells) if stem == "sheet1" else content)
        if "sharedStrings" in more:
            new.writestr("xl/sharedStrings.xml", more["sharedStrings"])
    return sink.getvalue()


def _row(number: int, cells: list[Any]) -> str:
    inside = "".join(
        f'<c t="inlineStr"><is><t>{cell}</t></is></c>' if isinstance(cell, str) else f"<c><v>{cell}</v></c>"
        for cell in cells
    )
    return f'<row r="{number}">{inside}</row>'


def workbooks(draw: random.Random) -> Iterator[Attack]:
    """Excel."""
    rows = "".join(_row(k + 1, row) for k, row in enumerate([list(COLUMNS), *ROWS]))
    for label, cells in {
        "a cell far below": '<row r="1048576"><c r="A1048576"><v>1</v></c></row>',
        "a cell far out": '<row r="99"><c r="XFD99"><v>1</v></c></row>',
        "cells far out below": '<row r="1048576"><c r="XFD1048576"><v>1</v></c></row>',
        "a row beyond all": '<row r="999999999999"><c><v>1</v></c></row>',
        "a column beyond all": '<row r="99"><c r="ZZZZZZZ99"><v>1</v></c></row>',
        "cells out of order": "".join(f'<row r="{k}"><c r="ABC{k}"><v>1</v></c></row>' for k in range(100, 20_000)),
        "long texts": "".join(_row(k, [1, 5000, 1, "x" * 32_000]) for k in range(70, 470)),
        "many cells": "".join(_row(k, [1] * 300) for k in range(70, 4070)),
        "an error": '<row r="99"><c t="e"><v>#DIV/0!</v></c><c t="e"><v>x</v></c></row>',
        "a date beyond all": '<row r="99"><c s="1"><v>1e300</v></c><c t="d"><v>99999-01-01</v></c></row>',
        "a number of 5,000 digits": _row(99, ["1" * 5000]) + f"<row><c><v>{'1' * 5000}</v></c></row>",
    }.items():
        yield Attack(f"Excel, {label}", file("a.xlsx", _book(rows + cells)))
    for claimed in ("A1:XFD1048576", "A1", "XFD1:A1", "?"):
        yield Attack(
            f"Excel, a sheet that claims {claimed}", file("a.xlsx", _book(rows, f'<dimension ref="{claimed}"/>'))
        )
    main = 'xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"'
    one = f"<sst {main}><si><t>{'s' * 32_000}</t></si></sst>"
    shared = "".join(f'<row r="{k}">' + '<c t="s"><v>0</v></c>' * 4 + "</row>" for k in range(70, 30_000))
    yield Attack("Excel, one text in many cells", file("a.xlsx", _book(rows + shared, sharedStrings=one)))
    many = f"<sst {main}>{'<si/>' * 3_000_000}</sst>"
    yield Attack("Excel, very many texts", file("a.xlsx", _book(rows, sharedStrings=many)))
    pairs = zip("abcdefgh", "bcdefghi", strict=True)
    grown = "".join(f'<!ENTITY {later} "{f"&{before};" * 10}">' for before, later in pairs)
    entity = f'<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">{grown}]><sst {main}><si><t>&i;</t></si></sst>'
    yield Attack("Excel, entities of entities", file("a.xlsx", _book(rows, sharedStrings=entity)))
    outside = f'<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]><sst {main}><si><t>&a;</t></si></sst>'
    yield Attack("Excel, an entity outside", file("a.xlsx", _book(rows, sharedStrings=outside)))
    yield from damaged(_book(rows), "a.xlsx", draw, 8)


def arrays(draw: random.Random) -> Iterator[Attack]:
    """Files of numpy."""

    def npy(array: Any, **options: Any) -> bytes:
        sink = io.BytesIO()
        np.save(sink, array, **options)
        return sink.getvalue()

    def npz(pack: bool = True, **columns: Any) -> bytes:
        sink = io.BytesIO()
        (np.savez_compressed if pack else np.savez)(sink, **columns)
        return sink.getvalue()

    yield Attack("npz of zeros", file("a.npz", npz(**{name: np.zeros(12_000_000) for name in COLUMNS})), reads=False)
    yield Attack("npz, zeros beside", file("a.npz", npz(**COLUMNS, more=np.zeros(40_000_000))), reads=False)
    yield Attack(
        "npz of long doubles",
        file("a.npz", npz(**{k: v.astype(np.longdouble) for k, v in COLUMNS.items()})),
        reads=True,
    )
    odd = np.array([object()] * N, object)
    yield Attack("npz, objects beside", file("a.npz", npz(**COLUMNS, odd=odd)), reads=True)
    for kind in ("f2", ">f4", ">f8", "<f16", "i1", "u8", "c16", "?", "M8[ns]", "m8[s]", "U5", "S9", "V4"):
        column = np.zeros(N, kind) if kind == "V4" else (np.arange(N) % 50).astype(kind)
        yield Attack(f"npz, a range of {kind}", file("a.npz", npz(**(COLUMNS | {"range_m": column}))))
        records = np.zeros(
            N, [("time_s", "f8"), ("range_m", column.dtype), ("azimuth_rad", "f8"), ("elevation_rad", "f8")]
        )
        yield Attack(f"npy, records with {kind}", file("a.npy", npy(records)))
    broken = np.array(["abcd"] * N)
    broken.view(np.uint32)[7] = 0x7FFFFFFF
    yield Attack("npz, letters that are none", file("a.npz", npz(**COLUMNS, note=broken)), ("--keep-columns",))
    whole = npy(np.array(ROWS))
    for shape in (
        "(60, 4)",
        "(9000000000, 4)",
        "(-1, 4)",
        "(60, 4, 9999999)",
        "(2305843009213693952, 4)",
        "()",
        "(0, 4)",
        "((((",
        "60",
    ):
        claimed = whole[10:128].replace(b"(60, 4)", shape.encode()).ljust(118)[:118]
        yield Attack(f"npy of shape {shape}", file("a.npy", whole[:10] + claimed + whole[128:]))
    nested = b"{'descr': " + b"[" * 50_000 + b"}"
    yield Attack("npy, a nested header", file("a.npy", b"\x93NUMPY\x02\x00" + struct.pack("<I", len(nested)) + nested))
    yield from damaged(npz(False, **COLUMNS), "a.npz", draw, 8)


def matlabs(draw: random.Random) -> Iterator[Attack]:
    """Matlab files."""

    def mat(**values: Any) -> bytes:
        sink = io.BytesIO()
        savemat(sink, values, do_compression=values.pop("pack", True))
        return sink.getvalue()

    def element(kind: int, content: bytes) -> bytes:
        return struct.pack("<II", kind, len(content)) + content

    def cells(depth: int) -> bytes:
        """A cell in a cell in a cell, as it stands in a file."""
        inner = b""
        head = element(6, struct.pack("<II", 1, 0)) + element(5, struct.pack("<ii", 1, 1)) + element(1, b"")
        for _ in range(depth):
            inner = element(14, head + inner)
        return inner

    top = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM"
    yield Attack("Matlab, zeros", file("a.mat", mat(**{name: np.zeros(12_000_000) for name in COLUMNS})), reads=False)
    yield Attack(
        "Matlab, zeros beside", file("a.mat", mat(**COLUMNS, more=np.zeros((10_000, 9000), np.int8))), reads=False
    )
    for depth in (60, 3000, 9000):
        yield Attack(f"Matlab, {depth} cells in each other", file("a.mat", top + cells(depth)), reads=False)
        packed = element(15, zlib.compress(cells(depth)))
        yield Attack(f"Matlab, {depth} cells in each other, packed", file("a.mat", top + packed), reads=False)
    many = mat(x=np.array([np.zeros(1)] * 400_000 + [None], object)[:-1])
    yield Attack("Matlab, very many cells", file("a.mat", many), reads=False)
    structures: dict[str, Any] = {
        "ragged": [1.0, [1.0, 2.0], []], "texts": ["a", "b", ""], "empty": [[], [], []], "mixed": ["a", 1.0, [2]],
        "structures": [{"x": 1.0}, {"x": [1, 2]}, {"x": "a"}], "truths": [True, False, True],
    }  # fmt: skip
    for label, column in structures.items():
        rows = [dict(zip(COLUMNS, row, strict=True)) | {"extra": column[k % 3]} for k, row in enumerate(ROWS)]
        kept = ("--keep-columns",)
        yield Attack(f"Matlab, structures with {label}", file("a.mat", mat(log=np.array(rows, object))), kept)
        one = {"log": COLUMNS | {"extra": np.array([*column, None], object)[:-1]}}
        yield Attack(f"Matlab, a structure with {label}", file("a.mat", mat(**one)), kept)
    ranges = [
        dict(zip(COLUMNS, row, strict=True)) | ({"range_m": []} if k % 9 == 4 else {}) for k, row in enumerate(ROWS)
    ]
    yield Attack("Matlab, empty ranges", file("a.mat", mat(log=np.array(ranges, object))), reads=True)
    plain = mat(pack=False, log=COLUMNS | {"ffieldnames": np.arange(3.0)})
    yield Attack("Matlab, a field _fieldnames", file("a.mat", plain.replace(b"ffieldnames", b"_fieldnames")))
    for kind in ("f2", "f4", "u8", "c16", "?", "U3"):
        try:
            content = mat(**(COLUMNS | {"range_m": (np.arange(N) % 50).astype(kind)}))
        except (TypeError, ValueError):
            continue
        yield Attack(f"Matlab, a range of {kind}", file("a.mat", content))
    version4 = struct.pack("<IIIII", 0, 100_000_000, 100, 0, 2) + b"x\0" + bytes(80)
    yield Attack("Matlab 4, a matrix that is not there", file("a.mat", version4), reads=False)
    yield from damaged(mat(pack=False, **COLUMNS), "a.mat", draw, 12)


def netcdfs(draw: random.Random) -> Iterator[Attack]:
    """netCDF of version 3."""

    def nc(units: dict[str, Any], **more: Any) -> bytes:
        sink = io.BytesIO()
        with netcdf_file(sink, "w") as out:
            out.createDimension("n", N)
            for name, values in (
                dict(zip(("time", "range", "azimuth", "elevation"), (T, R, A, E), strict=True)) | more
            ).items():
                made = out.createVariable(name, values.dtype, ("n",))
                made[:] = values
                if name in units:
                    made.units = units[name]
            out.flush()
            return sink.getvalue()

    angles = {"range": "m", "azimuth": "rad", "elevation": "rad"}
    since = ("9999999-01-01", "2024-13-01", "2024-01-01 1:02:03", "1-1-1", "1970-01-01 99:99")
    units = (
        5.0,
        np.arange(3.0),
        np.int32(1),
        b"\xff\xfe",
        "x" * 100_000,
        *(f"seconds since {start}" for start in since),
    )
    for unit in units:
        yield Attack(f"netCDF, time in {str(unit)[:40]}", file("a.nc", nc(angles | {"time": unit})))
        yield Attack(f"netCDF, range in {str(unit)[:40]}", file("a.nc", nc(angles | {"time": "s", "range": unit})))
    for value in (1e300, np.nan, -1e17):
        yield Attack(
            f"netCDF, a moment of {value}",
            file("a.nc", nc(angles | {"time": "days since 2000-01-01"}, time=np.full(N, value))),
        )
    whole = nc(angles | {"time": "s"})
    place = whole.index(b"\x00\x00\x00\x0b")
    many = struct.pack(">I", 2_000_000_000)
    yield Attack(
        "netCDF, very many variables", file("a.nc", whole[: place + 4] + many + whole[place + 8 :]), reads=False
    )
    yield Attack("netCDF, very many records", file("a.nc", whole[:4] + many + whole[8:]))
    yield from damaged(whole, "a.nc", draw, 12)


ALL = (parquets, feathers, workbooks, arrays, matlabs, netcdfs)
