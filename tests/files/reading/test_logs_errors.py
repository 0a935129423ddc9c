"""Every sentence a user may see about a log: the file, the row, the column, what is wrong and the cure."""

import gzip
import os
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pytest

from ftproc.errors import FtprocError, InputError, UsageError
from ftproc.files.reading import logs
from ftproc.files.writing import flights
from tests.files.conftest import Make

HEADER = "time_s,range_m,azimuth_rad,elevation_rad\n"
CURE = "Correct the cell, or leave it empty if there was no reading."


def refused(path: object, **options: object) -> str:
    with pytest.raises(InputError) as caught:
        logs.read(path, **options)  # type: ignore[arg-type]
    sentence = str(caught.value)
    assert sentence.startswith(f"{path}: " if isinstance(path, str | Path) else "<table>: ")
    assert "\n" not in sentence
    return sentence


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
    sentence = refused(make(HEADER + rows + "1,?,1,1\n" + rows))
    assert 'row 200000 (the first data row is 0), column "range_m": "?"' in sentence


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('t,R\n0,"1,5"\n', '"1,5" is not a number with a decimal point; expected a range in m. Write points'),
        ("t\tR\n0\t1,5\n", "Write points, or separate the cells with semicolons."),
        ("t,R\n0,5,1,5\n", "has 4 cells where the header has 2. If these are decimal commas, write decimal points"),
        (
            "t;R\n0;999,5\n1;1.000\n",
            'row 1 (the first data row is 0), column "R": "1.000" is not a number with a decimal comma',
        ),
        ("t;R\n0;1.000,5\n", '"1.000,5" is not a number'),
        ("t,R\n12:34:56.5,1\n", "A time of day needs its date: 2024-05-31T12:34:56.789Z, or count seconds."),
        (
            "t,R\n2024-05-31T00:00:00Z,1\nx,2\n",
            'row 1 (the first data row is 0), column "t": "x" is not a timestamp with time',
        ),
        ("t,R\n2024-05-31T00:00:00Z,1\n2024-05-31T00:00:01,2\n", "not a timestamp with time zone like the first one"),
        ("t,R\n2024-05-31T00:00:00,1\n2024-05-31T00:00:01Z,2\n", "not a timestamp without time zone like the first"),
        ("t,R\n2024-05-31T00:00:00,1\n17.5,2\n", '"17.5" is not a timestamp'),
        ("t,R\n2024-13-31T00:00:00,1\n", '"2024-13-31T00:00:00" is not a number; expected a time in s or an ISO-8601'),
        (b"t,R\n0,1\xb0\n", 'column "R": "1\ufffd" is not a number'),
    ],
)
def test_what_looks_like_something_else_is_explained(make: Make, text: str | bytes, expected: str) -> None:
    assert expected in refused(make(text))


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
        ("time_s range_m\n0 1\n", 'the header line "time_s range_m" has no separator; separate the cells with commas'),
        (
            "a,b\n0,1\n",
            "no time column (expected time_s or time or t). Its columns are: a, b. Name the right ones with "
            "--columns time=NAME,range=NAME,elevation=NAME.",
        ),
        ("t,R\n".encode("utf-16"), "this is UTF-16 text; save it as UTF-8 (iconv -f UTF-16 -t UTF-8)."),
        ("t,R\n".encode("utf-16-be"), "this is not text in UTF-8 (it has NUL bytes)"),
        ("t,R,Höhe\n0,1,2\n".encode("latin-1"), "the header line is not UTF-8 (Latin-1 or Windows text?)"),
        (b"PAR1....", "this is a Parquet file; give it the name .parquet."),
        (b"PK\x03\x04....", "this is a zip archive or an Excel workbook"),
    ],
)
def test_text_that_is_no_log(make: Make, text: str | bytes, expected: str) -> None:
    assert expected in refused(make(text))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "t,A,E\n0,180,0.1\n",
            "it looks like degrees (or gon); use --units azimuth=deg (and elevation=deg if that is so too).",
        ),
        (
            "t,A,E\n0,1,45\n",
            '"E" lies beyond 45 rad, which is no elevation: it looks like degrees (or gon); use --units elevation=deg',
        ),
        ("t,A\n0,380\n", "it looks like gradians (gon); use --units azimuth=grad"),
        (
            "t,A\n0,100\n1,200\n2,390\n",
            'half of column "A" lies beyond 200 rad, which is no azimuth: it looks like grad',
        ),
        ("t,A\n0,100\n1,200\n2,350\n", "it looks like degrees"),
        ("t,A\n0,3200\n", "it looks like mils; use --units azimuth=mil"),
        ("t,el_deg\n0,800\n", "lies beyond 800 deg, which is no elevation: it looks like mils"),
        ("t,A\n0,1e9\n", "it looks like another unit; use --units azimuth=UNIT"),
        ("t,azimuth_rad\n0,180\n", "use --columns azimuth=azimuth_rad --units azimuth=deg."),
        ("t,A\n0,\n1,-180\n2,1\n3,-170\n", "it looks like degrees"),
    ],
)
def test_angles_in_a_mistaken_unit(make: Make, text: str, expected: str) -> None:
    assert expected in refused(make(text))


def test_the_cures_for_a_mistaken_unit_work(make: Make) -> None:
    bare, stated = make("t,A\n0,180\n", "a.csv"), make("t,azimuth_rad\n0,180\n", "b.csv")
    assert logs.read(bare, units="azimuth=deg").measurement[0, 1] == pytest.approx(3.14159265358979)
    assert logs.read(bare, units="azimuth=rad").measurement[0, 1] == 180
    options = {"columns": "azimuth=azimuth_rad", "units": "azimuth=deg"}
    assert logs.read(stated, **options).measurement[0, 1] == pytest.approx(3.14159265358979)  # type: ignore[arg-type]


def test_a_few_wild_angles_are_no_mistaken_unit(make: Make) -> None:
    log = logs.read(make("t,A,E\n0,1,1\n1,400,80\n2,12,1.5\n"))
    assert log.measurement[1, 1:].tolist() == [400, 80]


def test_files_that_cannot_be_opened(tmp_path: Path, make: Make) -> None:
    assert refused(tmp_path / "none.csv").endswith("none.csv: there is no such file.")
    assert refused(tmp_path / "none.parquet").endswith("there is no such file.")
    (tmp_path / "dir.csv").mkdir()
    assert "this is a directory; name a file in it." in refused(tmp_path / "dir.csv")
    assert "supported are .csv, .csv.gz, .parquet, .feather." in refused(make("t,R\n0,1\n", "log.xlsx"))
    assert "the file is empty" in refused(make(b"", "log.parquet"))
    assert "the file is empty" in refused(make(b"", "log.csv.gz"))


def test_no_permission_and_other_faults_of_the_system(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    path = make("t,R\n0,1\n")

    def fail(error: OSError) -> object:
        def open_(*_: object, **__: object) -> object:
            raise error

        return open_

    monkeypatch.setattr(Path, "open", fail(PermissionError(13, "Permission denied")))
    assert "no permission to read it." in refused(path)
    monkeypatch.setattr(Path, "open", fail(OSError(5, "Input/output error")))
    assert "cannot be read (Input/output error); check the file." in refused(path)


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may read everything")
def test_a_file_that_may_not_be_read(make: Make) -> None:
    path = make("t,R\n0,1\n")
    path.chmod(0)
    assert "no permission to read it." in refused(path)


def test_damaged_gzip(make: Make) -> None:
    packed = gzip.compress(b"t,R\n" + b"0,1\n" * 1000)
    assert "the gzip file is cut short; copy it again." in refused(make(packed[:-20], "log.csv.gz"))
    assert "not a gzip file, or a damaged one" in refused(make("t,R\n0,1\n", "log.csv.gz"))
    broken = bytearray(packed)
    broken[15] ^= 0xFF
    assert "not a gzip file, or a damaged one" in refused(make(bytes(broken), "log.csv.gz"))


def test_damaged_parquet(make: Make, tmp_path: Path) -> None:
    path = tmp_path / "log.parquet"
    flights.write_log(logs.read(make("t,R\n" + "".join(f"{k},{k * 1.1}\n" for k in range(5000)))), path)
    whole = path.read_bytes()
    assert "no Parquet file, or one cut short or damaged; copy it again" in refused(make(whole[:-30], "log.parquet"))
    assert "no Parquet file" in refused(make("t,R\n0,1\n", "log.parquet"))
    middle = whole[:10] + b"\xff" * 2000 + whole[2010:]
    assert "no Parquet file" in refused(make(middle, "log.parquet"))


def test_words_in_a_parquet_or_pandas_column() -> None:
    table = pa.table({"t": [0.0, 1.0, 2.0], "R": ["1", None, "far"]})
    assert 'row 2 (the first data row is 0), column "R": "far" is not a number' in refused(table)
    frame = pd.DataFrame({"t": [0.0, 1.0], "R": [1.5, "far"]})
    assert 'row 1 (the first data row is 0), column "R": "far" is not a number' in refused(frame)
    assert '"True" is not a number' in refused(pa.table({"t": [0.0], "R": [True]}))
    assert "is not finite" in refused(pa.table({"t": [0.0, 1.0], "R": [1.0, float("-inf")]}))
    assert "there are column names but no rows" in refused(frame.iloc[:0])
    assert "expected a path, a pandas DataFrame or a pyarrow Table, not int." in refused(5)


def test_kept_columns_must_be_told_apart(make: Make) -> None:
    sentence = refused(make("t,R,n,n\n0,1,2,3\n"), keep_columns=True)
    assert 'column "n" is there twice, so both cannot be kept' in sentence
    assert "leave --keep-columns out" in sentence


def test_a_kept_column_that_is_not_utf8(make: Make) -> None:
    sentence = refused(make(b"t,R,n\n0,1,\xf6\n"), keep_columns=True)
    assert 'column "n" is not UTF-8 text, so it cannot be kept' in sentence


def test_options_that_are_not_understood(make: Make) -> None:
    path = make(HEADER + "0,1,1,1\n")
    for options, expected in (
        ({"azimuth_from": "south"}, '--azimuth-from: "south" is not understood; say x or north.'),
        ({"units": "range=yd"}, '"yd" is not a unit of range'),
        ({"columns": "range"}, '"range" is not QUANTITY=NAME'),
    ):
        with pytest.raises(UsageError) as caught:
            logs.read(path, **options)  # type: ignore[arg-type]
        assert expected in str(caught.value)
        assert isinstance(caught.value, FtprocError)
        assert caught.value.exit_code == 2


@pytest.mark.parametrize("name", ["time", "azimuth_rad"])
def test_a_time_beyond_the_calendar_is_told_wherever_it_stands(name):
    far = pa.array([5, 2**43], pa.timestamp("s"))
    table = pa.table({"time": pa.array([5, 6], pa.timestamp("s")), "range_m": [1.0, 2.0], "azimuth_rad": [0.0, 0.0]})
    with pytest.raises(InputError, match=r"row [01] .the first data row is 0., column") as error:
        logs.read(table.set_column(table.column_names.index(name), name, far))
    assert ("between the years 1 and 9999" in str(error.value)) == (name == "time")


def test_times_that_are_ages_apart_are_told():
    ends = pa.array([-(2**63) + 10**15, 2**63 - 10**15], pa.timestamp("ns"))
    with pytest.raises(InputError, match=r"is not a time of the others' age"):
        logs.read(pa.table({"time": ends, "range_m": [1.0, 2.0]}))
