"""The worker pool on this machine: one log at a time each, stopped by Ctrl-C; a worker that dies is replaced."""

from __future__ import annotations

import contextlib
import gc
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from ftproc.batch.tasks import Notify, Outcome, Task, filter_one
from ftproc.core.compiled import COMPILING
from ftproc.core.processes import CONTEXT, Workers, starting
from ftproc.core.threads import available, use
from ftproc.errors import Failure

_DIED = "its worker process died (out of memory, or killed). Use fewer --jobs, or split the log."


def outcomes(tasks: Sequence[Task], jobs: int, notify: Notify | None) -> Generator[tuple[int, Outcome], None, None]:
    """The number of each task and its outcome, as they end, from `jobs` processes.

    A log whose worker dies is tried a second time, with no other log beside it: when the memory was short, it has all
    of it, and when it dies again, it is the cause.
    """
    with starting():
        compiling = CONTEXT.Value("b", False)  # whether the user knows that kernels are being compiled
    # Together the workers use no more threads than there are processors.
    prepared = (_prepare, max(available() // jobs, 1), compiling, notify)
    waiting, suspects = deque(range(len(tasks))), set[int]()
    running: dict[Future[Outcome], tuple[int, Workers]] = {}

    def next_may_start() -> bool:
        if not waiting or not idle:
            return False
        return not running or not suspects.intersection([waiting[0], *(number for number, _ in running.values())])

    with _pool(jobs, prepared) as idle:
        while waiting or running:
            while next_may_start():
                number, worker = waiting.popleft(), idle.pop()
                running[_submitted(worker, tasks[number])] = number, worker
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                number, worker = running.pop(future)
                try:
                    outcome = future.result()
                except BrokenProcessPool as error:
                    worker.replace()
                    if number not in suspects:
                        suspects.add(number)
                        waiting.appendleft(number)
                        continue
                    outcome = Outcome(tasks[number], failure=Failure(f"{tasks[number].log}: {_DIED}", 1, str(error)))
                finally:
                    idle.append(worker)
                yield number, outcome


def _submitted(worker: Workers, task: Task) -> Future[Outcome]:
    """Also where the worker has died since its last log."""
    try:
        return worker.submit(_work, task)
    except BrokenProcessPool:
        worker.replace()
        return worker.submit(_work, task)


@contextlib.contextmanager
def _pool(jobs: int, prepared: tuple[Any, ...]) -> Iterator[list[Workers]]:
    """So many workers, each a pool of its own: the executor ends all of a pool when one dies."""
    with contextlib.ExitStack() as stack:
        workers = [stack.enter_context(Workers(1, *prepared)) for _ in range(jobs)]
        try:
            yield list(workers)
        except BaseException:
            for worker in workers:
                worker.stop()
            raise


_notify: Notify | None


def _prepare(threads: int, compiling: Any, notify: Notify | None) -> None:
    """In the worker, before its first task."""
    global _notify
    _notify = None if notify is None else _once(notify, compiling)
    use(threads)
    gc.set_threshold(100_000, 50, 50)  # as the program itself: a log leaves little garbage


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
    return filter_one(task, _notify)
