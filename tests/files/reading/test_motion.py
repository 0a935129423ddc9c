"""Units that nobody stated, by the motion of the target."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ftproc.errors import InputError
from ftproc.files.reading import logs
from ftproc.files.reading.meaning.values import paths
from ftproc.records import FloatArray


def flown(step_s: float, rows: int, speed: FloatArray, noise_m: float = 1.0) -> tuple[FloatArray, ...]:
    """Times in s, ranges in m and angles in deg of a target on a straight way past the station."""
    rng = np.random.default_rng(7)
    time = np.arange(rows) * step_s
    x, y, z = np.array([[2500.0], [-700.0], [500.0]]) + np.asarray(speed)[:, None] * time
    distance = np.sqrt(x**2 + y**2 + z**2)
    azimuth, elevation = np.arctan2(y, x) % (2 * np.pi), np.arcsin(z / distance)
    noises = (rng.normal(0, size, rows) for size in (noise_m, 1e-4, 1e-4))
    return time, *(v + n for v, n in zip((distance, azimuth, elevation), noises, strict=True))


def read(path: Path, head: str, *columns: FloatArray, units: str = "") -> FloatArray:
    """(n, 4) time and readings."""
    rows = (",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True))
    path.write_text(head + "\n" + "\n".join(rows) + "\n")
    log = logs.read(path, units=units or None)
    return np.column_stack([log.time_s, log.measurement])


FAST = np.array([-40.0, 190.0, 10.0])
BARE = "time,range_m,az_rad,el_rad"


@pytest.mark.parametrize("step_ms", [4, 5, 10, 20, 40, 100, 200])
def test_milliseconds_of_a_flight_need_no_word(tmp_path: Path, step_ms: int) -> None:
    time, *rest = flown(step_ms / 1e3, 800, FAST)
    found = read(tmp_path / "a.csv", BARE, time * 1e3, *rest)
    np.testing.assert_allclose(found[:, 0], time, atol=1e-9)


@pytest.mark.parametrize(("step_s", "speed"), [(1, FAST), (4, FAST), (10, FAST), (2, FAST / 50), (1, FAST * 0)])
def test_seconds_stay_seconds(tmp_path: Path, step_s: float, speed: FloatArray) -> None:
    time, *rest = flown(step_s, 300, speed)
    assert np.array_equal(read(tmp_path / "a.csv", BARE, time, *rest)[:, 0], time)


def test_a_rate_of_a_kilohertz_is_asked_about(tmp_path: Path) -> None:
    time, *rest = flown(1e-3, 3000, FAST)
    with pytest.raises(InputError, match="Say --units time=ms or --units time=s"):
        read(tmp_path / "a.csv", BARE, time * 1e3, *rest)
    found = read(tmp_path / "a.csv", BARE, time * 1e3, *rest, units="time=ms")
    np.testing.assert_allclose(found[:, 0], time, atol=1e-9)


@pytest.mark.parametrize(("unit", "size"), [("km", 1e3), ("nmi", 1852.0)])
def test_a_range_that_can_hardly_be_in_metres_is_asked_about(tmp_path: Path, unit: str, size: float) -> None:
    time, distance, *angles = flown(0.2, 400, FAST)
    with pytest.raises(InputError, match=f"--units range={unit}"):
        read(tmp_path / "a.csv", "time_s,range,az_rad,el_rad", time, distance / size, *angles)


def test_millimetres_need_no_word(tmp_path: Path) -> None:
    time, distance, *angles = flown(0.2, 400, FAST)
    found = read(tmp_path / "a.csv", "time_s,range,az_rad,el_rad", time, distance * 1e3, *angles)
    np.testing.assert_allclose(found[:, 1], distance, rtol=1e-6)


def test_small_degrees_are_not_taken_for_radians(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    time = np.arange(200.0)
    azimuth, elevation = (
        level + slope * time + rng.normal(0, 0.06, 200) for level, slope in ((4, 0.01), (1.2, -0.001))
    )
    with pytest.raises(InputError, match="azimuth=deg,elevation=deg"):
        read(tmp_path / "a.csv", "time_s,range_m,az,el", time, 3e4 - 90 * time, azimuth, elevation)


def test_values_that_nothing_has_are_bent_without_end() -> None:
    """Their squares overflow, without a warning."""
    draw = np.random.default_rng(0).standard_normal((8, 3))
    assert paths.bent(1e-300 * np.arange(8.0), 1e150 * draw, np.full(8, 1e150)) == np.inf


@pytest.mark.parametrize(("head", "size"), [("elevation", 1.0), ("el_deg", 180 / np.pi)])
def test_steep_elevations_that_may_be_zenith_angles_are_asked_about(tmp_path: Path, head: str, size: float) -> None:
    """Of a target near the horizon, of which the motion does not tell."""
    time, distance, azimuth, elevation = flown(1.0, 300, np.array([10.0, 40.0, 2.0]))
    way = distance * np.array([np.cos(azimuth), np.sin(azimuth)])
    wavy = (np.arctan2(way[1] + 300 * np.sin(time / 15), way[0] + 300 * np.cos(time / 11))) % (2 * np.pi)
    with pytest.raises(InputError, match=f'"{head}" counts.*Say --elevation-from horizon or --elevation-from zenith'):
        read(tmp_path / "a.csv", f"time,range_m,az_rad,{head}", time, distance, wavy, (np.pi / 2 - elevation) * size)


def test_steep_elevations_of_a_straight_way_need_no_word(tmp_path: Path) -> None:
    time, _, azimuth, _ = flown(1.0, 300, np.array([10.0, 0.0, 0.0]))
    x, y, z = 10 * time - 1500, 500 + 0 * time, 6000 + 0 * time
    distance = np.sqrt(x**2 + y**2 + z**2)
    noise = azimuth - np.arctan2(-700.0, 2500 + 10 * time) % (2 * np.pi)
    found = read(tmp_path / "a.csv", "time,range_m,azimuth,elevation", time, distance,
                 np.arctan2(y, x) % (2 * np.pi) + noise, np.arcsin(z / distance) + noise)  # fmt: skip
    assert np.median(found[:, 3]) > 1.0


def test_degrees_are_offered_before_mils(tmp_path: Path) -> None:
    """Of noisy angles, which are likelier in mils."""
    time = np.arange(600) * 0.1
    rng = np.random.default_rng(2)
    azimuth = 8 + 44 * np.sin(time / 40) + rng.normal(0, 1.0, 600)
    elevation = 12 + 7 * np.cos(time / 30) + rng.normal(0, 1.0, 600)
    distance = 350 + 170 * np.cos(time / 25) + rng.normal(0, 1.5, 600)
    with pytest.raises(InputError, match="no unit is stated") as question:
        read(tmp_path / "a.csv", "time_s,range_m,az,el", time, distance, azimuth, elevation)
    said = str(question.value)
    assert 0 < said.index("=deg") < said.index("=mil")


def test_an_elevation_that_passes_a_whole_turn_is_an_azimuth(tmp_path: Path) -> None:
    """Of a drone that weaves about north, whose motion does not tell; a target is not so far below the horizontal."""
    time = np.arange(400) / 5
    x, y, z = -150 + 5 * time + 10 * np.sin(time / 9), 60 + 25 * np.sin(time / 17), 12 + 18 * np.sin(time / 25) ** 2
    rng = np.random.default_rng(4)
    azimuth = (np.degrees(np.arctan2(x, y)) + rng.normal(0, 3e-3, 400)) % 360
    elevation = np.degrees(np.arctan2(z, np.hypot(x, y))) + rng.normal(0, 3e-3, 400)
    distance = np.sqrt(x**2 + y**2 + z**2) + rng.normal(0, 0.01, 400)
    with pytest.raises(InputError, match="or --columns azimuth=el_deg,elevation=az_deg --elevation-from horizon"):
        read(tmp_path / "a.csv", "time_s,range_m,az_deg,el_deg", time, distance, elevation, azimuth)
