"""Truths that are wrong; they share their readers with the logs, so this is mostly what is their own."""

from __future__ import annotations

import gzip
from collections.abc import Iterator

import numpy as np

from tests.trust.cases import Case, flight, written

COLUMNS = ("time_s", "x_m", "y_m", "z_m", "outlier_range")
NAME = "t.csv"


def text(row: int = -1, column: int = -1, cell: str = "", header: tuple[str, ...] = COLUMNS) -> str:
    """The flight's truth, one cell replaced."""
    truth = flight().truth
    lines = [",".join(header)]
    for k, (t, p) in enumerate(zip(truth.time_s, truth.position_m, strict=True)):
        cells = [*(repr(float(v)) for v in (t, *p)), "0"]
        if k == row:
            cells[column] = cell
        lines.append(",".join(cells))
    return "\n".join(lines) + "\n"


def _right(truth: object) -> bool:
    return np.array_equal(truth.position_m, flight().truth.position_m)  # type: ignore[attr-defined]


def all_cases() -> Iterator[Case]:
    """Every truth."""
    yield Case("truth", "good", written(text(), NAME), None, _right)
    for column, name in enumerate(COLUMNS):
        place = ("row 7 (the first data row is 0)", f'column "{name}"')
        for cell in ("abc", "1,5;", "inf", "1e999", "true", "0x1", "2024-05-31", "--1", "١"):
            content = text(7, column, f'"{cell}"')
            yield Case("truth", f"{name} cell {cell}", written(content, NAME), place)
        if column < 4:
            yield Case(
                "truth", f"{name} missing", written(text(7, column, ""), NAME), (*place, "missing", "Fill it in")
            )
            gone = tuple("other" if other == name else other for other in COLUMNS)
            says = (f'no column "{name}"', f"Rename the right one to {name}")
            yield Case("truth", f"no {name}", written(text(header=gone), NAME), says)
        twice = tuple(name if other == "outlier_range" else other for other in COLUMNS)
        if name != "outlier_range":
            yield Case("truth", f"{name} twice", written(text(header=twice), NAME), ("is there twice",))
    for cell in ("-1", "0.5", "256", "1e300"):
        yield Case("truth", f"flag {cell}", written(text(7, 4, cell), NAME), ("row 7", "is not a flag"))
    for content, what in (
        (b"", "empty"),
        (b"x", "no column"),
        (",".join(COLUMNS).encode(), "no rows"),
        (text().encode()[:200] + bytes(5000), "NUL bytes"),
        (b"PAR1", "Parquet"),
    ):
        yield Case("truth", f"file of {len(content)} bytes {content[:9]!r}", written(content, NAME), (what,))
    yield Case("truth", "last line cut", written(text()[:-40], NAME), None, lambda truth: len(truth.time_s) == 39)
    yield Case("truth", "UTF-16", written(text().encode("utf-16"), NAME), None, _right)
    yield Case("truth", "gzip cut", written(gzip.compress(text().encode())[:-3], NAME + ".gz"), ("cut short",))
    turned = "time_s,x_m,y_m,z_m\n" + "".join(f"{(86_380 + k) % 86_400},1,2,{k}\n" for k in range(60))
    yield Case("truth", "midnight", written(turned, NAME), None, lambda truth: truth.time_s[-1] == 86_439)
    for cell in ("1e308", "-1e308"):
        for column in range(4):
            yield Case("truth", f"{COLUMNS[column]} {cell}", written(text(7, column, cell), NAME), either=True)
    yield Case("truth", "one row", written("time_s,x_m,y_m,z_m\n0,1,2,3\n", NAME), None, lambda truth: len(truth) == 1)
    yield Case("truth", "called .txt", written(text(), "t.txt"), None, _right)
