"""The worker pool on this machine: one log at a time each, stopped by Ctrl-C, replaced when a worker dies."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from typing import Any

from ftproc.batch.tasks import Notify, Outcome, Submit, Task, filter_one
from ftproc.config.recipe import Recipe
from ftproc.core.compiled import COMPILING
from ftproc.core.processes import CONTEXT, Workers, starting
from ftproc.core.threads import available, use
from ftproc.errors import Failure

_DIED = "its worker process died (out of memory, or killed). Use fewer --jobs, or split the log."


@contextlib.contextmanager
def pool(recipe: Recipe, jobs: int, notify: Notify | None) -> Iterator[Submit]:
    """`jobs` processes. When one dies, the tasks left are done one at a time."""
    with starting():
        compiling = CONTEXT.Value("b", False)  # whether the user knows that kernels are being compiled
    # Together the workers use no more threads than there are processors.
    prepared = (_prepare, recipe, max(available() // jobs, 1), compiling, notify)
    with Workers(jobs, *prepared) as workers:

        def submit(task: Task) -> Callable[[], Outcome]:
            alone = partial(_alone, task, prepared)
            try:
                return partial(_outcome, workers.submit(_work, task), alone)
            except BrokenProcessPool:
                return alone

        yield submit


def _outcome(future: Future[Outcome], alone: Callable[[], Outcome]) -> Outcome:
    try:
        return future.result()
    except BrokenProcessPool:
        return alone()


def _alone(task: Task, prepared: tuple[Any, ...]) -> Outcome:
    """In a separate worker, which shows the log that kills it."""
    with Workers(1, *prepared) as workers:
        try:
            outcome: Outcome = workers.submit(_work, task).result()
            return outcome
        except BrokenProcessPool as error:
            return Outcome(task, failure=Failure(f"{task.log}: {_DIED}", 1, str(error)))


_recipe: Recipe
_notify: Notify | None


def _prepare(recipe: Recipe, threads: int, compiling: Any, notify: Notify | None) -> None:
    """In the worker, before its first task."""
    global _recipe, _notify
    _recipe = recipe
    _notify = None if notify is None else _once(notify, compiling)
    use(threads)


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
    return filter_one(task, _recipe, _notify)
