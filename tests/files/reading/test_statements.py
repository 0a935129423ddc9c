"""What stands beside the readings is asked about or refused where the program would take it otherwise."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ftproc.errors import InputError
from ftproc.files.reading import logs
from ftproc.settings import Station
from tests.files.conftest import Make, refused

PLAIN = "time_s,range_m,azimuth_deg,elevation_deg"
ROWS = "".join(f"{k},{9000 + 40 * k},{30 + 0.1 * k},{10 + 0.02 * k}\n" for k in range(60))
Log = Callable[..., Path]


@pytest.fixture
def log(tmp_path: Path) -> Log:
    def made(head: str = PLAIN, rows: str = ROWS) -> Path:
        path = tmp_path / "a.csv"
        path.write_text(f"{head}\n{rows}")
        return path

    return made


@pytest.mark.parametrize(
    ("line", "sentence", "otherwise"),
    [
        ("# two-way range", "ranges there and back. If these are such, say --columns range=range_m --units", "range=m"),
        ("# vertical angle is a zenith distance", "say --elevation-from zenith; if not, --elevation-from horizon", ""),
        ("# azimuth counted from south", "zero_deg = 180 under [azimuth]", "north"),
    ],
)
def test_a_line_above_the_table_is_heard(log: Log, line: str, sentence: str, otherwise: str) -> None:
    path = log(f"{line}\n{PLAIN}")
    with pytest.raises(InputError) as question:
        logs.read(path)
    assert line in str(question.value)
    assert sentence in str(question.value)
    station = Station(elevation_from="horizon", azimuth_from="north" if otherwise == "north" else None)
    assert len(logs.read(path, units=otherwise if "=" in otherwise else None, station=station)) == 60


@pytest.mark.parametrize(
    ("head", "sentence"),
    [
        ("Time (s),HD (m),Az (deg),El (deg)", '"HD (m)" is a horizontal distance, and ranges are slant ones'),
        ("Time (s),Range gate,Az (deg),El (deg)", '"Range gate" may be the range as numbers of range gates'),
        ("Time (s),Bin,Az (deg),El (deg)", "--columns range=Bin --units range=UNIT, where UNIT is the length of one"),
        ("Time (s),D,Az (deg),El (deg)", 'column "D" may be the range. Say --columns range=D'),
        ("Time (s),Slant (Dm),Az (deg),El (deg)", '"Dm" in column "Slant (Dm)" is not a unit of range'),
        ("Time (s),latitude,longitude,elevation", "positions by latitude and longitude, not readings"),
    ],
)
def test_what_is_no_slant_range_is_not_left_out_without_a_word(log: Log, head: str, sentence: str) -> None:
    with pytest.raises(InputError) as question:
        logs.read(log(head))
    assert sentence in str(question.value)


def test_times_that_are_all_the_same_are_refused(log: Log) -> None:
    path = log("Date,Lap,range_m,azimuth_deg,elevation_deg", "".join(f"2024-05-14,{row}\n" for row in ROWS.split()))
    with pytest.raises(InputError, match=r'all 60 rows have the same time in "Date".*Lap'):
        logs.read(path)


def test_units_that_change_from_row_to_row_are_named(log: Log) -> None:
    rows = "".join(f"{k},{9000 + k},{'m' if k % 2 else 'ft'},30,10\n" for k in range(60))
    with pytest.raises(InputError, match='"Range unit" names several units, ft and m'):
        logs.read(log("Time (s),Range,Range unit,Az (deg),El (deg)", rows))


@pytest.mark.parametrize(("head", "moving"), [("Relative Bearing (deg)", True), ("Bearing (deg M)", False)])
def test_bearings_that_are_not_true_are_not_from_north(log: Log, head: str, moving: bool) -> None:
    path = log(f"Time (s),Range (m),{head},El (deg)")
    found = logs.read(path, columns={"azimuth": head})
    assert found.understood["axis_is_known"] is False
    assert any("stays where it is" in each for each in found.understood["assumed"]) == moving


@pytest.mark.parametrize("rows", [24, 25, 30, 60, 200])
def test_day_hour_minute_and_second_are_no_time_codes(log: Log, rows: int) -> None:
    """However few there are, so that the seconds go as far as frames do."""
    cells = "".join(f"05:10:{k // 60:02d}:{k % 60:02d},{9000 + 40 * k},{30 + k / 10},10\n" for k in range(rows))
    found = logs.read(log("Time,range_m,azimuth_deg,elevation_deg", cells))
    np.testing.assert_allclose(found.time_s - found.time_s[0], np.arange(rows), atol=1e-6)


def test_a_zone_behind_hhmmss_is_no_digit(log: Log) -> None:
    cells = "".join(f"1010{10 + k},{9000 + 40 * k},{30 + k / 10},10\n" for k in range(9))
    found = logs.read(log("Time (HHMMSS Z),range_m,azimuth_deg,elevation_deg", cells))
    assert found.time_s[0] == pytest.approx(36610)


@pytest.mark.parametrize(
    ("line", "say"),
    [
        ("range: LSB 0.1 m", "--units 'range=0.1 m'"),
        ("1 count of range = 0.1 m", "--units 'range=0.1 m'"),
        ("LSB = 0.0054931640625 deg", "--units 'azimuth=0.0054931640625 deg,elevation=0.0054931640625 deg'"),
        ("azimuth scale: 0.01 deg", "--units 'azimuth=0.01 deg'"),
        ("16-bit angles, 65536 counts = 360 deg", "--units 'azimuth=360/65536 deg,elevation=360/65536 deg'"),
        ("angles in counts, 65536 counts per turn", "--units 'azimuth=1/65536 turn,elevation=1/65536 turn'"),
    ],
)
def test_the_worth_of_a_count_above_the_table_is_asked_about(make: Make, line: str, say: str) -> None:
    rows = "".join(f"{k / 2},{50000 + 7 * k},{2000 + k},{1000 + k}\n" for k in range(30))
    path = make(f"# {line}\nt,range,az,el\n{rows}")
    assert say in refused(path)
    units = dict(pair.split("=") for pair in say.removeprefix("--units ").strip("'").split(","))
    log = logs.read(path, units={"range": "m", "azimuth": "cdeg", "elevation": "cdeg"} | units)
    assert log.understood["columns"][next(iter(units))]["unit"] == next(iter(units.values()))


@pytest.mark.parametrize(
    "line", ["250 counts recorded in 60 s", "radar range scale 24 NM", "scale 1 m", "Counts: see page 3"]
)
def test_other_lines_with_counts_and_scales_say_nothing(make: Make, line: str) -> None:
    rows = "".join(f"{k / 2},{50000 + 7 * k},{20 + k / 8},{10 + k / 16}\n" for k in range(30))
    assert len(logs.read(make(f"# {line}\ntime,range,az_deg,el_deg\n{rows}"), units="range=m")) == 30


@pytest.mark.parametrize("name", ["time_to_go_s", "t_to_impact", "T-minus", "Time remaining (s)", "Countdown"])
def test_a_time_that_counts_down_is_refused(log: Log, name: str) -> None:
    falling = "".join(f"{80 - k},{9000 + 40 * k},{30 + 0.1 * k},{10 + 0.02 * k}\n" for k in range(60))
    head = f"{name},range_m,azimuth_deg,elevation_deg"
    with pytest.raises(InputError, match=r"counts down to an event, and a time counts up\. Write minus its numbers"):
        logs.read(log(head, falling))
    with pytest.raises(InputError, match=r"no time column|is not a unit of time"):
        logs.read(log(head, ROWS))


def test_a_strecke_is_a_range(log: Log) -> None:
    assert logs.read(log("Zeit,Strecke,Richtung,Vertikalwinkel")).measurement[0, 0] == 9000
