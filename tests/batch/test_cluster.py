"""A real scheduler and two worker processes on loopback: the same bytes as local, also when one of them dies."""

from __future__ import annotations

import contextlib
import logging
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple, TypeVar

import pytest

from ftproc import __version__
from ftproc.batch import cluster, run
from ftproc.batch.tasks import Task
from ftproc.config.recipe import Recipe
from ftproc.correction import model_file
from ftproc.errors import UsageError
from ftproc.files.writing.flights import write_log
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate

T = TypeVar("T")
FTPROC = Path(sys.prefix) / "bin" / "ftproc"
PATIENCE_S = 60.0


class Cluster(NamedTuple):
    address: str
    scheduler: subprocess.Popen[bytes]
    workers: list[subprocess.Popen[bytes]]


@pytest.fixture(scope="module")
def two_workers(tmp_path_factory) -> Iterator[Cluster]:
    """A scheduler on a free port and two workers of one thread each, in a directory of their own."""
    folder = tmp_path_factory.mktemp("cluster")
    common = ["--host", "127.0.0.1", "--no-dashboard"]
    worker = ["--scheduler-file", "scheduler.json", "--nthreads", "1", "--no-nanny", "--memory-limit", "0"]
    worker += ["--death-timeout", "60", "--local-directory", str(folder)]
    processes = [_start(folder, "dask_scheduler", "--port", "0", "--scheduler-file", "scheduler.json", *common)]
    try:
        processes += [_start(folder, "dask_worker", *worker, *common) for _ in range(2)]
        _until((folder / "scheduler.json").exists)
        from distributed import Client

        with Client(scheduler_file=str(folder / "scheduler.json"), set_as_default=False) as client:
            client.wait_for_workers(2, timeout=PATIENCE_S)
            address = client.scheduler.address
        yield Cluster(address, processes[0], processes[1:])
    finally:
        for process in processes:
            process.kill()
            process.wait()


@pytest.fixture
def flights(tmp_path, monkeypatch) -> list[str]:
    """Six short logs in the current directory, the third of which is none."""
    monkeypatch.chdir(tmp_path)
    for number in range(6):
        write_log(simulate("zuo2021-outliers", seed=number).log, f"{number}.csv")
    Path("2.csv").write_text("no log\n1\n")
    return [f"{number}.csv" for number in range(6)]


def test_the_cluster_gives_what_this_process_gives(two_workers, flights, monkeypatch):
    """Names are relative to the user's directory, and a model is the user's, not one that a worker has cached."""
    model_file.save(model_file.named("packaged"), Path("mine.safetensors"))
    recipe = Recipe(model="mine.safetensors")
    alone = list(run.run(_tasks(flights, "alone", recipe)))
    shared = list(run.run(_tasks(flights, "shared", recipe), scheduler=two_workers.address))
    assert [outcome.failure is None for outcome in shared] == [True, True, False, True, True, True]
    assert [outcome.text for outcome in shared] == [outcome.text for outcome in alone]
    assert [outcome.summary for outcome in shared] == [outcome.summary for outcome in alone]
    assert [outcome.task.log for outcome in shared] == flights
    assert shared[2].failure is not None
    assert alone[2].failure is not None
    assert shared[2].failure.message == alone[2].failure.message  # with the names that the user has given
    assert _contents("shared") == _contents("alone")
    assert len(_contents("alone")) == 10  # each with its sidecar


def test_warnings_of_workers_reach_the_user(two_workers, flights):
    recipe, said = Recipe(settings=FilterSettings(method="renpf", particles=40)), list[str]()
    assert (
        len(list(run.run(_tasks(flights[:2], "few", recipe), notify=said.append, scheduler=two_workers.address))) == 2
    )
    assert said == [f"{n}: renpf: 40 particles are few for 9 states; 90 or more are trustworthy" for n in flights[:2]]


def test_a_cluster_reads_no_standard_input(two_workers):
    with pytest.raises(UsageError, match="a cluster reads and writes files only"):
        next(run.run([Task("-", "-")], scheduler=two_workers.address))


def test_a_worker_with_another_version_is_named(two_workers, flights, monkeypatch):
    monkeypatch.setattr("ftproc.__version__", "9.9")
    with pytest.raises(
        UsageError, match=rf"the worker tcp://127.0.0.1:\d+ has ftproc {__version__}, this is ftproc 9.9; .*pip"
    ):
        next(run.run(_tasks(flights, "none"), scheduler=two_workers.address))
    monkeypatch.setattr(cluster, "_check_workers", lambda client, address: None)  # it joins after they were asked
    (late,) = run.run(_tasks(flights[:1], "late"), scheduler=two_workers.address)
    assert late.failure is not None
    assert late.failure.message.startswith("0.csv: the worker tcp://127.0.0.1:")
    assert f"has ftproc {__version__}, this is ftproc 9.9" in late.failure.message
    assert not _contents("none")
    assert not _contents("late")


def test_the_log_of_a_worker_that_dies_is_done_by_the_other(two_workers, flights):
    """One is killed as soon as a first trajectory is there, while both have logs to do."""
    write_log(simulate("zuo2021-outliers", seed=2).log, "2.csv")
    expected = list(run.run(_tasks(flights, "alone")))
    command = [FTPROC, "filter", *flights, "-o", "shared/", "--scheduler", two_workers.address]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            _until(lambda: list(Path("shared").glob("[!.]*.csv")))
            two_workers.workers[0].kill()
            left = len(flights) - len(list(Path("shared").glob("[!.]*.csv")))
            two_workers.workers[0].wait()
            out, err = process.communicate(timeout=PATIENCE_S)
        finally:
            process.kill()
    assert left > 0
    assert (process.returncode, err) == (0, "")
    assert out.count("-> shared/") == 6
    assert all(outcome.failure is None for outcome in expected)
    assert _contents("shared") == _contents("alone")


def test_an_output_that_only_the_worker_has(two_workers, flights, monkeypatch, tmp_path):
    """Where it has a directory of the same name that is another one: here it finds none, or an earlier file."""
    (tmp_path / "theirs").mkdir()
    monkeypatch.setattr(cluster, "SEEN_S", 0.3)
    monkeypatch.setattr(cluster.os, "getcwd", lambda: str(tmp_path / "theirs"))
    tasks = [Task(str(tmp_path / name), f"{name}.out.csv") for name in flights[:2]]
    Path("1.csv.out.csv").write_bytes(b"earlier")
    missing, older = run.run(tasks, scheduler=two_workers.address)
    for outcome, name in ((missing, "0.csv.out.csv"), (older, "1.csv.out.csv")):
        assert outcome.failure is not None
        assert outcome.failure.exit_code == 1
        assert outcome.failure.message == (
            f"{outcome.task.log}: a worker has written {name}, and this machine does not find it there; give -o a "
            "directory that the workers share with it, or a URI."
        )
        assert (tmp_path / "theirs" / name).exists()


def test_all_workers_dead(two_workers, flights, monkeypatch):
    for worker in two_workers.workers:
        worker.kill()
        worker.wait()
    monkeypatch.setattr(cluster, "PATIENCE_S", 3.0)
    with pytest.raises(
        UsageError, match=r"it has no workers. Start one with `PYTHONSAFEPATH=1 dask worker tcp://127.0.0.1:\d+ "
    ):
        next(run.run(_tasks(flights, "none"), scheduler=two_workers.address))


def test_the_scheduler_stops(two_workers, flights, monkeypatch):
    """After the last test it has no workers, so the log waits when it is killed."""
    monkeypatch.setattr(cluster, "PATIENCE_S", 3.0)
    monkeypatch.setattr(cluster, "_check_workers", lambda client, address: two_workers.scheduler.kill())
    (outcome,) = run.run(_tasks(flights[:1], "none"), scheduler=two_workers.address)
    assert outcome.failure is not None
    expected = f"0.csv: the scheduler {two_workers.address} stopped before it was done; run again."
    assert outcome.failure.message == expected


def test_dask_s_log_is_not_shown(capsys):
    """Such as a result lost with its worker, which is computed again."""
    cluster.require_distributed()
    logger = logging.getLogger("distributed.client")
    handler = logging.StreamHandler(sys.stderr)
    logger.addHandler(handler)
    try:
        with cluster._quiet():
            logger.error("inside")
        logger.error("after")
    finally:
        logger.removeHandler(handler)
    err = capsys.readouterr().err
    assert "inside" not in err
    assert "after" in err


def test_a_log_that_kills_every_worker_is_named():
    import distributed

    class Future:
        def result(self) -> None:
            raise distributed.KilledWorker("task", SimpleNamespace(address="tcp://there:2"), 3)

        def release(self) -> None:
            pass

    outcome, _ = cluster._outcome(distributed, Future(), Task("a.csv", "b.csv"), "tcp://there:1", [])
    assert outcome.failure is not None
    assert outcome.failure.message.startswith("a.csv: every worker that took it died (out of memory, or killed).")
    assert "KilledWorker" in outcome.failure.trace


def _refused(flights: list[str], address: str) -> str:
    with pytest.raises(UsageError) as caught:
        next(run.run(_tasks(flights, "none"), scheduler=address))
    assert str(caught.value).startswith(f"--scheduler {address}: ")
    assert str(caught.value).endswith(
        "Start one with `dask scheduler`; it prints its address, such as tcp://10.0.0.1:8786."
    )
    return str(caught.value)


@pytest.mark.parametrize(
    "address",
    [
        "",
        "foo",
        "tcp://foo",
        "nonsense://here:1",
        "http://127.0.0.1:8786",
        "no address at all",
        "h:99999",
        "h:x",
        "::1",
    ],
)
def test_what_is_no_address(flights, address):
    assert "this is no address of a scheduler" in _refused(flights, address)


def test_a_scheduler_that_is_not_there(flights, monkeypatch):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))  # and never listens
        sentence = _refused(flights, f"127.0.0.1:{taken.getsockname()[1]}")
    assert "no connection to it (connection refused)" in sentence
    assert "no connection to it (" in _refused(flights, "nowhere..invalid:8786")  # no name at all

    def unknown(*_: object, **__: object) -> None:  # where there is no network a real answer may take long
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", unknown)
    assert "no connection to it (name or service not known)" in _refused(flights, "nowhere.invalid:8786")


def test_a_name_that_is_looked_up_for_long(flights, monkeypatch):
    gone = threading.Event()

    def looked_up(*_: object, **__: object) -> None:
        gone.wait(60)
        raise OSError

    monkeypatch.setattr(cluster, "REACHED_S", 0.1)
    monkeypatch.setattr(socket, "create_connection", looked_up)
    assert "nothing answers there within 0.1 s" in _refused(flights, "10.0.0.1:8786")
    gone.set()


@pytest.mark.parametrize("said", [b"\0", b"HTTP/1.1 400 Bad Request\r\n\r\n" * 9])
def test_what_answers_is_no_scheduler(flights, monkeypatch, said, capfd):
    """It says nothing; or something that is taken for a length."""
    monkeypatch.setattr(cluster, "PATIENCE_S", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as server:

        def answer() -> None:
            with contextlib.suppress(OSError):
                while True:
                    connection, _ = server.accept()
                    connection.sendall(said)
                    held.append(connection)

        held: list[socket.socket] = []
        threading.Thread(target=answer, daemon=True).start()
        sentence = _refused(flights, f"tcp://127.0.0.1:{server.getsockname()[1]}")
    for connection in held:
        connection.close()
    assert "no Dask scheduler answers there within 0.5 s" in sentence
    assert capfd.readouterr().err == ""


def test_without_distributed(flights, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    missing = pytest.raises(UsageError, match=r"--scheduler needs distributed, which is not installed: pip install")
    with socket.create_server(("127.0.0.1", 0)) as server, missing:
        next(run.run(_tasks(flights, "none"), scheduler=f"127.0.0.1:{server.getsockname()[1]}"))


def _start(folder: Path, module: str, *args: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", f"distributed.cli.{module}", *args]
    return subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def _tasks(names: list[str], directory: str, recipe: Recipe | None = None) -> list[Task]:
    Path(directory).mkdir(exist_ok=True)
    return [Task(n, f"{directory}/{n.replace('.csv', '.trajectory.csv')}", recipe or Recipe()) for n in names]


def _contents(directory: str) -> dict[str, bytes]:
    """Its outputs; the hidden file that a killed worker was writing is none."""
    return {path.name: path.read_bytes() for path in Path(directory).glob("[!.]*")}


def _until(found: Callable[[], T | None]) -> T:
    """What `found` gives as soon as it is true."""
    deadline = time.monotonic() + PATIENCE_S
    while not (value := found()):
        assert time.monotonic() < deadline, "timed out"
        time.sleep(0.02)
    return value
