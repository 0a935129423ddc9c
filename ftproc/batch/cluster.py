"""The worker pool of a Dask cluster: one log at a time each; the log of a worker that dies goes to another.

Workers read the logs and write the trajectories, so both must have the same names on all of them. The model is sent
with each task: a worker could have cached an older one of the same name. The user who starts a worker decides from
where it imports: with PYTHONSAFEPATH=1 not from the directory where it is started.
"""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import importlib.metadata
import logging
import os
import socket
import threading
import time
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import CancelledError
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import ftproc
from ftproc.batch.tasks import Notify, Outcome, Task, filter_one
from ftproc.core.threads import use
from ftproc.correction import model_file
from ftproc.errors import Failure, UsageError, failure
from ftproc.files import layout, remote
from ftproc.settings import NO_MODEL

REACHED_S = 1.0  # for the machine of a scheduler to accept a connection
SEEN_S = 5.0  # for what a worker has written to be seen here
_POLL_S, _END = 0.2, 1 << 16  # bytes
PATIENCE_S = 10.0  # for a scheduler to answer, and for a first worker
_PROTOCOLS = ("tcp", "tls", "ws", "wss")
_START = "Start one with `PYTHONSAFEPATH=1 dask worker {0} --nthreads 1`, and more for more logs at a time."
_CURE = 'install the same there: pip install "ftproc=={0}".'


def require_distributed() -> Any:
    """The module distributed. Raises UsageError when it is not installed."""
    try:
        import distributed
    except ImportError as error:
        raise UsageError(
            '--scheduler needs distributed, which is not installed: pip install "distributed>=2024.1".'
        ) from error
    return distributed


def outcomes(
    tasks: Sequence[Task], address: str, notify: Notify | None = None
) -> Generator[tuple[int, Outcome], None, None]:
    """The number of each task and its outcome, in their order, from all workers of the scheduler at `address`. Raises
    UsageError when it does not answer, has no worker, or has one with another version of ftproc; and for standard
    input."""
    if any("-" in (task.log, task.output) for task in tasks):
        raise UsageError("a cluster reads and writes files only: name the log, and the output with -o.")
    _reach(address)
    distributed = require_distributed()
    unseen: list[str] = []
    with _quiet(), contextlib.closing(_connect(distributed, address)) as client:
        _check_workers(client, address)
        futures = client.map(_work, [_carried(task) for task in tasks], version=ftproc.__version__, pure=False)
        try:
            for number, (task, future) in enumerate(zip(tasks, futures, strict=True)):
                outcome, said = _outcome(distributed, future, task, address, unseen)
                for text in said:
                    (notify or str)(text)
                yield number, outcome
        except BaseException:
            client.cancel(futures)
            raise


def _carried(task: Task) -> Task:
    """What a worker needs: the directory of this process, and the model itself."""
    recipe = replace(task.recipe, model=model_file.named(task.recipe.model) or NO_MODEL)
    return replace(task, recipe=recipe, folder=os.getcwd())  # noqa: PTH109


def _connect(distributed: Any, address: str) -> Any:
    """A client, made only when a scheduler has answered: one that has not takes long to give up, and prints errors."""
    try:
        asyncio.run(_greet(distributed, address))
        return distributed.Client(address, timeout=PATIENCE_S, set_as_default=False)
    except Exception:  # whatever answers may send anything: taken for a length, it may exceed the memory
        raise _unanswered(address, f"no Dask scheduler answers there within {PATIENCE_S:g} s") from None


async def _greet(distributed: Any, address: str) -> None:
    security = distributed.Security().get_connection_args("client")
    greeting = distributed.comm.connect(address, timeout=PATIENCE_S, **security)
    (await asyncio.wait_for(greeting, PATIENCE_S)).abort()  # its own limit holds for each attempt


def _reach(address: str) -> None:
    """Raises UsageError unless `address` is one, and its machine accepts a connection."""
    host, port = _host_and_port(address)
    found: list[Exception | None] = []

    def connect() -> None:
        try:
            with socket.create_connection((host, port), timeout=REACHED_S):
                found.append(None)
        except (OSError, UnicodeError) as error:
            found.append(error)

    connecting = threading.Thread(target=connect, daemon=True)  # names are looked up without a limit of time
    connecting.start()
    connecting.join(REACHED_S)
    if not found or isinstance(found[0], TimeoutError):
        raise _unanswered(address, f"nothing answers there within {REACHED_S:g} s")
    if found[0] is not None:
        reason = (getattr(found[0], "strerror", None) or str(found[0])).lower()
        raise _unanswered(address, f"no connection to it ({reason})") from found[0]


def _host_and_port(address: str) -> tuple[str, int]:
    """Raises UsageError for what is no address."""
    parts = urlsplit(address if "://" in address else f"tcp://{address}")
    try:
        port = parts.port
    except ValueError:
        port = None
    if not parts.hostname or port is None or parts.scheme not in _PROTOCOLS:
        raise _unanswered(address, "this is no address of a scheduler")
    return parts.hostname, port


def _unanswered(address: str, why: str) -> UsageError:
    cure = "Start one with `dask scheduler`; it prints its address, such as tcp://10.0.0.1:8786."
    return UsageError(f"--scheduler {address}: {why}. {cure}")


def _check_workers(client: Any, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=PATIENCE_S)
    except TimeoutError as error:
        raise UsageError(f"--scheduler {address}: it has no workers. {_START.format(address)}") from error
    # A function that workers have without ftproc.
    for worker, found in client.run(importlib.metadata.version, "ftproc", on_error="return").items():
        if found != ftproc.__version__:
            raise UsageError(_differs(worker, None if isinstance(found, BaseException) else found, ftproc.__version__))


def _differs(worker: str, found: str | None, wanted: str) -> str:
    has = "no ftproc" if found is None else f"ftproc {found}"
    return f"the worker {worker} has {has}, this is ftproc {wanted}; {_CURE.format(wanted)}"


class _Done(NamedTuple):
    """What comes back from a worker. written: the files that the task has written there, see `_marks`. said: what the
    user is to read."""

    outcome: Outcome
    written: dict[str, str]
    said: list[str]


def _work(task: Task, version: str) -> _Done:
    """On the worker, which may have joined after the versions were checked."""
    if ftproc.__version__ != version:
        from distributed import get_worker

        message = f"{task.log}: {_differs(get_worker().address, ftproc.__version__, version)}"
        return _Done(Outcome(task, failure=Failure(message, 1, "")), {}, [])
    use(1)  # Dask runs one task for each thread of the machine
    said: list[str] = []
    outcome = filter_one(task, said.append)
    return _Done(outcome, _marks(task) if outcome.failure is None else {}, said)


def _marks(task: Task) -> dict[str, str]:
    """The files of a task that are there, with what tells them from earlier ones: a digest of their size and ends. What
    is stored elsewhere under a URI is not among them."""
    names = (task.output, layout.sidecar(task.output), task.report)
    found = {}
    for name in map(str, filter(None, names)):
        path = remote.local(task.at(name))
        with contextlib.suppress(OSError):
            if path is not None and path.is_file():
                found[name] = _mark(path)
    return found


def _mark(path: Path) -> str:
    with path.open("rb") as stream:
        size = stream.seek(0, os.SEEK_END)
        ends = []
        for offset in (0, max(size - _END, 0)):
            stream.seek(offset)
            ends.append(stream.read(_END))
    return hashlib.blake2b(b"".join(ends), salt=size.to_bytes(16, "little"), digest_size=16).hexdigest()


def _arrived(outcome: Outcome, written: dict[str, str], unseen: list[str]) -> Outcome:
    """The outcome, if this machine sees what the worker has written: a network file system may take its time, for which
    only the first of `unseen` is waited. Else the failure that it is."""
    until = time.monotonic() + (0 if unseen else SEEN_S)
    while written != (here := _marks(outcome.task)):
        if time.monotonic() > until:
            name = next(name for name in written if written[name] != here.get(name))
            unseen.append(name)
            why = f"a worker has written {name}, and this machine does not find it there; give -o a directory that"
            return _failed(outcome.task, f"{why} the workers share with it, or a URI.", FileNotFoundError(name))
        time.sleep(_POLL_S)
    return outcome


def _outcome(
    distributed: Any, future: Any, task: Task, address: str, unseen: list[str]
) -> tuple[Outcome, Sequence[str]]:
    """Waits for the outcome, and what the user is to read. Dask gives the task of a worker that died to another one, a
    few times. unseen: files that workers have written, but not where this machine finds them; gets another one."""
    try:
        done: _Done = future.result()
        return _arrived(replace(done.outcome, task=task), done.written, unseen), done.said
    except distributed.KilledWorker as error:
        return _failed(task, "every worker that took it died (out of memory, or killed). Split the log.", error), ()
    except CancelledError as error:
        return _failed(task, f"the scheduler {address} stopped before it was done; run again.", error), ()
    except Exception as error:
        return Outcome(task, failure=failure(error, task.log)), ()
    finally:
        future.release()


def _failed(task: Task, why: str, error: BaseException) -> Outcome:
    return Outcome(task, failure=Failure(f"{task.log}: {why}", 1, failure(error).trace))


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Silences Dask's log of errors that ftproc reports. Each of its loggers has a level, so that of their parent does
    not count."""
    loggers = [logging.getLogger(name) for name in logging.root.manager.loggerDict if name.startswith("distributed")]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)
