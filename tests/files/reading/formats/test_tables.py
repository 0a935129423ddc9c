"""Sources: files, tables in memory, and what cannot be opened."""

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

from ftproc.files.reading import logs
from tests.files.conftest import Make, refused

NAN = np.nan


def test_a_data_frame_and_a_table_are_logs_too() -> None:
    frame = pd.DataFrame({"t": [1, 0, 2], "R": [1.0, None, 3.0], 7: ["a", "b", "c"]}, index=[9, 9, 9])
    for source in (frame, pa.table({"t": [1, 0, 2], "R": [1.0, None, 3.0]})):
        log = logs.read(source)
        assert log.name == "<table>"
        assert log.row.tolist() == [1, 0, 2]
        assert np.array_equal(log.measurement[:, 0], [NAN, 1, 3], equal_nan=True)
    moments = pd.DataFrame({"time": pd.to_datetime(["2024-05-31T01:00:00.25", "NaT"]), "R": ["5", "6"]})
    assert logs.read(moments).time_s.tolist() == [3600.25]


def test_files_that_cannot_be_opened(tmp_path: Path, make: Make) -> None:
    assert refused(tmp_path / "none.csv").endswith("none.csv: there is no such file.")
    assert refused(tmp_path / "none.parquet").endswith("there is no such file.")
    (tmp_path / "dir.csv").mkdir()
    assert "this is a directory; name a file in it." in refused(tmp_path / "dir.csv")
    assert "not an Excel workbook (.xlsx), or a damaged one" in refused(make("t,R\n0,1\n", "log.xlsx"))
    assert 'did you mean "log.xlsx"?' in refused(tmp_path / "lgo.xlsx")
    assert "this is a station file: ftproc filter LOG --config" in refused(make("", "a.toml"))
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
