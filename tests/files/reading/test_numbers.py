"""Cells that are not numbers: the message names the file, the row, the column, the fault and the cure."""

import pandas as pd
import pyarrow as pa
import pytest

from ftproc.files.reading import logs
from tests.files.conftest import Make, refused

HEADER = "time_s,range_m,azimuth_rad,elevation_rad\n"
CURE = "Correct the cell, or leave it empty if there was no reading."


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        ("0,1,1,1\n\n1,12x4,1,1\n", 'row 1 (the first data row is 0), column "range_m": "12x4" is not a number'),
        ("0,1,1,1\n,,,\n1,1,1,abc\n", 'row 2 (the first data row is 0), column "elevation_rad": "abc" is not a number'),
        ("0,1,1,1\n1,1,1.2.3,1\n", "expected an azimuth in rad"),
        ("0,1,true,1\n", '"true" is not a number'),
        ("0,1,1_000,1\n", '"1_000" is not a number'),
        ("0,1,2024-05-31,1\n", '"2024-05-31" is not a number'),
        (
            "0,inf,1,1\n",
            'row 0 (the first data row is 0), column "range_m": "inf" is not finite; expected a range in m',
        ),
        ("0,1,1,1\n1,-Infinity,1,x\n", '"-inf" is not finite'),
        ("0,1e999,1,1\n", '"inf" is not finite'),
        ("inf,1,1,1\n", 'column "time_s": "inf" is not finite; expected a time in s or an ISO-8601 timestamp'),
        ("0,1,1,1\nx,1,1,1\n", 'row 1 (the first data row is 0), column "time_s": "x" is not a number'),
    ],
)
def test_a_cell_that_is_no_number(make: Make, rows: str, expected: str) -> None:
    sentence = refused(make(HEADER + rows))
    assert expected in sentence
    assert CURE in sentence


def test_a_bad_cell_far_down_a_long_file(make: Make) -> None:
    rows = "0.25,1000,1,1\n" * 200_000
    sentence = refused(make(HEADER + rows + "1,far,1,1\n" + rows))
    assert 'row 200000 (the first data row is 0), column "range_m": "far"' in sentence


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('t,R\n0,"1,5"\n', '"1,5" is not a number with a decimal point; expected a range in m. Write points'),
        ("t,R\n0,5,1,5\n", "has 4 cells where the header has 2. If these are decimal commas, write decimal points"),
        (
            "t;R\n0;999,5\n1;1.000\n",
            'row 1 (the first data row is 0), column "R": "1.000" is not a number with a decimal comma',
        ),
        ("t;R\n0;1.00,5\n", '"1.00,5" is not a number'),
        ("t,R\n12:34:56.5,1\n12:34:61,1\n", '"12:34:61" is not a possible time of day like the first one, 12:34:56.5'),
        ("t,R\n0,12:34:56\n", '"12:34:56" is not a number'),
        (
            "t,R\n2024-05-31T00:00:00Z,1\nx,2\n",
            'row 1 (the first data row is 0), column "t": "x" is not a timestamp with time',
        ),
        ("t,R\n2024-05-31T00:00:00Z,1\n2024-05-31T00:00:01,2\n", "not a timestamp with time zone like the first one"),
        ("t,R\n2024-05-31T00:00:00,1\n2024-05-31T00:00:01Z,2\n", "not a timestamp without time zone like the first"),
        ("t,R\n2024-05-31T00:00:00,1\n17.5,2\n", '"17.5" is not a timestamp'),
        ("t,R\n2024-13-31T00:00:00,1\n", '"2024-13-31T00:00:00" is not a number; expected a time in s or an ISO-8601'),
        (b"t,R\n0,1\xb0\n", 'column "R": "1°" is not a number'),
    ],
)
def test_what_looks_like_something_else_is_explained(make: Make, text: str | bytes, expected: str) -> None:
    assert expected in refused(make(text))


def test_words_in_a_parquet_or_pandas_column() -> None:
    table = pa.table({"t": [0.0, 1.0, 2.0], "R": ["1", None, "far"]})
    assert 'row 2 (the first data row is 0), column "R": "far" is not a number' in refused(table)
    frame = pd.DataFrame({"t": [0.0, 1.0], "R": [1.5, "far"]})
    assert 'row 1 (the first data row is 0), column "R": "far" is not a number' in refused(frame)
    assert '"True" is not a number' in refused(pa.table({"t": [0.0], "R": [True]}))
    assert "is not finite" in refused(pa.table({"t": [0.0, 1.0], "R": [1.0, float("-inf")]}))
    assert "there are column names but no rows" in refused(frame.iloc[:0])
    assert "expected a path, a pandas DataFrame or a pyarrow Table, not int." in refused(5)


@pytest.mark.parametrize("other", [(".", ","), (",", ".")])
def test_marks_between_thousands_are_known_by_the_decimals_of_other_columns(make: Make, other: tuple[str, str]) -> None:
    thousand, decimal = other
    rows = [f"0.{k};{8200 + k:,};0.50{k}1;0.30{k}1" for k in range(9)]
    text = "\n".join(rows).replace(".", "!").replace(",", thousand).replace("!", decimal)
    log = logs.read(make(HEADER.replace(",", ";") + text))
    assert log.measurement[:, 0].tolist() == [8200 + k for k in range(9)]
    assert log.time_s[1] == 0.1
    assert f'"range_m" has marks between thousands ("8{thousand}200")' in " ".join(log.remarks)


def test_marks_that_both_stand_for_decimals_elsewhere_are_asked_about(make: Make) -> None:
    rows = "\n".join(f"0.{k};8.20{k};0,50{k}1;0,30{k}1" for k in range(9))
    assert "Write all decimals with the same mark" in refused(make(HEADER.replace(",", ";") + rows))


def test_points_that_surely_stand_for_decimals_stay(make: Make) -> None:
    rows = "\n".join(f"0,{k};820{k}.5;0,50{k}1;0,30{k}1" for k in range(9))
    log = logs.read(make(HEADER.replace(",", ";") + rows))
    assert log.measurement[0, 0] == 8200.5
