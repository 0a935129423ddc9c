"""Tables out."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from ftproc.errors import OutputError
from ftproc.files.writing import csvtext, tables


def test_a_column_that_csv_cannot_hold_is_refused_and_leaves_no_file(tmp_path: Path) -> None:
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
    n = 3 * csvtext._ROWS_AT_ONCE // 2
    tables.write_table(pa.table({"a,b": np.arange(n)}), tmp_path / "out.csv")
    lines = (tmp_path / "out.csv").read_text().splitlines()
    assert lines[0] == '"a,b"'
    assert lines[1:] == [str(k) for k in range(n)]
