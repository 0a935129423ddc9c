"""The worker pool on this machine: one log at a time each, stopped by Ctrl-C, replaced when a worker dies."""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from typing import Any

from ftproc.batch.tasks import Notify, Outcome, Submit, Task, filter_one
from ftproc.config.recipe import Recipe
from ftproc.core.compiled import COMPILING
from ftproc.core.threads import available, use
from ftproc.errors import Failure

_DIED = "its worker process died (out of memory, or killed). Use fewer --jobs, or split the log."


class _Shared:
    """What all workers share. stop: start no more tasks. compiling: the user knows that kernels are being compiled."""

    def __init__(self, context: Any, notify: Notify | None) -> None:
        self.stop, self.compiling, self.notify = context.Event(), context.Value("b", False), notify


@contextlib.contextmanager
def pool(recipe: Recipe, jobs: int, notify: Notify | None) -> Iterator[Submit]:
    """`jobs` processes. When one dies, the tasks left are done one at a time."""
    context = multiprocessing.get_context("spawn")  # fork would copy the threads' locks but not the threads
    shared = _Shared(context, notify)
    executor = _executor(context, jobs, recipe, shared)

    def submit(task: Task) -> Callable[[], Outcome]:
        alone = partial(_alone, context, task, recipe, shared)
        try:
            with _unheard():
                return partial(_outcome, executor.submit(_work, task), alone)
        except BrokenProcessPool:
            return alone

    try:
        yield submit
    except BaseException:
        shared.stop.set()
        raise
    finally:
        executor.shutdown(wait=True, cancel_futures=True)


@contextlib.contextmanager
def _unheard() -> Iterator[None]:
    """Processes started inside never hear Ctrl-C, not even before they can ignore it; this one hears it afterwards."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _outcome(future: Future[Outcome], alone: Callable[[], Outcome]) -> Outcome:
    try:
        return future.result()
    except BrokenProcessPool:
        return alone()


def _executor(context: Any, jobs: int, recipe: Recipe, shared: _Shared) -> ProcessPoolExecutor:
    arguments = (recipe, max(available() // jobs, 1), shared.stop, shared.compiling, shared.notify)
    return ProcessPoolExecutor(jobs, mp_context=context, initializer=_prepare, initargs=arguments)


def _alone(context: Any, task: Task, recipe: Recipe, shared: _Shared) -> Outcome:
    """In a separate worker, which shows the log that kills it."""
    with _executor(context, 1, recipe, shared) as executor:
        try:
            with _unheard():
                future = executor.submit(_work, task)
            return future.result()
        except BrokenProcessPool as error:
            return Outcome(task, failure=Failure(f"{task.log}: {_DIED}", 1, str(error)))


_recipe: Recipe
_notify: Notify | None
_stop: Any


def _prepare(recipe: Recipe, threads: int, stop: Any, compiling: Any, notify: Notify | None) -> None:
    """In the worker, before its first task. Together the workers use no more threads than there are processors."""
    global _recipe, _notify, _stop
    _recipe, _stop = recipe, stop
    _notify = None if notify is None else _once(notify, compiling)
    use(threads)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # an idle worker waits for the parent to end it


def _once(notify: Notify, compiling: Any) -> Notify:
    """`notify`, with the line about compiling kernels from the first worker only."""

    def filtered(text: str) -> None:
        if text == COMPILING:
            with compiling.get_lock():
                known, compiling.value = compiling.value, True
            if known:
                return
        notify(text)

    return filtered


def _work(task: Task) -> Outcome:
    if _stop.is_set():
        raise KeyboardInterrupt
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return filter_one(task, _recipe, _notify)
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
