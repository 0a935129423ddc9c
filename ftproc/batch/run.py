"""Many logs through the filter, independently, so that a bad one does not stop the others: in this process, in worker
processes or on a Dask cluster, with the same bytes."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Generator, Sequence

from ftproc.batch.tasks import Notify, Outcome, Task, filter_one
from ftproc.correction import model_file
from ftproc.files.writing import geodesy


def run(
    tasks: Sequence[Task],
    jobs: int = 1,
    notify: Notify | None = None,
    scheduler: str | None = None,
    ended: Callable[[Outcome], object] = lambda outcome: None,
) -> Generator[Outcome, None, None]:
    """Filter every log, in up to `jobs` processes or on the Dask cluster of the scheduler at this address. Yields the
    outcomes in the order of the tasks.

    notify: takes warnings, and a line when kernels have to be compiled; with workers it must be picklable. ended: takes
    each outcome as soon as it is there.
    Before any log is read, raises ModelError, and UsageError when pymap3d is needed and not installed, or the cluster
    does not answer.
    """
    for recipe in {id(task.recipe): task.recipe for task in tasks}.values():
        model_file.named(recipe.model)
        geodesy.check(recipe.settings)
    early: dict[int, Outcome] = {}
    following = 0
    with contextlib.closing(_outcomes(tasks, jobs, notify, scheduler)) as outcomes:
        for number, outcome in outcomes:
            ended(outcome)
            early[number] = outcome
            while following in early:
                yield early.pop(following)
                following += 1


def _outcomes(
    tasks: Sequence[Task], jobs: int, notify: Notify | None, scheduler: str | None
) -> Generator[tuple[int, Outcome], None, None]:
    """The number of each task and its outcome, as they end."""
    if scheduler is not None:
        from ftproc.batch import cluster

        return cluster.outcomes(tasks, scheduler, notify)
    if jobs > 1 and len(tasks) > 1:
        from ftproc.batch import processes

        return processes.outcomes(tasks, min(jobs, len(tasks)), notify)
    return ((number, filter_one(task, notify)) for number, task in enumerate(tasks))
