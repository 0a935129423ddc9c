"""A few rows as text, as a stream writes them, are those that a whole file has."""

import json
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pytest

from ftproc.files.writing import csvtext, trajectories
from ftproc.records import Trajectory

DRAWN = np.random.default_rng(5)


def a_few(count: int, extra: pa.Table | None = None) -> Trajectory:
    """Rows of numbers of every size, with some missing and some infinite."""

    def some(*shape: int) -> np.ndarray:
        drawn = DRAWN.normal(size=(count, *shape)) * 10.0 ** DRAWN.integers(-320, 300, (count, *shape))
        drawn = np.where(DRAWN.random(drawn.shape) < 0.3, np.round(drawn), drawn)
        return np.where(DRAWN.random(drawn.shape) < 0.1, DRAWN.choice([np.nan, np.inf, -np.inf, -0.0]), drawn)

    label = DRAWN.integers(0, 4, (count, 3)).astype(np.uint8)
    return Trajectory(
        "live", np.arange(count), some(), some(3), some(9), some(9), some(3), label, some(), some(6), extra=extra
    )


def extras(count: int) -> list[pa.Table | None]:
    numbers = {"rate": DRAWN.normal(size=count), "outlier_rate": pa.array(np.zeros(count, np.uint8))}
    missing = {"rate": pa.array([None, *DRAWN.normal(size=count - 1)]), "n": pa.array([None, *range(count - 1)])}
    return [None, pa.table(numbers), pa.table(missing), pa.table({"target": ["=A1"] * count})]


@pytest.mark.parametrize("count", [1, 7, csvtext.FEW, csvtext.FEW + 1])
def test_a_few_rows_are_the_text_of_the_whole_table(count: int) -> None:
    for extra in extras(count):
        part = a_few(count, extra)
        whole = b"".join(csvtext.pieces(trajectories.to_table(part)))
        header, rows = whole.split(b"\n", 1)
        assert trajectories.as_csv(part, with_header=False) == rows
        assert trajectories.as_csv(part, with_header=True) == whole
        assert header.startswith(b"row,time_s,")


def test_objects_of_a_few_rows_are_those_of_the_whole_table() -> None:
    for extra in extras(3):
        part = replace(a_few(3, extra), metadata={"frame": "enu"})
        table = trajectories.to_table(part).to_pylist()
        found = trajectories.as_json_lines(part).splitlines()
        assert [json.loads(line) for line in found] == [trajectories.plain(row) for row in table]
