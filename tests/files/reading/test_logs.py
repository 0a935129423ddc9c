"""Logs as they are read: order, units, missing readings, kept columns."""

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from ftproc.errors import FtprocError, InputError, UsageError
from ftproc.files.reading import logs
from ftproc.files.reading.meaning import readings
from ftproc.files.writing import flights
from ftproc.records import MeasurementLog
from tests.files.conftest import Make, refused

HEADER = "time_s,range_m,azimuth_rad,elevation_rad\n"
NAN = math.nan

#: What can be a reading: some numbers stand for "no reading" and are found as such.
finite = st.floats(allow_nan=False, allow_infinity=False).filter(lambda number: number not in readings.NUMBERS)
small_angle = st.floats(-1.5, 1.5)


@st.composite
def some_logs(draw: st.DrawFn) -> MeasurementLog:
    n = draw(st.integers(1, 30))
    time = np.sort(draw(hnp.arrays(np.float64, n, elements=finite)))
    measurement = np.column_stack(
        [
            draw(hnp.arrays(np.float64, n, elements=st.one_of(finite, st.just(NAN)))),
            draw(hnp.arrays(np.float64, (n, 2), elements=st.one_of(small_angle, st.just(NAN)))),
        ]
    )
    measurement[draw(st.integers(0, n - 1)), draw(st.integers(0, 2))] = 0.25
    return MeasurementLog("a", time, measurement, np.arange(n))


@pytest.mark.parametrize("suffix", [".csv", ".csv.gz", ".parquet", ".feather"])
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=40)
@given(log=some_logs())
def test_every_bit_comes_back(tmp_path: Path, suffix: str, log: MeasurementLog) -> None:
    path = tmp_path / f"log{suffix}"
    flights.write_log(log, path)
    back = logs.read(path)
    assert back.time_s.tobytes() == log.time_s.tobytes()
    assert np.array_equal(back.measurement, log.measurement, equal_nan=True)
    assert np.array_equal(np.signbit(back.measurement), np.signbit(log.measurement) & ~np.isnan(log.measurement))
    assert back.row.tolist() == list(range(len(log)))
    assert (back.name, back.rows_in_file, back.frame) == (str(path), len(log), "local")


@settings(max_examples=60)
@given(data=st.data(), n=st.integers(1, 40))
def test_a_permutation_of_the_rows_changes_only_their_numbers(data: st.DataObject, n: int) -> None:
    time = np.arange(n) * 0.05
    table = pa.table({"time_s": time, "range_m": np.arange(n) + 100.0, "azimuth_rad": np.sin(time)})
    order = np.array(data.draw(st.permutations(range(n))))
    straight, mixed = logs.read(table), logs.read(table.take(order))
    assert np.array_equal(mixed.time_s, straight.time_s)
    assert np.array_equal(mixed.measurement, straight.measurement, equal_nan=True)
    assert np.array_equal(order[mixed.row], straight.row)
    late = sum(1 for place in range(n) if order[place] < max(order[: place + 1]))
    assert (straight.rows_out_of_order, mixed.rows_out_of_order) == (0, late)


def test_rows_are_sorted_stably_counted_and_numbered(make: Make) -> None:
    log = logs.read(make(HEADER + "2,20,0,0\n1,10,0,0\n,99,0,0\n1,11,0,0\n3,30,0,0\nNaN,98,0,0\n1,12,0,0\n"))
    assert log.time_s.tolist() == [1, 1, 1, 2, 3]
    assert log.measurement[:, 0].tolist() == [10, 11, 12, 20, 30]
    assert log.row.tolist() == [1, 3, 6, 0, 4]
    assert log.row.dtype == np.int64
    assert log.rows_without_time == (2, 5)
    assert (log.rows_in_file, log.rows_out_of_order, log.duplicate_times) == (7, 3, 2)


def test_many_equal_times_keep_the_order_of_the_file() -> None:
    time = np.tile([2.0, 1.0, 3.0], 1000)  # long enough for a sort that is not stable to show it
    log = logs.read(pa.table({"time_s": time, "range_m": np.arange(3000.0)}))
    assert log.row.tolist() == [*range(1, 3000, 3), *range(0, 3000, 3), *range(2, 3000, 3)]
    assert log.measurement[:, 0].tolist() == log.row.tolist()


@pytest.mark.parametrize("word", ["", " ", "NaN", "nan", "NA", "N/A", "null", "NULL", "None", "-nan", " NaN "])
def test_words_for_a_missing_reading(make: Make, word: str) -> None:
    log = logs.read(make(f"{HEADER}0,1,{word},0.5\n1,{word},1.5,0.5\n"))
    assert np.array_equal(log.measurement, [[1, NAN, 0.5], [NAN, 1.5, 0.5]], equal_nan=True)


def test_nan_never_becomes_zero_nor_a_zero_nan(make: Make) -> None:
    log = logs.read(make(HEADER + "0,0,,0\n1,,0,\n"))
    assert np.array_equal(log.measurement, [[0, NAN, 0], [NAN, 0, NAN]], equal_nan=True)


@pytest.mark.parametrize("times", [1, 3])
@pytest.mark.parametrize(
    ("column", "number"), [(1, 0), (1, -1), (1, -9999), (1, 99999), (2, 9999), (2, -999), (3, -99999)]
)
def test_a_number_that_no_reading_is_is_missing_from_its_first_time_on(
    make: Make, column: int, number: int, times: int
) -> None:
    """Live rows must not depend on how often it comes later."""
    rows = [[k, 5000 + 15 * k, 0.5 + 0.001 * k, 0.2 + 0.001 * k] for k in range(60)]
    for k in (7, 30, 50)[:times]:
        rows[k][column] = number
    lines = "\n".join(",".join(map(str, row)) for row in rows)
    found = logs.read(make(f"time_s,range_m,azimuth_rad,elevation_rad\n{lines}\n"))
    assert np.isnan(found.measurement[:, column - 1]).sum() == times
    assert np.isnan(found.measurement).sum() == times
    often = "once" if times == 1 else "3 times"
    assert f"is {number} {often}, which is taken for a missing reading" in str(found.remarks)


def test_an_absent_column_is_missing_throughout(make: Make) -> None:
    log = logs.read(make("time_s,elevation_rad,azimuth_rad\n0,0.5,1\n"))
    assert np.array_equal(log.measurement, [[NAN, 1, 0.5]], equal_nan=True)


def test_outliers_stay_for_editing(make: Make) -> None:
    log = logs.read(make(HEADER + "0,-5,1,0.1\n1,0,99,0.1\n2,1e12,1,-7\n"))
    assert log.measurement.tolist() == [[-5, 1, 0.1], [0, 99, 0.1], [1e12, 1, -7]]


def test_units_by_suffix_and_by_option(make: Make) -> None:
    expected = [[1852.0, math.pi / 2, math.pi / 4]]
    log = logs.read(make("time_ms,range_nmi,az_deg,el_grad\n1500,1,90,50\n"))
    assert log.time_s.tolist() == [1.5]
    np.testing.assert_allclose(log.measurement, expected, rtol=1e-15)
    path = make("T0,RNG,A,E\n1500000,1.852,1600,45\n")
    log = logs.read(path, units="time=us,range=km,azimuth=mil,elevation=deg", columns="time=T0,range=RNG")
    assert log.time_s.tolist() == [1.5]
    np.testing.assert_allclose(log.measurement, expected, rtol=1e-15)


def test_azimuth_from_north_names_the_axes_and_leaves_the_angle(make: Make) -> None:
    path = make(HEADER + "0,1,0.25,0.5\n")
    assert logs.read(path).frame == "local"
    log = logs.read(path, azimuth_from="north")
    assert (log.frame, log.measurement[0, 1]) == ("north-east-up", 0.25)


def test_other_columns_are_ignored_or_kept_row_for_row(make: Make) -> None:
    path = make("note,time_s,snr,range_m,R,empty\nc,2,3,30,x,\na,1,1,10,y,\nz,,0,0,y,\n")
    assert logs.read(path).extra is None
    log = logs.read(path, keep_columns=True)
    assert log.extra is not None
    assert log.extra.to_pydict() == {"note": ["a", "c"], "snr": [1, 3], "R": ["y", "x"], "empty": [None, None]}
    assert logs.read(make(HEADER + "0,1,1,1\n"), keep_columns=True).extra is None


def test_kept_columns_are_written_behind_the_canonical_ones(make: Make, tmp_path: Path) -> None:
    log = logs.read(make("t,R,note\n0,1.5,a\n"), keep_columns=True)
    flights.write_log(log, tmp_path / "out.csv")
    assert (tmp_path / "out.csv").read_text() == HEADER.strip() + ',note\n0,1.5,,,"a"\n'


def test_the_arrays_may_be_written_to(make: Make) -> None:
    log = logs.read(make(HEADER + "0,1,1,1\n1,1,1,1\n"))
    assert log.time_s.flags.writeable
    assert log.measurement.flags.writeable
    assert log.measurement.flags.c_contiguous


def test_options_that_are_not_understood(make: Make) -> None:
    path = make(HEADER + "0,1,1,1\n")
    for options, expected in (
        ({"azimuth_from": "south"}, '--azimuth-from: "south" is not understood; say x or north.'),
        ({"units": "range=ell"}, '"ell" is not a unit of range'),
        ({"columns": "range"}, '"range" is not QUANTITY=NAME'),
    ):
        with pytest.raises(UsageError) as caught:
            logs.read(path, **options)  # type: ignore[arg-type]
        assert expected in str(caught.value)
        assert isinstance(caught.value, FtprocError)
        assert caught.value.exit_code == 2


def test_kept_columns_must_have_different_names(make: Make) -> None:
    sentence = refused(make("t,R,n,n\n0,1,2,3\n"), keep_columns=True)
    assert 'column "n" is there twice, so both cannot be kept' in sentence
    assert "leave --keep-columns out" in sentence


def test_a_counter_is_not_proposed_as_the_time(make: Make) -> None:
    for name, proposed in (("n", "time=NAME"), ("when", "time=when")):
        rows = "".join(f"{k},{1000 + k},0.1,0.2\n" for k in range(30))
        assert f"--columns {proposed}." in refused(make(f"{name},range_m,azimuth_rad,elevation_rad\n{rows}"))


def test_a_workbook_of_several_logs_is_asked_about(tmp_path: Path) -> None:
    path = tmp_path / "two.xlsx"
    frame = pd.DataFrame({"time_s": [0.0, 1.0], "range_m": [1.0, 2.0]})
    with pd.ExcelWriter(path) as book:
        for title in ("one", "the other"):
            frame.to_excel(book, sheet_name=title, index=False)
    assert f"several logs, in the sheets one, the other. Name one behind #, such as '{path}#one'." in refused(path)
    assert len(logs.read(f"{path}#the other")) == 2


def test_names_in_another_order_among_the_rows_are_refused(tmp_path: Path) -> None:
    log = tmp_path / "joined.csv"
    log.write_text("t,range_m,az_deg\n" + "0,100,5\n" * 9 + "t,az_deg,range_m\n" + "1,5,100\n" * 9)
    with pytest.raises(InputError, match=r"joined\.csv: names of columns stand among the rows.*t, az_deg, range_m"):
        logs.read(log)
