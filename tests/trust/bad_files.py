"""Parquet logs, and things that are not files under a log's name."""

from __future__ import annotations

import io
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from tests.trust import cases
from tests.trust.cases import Case, flight, same, text, written

NAME = "log.parquet"
_FLIPS = 60


def packed(columns: dict[str, Any] | pa.Table, **options: Any) -> bytes:
    """A Parquet file of these columns."""
    sink = io.BytesIO()
    pq.write_table(columns if isinstance(columns, pa.Table) else pa.table(columns), sink, **options)
    return sink.getvalue()


def columns(**changes: Any) -> dict[str, Any]:
    """The flight's columns, some of them replaced."""
    log = flight().log
    found: dict[str, Any] = {"time_s": log.time_s, "range_m": log.measurement[:, 0].copy()}
    found |= {"azimuth_rad": log.measurement[:, 1].copy(), "elevation_rad": log.measurement[:, 2].copy()}
    return found | changes


def damaged() -> Iterator[Case]:
    """Cut short, with single bits flipped, and of the wrong size."""
    whole = packed(columns(), write_page_checksum=True)
    for length in (1, 4, 8, 12, len(whole) // 4, len(whole) // 2, len(whole) - 9, len(whole) - 8, len(whole) - 1):
        yield Case("log", f"Parquet cut at {length}", written(whole[:length], NAME), ("Parquet", "copy it again"))
    for place in np.linspace(0, len(whole) - 1, _FLIPS).astype(int):
        flipped = bytearray(whole)
        flipped[place] ^= 1 << int(place % 8)
        yield Case("log", f"Parquet flipped at {place}", written(bytes(flipped), NAME), None, same, either=True)
    yield Case("log", "Parquet, rubbish before", written(b"x" + whole, NAME), ("Parquet",))
    yield Case("log", "Parquet, rubbish behind", written(whole + b"x", NAME), ("Parquet",))
    yield Case("log", "Parquet, footer of 4 GB", written(whole[:-8] + b"\xff\xff\xff\x7fPAR1", NAME), ("Parquet",))
    yield Case("log", "Parquet called .csv", written(whole), ("give it the name .parquet",))
    bomb = {name: pa.array(np.broadcast_to(1.0, 40_000_000)) for name in columns()}
    yield Case("log", "Parquet bomb", lambda d: _bomb(d, bomb), ("unpack to more than",))


def _bomb(directory: Path, table: dict[str, Any]) -> Path:
    path = directory / NAME
    pq.write_table(pa.table(table), path, compression="zstd", write_statistics=False)
    return path


def types() -> Iterator[Case]:
    """Columns of types that are no numbers, and of odd ones that are."""
    n = len(flight().log)
    ones = np.ones(n)
    whole = [round(float(v)) for v in flight().log.measurement[:, 0]]
    for label, column in (
        ("bool", pa.array([True] * n)),
        ("list", pa.array([[1.0]] * n)),
        ("struct", pa.array([{"a": 1.0}] * n)),
        ("map", pa.array([[("a", 1.0)]] * n, pa.map_(pa.string(), pa.float64()))),
        ("words", pa.array(["far"] * n)),
        ("binary", pa.array([b"\xff\x00"] * n)),
        ("time of day", pa.array([1] * n, pa.time64("us"))),
        ("timestamps", pa.array([1] * n, pa.timestamp("us"))),
        ("dictionary of words", pa.array(["a"] * n).dictionary_encode()),
        ("infinite", pa.array(ones * np.inf)),
        ("infinite float32", pa.array((ones * np.inf).astype(np.float32))),
    ):
        yield Case(
            "log", f"range of {label}", written(packed(columns(range_m=column)), NAME), ('column "range_m"', "row 0")
        )
    for label, column in (
        ("int64", pa.array(whole)),
        ("uint16", pa.array(whole, pa.uint16())),
        ("decimal", pa.array(whole, pa.int64()).cast(pa.decimal128(20, 0))),
        ("text", pa.array([str(v) for v in whole])),
        ("large text", pa.array([str(v) for v in whole], pa.large_string())),
        ("dictionary", pa.array([str(v) for v in whole]).dictionary_encode()),
        ("float16", None),
        ("binary", pa.array([str(v).encode() for v in whole])),
    ):
        made = pa.array(np.array(whole).astype(np.float16), pa.float16()) if column is None else column
        expected = np.array(whole).astype(np.float16 if column is None else float)
        yield Case(
            "log",
            f"range as {label}",
            written(packed(columns(range_m=made)), NAME),
            None,
            lambda log, e=expected: np.array_equal(log.measurement[:, 0], e),
        )
    yield Case(
        "log",
        "range all null",
        written(packed(columns(range_m=pa.nulls(n))), NAME),
        None,
        lambda log: bool(np.isnan(log.measurement[:, 0]).all()),
    )
    low, high = -(2**63) + 1, 2**63 - 1
    for label, ticks in (("lowest", [low] * n), ("highest", [high] * n), ("both", [low, *[high] * (n - 1)])):
        for unit in ("us", "ns"):
            stamps = pa.array(ticks, pa.timestamp(unit))
            changed = {"time": stamps, **{k: v for k, v in columns().items() if k != "time_s"}}
            yield Case("log", f"timestamps {label} {unit}", written(packed(changed), NAME), either=True)
    yield Case(
        "log", "time as bool", written(packed(columns(time_s=pa.array([True] * n))), NAME), ('"time_s"', "row 0")
    )
    yield Case("log", "no columns", written(packed({}), NAME), ("no time column",))
    yield Case("log", "no rows", written(packed({k: v[:0] for k, v in columns().items()}), NAME), ("no rows",))
    pairs = list(columns().items())
    twice = pa.Table.from_arrays([pa.array(v) for _, v in [*pairs, pairs[1]]], names=[k for k, _ in [*pairs, pairs[1]]])
    yield Case("log", "Parquet, range twice", written(packed(twice), NAME), ("there 2 times",))
    dotted = {"my.time": flight().log.time_s, "R": ones * 5000.0, "A": ones, "E": ones}
    yield Case(
        "log",
        "a dot in a name",
        written(packed(dotted), NAME),
        None,
        lambda log: len(log) == n,
        options={"columns": "time=my.time"},
    )
    nested = columns(extra=pa.array([{"range_m": 1.0, "x": 2.0}] * n))
    yield Case("log", "nested columns beside", written(packed(nested), NAME), None, same)
    wide = columns() | {f"c{i}": ones for i in range(3000)}
    yield Case("log", "Parquet of 3,000 columns", written(packed(wide), NAME), None, same)


def places() -> Iterator[Case]:
    """A name behind which there is no ordinary file."""
    for suffix in ("csv", "csv.gz", "parquet"):
        name = f"log.{suffix}"

        def directory(d: Path, name: str = name) -> Path:
            (d / name).mkdir()
            return d / name

        def pipe(d: Path, name: str = name) -> Path:
            os.mkfifo(d / name)
            return d / name

        def link(target: str, name: str = name) -> cases.Make:
            def make(d: Path) -> Path:
                (d / name).symlink_to(target)
                return d / name

            return make

        yield Case("log", f"a directory {name}", directory, ("this is a directory",))
        yield Case("log", f"a named pipe {name}", pipe, ("not an ordinary file", "standard input"))
        yield Case("log", f"a link to itself {name}", link(name), ("cannot be read",))
        yield Case("log", f"a link to nothing {name}", link("gone"), ("there is no such file",))
        yield Case(
            "log", f"a link to an endless device {name}", link(os.devnull.replace("null", "zero")), ("ordinary file",)
        )
        yield Case("log", f"the empty device {name}", link(os.devnull), ("ordinary file",))
        yield Case("log", f"no file {name}", lambda d, name=name: d / name, ("there is no such file",))
        yield Case("log", f"below a file {name}", lambda d, name=name: _below(d, name), ("cannot be read",))
        yield Case(
            "log", f"a name of 300 letters {name}", lambda d, s=suffix: d / f"{'x' * 300}.{s}", ("cannot be read",)
        )
        if os.geteuid() != 0:  # root may read everything
            yield Case("log", f"no permission {name}", lambda d, name=name: _closed(d, name), ("no permission",))


def _below(directory: Path, name: str) -> Path:
    (directory / "file").write_text(text())
    return directory / "file" / name


def _closed(directory: Path, name: str) -> Path:
    path = directory / name
    path.write_text(text())
    path.chmod(0)
    return path


def all_cases() -> Iterator[Case]:
    """Every log that is not text."""
    for table in (damaged, types, places):
        yield from table()
