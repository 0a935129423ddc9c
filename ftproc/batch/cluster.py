"""The worker pool of a Dask cluster: one log at a time each; the log of a worker that dies goes to another.

Workers read the logs and write the trajectories, so both must have the same names on all of them. The model is sent
with each task: a worker could have cached an older one of the same name.
"""

from __future__ import annotations

import contextlib
import importlib.metadata
import logging
import os
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from dataclasses import replace
from functools import partial
from typing import Any

import ftproc
from ftproc.batch.tasks import Outcome, Submit, Task, filter_one
from ftproc.config.recipe import Recipe
from ftproc.core.threads import use
from ftproc.correction import model_file
from ftproc.errors import Failure, UsageError, failure
from ftproc.settings import NO_MODEL

PATIENCE_S = 10.0  # for a scheduler to answer, and for a first worker
_START = "Start one with `dask worker {0} --nthreads 1`, and more for more logs at a time."
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


@contextlib.contextmanager
def pool(recipe: Recipe, address: str) -> Iterator[Submit]:
    """All workers of the scheduler at `address`. Raises UsageError when it does not answer, has no worker, or has one
    with another version of ftproc."""
    distributed = require_distributed()
    carried = replace(recipe, model=model_file.named(recipe.model) or NO_MODEL)
    with _quiet(), contextlib.closing(_connect(distributed, address)) as client:
        _check_workers(client, address)
        futures: list[Any] = []

        def submit(task: Task) -> Callable[[], Outcome]:
            if "-" in (task.log, task.output):
                raise UsageError("a cluster reads and writes files only: name the log, and the output with -o.")
            here = replace(task, place=os.getcwd())  # noqa: PTH109
            future = client.submit(_work, here, carried, ftproc.__version__, pure=False)
            futures.append(future)
            return partial(_outcome, distributed, future, task, address)

        try:
            yield submit
        except BaseException:
            client.cancel(futures)
            raise


def _connect(distributed: Any, address: str) -> Any:
    try:
        return distributed.Client(address, timeout=PATIENCE_S, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise UsageError(
            f"--scheduler {address}: no Dask scheduler answers there within {PATIENCE_S:g} s. Start one with "
            f"`dask scheduler`; it prints its address, such as tcp://10.0.0.1:8786."
        ) from error


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


def _work(task: Task, recipe: Recipe, version: str) -> Outcome:
    """On the worker, which may have joined after the versions were checked."""
    if ftproc.__version__ != version:
        from distributed import get_worker

        message = f"{task.log}: {_differs(get_worker().address, ftproc.__version__, version)}"
        return Outcome(task, failure=Failure(message, 1, ""))
    use(1)  # Dask runs one task for each thread of the machine
    return filter_one(task, recipe)


def _outcome(distributed: Any, future: Any, task: Task, address: str) -> Outcome:
    """Waits for the outcome. Dask gives the task of a worker that died to another one, a few times."""
    try:
        outcome: Outcome = future.result()
        return replace(outcome, task=task)
    except distributed.KilledWorker as error:
        return _failed(task, "every worker that took it died (out of memory, or killed). Split the log.", error)
    except CancelledError as error:
        return _failed(task, f"the scheduler {address} stopped before it was done; run again.", error)
    except Exception as error:
        return Outcome(task, failure=failure(error, task.log))
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
