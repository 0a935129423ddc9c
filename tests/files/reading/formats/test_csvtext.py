"""CSV: text as other programs write it, and what is refused."""

import gzip
import io
import sys
from pathlib import Path

import numpy as np
import pytest

from ftproc.errors import InputError
from ftproc.files.reading import logs
from ftproc.files.writing import flights
from tests.files.conftest import Make, refused

HEADER = "time_s,range_m,azimuth_rad,elevation_rad\n"
NAN = np.nan


@pytest.mark.parametrize(
    "text",
    [
        "\ufefft,R,A,E\r\n0.5,1000.25,1,0.5\r\n\r\n1,2e3,,0.25\r\n",
        "\r\nt , R, A ,E\r0.5,+1000.25,1, 0.5\r1.0, 2000 ,,.25",
        '"t","R","A","E"\n"0.5","1000.25","1","0.5"\n1,2000,"",0.25\n',
        "t\tR\tA\tE\n0.5\t1000.25\t1\t0.5\n1\t2000\t\t0.25\n",
        "t;R;A;E\n0.5;1000.25;1;0.5\n1;2000;;0.25\n",
        "t;R;A;E\n0,5;1000,25;1;0,5\n1;2000;;0,25\n",
        "t;R;A;E\n0,5;1000,25;1;0.5\n1;2000;;0.25\n",
    ],
)
def test_csv_of_other_programs_is_read_where_there_is_no_doubt(make: Make, text: str) -> None:
    log = logs.read(make(text))
    assert log.time_s.tolist() == [0.5, 1.0]
    assert np.array_equal(log.measurement, [[1000.25, 1, 0.5], [2000, NAN, 0.25]], equal_nan=True)


def test_standard_input_is_csv_gzipped_or_not(make: Make, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    log = logs.read(make(HEADER + "0,1,1,1\n"))
    flights.write_log(log, tmp_path / "log.csv.gz")
    for path in (tmp_path / "log.csv", tmp_path / "log.csv.gz"):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(path.read_bytes())))
        read = logs.read("-")
        assert (read.name, read.measurement.tolist()) == ("<stdin>", [[1, 1, 1]])


def test_an_ignored_column_may_hold_anything(make: Make) -> None:
    log = logs.read(make(b't,R,note\n0,1,\xf6\n1,2,5" gun\n2,3,"a, b"\n'))
    assert log.measurement[:, 0].tolist() == [1, 2, 3]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "t,R\n0,1\n\n1\n",
            "row 1 (the first data row is 0) has 1 cell where the header has 2. Complete the row or delete it.",
        ),
        ("t,R\n0,1\n1,2,3\n", "row 1 (the first data row is 0) has 3 cells where the header has 2."),
        ("t,R\n0,1\nx,1\n1,2,3\n", "row 2 (the first data row is 0) has 3 cells"),
        ('t,R,note\n0,1,a\n1,2,"b\n2,3,c\n3,4,d\n', "row 1 (the first data row is 0) opens a quotation mark"),
        ('t,R\n0,1\n1,"2\n2,3\n', "row 1 (the first data row is 0) opens a quotation mark and does not close it"),
        ("", "the file is empty; expected a header line and rows."),
        ("\ufeff\r\n\n", "the file is empty"),
        ("t,R\n", "there are column names but no rows."),
        ("t,R\r\n\r\n\n", "there are column names but no rows."),
        ("t,R\n,1\n,2\n", "no row has a time, so there is nothing to process; fill the times in."),
        (
            "t,R\n1,\n,5\n",
            "no row has a range, azimuth or elevation, so there is nothing to process; check the columns.",
        ),
        (
            "time_s range_m\n",
            'the header line "time_s range_m" has no separator, and no line looks like a row of a log',
        ),
        (
            "a,b\n0,1\n",
            "no time column (expected time_s or time or t). Its columns are: a, b. Its columns hold, in two rows: "
            '2 "b": 1, from 1 to 1. Name the right ones with --columns time=NAME.',
        ),
        ("t,R\n".encode("utf-16"), "there are column names but no rows."),
        (b"t,R\n0,1\n\0\0\0", "this is not text in UTF-8 (it has NUL bytes or the like)"),
        (b"PAR1....", "this is a Parquet file; give it the name .parquet."),
        (b"PK\x03\x04....", "this is a zip archive or an Excel workbook"),
    ],
)
def test_text_that_is_no_log(make: Make, text: str | bytes, expected: str) -> None:
    assert expected in refused(make(text))


def test_a_kept_column_of_windows_text(make: Make) -> None:
    log = logs.read(make(b"t,R,n\n0,1,\xf6\n"), keep_columns=True)
    assert log.extra.to_pydict() == {"n": ["ö"]}
    assert "Latin-1" in log.understood["file"]


def test_damaged_gzip(make: Make) -> None:
    packed = gzip.compress(b"t,R\n" + b"0,1\n" * 1000)
    assert "the gzip file is cut short; copy it again." in refused(make(packed[:-20], "log.csv.gz"))
    assert "not a gzip file, or a damaged one" in refused(make("t,R\n0,1\n", "log.csv.gz"))
    broken = bytearray(packed)
    broken[15] ^= 0xFF
    assert "not a gzip file, or a damaged one" in refused(make(bytes(broken), "log.csv.gz"))


@pytest.mark.parametrize("last", ["x,2,3,4", "Mode,2,3,4", "x,2,,", "Mean,2,3,4,5,6\n2,1002,1,0.1"])
def test_a_row_that_is_no_summary_is_not_left_out(last: str, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(f"{HEADER}0,1000,1,0.1\n1,1001,1,0.1\n{last}\n")
    if last == "x,2,,":  # a word and a whole number alone, as in: Total rows, 1200
        assert len(logs.read(path)) == 2
        return
    with pytest.raises(InputError, match="row 2"):
        logs.read(path)


def test_a_summary_is_told_from_rows_that_begin_with_such_words(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("gain,time_s,range_m\n" + "".join(f"Max,{k},{1000 + k}\n" for k in range(40)))
    assert len(logs.read(path)) == 40


def test_a_drawn_table_that_is_large_is_read_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ftproc.files.reading.formats.content.LARGE", 1000)
    rows = "".join(f"| {k} | {1000 + k} | 1.0 | 0.1 |\n" for k in range(200))
    path = tmp_path / "a.txt"
    path.write_text(f"| time_s | range_m | azimuth_rad | elevation_rad |\n|---|---|---|---|\n{rows}")
    log = logs.read(path)
    assert log.time_s.tolist() == list(range(200))
    assert log.measurement[:, 0].tolist() == [1000.0 + k for k in range(200)]


@pytest.mark.parametrize("stands", [HEADER, "# the wind has turned\n", "# a, b, c, d\n"])
@pytest.mark.parametrize("place", [1, 3, 9, 15, 30])
def test_names_that_come_again_and_comments_cost_no_row(make: Make, place: int, stands: str) -> None:
    """Among the first lines, by which the table is found, as well as later."""
    rows = [f"{k},{1000 + k},0.5,0.25\n" for k in range(40)]
    log = logs.read(make(HEADER + "".join([*rows[:place], stands, *rows[place:]])))
    assert log.time_s.tolist() == list(range(40))


@pytest.mark.parametrize("between", ["Flight 12, continued\n\n{names}\n", "; lost lock\n", '"lost lock"\n', "=====\n"])
@pytest.mark.parametrize("row", [5, 100, 150])
def test_lines_among_the_rows_below_a_title_lose_none(tmp_path: Path, between: str, row: int) -> None:
    names = "Time (s),Range (m),Azimuth (deg),Elevation (deg)"
    rows = [f"{k / 10},{5000 + 3 * k},{30 + 0.05 * k},12\n" for k in range(250)]
    text = f"Flight 12\n\n{names}\n{''.join(rows[:row])}{between.format(names=names)}{''.join(rows[row:])}"
    (tmp_path / "a.csv").write_text(text)
    log = logs.read(tmp_path / "a.csv")
    np.testing.assert_allclose(log.time_s, np.arange(250) / 10)
    np.testing.assert_allclose(log.measurement[:, 0], 5000 + 3 * np.arange(250))
