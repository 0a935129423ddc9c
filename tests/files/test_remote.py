"""Files by URI: fsspec's memory stands for a bucket, file:// is this machine's disk."""

from __future__ import annotations

import gc
import tempfile
from pathlib import Path

import numpy as np
import pytest

from ftproc.batch import plan, run
from ftproc.batch.tasks import Task
from ftproc.errors import InputError, OutputError, UsageError
from ftproc.files import layout, remote
from ftproc.files.reading import logs, trajectories
from ftproc.files.reading.formats import content
from ftproc.files.writing import atomic, flights, outputs
from ftproc.files.writing.outputs import Output
from tests.simulated import simulate

fsspec = pytest.importorskip("fsspec")


@pytest.fixture
def bucket():
    """Files in memory, by the name of a bucket that is empty before and after."""
    files = fsspec.filesystem("memory")
    files.store.clear()
    yield files
    files.store.clear()


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """Where temporary files lie; whatever is left there at the end is a leak."""
    place = tmp_path / "temporary"
    place.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(place))
    yield place
    gc.collect()
    assert list(place.iterdir()) == []


@pytest.fixture
def flight(tmp_path):
    log = simulate("cruise", seed=1, duration_s=30.0).log
    flights.write_log(log, tmp_path / "flight.csv")
    return log, tmp_path / "flight.csv"


@pytest.mark.parametrize(
    ("name", "known", "path"),
    [
        ("s3://bucket/flight.csv", True, None),
        ("GS://bucket/flight.csv", True, None),
        ("file:///tmp/a%20b.csv", True, Path("/tmp/a b.csv")),
        ("flight.csv", False, Path("flight.csv")),
        ("C:\\logs\\flight.csv", False, Path("C:\\logs\\flight.csv")),
        ("a:b//c.csv", False, Path("a:b//c.csv")),
    ],
)
def test_which_names_are_uris(name, known, path):
    assert remote.is_uri(name) == known
    assert remote.local(name) == path


@pytest.mark.parametrize("large", [False, True])
@pytest.mark.parametrize("kind", ["csv", "csv.gz", "parquet", "feather"])
def test_log_from_a_bucket_is_the_log(bucket, temporary, tmp_path, flight, monkeypatch, kind, large):
    log, _ = flight
    path = tmp_path / f"log.{kind}"
    flights.write_log(log, path)
    bucket.pipe(f"/bucket/log.{kind}", path.read_bytes())
    if large:
        monkeypatch.setattr(content, "LARGE", 100)
    found = logs.read(f"memory://bucket/log.{kind}")
    assert found.name == f"memory://bucket/log.{kind}"
    np.testing.assert_array_equal(found.measurement, log.measurement)


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_trajectory_in_a_bucket_is_that_on_the_disk(bucket, temporary, tmp_path, flight, kind):
    bucket.pipe("/bucket/flight.csv", flight[1].read_bytes())
    near, far = tmp_path / f"out.{kind}", f"memory://bucket/made/out.{kind}"
    for task in (
        Task("memory://bucket/flight.csv", str(near)),
        Task("memory://bucket/flight.csv", far, folder="/work"),
    ):
        assert run.filter_one(task).failure is None
    assert bucket.cat(f"/bucket/made/out.{kind}") == near.read_bytes()
    found = trajectories.read(far)
    assert found.metadata["log"] == "memory://bucket/flight.csv"
    assert len(found) == len(flight[0])


def test_file_uri_is_a_path(tmp_path, flight):
    uri = f"file://{tmp_path}/out.parquet"
    assert run.filter_one(Task(f"file://{flight[1]}", uri)).failure is None
    assert len(trajectories.read(tmp_path / "out.parquet")) == len(flight[0])
    with pytest.raises(OutputError, match="never overwritten"):
        outputs.check([Output(f"file://{flight[1]}")], [flight[1]])


def test_missing_files_and_unknown_schemes_are_named(bucket, temporary):
    with pytest.raises(InputError, match=r"memory://bucket/none.csv: there is no such file"):
        logs.read("memory://bucket/none.csv")
    sentence = 'nowhere://bucket/a.csv: neither pyarrow nor fsspec supports "nowhere" here'
    with pytest.raises(InputError, match=sentence):
        logs.read("nowhere://bucket/a.csv")
    with pytest.raises(OutputError, match=sentence), atomic.replacing("nowhere://bucket/a.csv") as stream:
        stream.write(b"1")


def test_failed_output_is_not_stored(bucket, temporary):
    def half():
        with atomic.replacing("memory://bucket/out.csv") as stream:
            stream.write(b"half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        half()
    assert not bucket.exists("/bucket/out.csv")


def test_half_an_output_is_taken_away(bucket, temporary, monkeypatch):
    def half(source, target, length):
        target.write(source.read(2))
        raise OSError("the network is gone")

    monkeypatch.setattr("ftproc.files.remote.shutil.copyfileobj", half)
    with (
        pytest.raises(OutputError, match=r"cannot be written \(the network is gone\); check"),
        atomic.replacing("memory://bucket/out.csv") as stream,
    ):
        stream.write(b"whole")
    assert not bucket.exists("/bucket/out.csv")


def test_errors_of_the_storage_are_quoted(bucket, temporary, monkeypatch):
    def refuse(*args, **how):
        raise PermissionError("403 Forbidden\nand a long page")

    monkeypatch.setattr(type(bucket), "_open", refuse)
    with (
        pytest.raises(OutputError, match=r"out.csv: cannot be written \(403 Forbidden\); check"),
        atomic.replacing("memory://bucket/out.csv") as stream,
    ):
        stream.write(b"1")


def test_outputs_by_uri_are_planned(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    tasks = plan.tasks([plan.Wanted("s3://in/a.csv"), plan.Wanted("s3://in/b.parquet")], "s3://out/clean/")
    assert [t.output for t in tasks] == ["s3://out/clean/a.trajectory.csv", "s3://out/clean/b.trajectory.parquet"]
    assert plan.tasks([plan.Wanted("s3://in/a.csv")], None)[0].output == "a.trajectory.csv"
    with pytest.raises(OutputError, match="never overwritten"):
        outputs.check([Output("s3://in/a.csv")], ["s3://in/a.csv"])
    assert layout.sidecar("s3://out/a.csv") == "s3://out/a.json"
    assert list(tmp_path.iterdir()) == []


def test_pages_are_written_on_this_machine(tmp_path):
    with pytest.raises(UsageError, match="pages are written on this machine"):
        plan.pages(["out.parquet"], "s3://bucket/pages/")
