"""Independent pieces of work in this process or in several."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ftproc.errors import FtprocError

Progress = Callable[[str, int, int], None]


def each(
    work: Callable[..., Any], tasks: Sequence[tuple[Any, ...]], jobs: int, progress: Progress | None = None
) -> list[Any]:
    """`work(*task)` of each task, in their order. In one process, `work` is also given `progress`; in several, the
    tasks done are counted. Raises FtprocError when a process dies."""
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
            if progress is not None:
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
    """Ctrl-C is the parent's to deal with."""
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)
