"""Many logs through the same filter: each by itself, so that a bad one stops no other, and by whatever crew: this
process, worker processes (`workers`) or a Dask cluster (`cluster`).

The results come in the order of the tasks, and are the same bytes whoever works.
"""

from __future__ import annotations

import contextlib
import time
import traceback
import warnings
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ftproc.errors import FtprocError, FtprocWarning, interruption
from ftproc.files import remote
from ftproc.records import joined
from ftproc.settings import FilterSettings, Station

if TYPE_CHECKING:
    from ftproc.correction.model import Model
    from ftproc.methods.registry import Method

PACKAGED, NO_MODEL = "packaged", "none"

Say = Callable[[str], None]


@dataclass(frozen=True)
class Task:
    """One log to filter and where its trajectory goes; either may be `-`. method: instead of the recipe's. report:
    where the HTML page goes, if one is wanted. place: the directory that names start from, when it is not the one in
    which the worker stands."""

    log: str
    output: str
    method: str | None = None
    report: str | None = None
    place: str = ""

    def at(self, name: str) -> str:
        """Where the file of that name is for whoever does the task."""
        return str(Path(self.place, name)) if self.place and not remote.is_uri(name) else name


@dataclass(frozen=True)
class Recipe:
    """What is done with every log. model: `packaged`, `none`, a path, or one that was loaded; the rest as
    `files.logs.read` takes it."""

    settings: FilterSettings = field(default_factory=FilterSettings)
    model: str | Model = PACKAGED
    units: str | Mapping[str, str] | None = None
    columns: str | Mapping[str, str] | None = None
    station: Station = field(default_factory=Station)
    keep_columns: bool = False

    def reading(self) -> dict[str, Any]:
        """What `files.logs.read` is told."""
        return {name: getattr(self, name) for name in ("units", "columns", "station", "keep_columns")}


@dataclass(frozen=True)
class Failure:
    """Why something was not done: a sentence for the user, the exit code it deserves, and the traceback."""

    message: str
    exit_code: int
    trace: str


@dataclass(frozen=True)
class Outcome:
    """What became of a task: its summary as text and as a dictionary, or its failure; and the time it took."""

    task: Task
    text: str = ""
    summary: Mapping[str, Any] = field(default_factory=dict)
    failure: Failure | None = None
    elapsed_s: float = 0.0


#: Takes a task and returns what waits for its outcome.
Begin = Callable[[Task], Callable[[], Outcome]]


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
    with _crew(len(tasks), recipe, jobs, say, scheduler) as begin:
        waiting = deque([begin(task) for task in tasks])
        while waiting:
            yield waiting.popleft()()


def _crew(
    tasks: int, recipe: Recipe, jobs: int, say: Say | None, scheduler: str | None
) -> contextlib.AbstractContextManager[Begin]:
    if scheduler is not None:
        from ftproc import cluster

        return cluster.crew(recipe, scheduler)
    if jobs > 1 and tasks > 1:
        from ftproc import workers

        return workers.crew(recipe, min(jobs, tasks), say)
    return contextlib.nullcontext(lambda task: partial(filter_one, task, recipe, say))


def filter_one(task: Task, recipe: Recipe, say: Say | None = None) -> Outcome:
    """Read, filter and write one log. Whatever goes wrong with it is in the outcome; only a closed pipe and
    an interruption are raised."""
    from ftproc import geodesy, pipeline, report, summary, warm
    from ftproc.files import logs, trajectories
    from ftproc.methods import registry

    began = time.perf_counter()
    try:
        log = logs.read(task.at(task.log), **recipe.reading())
        if task.place:
            log = replace(log, name=task.log)  # the trajectory says where it comes from in the user's words
        settings = replace(recipe.settings, method=task.method or recipe.settings.method)
        named = None if task.method is None else registry.named(task.method)
        model = model_named(recipe.model) if named is None else model_for(named, recipe.model)
        filtering = pipeline.Filtering(log, settings, model)
        with warm.announced(say), _passed_on(task.log, say):
            parts = (geodesy.located(part, settings) for part in filtering.parts())
            if task.report is None:
                trajectories.write_parts(parts, filtering.metadata, task.at(task.output))
            else:
                trajectory = joined(list(parts))
                trajectory = replace(trajectory, metadata={**trajectory.metadata, **filtering.metadata()})
                trajectories.write(trajectory, task.at(task.output))
                report.write(trajectory, task.at(task.report))
        metadata = filtering.metadata()
        elapsed_s = time.perf_counter() - began
        return Outcome(task, summary.text(metadata), summary.as_dict(metadata), elapsed_s=elapsed_s)
    except BrokenPipeError:
        raise
    except Exception as error:
        if stop := interruption(error):
            raise stop from None
        return Outcome(task, failure=failure(error, task.log))


def model_for(method: Method, name: str | Model) -> Model | None:
    """The model named if it was trained for the method, else the packaged one: when all methods are run side
    by side, one model cannot suit them all. Raises ModelError."""
    model = model_named(name)
    return model if model is None or method.suits(model.made_for) else model_named(PACKAGED)


@contextlib.contextmanager
def _passed_on(source: str, say: Say | None) -> Iterator[None]:
    """Inside the block, warnings of ours go to `say`, naming their source."""
    if say is None:
        yield
        return
    with warnings.catch_warnings():
        warnings.simplefilter("always", FtprocWarning)
        show = warnings.showwarning

        def tell(message: Warning | str, category: type[Warning], *where: Any) -> None:
            if issubclass(category, FtprocWarning):
                say(f"{source}: {message}")
            else:
                show(message, category, *where)

        warnings.showwarning = tell  # type: ignore[assignment]
        yield


def failure(error: BaseException, source: str | None = None) -> Failure:
    """An error in a plain sentence or two, naming `source` where the error does not do so itself."""
    if isinstance(error, MemoryError):
        traceback.clear_frames(error.__traceback__)  # what filled the memory, or the next log would find no room either
    trace = "".join(traceback.format_exception(error))
    about = f"{source}: " if source else ""
    if isinstance(error, FtprocError):
        return Failure(str(error), error.exit_code, trace)
    if isinstance(error, MemoryError) or "Resource temporarily unavailable" in str(error):
        return Failure(f"{about}there is not enough memory for it. Use fewer --jobs, or split the log.", 1, trace)
    if isinstance(error, RuntimeError) and "no locator available" in str(error):
        cure = "Set NUMBA_CACHE_DIR to a directory that can be written to."
        return Failure(f"the compiled kernels cannot be kept anywhere. {cure}", 1, trace)
    if isinstance(error, OSError) and error.strerror:
        place = error.filename or source or "standard output"
        return Failure(f"{place}: {error.strerror.lower()}.", 1, trace)
    kind = f"{type(error).__name__}: {error}".splitlines()[0][:200]
    return Failure(f"{about}internal error ({kind}); run again with --debug and report it.", 1, trace)


def _check(tasks: Sequence[Task], recipe: Recipe) -> None:
    from ftproc import geodesy, report

    model_named(recipe.model)
    geodesy.check(recipe.settings)
    if any(task.report is not None for task in tasks):
        report.require_plotly()


def model_named(name: str | Model) -> Model | None:
    """`packaged`, `none` or a file -> the correction; one that was loaded is what it is. Raises ModelError."""
    if name == NO_MODEL:
        return None
    return _loaded(name) if isinstance(name, str) else name


@cache
def _loaded(name: str) -> Model:
    from ftproc import pipeline
    from ftproc.correction import model_file

    return pipeline.default_model() if name == PACKAGED else model_file.load(name)
