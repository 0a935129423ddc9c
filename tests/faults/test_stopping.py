"""A log that is followed, stopped by a signal in each state: it is heard soon, and the rows before it are whole."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import signal
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from ftproc.files.reading import trajectories
from tests.faults.batches import PROGRAM
from tests.trust import cases
from tests.trust.streams import GOOD, flight, lines

LAG_S = 2.0
SOON_S = 20.0  # for an answer; four times what it takes on a machine with much else to do
RUNNING_S = 1.0  # that it reads the log before it is stopped
QUICK = ("one time", "0"), ("30 years", "2"), ("as usual", "0"), ("no time", "2")


def good() -> list[str]:
    return [cases.HEADER, *lines(flight().log.time_s[:GOOD], np.arange(GOOD))]


def endless(name: str) -> Iterator[str]:
    """Rows that do not end, after the good ones."""
    yield from good()
    last_s = float(flight().log.time_s[GOOD - 1])
    times = {
        "one time": itertools.repeat(last_s),
        "no interval": (last_s + 1e-13 * k for k in itertools.count()),
        "an hour": (last_s + 3600.0 * k for k in itertools.count(1)),
        "30 years": itertools.chain([last_s + 1e9], (last_s + 1e9 + 0.1 * k for k in itertools.count(1))),
        "as usual": (last_s + 0.1 * k for k in itertools.count(1)),
        "no time": itertools.repeat(np.nan),
    }[name]
    for number, time_s in enumerate(times, GOOD):
        yield lines(np.array([time_s]), np.array([number]))[0].replace("nan", "")


def fed(path: Path, rows: Iterator[str]) -> threading.Thread:
    """Writes rows into a pipe until nobody reads it any more."""

    def feed() -> None:
        try:
            with path.open("w") as stream:
                for row in rows:
                    stream.write(f"{row}\n")
        except OSError:
            pass

    thread = threading.Thread(target=feed, daemon=True)
    thread.start()
    return thread


def wait_until_read(process: subprocess.Popen[str], log: Path) -> None:
    """Until a process has opened a file, or has ended."""
    for _ in range(600):
        if process.poll() is not None:
            return
        for descriptor in Path(f"/proc/{process.pid}/fd").glob("*"):
            with contextlib.suppress(OSError):
                if descriptor.readlink() == log:
                    return
        time.sleep(0.1)


def wait_for_rows(log: Path, count: int) -> None:
    """Until a file has so many rows, on a busy machine too."""
    for _ in range(300):
        if log.exists() and log.read_bytes().count(b"\n") > count:
            return
        time.sleep(0.1)


def stopped(directory: Path, number: int, *options: str, rows: int = 0) -> tuple[int, str, float]:
    """The exit code, what was said, and the seconds after a signal that a run needed to end. rows: that it publishes
    before it is stopped."""
    command = [PROGRAM, "filter", "log", "--follow", "-o", "out.csv", *options]
    with subprocess.Popen(command, cwd=directory, stderr=subprocess.PIPE, text=True) as process:
        wait_until_read(process, directory / "log")
        time.sleep(RUNNING_S)
        if rows:
            wait_for_rows(directory / "out.csv", rows)
        process.send_signal(number)
        began_s = time.monotonic()
        try:
            err = process.communicate(timeout=SOON_S)[1]
        finally:
            process.kill()
    assert "Traceback" not in err
    assert "internal error" not in err
    assert not list(directory.glob(".*")), "a hidden file is left"
    return process.returncode, err, time.monotonic() - began_s


def whole(directory: Path, least: int) -> None:
    """The output has at least the first rows, and its sidecar counts them all."""
    found = trajectories.read(directory / "out.csv")
    assert found.row[:least].tolist() == list(range(least))
    assert json.loads((directory / "out.json").read_text())["summary"]["rows"] == len(found)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_pipe_into_which_nobody_writes(tmp_path: Path, number: int) -> None:
    os.mkfifo(tmp_path / "log")
    code, err, taken_s = stopped(tmp_path, number)
    assert (code, err) == (1, "ftproc: log: there is no line; expected a line of names and rows.\n")
    assert taken_s < 5.0
    assert not (tmp_path / "out.csv").exists()


@pytest.mark.parametrize(
    ("pipe", "count"),
    [
        pytest.param(pipe, count, marks=[] if pipe == (k % 2 == 0) else pytest.mark.slow)
        for pipe in (True, False)
        for k, count in enumerate([0, 1, 20, GOOD + 1])
    ],
)
def test_a_writer_that_has_nothing_more_to_say(tmp_path: Path, count: int, pipe: bool) -> None:
    text = "".join(f"{row}\n" for row in good()[:count])
    if pipe:
        os.mkfifo(tmp_path / "log")
        writer = os.open(tmp_path / "log", os.O_RDWR)
        os.write(writer, text.encode())
    else:
        (tmp_path / "log").write_text(text)
    early = max(count - 1 - int(1.5 * LAG_S / 0.1), 0)  # that do not wait for their lag when all is read
    code, err, _ = stopped(tmp_path, signal.SIGTERM, "--lag", f"{LAG_S:g}", rows=early)
    if count < 2:
        assert code == 1
        assert ("there is no line" if count == 0 else "no row came after the line of names") in err
    else:
        assert code == 0
        whole(tmp_path, count - 1)


@pytest.mark.parametrize(
    ("name", "lag"),
    [
        pytest.param(name, lag, marks=[] if (name, lag) in QUICK else pytest.mark.slow)
        for name in ("one time", "no interval", "an hour", "30 years", "as usual", "no time")
        for lag in ("0", "2")
    ],
)
def test_rows_that_come_faster_than_they_can_be_used(tmp_path: Path, name: str, lag: str) -> None:
    """In the middle of its work, with much more to do."""
    os.mkfifo(tmp_path / "log")
    fed(tmp_path / "log", endless(name))
    number = signal.SIGINT if lag == "0" else signal.SIGTERM
    code, err, _ = stopped(tmp_path, number, "--lag", lag, rows=GOOD)
    assert code == 0, err
    whole(tmp_path, GOOD)


def test_comments_that_do_not_end(tmp_path: Path) -> None:
    """Are refused before anybody has to stop it."""
    os.mkfifo(tmp_path / "log")
    fed(tmp_path / "log", itertools.repeat("# note"))
    code, err, _ = stopped(tmp_path, signal.SIGINT)
    assert code == 1
    assert "none of its first 2001 lines looks like a row of a log" in err
