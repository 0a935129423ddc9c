"""Files that grow: what a run after a crash finds, a full disk, and a file that is taken away."""

from __future__ import annotations

import errno
import gzip

import pyarrow.parquet as pq
import pytest

import ftproc
from ftproc.errors import OutputError
from ftproc.live.outputs import parquet, rows
from ftproc.live.outputs.rows import Output
from ftproc.settings import FilterSettings
from tests.trust.streams import flight

KINDS = ("a.csv", "a.csv.gz", "a.jsonl", "a.parquet")


@pytest.fixture(scope="module")
def parts():
    log, track = flight().log, ftproc.Live(FilterSettings(editing="live", lag_s=0.0))
    return [track.push(log.time_s[k : k + 50], *log.measurement[k : k + 50].T) for k in range(0, 300, 50)]


def run(path, parts, known=None):
    """What a later run must know after these parts."""
    with Output(str(path), "csv", dict, known) as output:
        for part in parts:
            output.add(part)
        return output.known()


def content(path):
    if path.suffix == ".parquet":
        return pq.read_table(path).to_pandas()
    return gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()


@pytest.mark.parametrize("name", KINDS)
def test_a_run_goes_on_with_what_the_one_before_has_left(name, parts, tmp_path, monkeypatch):
    monkeypatch.setattr(parquet, "GROUP", 100)
    run(tmp_path / name, parts)
    whole = content(tmp_path / name)
    (tmp_path / name).unlink()
    known = run(tmp_path / name, parts[:3])
    run(tmp_path / name, parts[3:5], known)  # which was killed before it kept what it knew
    run(tmp_path / name, parts[3:], known)
    found = content(tmp_path / name)
    assert found == whole if isinstance(found, bytes) else found.equals(whole)


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("change", ["deleted", "cut", "replaced"])
def test_a_file_that_has_changed_is_not_gone_on_with(name, change, parts, tmp_path, monkeypatch):
    monkeypatch.setattr(parquet, "GROUP", 100)
    path = tmp_path / name
    known = run(path, parts[:3])
    if change == "deleted":
        path.unlink()
    else:
        path.write_bytes(path.read_bytes()[:100] if change == "cut" else b"x" * 100_000)
    with pytest.raises(OutputError, match=f"{name}: it was deleted, cut or replaced since the run before"):
        run(path, parts[3:], known)


@pytest.mark.parametrize("name", KINDS)
def test_a_full_disk_is_named_and_leaves_whole_rows(name, parts, tmp_path, monkeypatch):
    monkeypatch.setattr(parquet, "GROUP", 100)
    path, room, real = tmp_path / name, [90_000 if name == "a.jsonl" else 40_000], rows.atomic.streams._Whole.write

    def write(self, data):
        fits = bytes(data)[: room[0]]
        room[0] -= len(fits)
        real(self, fits)
        if len(fits) < len(data):
            room[0] = 4000  # that a shorter footer finds
            raise OSError(errno.ENOSPC, "No space left on device")
        return len(data)

    monkeypatch.setattr(rows.atomic.streams._Whole, "write", write)
    with pytest.raises(OutputError, match=f"{name}: "):
        _until_full(path, parts)
    monkeypatch.undo()
    found = content(path)
    if isinstance(found, bytes):
        cells = {line.count(b",") for line in found.splitlines()}
        assert found.endswith(b"\n")
        assert len(cells) == 1
    else:
        assert len(found) % 100 == 0


@pytest.mark.parametrize("name", KINDS)
def test_a_file_that_is_taken_away_is_missed_at_once(name, parts, tmp_path, monkeypatch):
    monkeypatch.setattr(rows, "EVERY_S", 0.0)
    path = tmp_path / name
    with pytest.raises(OutputError, match="removed or replaced while it was written"):
        _taken_away(path, parts)


def _until_full(path, parts):
    with Output(str(path), "csv", dict, None) as output:
        for _ in range(40):
            for part in parts:
                output.add(part)
                output.known()


def _taken_away(path, parts):
    with Output(str(path), "csv", dict, None) as output:
        output.add(parts[0])
        output.pause()
        path.unlink()
        output.add(parts[1])
        output.pause()
        raise AssertionError("not missed")
