"""A stream that is killed again and again, while its log grows: no row is lost, and none is there twice."""

from __future__ import annotations

import contextlib
import os
import random
import subprocess
import threading
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.faults.batches import PROGRAM
from tests.trust import cases
from tests.trust.streams import flight, lines

KILLS = int(os.environ.get("FTPROC_KILLS", "4"))  # 50 of them take a few minutes
RATE = 30.0  # rows in a second


def grow(log: Path, ended: threading.Event) -> None:
    rows = lines(flight().log.time_s, np.arange(len(flight().log)))
    with log.open("w", buffering=1) as file:
        file.write(f"{cases.HEADER}\n")
        for row in rows:
            file.write(f"{row}\n")
            time.sleep(1 / RATE)
    ended.set()


@pytest.mark.parametrize("output", ["out.csv", "out.parquet"])
def test_no_row_is_lost_or_there_twice(tmp_path: Path, output: str) -> None:
    log, ended, draw = tmp_path / "log.csv", threading.Event(), random.Random(1)
    threading.Thread(target=grow, args=(log, ended), daemon=True).start()
    command = [PROGRAM, "filter", "--follow", "log.csv", "--lag", "0.5", "-o", output, "--state", "state"]
    rows = len(flight().log)
    for _ in range(KILLS):
        with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.DEVNULL) as process:
            time.sleep(draw.uniform(0.5, 3.0))
            process.kill()
    ended.wait(120)
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.DEVNULL) as process:
        try:
            for _ in range(600):
                time.sleep(0.1)
                with contextlib.suppress(OSError):  # read while it grows
                    if len(read(tmp_path / output)) == rows:
                        break
        finally:
            process.terminate()
    found = read(tmp_path / output)
    assert found["row"].tolist() == list(range(rows))
    assert process.returncode == 0
    assert not list(tmp_path.glob(".*")), "a hidden file is left"


def read(path: Path) -> pd.DataFrame:
    return pd.read_parquet(path) if path.suffix == ".parquet" else pd.read_csv(path)
