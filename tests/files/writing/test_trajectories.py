"""Trajectories out and back: columns, types, metadata, stretches, and what fails half way."""

import errno
import gzip
import io
import itertools
import json
import os
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from ftproc.errors import InputError, OutputError, UsageError
from ftproc.files import layout
from ftproc.files.reading import trajectories
from ftproc.files.writing.trajectories import to_table, write_parts
from ftproc.files.writing.trajectories import write as write_trajectory
from ftproc.records import FloatArray, Trajectory

PROMISED = [
    "row",
    "time_s",
    "range_m",
    "azimuth_rad",
    "elevation_rad",
    "x_m",
    "y_m",
    "z_m",
    "vx_mps",
    "vy_mps",
    "vz_mps",
    "ax_mps2",
    "ay_mps2",
    "az_mps2",
    "sigma_x_m",
    "sigma_y_m",
    "sigma_z_m",
    "sigma_vx_mps",
    "sigma_vy_mps",
    "sigma_vz_mps",
    "sigma_ax_mps2",
    "sigma_ay_mps2",
    "sigma_az_mps2",
    "sigma_range_m",
    "sigma_azimuth_rad",
    "sigma_elevation_rad",
    "outlier_range",
    "outlier_azimuth",
    "outlier_elevation",
    "nis",
    "correction_x_m",
    "correction_y_m",
    "correction_z_m",
    "correction_vx_mps",
    "correction_vy_mps",
    "correction_vz_mps",
]
METADATA = {"version": "0.1", "frame": "local", "counts": {"rows": 3}, "noise": [1.0, 0.001], "name": "Flüg.csv"}
FIELDS = ("row", "time_s", "measurement", "state", "sigma", "measurement_sigma", "outlier", "nis", "correction")


def some(n: int = 50, seed: int = 0) -> Trajectory:
    rng = np.random.default_rng(seed)
    state = rng.normal(size=(n, 9)) * 10.0 ** rng.integers(-12, 12, (n, 9))
    state[n // 2, 6:] = np.nan
    return Trajectory(
        name="a",
        row=rng.permutation(n),
        time_s=np.sort(rng.uniform(0, 100, n)),
        measurement=rng.normal(size=(n, 3)),
        state=state,
        sigma=rng.random((n, 9)),
        measurement_sigma=rng.random((n, 3)),
        outlier=rng.integers(0, 4, (n, 3)).astype(np.uint8),
        nis=np.where(rng.random(n) < 0.2, np.nan, rng.random(n)),
        correction=rng.normal(size=(n, 6)),
        metadata=METADATA,
    )


def assert_same(one: Trajectory, other: Trajectory) -> None:
    for name in FIELDS:
        a, b = getattr(one, name), getattr(other, name)
        assert (a.shape, a.dtype) == (b.shape, b.dtype), name
        assert np.array_equal(a, b, equal_nan=a.dtype.kind == "f"), name


def test_columns_and_types_are_as_promised() -> None:
    table = to_table(some())
    assert table.column_names == PROMISED == list(layout.TRAJECTORY)
    for field in table.schema:
        expected = (
            pa.int64() if field.name == "row" else pa.uint8() if field.name.startswith("outlier") else pa.float64()
        )
        assert field.type == expected, field.name
    assert sum(column.null_count for column in table.columns) == 0


def test_each_number_stands_in_the_column_of_its_name() -> None:
    n = 2
    numbers = iter(range(1, 40))

    def block(width: int) -> FloatArray:
        return np.tile([float(next(numbers)) for _ in range(width)], (n, 1))

    trajectory = replace(
        some(n),
        measurement=block(3),
        state=block(9),
        sigma=block(9),
        measurement_sigma=block(3),
        outlier=np.tile(np.array([1, 2, 3], np.uint8), (n, 1)),
        nis=block(1)[:, 0],
        correction=block(6),
    )
    row = to_table(trajectory).slice(1, 1).to_pylist()[0]
    names = [name for name in PROMISED[2:] if not name.startswith("outlier")]
    assert [row[name] for name in names] == list(range(1, 32))
    assert [row[f"outlier_{name}"] for name in ("range", "azimuth", "elevation")] == [1, 2, 3]


@pytest.mark.parametrize(
    "name", ["out.parquet", "out.feather", "out.csv", "out.trajectory.csv", "out.csv.gz", "OUT.CSV"]
)
def test_what_is_written_comes_back_with_its_metadata(tmp_path: Path, name: str) -> None:
    original = some()
    write_trajectory(original, tmp_path / name)
    back = trajectories.read(tmp_path / name)
    assert_same(back, original)
    assert back.metadata == METADATA
    assert (back.name, back.extra) == (str(tmp_path / name), None)


def test_parquet_carries_the_metadata_and_pandas_reads_it(tmp_path: Path) -> None:
    path = tmp_path / "out.parquet"
    write_trajectory(some(), path)
    assert json.loads(pq.read_schema(path).metadata[b"ftproc"]) == METADATA
    assert list(pd.read_parquet(path).columns) == PROMISED
    assert [entry.name for entry in tmp_path.iterdir()] == ["out.parquet"]


def test_csv_has_a_sidecar_and_empty_cells_for_nan(tmp_path: Path) -> None:
    write_trajectory(some(3), tmp_path / "flight.trajectory.csv")
    assert json.loads((tmp_path / "flight.trajectory.json").read_text("utf-8")) == METADATA
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["flight.trajectory.csv", "flight.trajectory.json"]
    lines = (tmp_path / "flight.trajectory.csv").read_text().splitlines()
    assert lines[0].split(",") == PROMISED
    assert lines[2].split(",")[11:14] == ["", "", ""]
    assert "nan" not in "".join(lines[1:]).lower()


def test_where_the_sidecar_stands() -> None:
    assert layout.sidecar("a/out.csv") == Path("a/out.json")
    assert layout.sidecar(Path("out.v2.csv.gz")) == Path("out.v2.json")
    assert layout.sidecar("out.parquet") is None
    assert layout.sidecar("-") is None


@pytest.mark.parametrize("name", ["out.parquet", "out.feather", "out.csv", "out.csv.gz"])
def test_the_same_trajectory_gives_the_same_bytes_at_any_time(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for directory, now in (("a", 1.0e9), ("b", 1.5e9)):
        (tmp_path / directory).mkdir()
        monkeypatch.setattr(time, "time", lambda now=now: now)
        write_trajectory(some(seed=3), tmp_path / directory / name)
    for file in (tmp_path / "a").iterdir():
        assert file.read_bytes() == (tmp_path / "b" / file.name).read_bytes()


def test_standard_streams_carry_csv(monkeypatch: pytest.MonkeyPatch, capfdbinary: pytest.CaptureFixture[bytes]) -> None:
    write_trajectory(some(), "-")
    written = capfdbinary.readouterr().out
    assert written.startswith(b"row,time_s,range_m,")
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(written)))
    back = trajectories.read("-")
    assert_same(back, some())
    assert (back.name, back.metadata) == ("<stdin>", {})


def test_extra_columns_follow_and_come_back(tmp_path: Path) -> None:
    extra = pa.table({"lat_deg": [1.5, None], "lon_deg": [2.5, 3.5], "note": ["a", "b,c"]})
    original = replace(some(2), extra=extra)
    assert to_table(original).column_names == [*PROMISED, "lat_deg", "lon_deg", "note"]
    for name in ("out.csv", "out.parquet"):
        write_trajectory(original, tmp_path / name)
        back = trajectories.read(tmp_path / name)
        assert_same(back, original)
        assert back.extra is not None
        assert back.extra.to_pydict() == extra.to_pydict()


def test_an_extra_column_may_not_take_the_name_of_an_output_column(tmp_path: Path) -> None:
    with pytest.raises(UsageError) as caught:
        write_trajectory(replace(some(1), extra=pa.table({"x_m": [1.0]})), tmp_path / "out.parquet")
    assert 'the log\'s column "x_m" has the name of an output column' in str(caught.value)
    assert "leave --keep-columns out" in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_metadata_of_numpy_make_becomes_plain_json(tmp_path: Path) -> None:
    metadata: dict[Any, Any] = {
        "a": np.float64(1.5),
        "b": np.array([1, 2]),
        "c": (1, np.nan),
        "d": Path("x"),
        5: True,
        "e": np.inf,
    }
    write_trajectory(replace(some(1), metadata=metadata), tmp_path / "out.csv")
    expected = {"a": 1.5, "b": [1, 2], "c": [1, None], "d": "x", "5": True, "e": None}
    assert json.loads((tmp_path / "out.json").read_text()) == expected


def test_a_sidecar_that_fails_leaves_the_earlier_file(tmp_path: Path) -> None:
    write_trajectory(some(1), tmp_path / "out.csv")
    before = (tmp_path / "out.csv").read_bytes()
    (tmp_path / "out.json").unlink()
    (tmp_path / "out.json").mkdir()
    with pytest.raises(OutputError, match=r"out\.json: this is a directory"):
        write_trajectory(some(9), tmp_path / "out.csv")
    assert (tmp_path / "out.csv").read_bytes() == before
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["out.csv", "out.json"]


def test_a_full_disk_leaves_both_the_earlier_file_and_its_sidecar(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_trajectory(some(1), tmp_path / "out.csv")
    before = {entry.name: entry.read_bytes() for entry in tmp_path.iterdir()}

    def full(_: int) -> None:
        monkeypatch.undo()  # the first flush fails, which is the big file's; the small one would still fit
        raise OSError(errno.ENOSPC, "")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OutputError, match=r"out\.csv: the disk is full"):
        write_trajectory(replace(some(9), metadata={"other": 1}), tmp_path / "out.csv")
    assert {entry.name: entry.read_bytes() for entry in tmp_path.iterdir()} == before


def test_feather_carries_the_metadata_and_pandas_reads_it(tmp_path: Path) -> None:
    path = tmp_path / "out.feather"
    write_trajectory(some(3), path)
    assert list(pd.read_feather(path).columns) == PROMISED
    assert trajectories.read(path).metadata == trajectories.read(to_table(some(3))).metadata != {}
    assert [entry.name for entry in tmp_path.iterdir()] == ["out.feather"]


def pieces(trajectory, edges):
    """Stretches of a trajectory as a long log's come: with the frame as their only metadata."""
    for low, high in itertools.pairwise(edges):
        part = {name: getattr(trajectory, name)[low:high] for name in FIELDS}
        extra = None if trajectory.extra is None else trajectory.extra.slice(low, high - low)
        yield replace(trajectory, **part, extra=extra, metadata={"frame": "local"})


@pytest.mark.parametrize("name", ["out.parquet", "out.csv", "out.csv.gz", "out.feather"])
@pytest.mark.parametrize("extra", [None, pa.table({"lat_deg": np.arange(90.0)}), pa.table({"word": ["a"] * 90})])
def test_stretches_make_the_file_of_the_whole(tmp_path, name, extra):
    whole = replace(some(90), extra=extra)
    calls = []

    def metadata():
        calls.append(1)
        return whole.metadata

    write_parts(pieces(whole, [0, 30, 31, 90]), metadata, tmp_path / name)
    write_trajectory(replace(whole, metadata={"frame": "local", **whole.metadata}), tmp_path / f"whole-{name}")
    one, other = (trajectories.read(tmp_path / n) for n in (name, f"whole-{name}"))
    assert_same(one, other)
    assert one.metadata == other.metadata
    assert one.extra == other.extra
    assert calls == [1]
    if name != "out.feather":
        table = tables_of(tmp_path / name), tables_of(tmp_path / f"whole-{name}")
        assert table[0] == table[1]


def tables_of(path):
    if path.suffix == ".parquet":
        found = pq.read_table(path)
        return found.schema, found.schema.metadata[b"ftproc"]
    return (gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()), b""


@pytest.mark.parametrize("name", ["out.parquet", "out.csv", "-"])
def test_stretch_that_fails_leaves_nothing(tmp_path, capfdbinary, name):
    def failing():
        yield from pieces(some(90), [0, 30, 60])
        raise InputError("the third is bad")

    target = name if name == "-" else tmp_path / name
    with pytest.raises(InputError, match="the third is bad"):
        write_parts(failing(), dict, target)
    assert list(tmp_path.iterdir()) == []
    assert capfdbinary.readouterr().out == b""


def test_fields_have_units_and_descriptions(tmp_path: Path) -> None:
    """In a file that is written at once, and in one that grows."""
    whole = some(90)
    write_trajectory(whole, tmp_path / "whole.parquet")
    write_parts(pieces(whole, [0, 30, 90]), lambda: METADATA, tmp_path / "grown.parquet")
    for name in ("whole.parquet", "grown.parquet"):
        schema = pq.read_schema(tmp_path / name)
        assert METADATA.items() <= json.loads(schema.metadata[b"ftproc"]).items()
        for column in layout.TRAJECTORY:
            found = schema.field(column).metadata
            assert found[b"description"], column
            assert (found[b"unit"] == b"1") == (column in ("row", "nis", *layout.OUTLIER)), column
    assert layout.described("temperature") == {}
