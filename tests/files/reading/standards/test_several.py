"""Several targets in one file, whose rows have no motion that tells their units: which one is asked first."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.errors import InputError
from ftproc.files.options import Extract, parse_where
from ftproc.files.reading import logs
from ftproc.files.reading.formats import content
from ftproc.records import FloatArray
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


def tracks(step_s: float, seen: float, speed: float, *places: tuple[float, float], rows: int = 200) -> FloatArray:
    """Rows of time, range and angles of targets at places, that share their times, each seen so often."""
    rng, found = np.random.default_rng(8), []
    for k in range(rows):
        for x, y in places:
            px, py, pz = x + speed * k * step_s, y, 3000.0
            r = np.sqrt(px**2 + py**2 + pz**2)
            angles = np.array([np.arctan2(py, px), np.arcsin(pz / r)]) + rng.normal(0, 5e-4, 2)
            if rng.random() < seen:
                found.append([k * step_s, r + rng.normal(0, 5), *angles])
    return np.array(found)


def read_as_one(make: Make, rows: FloatArray, head: str = "time_s,range_m,az_rad,el_rad") -> str:
    """What is said of the rows of one target after all; nothing if they are read."""
    text = "".join(",".join(f"{value:.9g}" for value in row) + "\n" for row in rows)
    path = make(f"{head}\n{text}")
    try:
        logs.read(path, extract=Extract(target="none"))
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(("step_s", "seen"), [(1.0, 1.0), (4.0, 1.0), (4.0, 0.8), (0.1, 1.0)])
@pytest.mark.parametrize("places", [((9e3, 9e3), (-9e3, 2e3)), ((9e3, 9e3), (-9e3, 2e3), (20e3, -5e3))])
def test_rows_of_one_time_that_are_kilometres_apart_are_no_one_target(
    make: Make, step_s: float, seen: float, places: tuple[tuple[float, float], ...]
) -> None:
    rows = tracks(step_s, seen, -120.0, *places)
    sentence = read_as_one(make, rows)
    assert "rows of one time are " in sentence
    assert " km apart (median), which no target is" in sentence
    assert " deg apart" in read_as_one(make, rows[:, [0, 2, 3]], "time_s,az_rad,el_rad")


@pytest.mark.parametrize("speed", [-120.0, -30.0])
@pytest.mark.parametrize("second", [(41e3, 9e3), (40.8e3, 9.1e3), (40e3, 10.1e3)])
def test_two_aircraft_a_kilometre_apart_are_no_one_target(
    make: Make, monkeypatch: pytest.MonkeyPatch, speed: float, second: tuple[float, float]
) -> None:
    rows = tracks(4.0, 1.0, speed, (40e3, 9e3), second)
    assert " apart (median), which no target is" in read_as_one(make, rows)
    rows[1::2, 0] += 0.1  # read in blocks, as times that are nearly the same are there
    monkeypatch.setattr(content, "LARGE", 0)
    assert " apart (median), which no target is" in read_as_one(make, rows)


def test_a_ship_clutter_and_a_clock_that_stands_are_one_target(make: Make) -> None:
    ship = tracks(2.5, 0.8, 8.0, (5000.0, 2000.0), (5000.0, 2250.0))
    assert not read_as_one(make, ship)
    rng = np.random.default_rng(1)
    clutter = tracks(4.0, 1.0, -120.0, (9e3, 9e3))
    false = clutter[rng.random(len(clutter)) < 0.25] + [0, 9000.0, 1.0, 0.0]
    everything = np.concatenate([clutter, false])
    assert not read_as_one(make, everything[np.argsort(everything[:, 0], kind="stable")])
    fast = tracks(0.1, 0.9, 7000.0, (-60e3, 40e3))
    fast[:, 0] = np.floor(fast[:, 0])
    assert not read_as_one(make, fast)
