"""Several targets in one file, whose rows have no motion that tells their units: which one is asked first."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.files.options import Extract, parse_where
from ftproc.files.reading import logs
from tests.files.conftest import Make, refused

N = 120
T = np.arange(N) * 1.0
COURSES = ((9000.0, 20.0, -60.0), (3000.0, -40.0, 30.0), (15000.0, 10.0, 80.0))


def table(head: str, divide: tuple[float, float], column: bool = True, more: str = "") -> str:
    """Rows of three targets in turn: time, range and angles over divisors; perhaps a first column that numbers them,
    and cells behind."""
    rng, rows = np.random.default_rng(5), []
    for k in range(N):
        for number, (x, vx, vy) in enumerate(COURSES, 1):
            t = T[k] + 0.1 * number
            px, py, pz = x + vx * t, 4000.0 * number + vy * t, 500.0 * number
            r = np.sqrt(px**2 + py**2 + pz**2)
            angles = np.array([np.arctan2(py, px) % (2 * np.pi), np.arcsin(pz / r)]) + rng.normal(0, 5e-4, 2)
            cells = [f"{t / divide[0]:.6g}", f"{r + rng.normal(0, 5):.1f}", *(f"{a / divide[1]:.7g}" for a in angles)]
            rows.append(",".join([f"R{number}"] * column + cells) + more.format(number=number))
    return head + "\n" + "\n".join(rows) + "\n"


DEG = np.pi / 180


@pytest.mark.parametrize(
    ("head", "divide", "name"),
    [
        ("Sensor,Time,Range_m,Az_deg,El_deg", (1.0, DEG), "Sensor"),
        ("track_id,timestamp,range,azimuth,elevation", (1e-3, 1.0), "track_id"),
        ("PRN,Time,Range (m),Az,El", (1.0, DEG), "PRN"),
    ],
)
def test_targets_are_asked_about_before_units(make: Make, head: str, divide: tuple[float, float], name: str) -> None:
    path = make(table(head, divide))
    assert f'column "{name}" tells 3 targets apart (R1, R2, R3)' in refused(path)
    assert len(logs.read(path, extract=Extract(target=f"{name}=R1"))) == N


def test_targets_among_the_rows_that_meet_a_condition(make: Make) -> None:
    """The column is that of these rows and not of the first rows of the file."""
    path = make("group," + table("Sensor,Time,Range (m),Az,El", (1.0, DEG)).replace("\nR", "\n7,R").replace(
        "\n7,R", "\n6,R0,0,1,1,1\n7,R", 1))  # fmt: skip
    assert "tells 3 targets apart (R1, R2, R3)" in refused(path, extract=Extract(where=parse_where("group=7")))
