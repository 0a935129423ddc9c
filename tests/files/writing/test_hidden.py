"""What a killed program leaves is removed by the next one, and nothing else is."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from ftproc.files.writing import hidden
from ftproc.files.writing.atomic import replacing

WRITER = (
    "import sys, time\nfrom ftproc.files.writing.atomic import replacing\n"
    "with replacing(sys.argv[1]) as stream:\n"
    "    stream.write(b'half'); stream.flush(); print(flush=True); time.sleep(60)\n"
)


def writing(target: Path) -> subprocess.Popen[bytes]:
    """Another program that has begun to write a file."""
    process = subprocess.Popen([sys.executable, "-c", WRITER, str(target)], stdout=subprocess.PIPE)
    assert process.stdout is not None
    process.stdout.readline()
    return process


def write(target: Path) -> None:
    hidden._clean.cache_clear()
    with replacing(target) as stream:
        stream.write(b"whole")


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("other", ["k.csv", "another.parquet", "n" * 250])
def test_what_was_killed_is_removed(tmp_path: Path, other: str) -> None:
    with writing(tmp_path / other) as one, writing(tmp_path / other) as another:
        one.kill()
        another.kill()
    left = names(tmp_path)
    assert len(left) == 2
    assert all(re.fullmatch(rf"\.{other[:200]}\.ftproc-[0-9a-f]{{8}}-[0-9a-f]{{8}}\.tmp", name) for name in left)
    write(tmp_path / "k.csv")
    assert names(tmp_path) == ["k.csv"]


def test_what_is_being_written_stays(tmp_path: Path) -> None:
    with writing(tmp_path / "k.csv") as process:
        before = names(tmp_path)
        write(tmp_path / "k.csv")
        assert names(tmp_path) == sorted([*before, "k.csv"])
        process.kill()
    write(tmp_path / "k.csv")
    assert names(tmp_path) == ["k.csv"]


def test_what_is_not_surely_ours_stays(tmp_path: Path) -> None:
    """Of the user, of another program, of another running system; a link, a directory, a file of two names."""
    ours = f"ftproc-{hidden._system()}"
    for name in (".k.csv.1a2b3c4d.tmp", ".k.csv.ftproc-00000000-1a2b3c4d.tmp", f"k.csv.{ours}-1a2b3c4d.tmp"):
        (tmp_path / name).write_bytes(b"mine")
    for name in (f".k.csv.{ours}-1a2b3c4.tmp", f".k.csv.{ours}-1a2b3c4d.tmp2", f".k.csv.{ours}-1A2B3C4D.tmp"):
        (tmp_path / name).write_bytes(b"mine")
    (tmp_path / "mine").write_bytes(b"mine")
    (tmp_path / f".k.csv.{ours}-00000001.tmp").symlink_to("mine")
    (tmp_path / f".k.csv.{ours}-00000002.tmp").mkdir()
    (tmp_path / f".k.csv.{ours}-00000003.tmp").hardlink_to(tmp_path / "mine")
    os.mkfifo(tmp_path / f".k.csv.{ours}-00000004.tmp")
    before = names(tmp_path)
    write(tmp_path / "out.csv")
    assert names(tmp_path) == sorted([*before, "out.csv"])


def test_a_hidden_file_that_is_removed_before_it_is_held_is_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lock, removed = hidden.fcntl.flock, []

    def late(descriptor: int, how: int) -> None:
        if not removed:
            removed.append(next(tmp_path.glob(".*")))
            removed[0].unlink()
        lock(descriptor, how)

    monkeypatch.setattr(hidden.fcntl, "flock", late)
    write(tmp_path / "k.csv")
    assert removed
    assert (tmp_path / "k.csv").read_bytes() == b"whole"
    assert names(tmp_path) == ["k.csv"]


@pytest.mark.parametrize("error", [OSError(38, "no locks"), BlockingIOError(11, "held")])
def test_a_file_system_without_locks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: OSError) -> None:
    """What was killed stays there; what another program is about to remove is left to it."""
    calls = []

    def none(descriptor: int, how: int) -> None:
        calls.append(how)
        if isinstance(error, BlockingIOError) and len(calls) > 1:
            return
        raise error

    monkeypatch.setattr(hidden.fcntl, "flock", none)
    write(tmp_path / "k.csv")
    assert (tmp_path / "k.csv").read_bytes() == b"whole"
