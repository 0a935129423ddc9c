"""What the guide shows in Python runs as it stands, and pandas and pyarrow give the same."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

import ftproc
from ftproc.files.writing import flights

GUIDE = Path(ftproc.__file__).with_name("README.md")


def test_python_section_runs(tmp_path, monkeypatch, capsys):
    (code,) = re.findall(r"```python\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)
    monkeypatch.chdir(tmp_path)
    flights.write_log(ftproc.simulate("zuo2021-outliers", seed=3).log, "flight.csv")
    made = {}
    exec(compile(code, "README.md", "exec"), made)
    assert list(made["frame"].columns) == made["table"].column_names
    np.testing.assert_array_equal(made["frame"]["x_m"], ftproc.filter_log("flight.csv").state[:, 0])
    assert len(made["figure"].data) > 3
    assert (tmp_path / "flight.html").stat().st_size > 1_000_000
    printed = capsys.readouterr().out
    assert "Name: time_s" in printed
    assert 0 < float(printed.splitlines()[-1]) < 5


def test_files_tables_and_frames_give_the_same(tmp_path):
    import pyarrow.csv

    file = tmp_path / "flight.csv"
    flights.write_log(ftproc.simulate("zuo2021-outliers", seed=3).log, file)
    table = pyarrow.csv.read_csv(file)  # older pandas reads a CSV file to the last bit but one
    found = [ftproc.filter_log(source) for source in (file, table.to_pandas(), table)]
    for other in found[1:]:
        np.testing.assert_array_equal(other.state, found[0].state)
        np.testing.assert_array_equal(other.outlier, found[0].outlier)


def test_report_from_records_and_files(tmp_path):
    flight = ftproc.simulate("zuo2021-outliers", seed=3)
    trajectory = ftproc.filter_log(flight.log)
    from ftproc.files.writing import trajectories

    trajectories.write(trajectory, tmp_path / "t.parquet")
    flights.write_truth(flight.truth, tmp_path / "truth.csv")
    ftproc.write_report(tmp_path / "t.parquet", tmp_path / "read.html", tmp_path / "truth.csv")
    ftproc.write_report(trajectory, tmp_path / "made.html")
    assert 'data-figure="errors"' in (tmp_path / "read.html").read_text()
    assert 'data-figure="residuals"' in (tmp_path / "made.html").read_text()
