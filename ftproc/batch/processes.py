"""The worker processes of `batch`: one log at a time each, stopped at once by Ctrl-C, replaced when one dies."""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from typing import Any

from ftproc.batch.tasks import Begin, Outcome, Say, Task, filter_one
from ftproc.config.recipe import Recipe
from ftproc.core.compiled import COMPILING
from ftproc.core.threads import available, use
from ftproc.errors import Failure

_DIED = "its worker process died (out of memory, or killed). Use fewer --jobs, or split the log."


class _Shared:
    """What all workers see. stop: begin nothing more. said: somebody has told that kernels are being compiled."""

    def __init__(self, context: Any, say: Say | None) -> None:
        self.stop, self.said, self.say = context.Event(), context.Value("b", False), say


@contextlib.contextmanager
def pool(recipe: Recipe, jobs: int, say: Say | None) -> Iterator[Begin]:
    """`jobs` processes. When one dies, what was not done is done one by one."""
    context = multiprocessing.get_context("spawn")  # fork would copy the threads' locks but not the threads
    shared = _Shared(context, say)
    executor = _executor(context, jobs, recipe, shared)

    def begin(task: Task) -> Callable[[], Outcome]:
        alone = partial(_alone, context, task, recipe, shared)
        try:
            return partial(_outcome, executor.submit(_work, task), alone)
        except BrokenProcessPool:
            return alone

    try:
        yield begin
    except BaseException:
        shared.stop.set()
        raise
    finally:
        executor.shutdown(wait=True, cancel_futures=True)


def _outcome(future: Future[Outcome], alone: Callable[[], Outcome]) -> Outcome:
    try:
        return future.result()
    except BrokenProcessPool:
        return alone()


def _executor(context: Any, jobs: int, recipe: Recipe, shared: _Shared) -> ProcessPoolExecutor:
    given = (recipe, max(available() // jobs, 1), shared.stop, shared.said, shared.say)
    return ProcessPoolExecutor(jobs, mp_context=context, initializer=_prepare, initargs=given)


def _alone(context: Any, task: Task, recipe: Recipe, shared: _Shared) -> Outcome:
    """In a worker of its own, so that it is known which log it was that killed one."""
    with _executor(context, 1, recipe, shared) as executor:
        try:
            return executor.submit(_work, task).result()
        except BrokenProcessPool as error:
            return Outcome(task, failure=Failure(f"{task.log}: {_DIED}", 1, str(error)))


_recipe: Recipe
_say: Say | None
_stop: Any


def _prepare(recipe: Recipe, threads: int, stop: Any, said: Any, say: Say | None) -> None:
    """In the worker, before its first task. Together the workers use no more threads than there are processors."""
    global _recipe, _say, _stop
    _recipe, _stop = recipe, stop
    _say = None if say is None else _once(say, said)
    use(threads)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # an idle worker waits for the parent to end it


def _once(say: Say, said: Any) -> Say:
    """`say`, but that the kernels are being compiled only from the first of all workers."""

    def tell(text: str) -> None:
        if text != COMPILING:
            say(text)
            return
        with said.get_lock():
            first, said.value = not said.value, True
        if first:
            say(text)

    return tell


def _work(task: Task) -> Outcome:
    if _stop.is_set():
        raise KeyboardInterrupt
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return filter_one(task, _recipe, _say)
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
