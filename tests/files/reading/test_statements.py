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
        ("# Azimut ab Süd", "zero_deg = 180 under [azimuth]", "north"),
        ("# Entfernungen: Hin- und Rückweg", "ranges there and back", "range=m"),
        ("# All ranges are horizontal distances", "speaks of horizontal distances", "range=m"),
        ("# multiply range by 10", "speaks of a factor or an offset", "range=m"),
        ("# elevation is positive down", "naming the column Depression; if not, --elevation-from horizon", ""),
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
        ("Time (s),Horizontaldistanz (m),Az (deg),El (deg)", "is a horizontal distance, and ranges are slant ones"),
        ("Time (s),水平距离(m),Az (deg),El (deg)", "is a horizontal distance, and ranges are slant ones"),
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


@pytest.mark.parametrize(
    ("range_", "sentence"),
    [
        ("Range (m; two-way)", 'the name of column "Range (m; two-way)" speaks of ranges there and back'),
        ("Range*10 (m)", "holds a factor, \"*10\". Say what one is worth, such as --units 'range=0.1 m'"),
        ("Range/10 (m)", 'holds a factor, "/10"'),
        ("Range (half km)", "such as --units 'range=0.1 km', or --units range=km if nothing is to be multiplied"),
    ],
)
def test_a_name_that_says_more_than_the_unit_is_asked_about(log: Log, range_: str, sentence: str) -> None:
    path = log(f"Time (s),{range_},Az (deg),El (deg)")
    with pytest.raises(InputError) as question:
        logs.read(path)
    assert sentence in str(question.value)
    assert len(logs.read(path, units={"range": "km" if "km" in range_ else "m"})) == 60


@pytest.mark.parametrize(
    "line",
    [
        "# range scale factor: 1.0", "# range offset 0.000", "# max range 40 km, time offset 0.5 s",
        "# data from S. Smith",
        "# target below horizon at start", "# wind from south, 5 m/s", "# max ground range 300 km",
    ],
)  # fmt: skip
def test_lines_that_change_nothing_are_passed_over(log: Log, line: str) -> None:
    assert len(logs.read(log(f"{line}\n{PLAIN}"))) == 60


def test_a_column_beside_the_range_may_say_anything(log: Log) -> None:
    rows = "".join(f"{row},5\n" for row in ROWS.split())
    assert len(logs.read(log(f"{PLAIN},Range offset 2 two-way", rows))) == 60


@pytest.mark.parametrize("name", ["El (deg, positive down)", "Elevation (deg; + down)", "Tiefenwinkel (deg)"])
def test_angles_that_are_said_to_count_downwards_are_turned_round(log: Log, name: str) -> None:
    up, down = (logs.read(log(f"Time (s),Range (m),Az (deg),{each}")) for each in ("El (deg)", name))
    np.testing.assert_allclose(down.measurement[:, 2], -up.measurement[:, 2])
    assert any("counts downwards and is turned round" in remark for remark in down.remarks)


@pytest.mark.parametrize(("name", "assumed"), [("Range (m; slant)", []), ("Range (m; squashed)", ["m; squashed"])])
def test_words_that_are_not_understood_are_a_condition(log: Log, name: str, assumed: list[str]) -> None:
    path = log(f"Time (s),{name},Az (deg),El (deg)")
    words = [f'"{each}" in the name of column "{name}" changes nothing' for each in assumed]
    assert logs.read(path).understood["assumed"] == words


def test_times_that_are_all_the_same_are_refused(log: Log) -> None:
    path = log("Date,Lap,range_m,azimuth_deg,elevation_deg", "".join(f"2024-05-14,{row}\n" for row in ROWS.split()))
    with pytest.raises(InputError, match=r'all 60 rows have the same time in "Date".*Lap'):
        logs.read(path)


@pytest.mark.parametrize("head", ["Time", "Date,Time", "Hour,Min,Sec", "Time (s)", "utc", "Time (s);", "Date,SOD (s)"])
@pytest.mark.parametrize(("rate", "step"), [(20, 50), (50, 20), (20, 5), (1, 1050)])
def test_times_whose_fractions_lack_their_zeros(log: Log, head: str, rate: int, step: int) -> None:
    """Of ms or hundredths, in texts and in numbers; with one in each second, by the digits alone."""
    size = 100 if step == 5 else 1000
    rows = []
    for k in range(600):
        second, part = divmod(k * step, size)
        clock = f"10:{second // 60:02d}:{second % 60:02d}.{part}"
        time = {"Time": clock, "Date,Time": f"2024-05-14,{clock}", "Hour,Min,Sec": clock.replace(":", ","),
                "utc": clock.replace(":", ""), "Date,SOD (s)": f"2024-05-14,{36000 + second}.{part}"}  # fmt: skip
        rows.append(f"{time.get(head, f'{36000 + second}.{part}')},{9000 + 2 * k},{30 + 0.01 * k},10")
    text = "\n".join([f"{head.strip(';')},Range (m),Az (deg),El (deg)", *rows, ""])
    path = log(*(text.replace(".", "_").replace(",", ";").replace("_", ",") if ";" in head else text).split("\n", 1))
    read = logs.read(path)
    np.testing.assert_allclose(np.diff(read.time_s), step / size, atol=1e-6)
    assert any("without their leading zeros" in remark for remark in read.remarks)


@pytest.mark.parametrize("digits", ["{:.1f}", "{:.10g}", "{:.2f}"])
@pytest.mark.parametrize("step", [0.1, 0.25, 0.125, 0.02, 1.05])
def test_numbers_of_seconds_stay_as_they_are(log: Log, digits: str, step: float) -> None:
    times = [float(digits.format(36000.5 + k * step)) for k in range(200)]
    rows = "".join(f"{digits.format(time)},{9000 + 2 * k},{30 + 0.01 * k},10\n" for k, time in enumerate(times))
    read = logs.read(log("Time (s),Range (m),Az (deg),El (deg)", rows))
    assert not any("leading zeros" in remark for remark in read.remarks)


@pytest.mark.parametrize("step", [1, 0.5])
def test_a_few_fractions_say_nothing_of_zeros(log: Log, step: float) -> None:
    """Nor do many that would be further out of order with more zeros."""
    fractions = ["50", "125", "250", "375"] if step == 1 else ["125", "50"]
    rows = [f"{int(k * step)}.{fractions[k % len(fractions)]},{9000 + 2 * k},{30 + 0.01 * k},10" for k in range(20)]
    read = logs.read(log("Time (s),Range (m),Az (deg),El (deg)", "\n".join(rows) + "\n"))
    np.testing.assert_array_equal(read.time_s, [float(row.split(",")[0]) for row in rows])


@pytest.mark.parametrize("fractions", [["0", "5", "05", "50"], ["1", "2", "3", "4"], ["100", "200", "350", "400"]])
def test_other_fractions_are_as_they_are(log: Log, fractions: list[str]) -> None:
    rows = [f"10:00:{k // 4:02d}.{fractions[k % 4]},{9000 + 2 * k},{30 + 0.01 * k},10" for k in range(80)]
    read = logs.read(log("Time,Range (m),Az (deg),El (deg)", "\n".join(rows) + "\n"))
    expected = sorted(36000 + k // 4 + float(f"0.{fractions[k % 4]}") for k in range(80))
    np.testing.assert_allclose(read.time_s, expected, atol=1e-9)


def test_bad_rows_are_left_out_and_not_taken_for_a_target(log: Log) -> None:
    rows = "".join(f"{k},{9000 + 40 * k + 3000 * (k % 3 == 0)},{30 + 5 * (k % 3 == 0)},10,{'OK' if k % 3 else 'BAD'}\n"
                   for k in range(90))  # fmt: skip
    with pytest.raises(
        InputError, match=r"calls OK are of another track than the others \(BAD\)\. Say --where Status=OK"
    ):
        logs.read(log("Time (s),Range (m),Az (deg),El (deg),Status", rows))


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
