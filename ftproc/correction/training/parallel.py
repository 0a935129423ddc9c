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
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor, as_completed
    from concurrent.futures.process import BrokenProcessPool

    context = multiprocessing.get_context("spawn")  # fork would copy the threads' locks but not the threads
    pool = ProcessPoolExecutor(min(jobs, len(tasks)), mp_context=context, initializer=_quiet)
    try:
        futures = [pool.submit(work, *task) for task in tasks]
        for done, _ in enumerate(as_completed(futures)):
            progress("training", done + 1, len(tasks))
        return [future.result() for future in futures]
    except BrokenProcessPool as cause:
        raise FtprocError("a worker process died (out of memory, or killed); use fewer --jobs") from cause
    except BaseException:
        for worker in list((pool._processes or {}).values()):
            worker.terminate()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _quiet() -> None:
    """Ignore Ctrl-C: the parent handles it."""
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)
