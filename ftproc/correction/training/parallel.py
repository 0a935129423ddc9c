"""Independent tasks in this process or in several."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ftproc.correction.training import Progress, silent
from ftproc.errors import FtprocError


def each(
    work: Callable[..., Any], tasks: Sequence[tuple[Any, ...]], jobs: int, progress: Progress = silent
) -> list[Any]:
    """`work(*task)` of each task, in their order. In one process, `work` takes `progress` as its last argument; in
    several, it counts the tasks done. Raises FtprocError when a process dies."""
    if jobs <= 1 or len(tasks) <= 1:
        return [work(*task, progress) for task in tasks]
    from concurrent.futures import as_completed
    from concurrent.futures.process import BrokenProcessPool

    from ftproc.core.processes import Workers

    with Workers(min(jobs, len(tasks))) as workers:
        try:
            futures = [workers.submit(work, *task) for task in tasks]
            for done, _ in enumerate(as_completed(futures)):
                progress("training", done + 1, len(tasks))
            return [future.result() for future in futures]
        except BrokenProcessPool as cause:
            raise FtprocError("a worker process died (out of memory, or killed); use fewer --jobs") from cause
