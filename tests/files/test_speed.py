"""Reading starts and runs fast."""

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow as pa

from ftproc.files.reading import logs
from ftproc.files.writing import tables


def test_importing_readers_and_writers_is_cheap() -> None:
    code = (
        "import sys\n"
        "from ftproc.files.reading import logs, trajectories, truth\n"
        "from ftproc.files.writing import atomic, flights, maps, tables, trajectories\n"
        "assert not {'pandas', 'pyarrow', 'numba', 'scipy', 'click'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_million_rows_are_read_fast(tmp_path: Path) -> None:
    """About a second of processor time; the bound only catches work done row by row in Python."""
    n = 1_000_000
    rng = np.random.default_rng(0)
    names = ("time_s", "range_m", "azimuth_rad", "elevation_rad")
    table = pa.table(dict(zip(names, (np.arange(n) / 20, *rng.normal(size=(3, n))), strict=True)))
    tables.write_table(table, tmp_path / "log.csv")
    start = time.process_time()
    log = logs.read(tmp_path / "log.csv")
    assert time.process_time() - start < 5
    assert np.array_equal(log.measurement[:, 0], table["range_m"].to_numpy())


def test_a_small_csv_is_read_without_pandas(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t,R\n0,1\n1,\n")
    code = (
        "import sys\n"
        "from ftproc.files.reading import logs\n"
        f"assert logs.read({str(path)!r}).rows_in_file == 2\n"
        "assert 'pandas' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
