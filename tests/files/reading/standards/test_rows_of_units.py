"""Rows of units below the names: metres beside degrees or hours, and degrees, minutes, seconds under one name."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.files.reading import logs
from tests.files.conftest import Make
from tests.files.reading.standards.test_layouts import DEG, A, E, N, R, T, sexagesimal

CELLS = {
    "Time": [f"{t:.1f}" for t in T],
    "UTC": [f"14:25:{10 + t:06.3f}" for t in T],
    "Hours": [f"{9 + t / 3600:.8f}" for t in T],
    "Azimuth": [f"{a * DEG:.5f}" for a in A],
    "Elevation": [f"{e * DEG:.5f}" for e in E],
    "Slant Range": [f"{r:.3f}" for r in R],
    "Height": [f"{r * np.sin(e):.3f}" for r, e in zip(R, E, strict=True)],
    "SNR": ["14.2"] * N,
}
TABLES = (
    {"Time": "s", "Azimuth": "deg", "Elevation": "deg", "Slant Range": "m"},
    {"Time": "[s]", "Elevation": "[deg]", "Azimuth": "[deg]", "Height": "[m]", "Slant Range": "[m]", "SNR": "[dB]"},
    {"UTC": "hh:mm:ss", "Elevation": "°", "Azimuth": "°", "Slant Range": "m"},
    {"Hours": "h", "Slant Range": "m", "Azimuth": "deg", "Elevation": "deg"},
)
WAYS = {
    **{mark: mark.join for mark in (",", ";", "|", "\t")},
    "two blanks": "  ".join,
    "one blank": lambda cells: " ".join(cell.replace(" ", "_") for cell in cells),
    "columns": lambda cells: "".join(cell.rjust(16) for cell in cells),
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("units", TABLES, ids=lambda units: " ".join(units.values()))
def test_metres_beside_degrees_or_hours_are_no_minutes(make: Make, units: dict[str, str], way: str) -> None:
    names = ["Time" if name == "Hours" else name for name in units]
    rows = [names, list(units.values()), *map(list, zip(*map(CELLS.get, units), strict=True))]  # type: ignore[arg-type]
    log = logs.read(make("".join(WAYS[way](row) + "\n" for row in rows), "log.txt"))
    np.testing.assert_allclose(np.diff(log.time_s), np.diff(T), atol=1e-3)
    np.testing.assert_allclose(log.measurement, np.transpose([R, A, E]), rtol=0, atol=1e-3)


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_parts_stand_under_one_name_with_empty_cells_beside(make: Make, mark: str) -> None:
    lines = [
        ["Time", "", "", "Azimuth", "", "", "Elevation", "", "", "Range"],
        ["h", "m", "s", "deg", "min", "sec", "d", "m", "s", "m"],
    ]
    for k in range(N):
        parts = [f"{value:g}" for angle in (A[k], E[k]) for value in sexagesimal(angle)]
        lines.append(["14", "25", f"{10 + T[k]:.3f}", *parts, f"{R[k]:.3f}"])
    log = logs.read(make("".join(mark.join(line) + "\n" for line in lines)))
    np.testing.assert_allclose(np.diff(log.time_s), np.diff(T), atol=1e-3)
    np.testing.assert_allclose(log.measurement, np.transpose([R, A, E]), rtol=0, atol=1e-3)


def test_a_workbook_has_metres_beside_degrees_too(make: Make) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    units = TABLES[0]
    for row in ([*units], [*units.values()], *zip(*(map(float, CELLS[name]) for name in units), strict=True)):
        book.active.append(list(row))
    path = make("", "log.xlsx")
    book.save(path)
    np.testing.assert_allclose(logs.read(path).measurement, np.transpose([R, A, E]), rtol=0, atol=1e-3)


@pytest.mark.parametrize(
    "types", ["string float float float", "float64 float64 float64 float64", "(TIMESTAMP) (REAL) (REAL) (REAL)",
              "datetime Double Double Double", "#text number number number"],
)  # fmt: skip
@pytest.mark.parametrize("head", ["time_s,range_m,az_deg,el_deg", "UTC,Range (m),Azimuth (deg),Elevation (deg)"])
def test_a_row_of_types_is_no_row_of_names_or_units(make: Make, types: str, head: str) -> None:
    columns = (CELLS["UTC" if "UTC" in head else "Time"], CELLS["Slant Range"], CELLS["Azimuth"], CELLS["Elevation"])
    lines = [head, ",".join(types.split()), *map(",".join, zip(*columns, strict=True))]
    log = logs.read(make("\n".join(lines) + "\n"))
    np.testing.assert_allclose(np.diff(log.time_s), np.diff(T), atol=1e-3)
    np.testing.assert_allclose(log.measurement, np.transpose([R, A, E]), rtol=0, atol=1e-3)
