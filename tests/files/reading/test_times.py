"""Times: timestamps count from midnight; a clock that restarts is continued, a glitch and rows in disorder are left."""

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ftproc.errors import InputError
from ftproc.files.reading import logs
from ftproc.files.reading.clocks.clock import unrolled
from tests.files.conftest import Make

DAY = np.arange(86_000.0, 86_900.0, 10.0) % 86_400


def test_a_clock_that_restarts_is_continued_and_the_row_named() -> None:
    time, notes = unrolled(np.insert(DAY, 3, np.nan))
    assert np.array_equal(time, np.insert(np.arange(86_000.0, 86_900.0, 10.0), 3, np.nan), equal_nan=True)
    assert notes == ("the clock restarts at midnight, row 41 (the first data row is 0): 86400 s are added",)
    week = np.arange(604_700.0, 604_900.0, 10.0)
    assert unrolled(week % 604_800)[0].tolist() == week.tolist()
    assert unrolled(week % 604_800, 86_400.0)[1] == ()


def test_two_midnights() -> None:
    time = np.arange(0.0, 200_000.0, 300.0)
    assert unrolled(time % 86_400)[0].tolist() == time.tolist()
    assert len(unrolled(time % 86_400)[1]) == 2


@pytest.mark.parametrize(
    "time",
    [
        np.sort(DAY),
        DAY[::-1],
        np.r_[DAY[:40], DAY[40:] + 86_400],
        np.r_[DAY[:20], 0.0, DAY[20:40]],
        np.r_[DAY[:39], 0.0, DAY[39]],
        np.r_[86_000.0, 40.0, 86_010.0, 86_020.0, 30.0, 86_030.0],
        np.r_[80_000.0:80_100.0:10, 0.0:100.0:10],
        np.random.default_rng(0).permutation(DAY),
        np.array([]),
        np.array([1.0, 0.0]),
    ],
    ids=[
        "sorted",
        "reversed",
        "added",
        "glitch",
        "late glitch",
        "glitches",
        "another flight",
        "shuffled",
        "none",
        "two",
    ],
)
def test_no_rollover(time: np.ndarray) -> None:
    same, notes = unrolled(time)
    assert same is time
    assert notes == ()


@pytest.mark.parametrize("zone", ["", "Z", "+00:00"])
@pytest.mark.parametrize("between", ["T", " "])
def test_timestamps_count_from_the_midnight_before_the_earliest(make: Make, zone: str, between: str) -> None:
    moments = [f"2024-06-01{between}00:00:01.5", f"2024-05-31{between}23:59:59.123456", f"2024-06-01{between}12:00:00"]
    log = logs.read(make("time,R\n" + "".join(f"{moment}{zone},1\n" for moment in moments) + ",1\n"))
    assert log.time_s.tolist() == [86399.123456, 86401.5, 129600.0]
    assert (log.row.tolist(), log.rows_without_time) == ([1, 0, 2], (3,))


@pytest.mark.parametrize("moment", ["20240531T010000.25Z", "2024-05-31T03:00:00,25+02:00", "2024-05-31 01:00:00,250"])
def test_other_ways_to_write_iso_8601(make: Make, moment: str) -> None:
    assert logs.read(make(f"time;R\n{moment};1\n;2\n")).time_s.tolist() == [3600.25]


@given(st.lists(st.integers(0, 7 * 86400 * 10**6), min_size=1, max_size=20))
def test_timestamps_keep_microseconds_for_a_week(ticks: list[int]) -> None:
    day = 19874 * 86400 * 10**6
    first = min(ticks) // (86400 * 10**6) * 86400 * 10**6
    for unit in ("us", "ns"):
        column = pa.array([day + tick for tick in ticks], pa.timestamp("us")).cast(pa.timestamp(unit, "UTC"))
        log = logs.read(pa.table({"time": column, "range_m": [1.0] * len(ticks)}))
        assert log.time_s.tolist() == sorted((tick - first) / 10**6 for tick in ticks)


@pytest.mark.parametrize("name", ["time", "azimuth_rad"])
def test_a_time_beyond_the_calendar_is_named_in_any_column(name):
    far = pa.array([5, 2**43], pa.timestamp("s"))
    table = pa.table({"time": pa.array([5, 6], pa.timestamp("s")), "range_m": [1.0, 2.0], "azimuth_rad": [0.0, 0.0]})
    with pytest.raises(InputError, match=r"row [01] .the first data row is 0., column") as error:
        logs.read(table.set_column(table.column_names.index(name), name, far))
    assert ("between the years 1 and 9999" in str(error.value)) == (name == "time")


def test_times_that_are_too_far_apart():
    ends = pa.array([-(2**63) + 10**15, 2**63 - 10**15], pa.timestamp("ns"))
    with pytest.raises(InputError, match=r"is not close enough to the latest time for 64-bit ns"):
        logs.read(pa.table({"time": ends, "range_m": [1.0, 2.0]}))


def test_the_day_of_timestamps_is_kept():
    stamped = pa.table({"time": ["2024-05-31T23:59:59Z", "2024-06-01T00:00:01Z"], "range_m": [1.0, 2.0]})
    found = logs.read(stamped)
    assert found.epoch == "2024-05-31T00:00:00Z"
    np.testing.assert_array_equal(found.time_s, [86399.0, 86401.0])
    assert logs.read(pa.table({"time_s": [0.0], "range_m": [5.0]})).epoch == ""


def test_a_local_time_is_no_utc(make: Make) -> None:
    rows = "".join(f"2024-05-31 12:00:{k:02d},{1000 + k}\n" for k in range(20))
    for name, epoch in (("Time", "2024-05-31T00:00:00Z"), ("Local Time", "")):
        log = logs.read(make(f"{name},range_m\n{rows}"))
        assert log.epoch == epoch
        assert any("without its zone" in doubt for doubt in log.understood["doubts"]) == (not epoch)
