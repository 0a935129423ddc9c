"""A reader of our output that stalls: what it gets is whole, or the program says that it is not; signals are heard."""

from __future__ import annotations

import fcntl
import io
import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from ftproc.files.writing import flights, streams
from ftproc.simulation import simulate
from tests.faults.batches import PROGRAM

UNBUFFERED = {**os.environ, "PYTHONUNBUFFERED": "1"}
ENVIRONMENTS = {"buffered": dict(os.environ), "unbuffered": UNBUFFERED}
COMMANDS = {
    "filter": ("filter", "long.csv", "-o", "-", "--summary", "none"),
    "follow": ("filter", "-", "--follow", "--summary", "none"),
    "follow jsonl": ("filter", "-", "--follow", "jsonl", "--summary", "none"),
    "simulate": ("simulate", "--scenario", "manoeuvre", "--duration", "600", "-o", "-"),
}


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("stalled")
    flights.write_log(simulate("manoeuvre", duration_s=60.0, seed=1).log, folder / "long.csv")
    return folder


@contextmanager
def started(place: Path, command: tuple[str, ...], environment: dict[str, str]) -> Iterator[subprocess.Popen[bytes]]:
    """A program whose standard output nobody reads, when it waits for its reader; killed at the end."""
    with (
        (place / "long.csv").open("rb") as log,
        subprocess.Popen(
            [PROGRAM, *command], cwd=place, stdin=log, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment
        ) as process,
    ):
        try:
            assert process.stdout is not None
            _until_full(process)
            yield process
        finally:
            process.kill()


def _until_full(process: subprocess.Popen[bytes]) -> None:
    """Until the pipe is full and the program sleeps."""
    waiting = Path(f"/proc/{process.pid}/wchan"), Path(f"/proc/{process.pid}/stat")
    held, since = -1, time.monotonic()
    while time.monotonic() - since < 60:
        assert process.poll() is None, process.stderr.read() if process.stderr else b""
        assert process.stdout is not None
        now = int.from_bytes(fcntl.ioctl(process.stdout, 0x541B, bytes(4)), "little")  # FIONREAD
        if now == held > 30_000 and waiting[1].read_text().rpartition(") ")[2].startswith("S"):
            return
        held = now
        time.sleep(0.3)
    raise AssertionError("the pipe is not full")


@pytest.mark.parametrize(
    "command", [pytest.param(name, marks=pytest.mark.slow) if name == "follow jsonl" else name for name in COMMANDS]
)
def test_stopped_and_continued_all_is_written(place: Path, command: str) -> None:
    """A raw stream then takes less than it is given."""
    with (place / "long.csv").open("rb") as log:
        whole = subprocess.run(
            [PROGRAM, *COMMANDS[command]], check=True, cwd=place, stdin=log, capture_output=True, timeout=120
        )
    with started(place, COMMANDS[command], UNBUFFERED) as process:
        for _ in range(3):
            process.send_signal(signal.SIGSTOP)
            time.sleep(0.1)
            process.send_signal(signal.SIGCONT)
            time.sleep(0.1)
        out, err = process.communicate(timeout=120)
    assert (process.returncode, err) == (0, b"")
    assert len(out.splitlines()) == len(whole.stdout.splitlines()) > 1000
    assert out == whole.stdout


@pytest.mark.parametrize(
    ("command", "number", "environment"),
    [
        pytest.param(
            name, number, environment, id=f"{name}-{number}-{kind}",
            marks=[] if (k + (number == signal.SIGINT)) % 2 == (kind == "buffered") else pytest.mark.slow,
        )
        for k, name in enumerate(COMMANDS)
        for number in (signal.SIGINT, signal.SIGTERM)
        for kind, environment in ENVIRONMENTS.items()
    ],
)  # fmt: skip
def test_signals_are_heard_while_the_reader_stalls(
    place: Path, command: str, number: signal.Signals, environment: dict[str, str]
) -> None:
    with started(place, COMMANDS[command], environment) as process:
        process.send_signal(number)
        code = process.wait(timeout=20)
        assert process.stderr is not None
        err = process.stderr.read().decode()
    if command.startswith("follow"):  # which would publish the rows that it has read, but cannot
        assert code == 1
        assert err == (
            "ftproc: standard output: its reader takes nothing, so the result is lost; read it, or send it to a file.\n"
        )
    else:
        assert code == 128 + number
        assert err == ("ftproc: interrupted\n" if number == signal.SIGINT else "")


def test_messages_to_the_same_reader_do_not_hold_the_program(place: Path) -> None:
    """Standard error goes where standard output stalls."""
    with subprocess.Popen(
        [PROGRAM, *COMMANDS["filter"]], cwd=place, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    ) as process:
        try:
            _until_full(process)
            process.send_signal(signal.SIGINT)
            assert process.wait(timeout=20) == 130
        finally:
            process.kill()


def test_a_slow_reader_gets_all_after_the_end_was_asked_for(place: Path) -> None:
    """It takes a little at a time, and the rows that were read are still published."""
    with started(place, COMMANDS["follow"], UNBUFFERED) as process:
        process.send_signal(signal.SIGTERM)
        assert process.stdout is not None
        found = b""
        while piece := os.read(process.stdout.fileno(), 20_000):
            found += piece
            time.sleep(0.02)
        assert process.wait(timeout=20) == 0
    assert found.endswith(b"\n")
    assert len(found.splitlines()) > 300


def test_a_pipe_that_does_not_block(place: Path) -> None:
    read, write = os.pipe()
    os.set_blocking(write, False)
    with subprocess.Popen([PROGRAM, *COMMANDS["filter"]], cwd=place, stdout=write, stderr=subprocess.PIPE) as process:
        os.close(write)
        found = b""
        time.sleep(2)
        with os.fdopen(read, "rb") as reader:
            found = reader.read()
        assert process.wait(timeout=60) == 0
    assert len(found.splitlines()) == len((place / "long.csv").read_bytes().splitlines())


@pytest.mark.parametrize("environment", ENVIRONMENTS.values(), ids=ENVIRONMENTS)
@pytest.mark.parametrize("command", COMMANDS)
def test_a_full_disk(place: Path, command: str, environment: dict[str, str]) -> None:
    with (place / "long.csv").open("rb") as log, Path("/dev/full").open("wb") as full:
        done = subprocess.run(
            [PROGRAM, *COMMANDS[command]], check=False, cwd=place, stdin=log, stdout=full, stderr=subprocess.PIPE,
            env=environment, timeout=120,
        )  # fmt: skip
    assert done.returncode == 1
    assert done.stderr.decode() == (
        "ftproc: standard output: no space left on device, so the result is lost; send it elsewhere.\n"
    )


@pytest.mark.parametrize("number", [signal.SIGTERM, pytest.param(signal.SIGINT, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("read", "more"),
    [
        pytest.param(False, ("--follow",), id="no reader-follow"),
        pytest.param(True, (), id="a reader that stalls-filter"),
        pytest.param(False, (), id="no reader-filter", marks=pytest.mark.slow),
        pytest.param(True, ("--follow",), id="a reader that stalls-follow", marks=pytest.mark.slow),
    ],
)
def test_a_named_pipe(place: Path, number: signal.Signals, more: tuple[str, ...], read: bool) -> None:
    pipe = place / "pipe.parquet" if read else place / "pipe.csv.gz"
    pipe.unlink(missing_ok=True)
    os.mkfifo(pipe)
    log = "long.csv" if not more else "-"
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK) if read else None
    with (place / "long.csv").open("rb") as text, subprocess.Popen(
        [PROGRAM, "filter", log, "-o", pipe.name, "--summary", "none", *more], cwd=place, stdin=text,
        stderr=subprocess.PIPE,
    ) as process:  # fmt: skip
        try:
            time.sleep(4)
            assert process.poll() is None
            process.send_signal(number)
            code = process.wait(timeout=20)
            assert process.stderr is not None
            err = process.stderr.read().decode()
        finally:
            process.kill()
            if reader is not None:
                os.close(reader)
    assert code == (1 if more else 128 + number)
    assert "Traceback" not in err
    assert (f"{pipe.name}: cannot be written (its reader takes nothing)" in err) == bool(more)


class Short(io.RawIOBase):
    """Takes three bytes at a time, and now and then none."""

    def __init__(self) -> None:
        self.held, self.calls = b"", 0

    def writable(self) -> bool:
        return True

    def write(self, data: object) -> int | None:  # type: ignore[override]
        self.calls += 1
        if self.calls % 3 == 0:
            return None
        self.held += bytes(data)[:3]  # type: ignore[call-overload]
        return min(3, len(bytes(data)))  # type: ignore[call-overload]


def test_short_writes_are_gone_on_with() -> None:
    raw = Short()
    stream = streams.whole(raw)  # type: ignore[arg-type]
    assert stream.write(b"0123456789") == 10
    stream.writelines([b"abcd", b"", b"efg"])
    assert raw.held == b"0123456789abcdefg"


def test_nothing_is_written_after_an_interruption() -> None:
    class Interrupted(Short):
        def write(self, data: object) -> int | None:  # type: ignore[override]
            if self.calls:
                raise KeyboardInterrupt
            return super().write(data)

    raw = Interrupted()
    stream = streams.whole(raw)  # type: ignore[arg-type]
    with pytest.raises(KeyboardInterrupt):
        stream.write(b"0123456789")
    stream.write(b"more")
    assert raw.held == b"012"
