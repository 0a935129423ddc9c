"""Standard streams that are closed or full, names that are not UTF-8: a sentence or the work done, never a traceback,
and never somebody else's bytes in a file."""

from __future__ import annotations

import errno
import json
import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from ftproc.errors import failure
from ftproc.files.reading import logs, trajectories
from ftproc.files.writing import flights
from ftproc.simulation import simulate
from tests.cli.conftest import Result, run
from tests.faults import batches
from tests.faults.batches import PROGRAM

__all__ = ["run"]

CLOSED = "standard output is closed, so the result is lost; leave it open, or send it to a file."


@pytest.fixture
def flight(tmp_path: Path) -> Path:
    path = tmp_path / "flight.csv"
    flights.write_log(simulate("zuo2021", seed=3).log, path)
    return path


def shell(directory: Path, line: str) -> subprocess.CompletedProcess[str]:
    """A line of bash in which `ftproc` is the program."""
    done = batches.run(directory, ["bash", "-c", f'ftproc() {{ {PROGRAM} "$@"; }}; {line}'])
    assert "Traceback" not in done.stderr
    assert "internal error" not in done.stderr
    return done


@pytest.mark.parametrize(
    "command",
    [
        "ftproc filter flight.csv -o -",
        "ftproc filter - < flight.csv",
        "ftproc filter flight.csv --summary json",
        "ftproc simulate --scenario zuo2021 -o -",
        "ftproc filter -h",
        "ftproc --version",
        "ftproc filter --list-methods",
        "ftproc filter --write-config",
        "ftproc train --show $MODEL",
    ],
)
def test_a_result_that_cannot_be_printed(flight: Path, monkeypatch: pytest.MonkeyPatch, command: str) -> None:
    from ftproc.correction import model_file

    monkeypatch.setenv("MODEL", str(model_file._PACKAGED_FILE))
    refused(shell(flight.parent, f"{command} > /dev/full"), "standard output: no space left")


@pytest.mark.parametrize("command", ["ftproc filter flight.csv -o -", "ftproc -h"])
def test_a_result_for_a_closed_output(flight: Path, command: str) -> None:
    """The stream is looked at before any command begins, so a few stand for all."""
    refused(shell(flight.parent, f"{command} >&-"), CLOSED)


def refused(done: subprocess.CompletedProcess[str], sentence: str) -> None:
    """Exit code 1, and one line that begins so."""
    assert done.returncode == 1
    assert done.stderr.startswith(f"ftproc: {sentence}")
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("place", [">&-", "> /dev/full"])
def test_a_summary_that_cannot_be_printed_costs_no_trajectory(flight: Path, place: str) -> None:
    for name in ("a.csv", "b.csv"):
        (flight.parent / name).write_bytes(flight.read_bytes())
    done = shell(flight.parent, f"ftproc filter a.csv b.csv flight.csv -o out/ {place}")
    assert done.returncode == 1
    assert len(list(flight.parent.glob("out/*.csv"))) == 3


@pytest.mark.parametrize(
    ("command", "kept", "lost"),
    [
        ("filter flight.csv -o out.csv", ["out.csv"], "only the summary is lost, and out.csv is whole"),
        ("filter flight.csv -o out.parquet --summary json", ["out.parquet"], "only the summary is lost, and out.parq"),
        ("filter flight.csv b.csv -o o/", ["o/b.trajectory.csv"], "and the 2 files written before are whole"),
        ("filter flight.csv none.csv -o o/", ["o/flight.trajectory.csv"], "and o/flight.trajectory.csv is whole"),
        ("filter flight.csv -o -", [], "standard output is closed, so the result is lost; leave it open, or send"),
        ("filter flight.csv --explain", [], "standard output is closed, so the result is lost"),
        ("train --scenario zuo2021 --flights 4 --population 2 --generations 0 --epochs 1 -o m.safetensors",
         ["m.safetensors"], "only the model's card is lost, and m.safetensors is whole"),
        ("score b.csv --report s.html", ["s.html"], "only the table of scores is lost, and s.html is whole"),
    ],
)  # fmt: skip
def test_what_is_lost_with_standard_output(flight: Path, command: str, kept: list[str], lost: str) -> None:
    here = flight.parent
    (here / "b.csv").write_bytes(flight.read_bytes())
    if command.startswith("score"):
        shell(here, "ftproc filter flight.csv -o t.csv; mv t.csv b.csv")
    done = shell(here, f"ftproc {command} >&-")
    assert done.returncode == 1
    assert lost in done.stderr.splitlines()[-1]
    assert all((here / name).exists() for name in kept)
    full = shell(here, f"ftproc {command} > /dev/full")
    assert full.returncode == 1
    assert lost.rpartition("so ")[2].partition(";")[0] in full.stderr.splitlines()[-1]


def test_a_reader_that_leaves_costs_no_trajectory(flight: Path) -> None:
    for name in "abcd":
        (flight.parent / f"{name}.csv").write_bytes(flight.read_bytes())
    done = shell(flight.parent, "ftproc filter a.csv b.csv c.csv d.csv -o out/ | true; echo ${PIPESTATUS[0]}")
    assert done.stdout == "1\n"
    assert len(list(flight.parent.glob("out/*.csv"))) == 4


def test_messages_that_standard_error_does_not_take_are_dropped(flight: Path) -> None:
    assert shell(flight.parent, "ftproc filter none.csv flight.csv -o o/ 2> /dev/full").returncode == 1
    assert (flight.parent / "o" / "flight.trajectory.csv").exists()
    assert shell(flight.parent, "ftproc filter --nonsense 2> /dev/full").returncode == 2


@pytest.mark.parametrize(
    "command",
    [
        "filter {0}/flight.csv -o {0}/out.csv",
        "filter {0}/flight.csv",
        "filter {0}/flight.csv {0}/b.csv -o {0}/o/ --jobs 2",
        "filter --fuse range.toml -o best.parquet",
        "simulate --scenario zuo2021 -o x.csv",
        "train --scenario zuo2021 -o m.safetensors",
        "score {0}/flight.csv",
    ],
)
def test_a_current_directory_that_is_there_no_more(flight: Path, command: str) -> None:
    here = flight.parent
    (here / "gone").mkdir()
    done = shell(here, f"cd gone; rmdir ../gone; ftproc {command.format(here)}")
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1] == (
        "ftproc: the current directory is there no more (deleted, or moved away); change to another one with cd, and "
        "run again."
    )
    assert [path.name for path in here.iterdir()] == ["flight.csv"]


@pytest.mark.parametrize(("closed", "more"), [("<&-", "--jobs 2"), ("2>&-", ""), ("<&- 2>&-", "--jobs 2")])
def test_streams_that_are_not_needed(flight: Path, closed: str, more: str) -> None:
    (flight.parent / "other.csv").write_bytes(flight.read_bytes())
    done = shell(flight.parent, f"ftproc filter flight.csv other.csv -o out/ {more} {closed}")
    assert done.returncode == 0
    assert done.stdout.count("verdict") == 2
    assert len(list(flight.parent.glob("out/*.csv"))) == 2


def test_no_file_gets_the_descriptor_of_a_closed_stream(flight: Path) -> None:
    """All three closed, and a library that writes to them as OpenBLAS does."""
    code = (
        "import errno, os, sys\nfrom ftproc.cli import process\nprocess.open_streams()\n"
        "print('err', file=sys.stderr)\ntry:\n    print('out')\nexcept OSError as error:\n"
        "    assert error.errno == errno.EBADF\n"
        "file = os.open('mine', os.O_WRONLY | os.O_CREAT)\nassert file > 2, file\nos.write(2, b'noise')\n"
        "os.write(file, b'data')\n"
    )
    python = Path(PROGRAM).with_name("python")
    done = batches.run(flight.parent, ["bash", "-c", f'{python} -c "{code}" <&- >&- 2>&-'])
    assert done.returncode == 0
    assert (flight.parent / "mine").read_bytes() == b"data"


def test_an_error_with_standard_error_closed_is_in_the_exit_code(tmp_path: Path) -> None:
    assert shell(tmp_path, "ftproc filter none.csv 2>&-").returncode == 1
    assert shell(tmp_path, "ftproc filter --nonsense 2>&-").returncode == 2


def test_a_closed_standard_input(tmp_path: Path) -> None:
    done = shell(tmp_path, "ftproc filter - <&-")
    assert done.returncode == 1
    assert done.stderr == "ftproc: <stdin>: standard input is closed; pipe a CSV log into it, or name a file.\n"


@pytest.mark.parametrize(("most", "more"), [(16, "--jobs 2"), (12, "--jobs 2")])
def test_too_many_open_files(flight: Path, most: int, more: str) -> None:
    (flight.parent / "other.csv").write_bytes(flight.read_bytes())
    done = shell(flight.parent, f"ulimit -n {most}; ftproc filter flight.csv other.csv {more} -o out/")
    assert done.returncode == 1
    assert done.stderr == "ftproc: too many files are open. Raise the limit (ulimit -n), or use fewer --jobs.\n"


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (MemoryError(), "a.csv: there is not enough memory"),
        (RuntimeError("std::bad_alloc"), "a.csv: there is not enough memory"),
        (RuntimeError("can't start new thread"), "a.csv: there is not enough memory"),
        (OSError(errno.ENOMEM, "Cannot allocate memory"), "a.csv: there is not enough memory"),
        (OSError(errno.EAGAIN, "Resource temporarily unavailable"), "a.csv: there is not enough memory"),
        (OSError(errno.EMFILE, "Too many open files"), "too many files are open"),
        (OSError(errno.EIO, "Input/output error", "b.csv"), "b.csv: input/output error"),
    ],
)
def test_faults_of_the_machine_in_words(error: Exception, sentence: str) -> None:
    assert failure(error, "a.csv").message.startswith(sentence)


def test_memory_at_the_bottom_of_another_error() -> None:
    error = ValueError("this cannot be written as CSV")
    error.__cause__ = MemoryError("malloc of size 15728640 failed")
    assert "not enough memory" in failure(error, "a.csv").message


ODD = os.fsdecode(b"fl\xffght\xe9")


def test_names_that_are_not_utf8(flight: Path, run: Callable[..., Result], monkeypatch: pytest.MonkeyPatch) -> None:
    """Everywhere: log, output, report, index, map, JSON, messages, scores."""
    monkeypatch.chdir(flight.parent)
    directory = flight.parent
    flight.rename(directory / f"{ODD}.csv")
    name = "$'fl\\xffght\\xe9'"
    line = f"ftproc filter {name}.csv --report {name}.html --site 48,11,600 --summary json"
    done = shell(directory, f"{line} -o {name}.parquet")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["log"] == "fl\\udcffght\\udce9.csv"
    found = trajectories.read(directory / f"{ODD}.parquet")
    assert len(found) == len(logs.read(directory / f"{ODD}.csv"))
    assert found.metadata["log"] == "fl\\udcffght\\udce9.csv"
    assert "fl\\udcffght\\udce9.csv" in (directory / f"{ODD}.html").read_text("utf-8")
    for kind in (".kml", ".geojson", ".czml", ".csv"):
        assert run("filter", f"{ODD}.csv", "--site", "48,11,600", "-o", f"m{kind}").code == 0
        assert (directory / f"m{kind}").read_text("utf-8")
        assert json.loads((directory / "m.json").read_text("utf-8"))["log"]
    done = shell(directory, f"ftproc filter {name}.csv none.csv -o out/ --report pages/ --jobs 2")
    assert done.returncode == 1
    assert "fl\\udcffght\\udce9.trajectory.csv" in done.stdout
    assert 'href="./fl%FFght%E9.report.html"' in (directory / "pages" / "index.html").read_text("utf-8")
    assert "fl\\" in shell(directory, f"ftproc score {name}.parquet").stdout
    for form in ("json", "csv"):
        scored = run("score", f"{ODD}.parquet", "--format", form)
        assert (scored.code, scored.err) == (0, "")
        assert "fl\\" in scored.out


@pytest.mark.parametrize("option", ["", "--config", "--model", "-o", "--report", "--truth"])
def test_an_empty_name(flight: Path, option: str) -> None:
    command = "score" if option == "--truth" else "filter"
    done = shell(flight.parent, f"ftproc {command} flight.csv {option} ''")
    assert done.returncode == 2
    assert "the name of a file is empty" in done.stderr


@pytest.mark.parametrize(
    "error", ["EOFError('Ran out of input')", "OSError(28, 'No space left on device')", "ValueError('unpickled')"]
)
def test_a_damaged_or_full_cache_of_kernels_is_not_blamed_on_the_log(error: str) -> None:
    """As numba raises it, while it reads or writes its cache."""
    load = compile(f"def load():\n    raise {error}\n", "/lib/numba/core/caching.py", "exec")
    names: dict[str, Any] = {}
    exec(load, names)
    with pytest.raises(Exception, match=r".") as caught:
        names["load"]()
    message = failure(caught.value, "a.csv").message
    assert message.startswith("numba's cache of kernels is damaged, or cannot be kept (")
    assert "set NUMBA_CACHE_DIR to another directory" in message
    assert "a.csv" not in message
