"""Worker processes that end with the process that started them, however it ends."""

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
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Any

#: fork would copy the threads' locks but not the threads.
CONTEXT = multiprocessing.get_context("spawn")

GRACE_S = 5.0  # for a worker to remove its partial output
_HELD = {getattr(signal, name) for name in ("SIGINT", "SIGHUP", "SIGQUIT", "SIGTERM") if hasattr(signal, name)}


class Workers:
    """A pool of `jobs` processes, each of which calls `prepare(*arguments)` first. As a context manager it waits for
    what was submitted; an exception, such as Ctrl-C, ends the workers in the middle of their work.

    The workers listen to a pipe whose other end only this process holds: it closes when this process is gone.
    """

    def __init__(self, jobs: int, prepare: Callable[..., None] | None = None, *arguments: Any) -> None:
        with unheard():
            alive, self._held = CONTEXT.Pipe(duplex=False)
            self._pool = ProcessPoolExecutor(
                jobs, mp_context=CONTEXT, initializer=_begin, initargs=(alive, prepare, arguments)
            )

    def submit(self, work: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """As of an executor; raises BrokenProcessPool after a worker has died."""
        with unheard():
            return self._pool.submit(_worked, work, *arguments)

    def __enter__(self) -> Workers:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is not None:
            self._held.close()
        self._pool.shutdown(wait=True, cancel_futures=error is not None)
        self._held.close()


@contextlib.contextmanager
def unheard() -> Iterator[None]:
    """Processes started inside, also that with which multiprocessing follows its locks, never hear what a terminal
    sends to all of them, and end through this process. It hears signals afterwards: a start is not cut in two."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _HELD)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin(alive: Connection, prepare: Callable[..., None] | None, arguments: tuple[Any, ...]) -> None:
    """In the worker, before its first task."""

    def begin() -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # where `unheard` does nothing
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
