"""Tables out, and how cheap and fast the reading is."""

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from ftproc.errors import OutputError
from ftproc.files.reading import logs
from ftproc.files.writing import tables


def test_what_csv_cannot_hold_is_said_and_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"cannot be written as CSV .*give the output the name \.parquet"):
        tables.write_table(pa.table({"a": [[1], [2]]}), tmp_path / "out.csv")
    assert list(tmp_path.iterdir()) == []


def test_kinds_of_file_by_name() -> None:
    assert [tables.kind_of(name) for name in ("-", "a.csv", "A.CSV.GZ", "a.b.parquet")] == [
        ".csv",
        ".csv",
        ".csv.gz",
        ".parquet",
    ]
    with pytest.raises(OutputError, match=r"out\.xls: .*end the name in \.csv, \.csv\.gz, \.parquet"):
        tables.kind_of("out.xls")


def test_names_with_commas_are_quoted_and_many_rows_written_in_pieces(tmp_path: Path) -> None:
    n = 3 * tables._ROWS_AT_ONCE // 2
    tables.write_table(pa.table({"a,b": np.arange(n)}), tmp_path / "out.csv")
    lines = (tmp_path / "out.csv").read_text().splitlines()
    assert lines[0] == '"a,b"'
    assert lines[1:] == [str(k) for k in range(n)]


def test_importing_the_readers_is_cheap() -> None:
    code = (
        "import sys\n"
        "from ftproc.files import atomic, logs, schema, tables, trajectories, truth, writing\n"
        "assert not {'pandas', 'pyarrow', 'numba', 'scipy', 'click'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_million_rows_are_read_fast(tmp_path: Path) -> None:
    """About half a second on two cores; the bound only catches work done row by row in Python."""
    n = 1_000_000
    rng = np.random.default_rng(0)
    names = ("time_s", "range_m", "azimuth_rad", "elevation_rad")
    table = pa.table(dict(zip(names, (np.arange(n) / 20, *rng.normal(size=(3, n))), strict=True)))
    tables.write_table(table, tmp_path / "log.csv")
    start = time.perf_counter()
    log = logs.read(tmp_path / "log.csv")
    assert time.perf_counter() - start < 5
    assert np.array_equal(log.measurement[:, 0], table["range_m"].to_numpy())
