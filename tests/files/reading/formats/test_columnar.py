"""Parquet and Feather: types as other programs write them, and damaged files."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ftproc.files.reading import logs
from ftproc.files.writing import flights, tables
from tests.files.conftest import Make, refused

NAN = np.nan


def test_parquet_types_of_other_programs(tmp_path: Path) -> None:
    table = pa.table(
        {
            "time": pa.array([0, 1500, None], pa.duration("ms")),
            "R": pa.array([1, None, 3], pa.int16()),
            "A": pa.array([0.5, 1.5, None], pa.float32()),
            "E": pa.array(["0.25", " null ", "1e-1"]).dictionary_encode(),
        }
    )
    pq.write_table(table, tmp_path / "log.PARQUET")
    log = logs.read(tmp_path / "log.PARQUET")
    assert log.time_s.tolist() == [0, 1.5]
    assert np.array_equal(log.measurement, [[1, 0.5, 0.25], [NAN, 1.5, NAN]], equal_nan=True)
    assert log.rows_without_time == (2,)


def test_damaged_parquet(make: Make, tmp_path: Path) -> None:
    path = tmp_path / "log.parquet"
    flights.write_log(logs.read(make("t,R\n" + "".join(f"{k},{k * 1.1}\n" for k in range(5000)))), path)
    whole = path.read_bytes()
    assert "not a Parquet file, or one cut short or damaged; copy it again" in refused(make(whole[:-30], "log.parquet"))
    assert "not a Parquet file" in refused(make("t,R\n0,1\n", "log.parquet"))
    middle = whole[:10] + b"\xff" * 2000 + whole[2010:]
    assert "not a Parquet file" in refused(make(middle, "log.parquet"))


def test_damaged_feather(tmp_path: Path) -> None:
    path = tmp_path / "log.feather"
    tables.write_table(pa.table({"t": [0.0], "R": [1.0]}), path)
    for data in (path.read_bytes()[:200], b"FEA1 of old", b"time_s,x_m\n"):
        path.write_bytes(data)
        assert "not a Feather file (version 2) or Arrow file, or one cut short or damaged;" in refused(path)
