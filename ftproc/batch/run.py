"""Many logs through the same filter, independently, so that a bad one does not stop the others: in this process, in
worker processes or on a Dask cluster, with the same bytes."""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Iterator, Sequence
from functools import partial

from ftproc.batch.tasks import Notify, Outcome, Submit, Task, filter_one
from ftproc.config.recipe import Recipe
from ftproc.correction import model_file
from ftproc.files.writing import geodesy


def run(
    tasks: Sequence[Task], recipe: Recipe, jobs: int = 1, notify: Notify | None = None, scheduler: str | None = None
) -> Iterator[Outcome]:
    """Filter every log, in up to `jobs` processes or on the Dask cluster of the scheduler at this address. Yields the
    outcomes in the order of the tasks.

    notify: takes warnings, and a line when kernels have to be compiled; with workers it must be picklable.
    Before any log is read, raises ModelError, and UsageError when pymap3d is needed and not installed, or the cluster
    does not answer.
    """
    model_file.named(recipe.model)
    geodesy.check(recipe.settings)
    with _workers(len(tasks), recipe, jobs, notify, scheduler) as submit:
        waiting = deque([submit(task) for task in tasks])
        while waiting:
            yield waiting.popleft()()


def _workers(
    tasks: int, recipe: Recipe, jobs: int, notify: Notify | None, scheduler: str | None
) -> contextlib.AbstractContextManager[Submit]:
    if scheduler is not None:
        from ftproc.batch import cluster

        return cluster.pool(recipe, scheduler)
    if jobs > 1 and tasks > 1:
        from ftproc.batch import processes

        return processes.pool(recipe, min(jobs, tasks), notify)
    return contextlib.nullcontext(lambda task: partial(filter_one, task, recipe, notify))
