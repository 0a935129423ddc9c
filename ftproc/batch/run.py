"""Many logs through the same filter: each by itself, so that a bad one stops no other, in this process, in worker
processes (`processes`) or on a Dask cluster (`cluster`).

The results come in the order of the tasks, and are the same bytes whoever works.
"""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Iterator, Sequence
from functools import partial

from ftproc.batch.tasks import Begin, Outcome, Say, Task, filter_one
from ftproc.config.recipe import Recipe


def run(
    tasks: Sequence[Task], recipe: Recipe, jobs: int = 1, say: Say | None = None, scheduler: str | None = None
) -> Iterator[Outcome]:
    """Filter every log, in up to `jobs` processes or by the workers of a Dask cluster, whose scheduler has the address
    `scheduler`. Yields the outcomes in the order of the tasks.

    say: is told when kernels are being compiled, which takes a while; with workers it must be picklable.
    Raises ModelError, and UsageError when a site or a report is asked for and pymap3d or plotly is not there, or when
    the cluster is not, before any log is touched.
    """
    _check(tasks, recipe)
    with _workers(len(tasks), recipe, jobs, say, scheduler) as begin:
        waiting = deque([begin(task) for task in tasks])
        while waiting:
            yield waiting.popleft()()


def _workers(
    tasks: int, recipe: Recipe, jobs: int, say: Say | None, scheduler: str | None
) -> contextlib.AbstractContextManager[Begin]:
    if scheduler is not None:
        from ftproc.batch import cluster

        return cluster.pool(recipe, scheduler)
    if jobs > 1 and tasks > 1:
        from ftproc.batch import processes

        return processes.pool(recipe, min(jobs, tasks), say)
    return contextlib.nullcontext(lambda task: partial(filter_one, task, recipe, say))


def _check(tasks: Sequence[Task], recipe: Recipe) -> None:
    from ftproc.correction import model_file
    from ftproc.files.writing import geodesy
    from ftproc.report import style

    model_file.named(recipe.model)
    geodesy.check(recipe.settings)
    if any(task.report is not None for task in tasks):
        style.require_plotly()
