"""Tables out."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from ftproc.errors import OutputError
from ftproc.files.reading.formats.tables import read_header
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
    n = 3 * csvtext._CELLS_AT_ONCE // 4
    tables.write_table(pa.table({"a,b": np.arange(n)}), tmp_path / "out.csv")
    lines = (tmp_path / "out.csv").read_text().splitlines()
    assert lines[0] == '"a,b"'
    assert lines[1:] == [str(k) for k in range(n)]


@pytest.mark.parametrize("kind", [".csv", ".csv.gz", ".parquet", ".feather"])
def test_very_many_columns(tmp_path, kind):
    """As many cells as a block of rows of a narrow table cannot hold; types are kept."""
    width = 4_000
    columns = {f"c{k}": pa.array(range(k, k + 5), pa.int64() if k % 2 else pa.float64()) for k in range(width)}
    path = tmp_path / f"wide{kind}"
    tables.write_table(pa.table(columns), path)
    header = read_header(path)
    assert header.names == list(columns)
    read = header.load([0], list(range(1, width)))
    assert read.num_rows == 5
    assert read.column(width - 1).to_pylist() == list(range(width - 1, width + 4))
    assert pa.types.is_int64(read.column(width - 1).type)
