"""Many logs: isolation, order, and the same bytes from any number of workers."""

from __future__ import annotations

import multiprocessing
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import pytest

from ftproc.batch import processes, run
from ftproc.batch.tasks import Task
from ftproc.config.recipe import Recipe
from ftproc.errors import ModelError
from ftproc.files.writing import flights
from ftproc.simulation import simulate

PROGRAM = str(Path(sys.prefix) / "bin" / "ftproc")
COUNT = 40  # logs of a batch that is stopped after the first


@pytest.fixture
def tasks(tmp_path):
    """Four flights and, second, a log that is none."""
    made = []
    for number in range(5):
        log = tmp_path / f"{number}.csv"
        if number == 1:
            log.write_text("no log\n1\n")
        else:
            flights.write_log(simulate("zuo2021-outliers", seed=number).log, log)
        made.append(log)

    def into(directory: str) -> list[Task]:
        (tmp_path / directory).mkdir()
        return [Task(str(log), str(tmp_path / directory / f"{log.stem}.parquet")) for log in made]

    return into


def test_any_number_of_workers_gives_the_same_in_the_same_order(tasks, tmp_path):
    alone = list(run.run(tasks("one")))
    together = list(run.run(tasks("three"), jobs=3))
    assert [outcome.failure is None for outcome in alone] == [True, False, True, True, True]
    assert [outcome.text for outcome in alone] == [outcome.text for outcome in together]
    assert [outcome.summary for outcome in alone] == [outcome.summary for outcome in together]
    assert alone[1].failure is not None
    assert together[1].failure is not None
    assert alone[1].failure.message == together[1].failure.message
    for file in (tmp_path / "one").iterdir():
        assert file.read_bytes() == (tmp_path / "three" / file.name).read_bytes()
    assert len(list((tmp_path / "three").iterdir())) == 4


def test_an_unexpected_error_fails_its_log_only(tasks, monkeypatch):
    monkeypatch.setattr("ftproc.pipeline.Filtering", lambda *args: 1 / 0)
    outcomes = list(run.run(tasks("one")))
    found = [outcome.failure for outcome in outcomes]
    assert all(failure is not None and failure.exit_code == 1 for failure in found)
    assert found[0] is not None
    assert "internal error (ZeroDivisionError: division by zero)" in found[0].message
    assert found[0].message.startswith(outcomes[0].task.log)
    assert "Traceback" in found[0].trace


def test_a_bad_model_is_reported_before_any_log_is_read(tasks, tmp_path):
    with pytest.raises(ModelError, match="there is no such file"):
        next(run.run([replace(task, recipe=Recipe(model=str(tmp_path / "none"))) for task in tasks("one")]))


def test_a_worker_that_dies_takes_only_its_own_log_with_it(tmp_path):
    """A named pipe without a reader holds a worker until it is killed, as the system does when memory is short."""
    stuck, good = tmp_path / "stuck.csv", tmp_path / "good.csv"
    os.mkfifo(tmp_path / "a.csv")
    flights.write_log(simulate("zuo2021").log, stuck)
    flights.write_log(simulate("zuo2021").log, good)
    done = threading.Event()

    def kill_waiting_workers() -> None:
        while not done.wait(1.0):
            for child in multiprocessing.active_children() if (tmp_path / "b.csv").exists() else ():
                child.kill()

    killer = threading.Thread(target=kill_waiting_workers)
    killer.start()
    try:
        tasks = [Task(str(stuck), str(tmp_path / "a.csv")), Task(str(good), str(tmp_path / "b.csv"))]
        first, second = run.run(tasks, jobs=2)
    finally:
        done.set()
        killer.join()
    assert first.failure is not None
    assert first.failure.message.startswith(f"{stuck}: its worker process died")
    assert second.failure is None
    assert (tmp_path / "b.csv").exists()


def test_a_process_started_for_work_is_deaf_to_ctrl_c_from_its_first_moment():
    code = "import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))"
    heard = [sys.executable, "-c", code]
    with processes.starting():
        inside = subprocess.run(heard, capture_output=True, text=True, check=True).stdout
    outside = subprocess.run(heard, capture_output=True, text=True, check=True).stdout
    assert (inside, outside) == ("True\n", "False\n")


@pytest.mark.parametrize(
    ("end", "group"),
    [
        (signal.SIGKILL, False),
        pytest.param(signal.SIGKILL, True, marks=pytest.mark.slow),
        pytest.param(signal.SIGHUP, False, marks=pytest.mark.slow),
        (signal.SIGTERM, True),
    ],
)
def test_workers_end_with_the_process_that_started_them(tmp_path, end, group):
    """Also in the middle of a log; only what kills at once leaves a partial file."""
    flights.write_log(simulate("manoeuvre", duration_s=1200.0, seed=1).log, tmp_path / "0.parquet")
    for number in range(1, 4):
        shutil.copy(tmp_path / "0.parquet", tmp_path / f"{number}.parquet")
    command = [PROGRAM, "filter", *(f"{n}.parquet" for n in range(4)), "--jobs", "2", "-o", "out"]
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        _until(lambda: sum("libarrow" in Path(f"/proc/{pid}/maps").read_text() for pid in _children(process.pid)) == 2)
        workers = _children(process.pid)
        (os.killpg if group else os.kill)(process.pid, end)
        err = process.communicate(timeout=60)[1]
    assert process.returncode == (-9 if end == signal.SIGKILL else 128 + end)
    assert "Traceback" not in err
    _until(lambda: not [pid for pid in workers if Path(f"/proc/{pid}").exists()])
    if end != signal.SIGKILL:
        assert not list(tmp_path.glob("out/.*"))


def _children(pid: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def _until(found):
    deadline = time.monotonic() + 60
    while not (value := found()):
        assert time.monotonic() < deadline, "timed out"
        time.sleep(0.02)
    return value


def test_ctrl_c_stops_all_workers_and_leaves_only_whole_files(tmp_path):
    for number in range(COUNT):
        flights.write_log(simulate("manoeuvre", duration_s=30.0, seed=number).log, tmp_path / f"{number}.parquet")
    names = [f"{number}.parquet" for number in range(COUNT)]
    command = [PROGRAM, "filter", *names, "--jobs", "2", "-o", "out"]
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        deadline = time.monotonic() + 60
        while not list(tmp_path.glob("out/*.parquet")) and time.monotonic() < deadline:
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to all of the group
        err = process.communicate(timeout=60)[1]
    assert process.returncode == 130
    assert err.strip().endswith("ftproc: interrupted")
    assert "Traceback" not in err
    written = [path.name for path in (tmp_path / "out").iterdir()]
    assert 0 < len(written) < COUNT
    assert all(name.endswith(".trajectory.parquet") and not name.startswith(".") for name in written)


@pytest.mark.parametrize("stop", [KeyboardInterrupt(), SystemExit(143)])
def test_an_interruption_inside_a_kernel_is_no_failure_of_the_log(tasks, monkeypatch, stop):
    """A kernel that a signal interrupts while it returns raises SystemError."""

    def interrupted(*_: object) -> None:
        raise SystemError("CPUDispatcher returned a result with an exception set") from stop

    monkeypatch.setattr("ftproc.pipeline.Filtering", interrupted)
    with pytest.raises(type(stop)) as raised:
        list(run.run(tasks("out")[:1]))
    assert raised.value is stop
