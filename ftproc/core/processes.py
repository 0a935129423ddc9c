"""Worker processes that end with the process that started them, however it ends, and run no code that lies beside a
log."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from functools import partial
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Any

from ftproc.errors import InstallationError

#: fork would copy the threads' locks but not the threads.
CONTEXT = multiprocessing.get_context("spawn")

_SAFE = "PYTHONSAFEPATH"
GRACE_S = 5.0  # for a worker to remove its partial output
_HELD = {getattr(signal, name) for name in ("SIGINT", "SIGHUP", "SIGQUIT", "SIGTERM") if hasattr(signal, name)}


class Workers:
    """A pool of `jobs` processes, each of which calls `prepare(*arguments)` first. As a context manager it waits for
    what was submitted; an exception, such as Ctrl-C, ends the workers in the middle of their work.

    The workers listen to a pipe whose other end only this process holds: it closes when this process is gone.
    """

    def __init__(self, jobs: int, prepare: Callable[..., None] | None = None, *arguments: Any) -> None:
        with starting():
            alive, self._held = CONTEXT.Pipe(duplex=False)
        self._made = partial(ProcessPoolExecutor, jobs, CONTEXT, _begin, (alive, prepare, arguments))
        self.replace()

    def replace(self) -> None:
        """New processes, after one has died; what was submitted is lost."""
        with starting():
            self._pool = self._made()

    def stop(self) -> None:
        """End the workers in the middle of their work, without waiting for it."""
        self._held.close()

    def submit(self, work: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """As of an executor; raises BrokenProcessPool after a worker has died."""
        with starting():
            return self._pool.submit(_worked, work, *arguments)

    def __enter__(self) -> Workers:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is not None:
            self.stop()
        self._pool.shutdown(wait=True, cancel_futures=error is not None)
        self._held.close()


@contextlib.contextmanager
def starting() -> Iterator[None]:
    """Around everything that starts a process, also that with which multiprocessing follows its locks. Raises
    InstallationError.

    Such a process never hears what a terminal sends to all of them, and ends through this one. This one hears signals
    afterwards: a start is not cut in two.
    """
    with _unheard(), _own_code():
        yield


@contextlib.contextmanager
def _unheard() -> Iterator[None]:
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _HELD)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def _own_code() -> Iterator[None]:
    """multiprocessing starts `python -c`, which searches for modules in the current directory first: a `signal.py`
    beside the logs would run in every worker. This variable takes the directory away. Raises InstallationError where
    the interpreter was started to ignore it."""
    if sys.flags.ignore_environment and not sys.flags.safe_path:
        raise InstallationError(
            "python -E ignores PYTHONSAFEPATH, so worker processes would import modules from the current directory; "
            "start Python with -P too, or use one process (--jobs 1)."
        )
    before = os.environ.get(_SAFE)
    os.environ[_SAFE] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[_SAFE]
        else:
            os.environ[_SAFE] = before


def _begin(alive: Connection, prepare: Callable[..., None] | None, arguments: tuple[Any, ...]) -> None:
    """In the worker, before its first task."""

    def begin() -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # where nothing can be held back
        signal.signal(signal.SIGTERM, _ended)
        if hasattr(signal, "pthread_sigmask"):
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})
        threading.Thread(target=_follow, args=(alive,), daemon=True).start()
        if prepare is not None:
            prepare(*arguments)

    _worked(begin)


def _ended(signum: int, frame: object) -> None:
    sys.exit(128 + signum)  # runs every `finally`


def _follow(alive: Connection) -> None:
    """End this worker when the process that started it stops it, or is gone."""
    with contextlib.suppress(EOFError, OSError):
        alive.recv_bytes()
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGTERM)
        time.sleep(GRACE_S)
    os._exit(1)


def _worked(work: Callable[..., Any], *arguments: Any) -> Any:
    try:
        return work(*arguments)
    except SystemExit as end:  # the executor would keep the worker
        os._exit(int(end.code or 0))
