"""Whole or not at all; never on top of an input."""

import errno
import os
import resource
import signal
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from ftproc.errors import InputError, OutputError
from ftproc.files.writing.atomic import check_target, replacing
from ftproc.files.writing.outputs import Output, check


def entries(directory: Path) -> list[str]:
    return sorted(entry.name for entry in directory.iterdir())


def test_the_file_appears_whole_and_only_at_the_end(tmp_path: Path) -> None:
    target = tmp_path / "out.csv"
    target.write_bytes(b"before")
    with replacing(target) as stream:
        stream.write(b"after")
        stream.flush()
        assert target.read_bytes() == b"before"
    assert target.read_bytes() == b"after"
    assert entries(tmp_path) == ["out.csv"]


@pytest.mark.parametrize("error", [ValueError("x"), InputError("y"), KeyboardInterrupt()])
def test_a_failure_leaves_what_was_there_and_nothing_else(tmp_path: Path, error: BaseException) -> None:
    target = tmp_path / "out.csv"
    target.write_bytes(b"before")

    def fail() -> None:
        with replacing(target) as stream:
            stream.write(b"half")
            raise error

    with pytest.raises(type(error)):
        fail()
    assert target.read_bytes() == b"before"
    assert entries(tmp_path) == ["out.csv"]


def test_a_killed_writer_leaves_the_earlier_file(tmp_path: Path) -> None:
    target = tmp_path / "out.csv"
    target.write_bytes(b"before")
    code = (
        "import sys, time\nfrom ftproc.files.writing.atomic import replacing\n"
        "with replacing(sys.argv[1]) as stream:\n"
        "    stream.write(b'half'); stream.flush(); print('written', flush=True); time.sleep(60)\n"
    )
    with subprocess.Popen([sys.executable, "-c", code, str(target)], stdout=subprocess.PIPE) as writer:
        assert writer.stdout is not None
        assert writer.stdout.readline() == b"written\n"
        writer.send_signal(signal.SIGKILL)
    assert target.read_bytes() == b"before"


def write_one(target: Path) -> None:
    with replacing(target) as stream:
        stream.write(b"new")


REASONS = [
    (errno.ENOSPC, "the disk is full; nothing was written."),
    (errno.EDQUOT, "the disk quota is used up; nothing was written."),
    (errno.EFBIG, "the file is larger than the system allows"),
    (errno.EIO, "cannot be written (Input/output error)."),
]


@pytest.mark.parametrize(("number", "reason"), REASONS)
def test_a_disk_that_fails_at_the_flush(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, reason: str
) -> None:
    target = tmp_path / "out.csv"
    target.write_bytes(b"before")

    def full(_: int) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OutputError) as caught:
        write_one(target)
    assert str(caught.value).startswith(f"{target}: {reason}")
    assert target.read_bytes() == b"before"
    assert entries(tmp_path) == ["out.csv"]


def test_a_disk_that_really_fills_up(tmp_path: Path) -> None:
    target = tmp_path / "out.csv"
    target.write_bytes(b"before")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, limits[1]))
    try:
        with pytest.raises(OutputError, match="larger than the system allows"), replacing(target) as stream:
            stream.write(bytes(1_000_000))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert target.read_bytes() == b"before"
    assert entries(tmp_path) == ["out.csv"]


@pytest.mark.parametrize(
    ("number", "reason"),
    [
        (errno.EACCES, "no permission to write in"),
        (errno.EPERM, "no permission to write in"),
        (errno.EROFS, "cannot be written to (read-only)"),
    ],
)
def test_a_directory_that_may_not_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, reason: str
) -> None:
    def refuse(*_: object) -> int:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(OutputError) as caught:
        write_one(tmp_path / "out.csv")
    assert reason in str(caught.value)
    assert str(tmp_path) in str(caught.value)


@pytest.mark.parametrize("check", [check_target, write_one])
def test_places_that_are_none(tmp_path: Path, check: object) -> None:
    assert callable(check)
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(OutputError) as caught:
        check(tmp_path / "none" / "out.csv")
    assert f"there is no directory {tmp_path / 'none'}; create it first (mkdir -p" in str(caught.value)
    with pytest.raises(OutputError, match="this is a directory; give the name of a file in it"):
        check(tmp_path)
    with pytest.raises(OutputError, match="file is not a directory"):
        check(tmp_path / "file" / "out.csv")


def test_a_good_place_passes_the_check(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for target in ("-", "out.csv", tmp_path / "out.csv"):
        check_target(target)
    assert entries(tmp_path) == []


def test_a_new_file_has_the_permissions_of_any_new_file(tmp_path: Path) -> None:
    (tmp_path / "usual").write_bytes(b"")
    write_one(tmp_path / "out.csv")
    assert stat.S_IMODE((tmp_path / "out.csv").stat().st_mode) == stat.S_IMODE((tmp_path / "usual").stat().st_mode)


def test_a_symbolic_link_stays_one(tmp_path: Path) -> None:
    (tmp_path / "real.csv").write_bytes(b"before")
    (tmp_path / "link.csv").symlink_to("real.csv")
    write_one(tmp_path / "link.csv")
    assert (tmp_path / "link.csv").is_symlink()
    assert (tmp_path / "real.csv").read_bytes() == b"new"


def test_what_is_no_regular_file_is_written_to_and_not_replaced(tmp_path: Path) -> None:
    """With a named pipe. Never with a real device: run as root, a fault here would replace /dev/null itself."""
    pipe = tmp_path / "out.csv"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write_one(pipe)
        assert os.read(reader, 100) == b"new"
    finally:
        os.close(reader)
    assert pipe.is_fifo()
    assert entries(tmp_path) == ["out.csv"]


def test_a_long_name_is_no_obstacle(tmp_path: Path) -> None:
    write_one(tmp_path / ("n" * 250 + ".csv"))
    write_one(tmp_path / ("\u98de" * 83 + ".csv"))  # three bytes each
    with pytest.raises(OutputError, match="the name is too long for the file system; give a shorter one"):
        write_one(tmp_path / ("n" * 300 + ".csv"))


def test_an_input_is_never_overwritten_by_any_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = tmp_path / "log.csv"
    log.write_bytes(b"log")
    (tmp_path / "soft.csv").symlink_to("log.csv")
    (tmp_path / "hard.csv").hardlink_to(log)
    (tmp_path / "sub").mkdir()
    monkeypatch.chdir(tmp_path)
    for target in (log, "log.csv", "./log.csv", "sub/../log.csv", "soft.csv", "hard.csv"):
        with pytest.raises(OutputError) as caught:
            check([Output(target)], ["-", "other.csv", str(log)])
        assert f"this is the input {log}, which is never overwritten. Give another name with -o." in str(caught.value)


def test_all_outputs_that_cannot_be_written_are_named(tmp_path: Path) -> None:
    for name in ("a.csv", "b.csv", "d.csv"):
        (tmp_path / name).mkdir()
    with pytest.raises(OutputError) as caught:
        check([Output(tmp_path / f"{name}.csv") for name in "abcd"], [])
    assert str(caught.value).startswith(f"{tmp_path}/a.csv: ")
    assert f"The same or the like holds of {tmp_path}/b.csv, {tmp_path}/d.csv." in str(caught.value)


def test_other_files_and_streams_may_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("log.csv").write_bytes(b"log")
    Path("copy.csv").write_bytes(b"log")
    check([Output("copy.csv"), Output("out.csv"), Output("-")], ["log.csv", "-"])


def test_two_writers_at_once_leave_one_whole_file(tmp_path: Path) -> None:
    target = tmp_path / "out.csv"
    with replacing(target) as one, replacing(target) as other:
        one.write(b"one")
        other.write(b"other")
    assert target.read_bytes() == b"one"
    assert entries(tmp_path) == ["out.csv"]


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs /proc")
def test_a_directory_in_which_no_file_can_be_made_is_there() -> None:
    with pytest.raises(OutputError, match=r"no file can be made in /proc; choose"), replacing("/proc/x.csv"):
        pass
