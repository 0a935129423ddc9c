"""Many logs through the same filter: each by itself, so that a bad one stops no other, and in any number of workers.

The results come in the order of the tasks, and are the same bytes whatever the number of workers.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import TYPE_CHECKING, Any

from ftproc.errors import FtprocError
from ftproc.settings import FilterSettings

if TYPE_CHECKING:
    from ftproc.correction.model import Model

PACKAGED, NO_MODEL = "packaged", "none"

Say = Callable[[str], None]


@dataclass(frozen=True)
class Task:
    """One log to filter and where its trajectory goes; either may be `-`. method: instead of the recipe's."""

    log: str
    output: str
    method: str | None = None


@dataclass(frozen=True)
class Recipe:
    """What is done with every log. model: `packaged`, `none` or a path; the rest as `files.logs.read` takes it."""

    settings: FilterSettings = field(default_factory=FilterSettings)
    model: str = PACKAGED
    units: str | None = None
    columns: str | None = None
    azimuth_from: str = "x"
    keep_columns: bool = False


@dataclass(frozen=True)
class Failure:
    """Why something was not done: a sentence for the user, the exit code it deserves, and the traceback."""

    message: str
    exit_code: int
    trace: str


@dataclass(frozen=True)
class Outcome:
    """What became of a task: its summary as text and as a dictionary, or its failure."""

    task: Task
    text: str = ""
    summary: Mapping[str, Any] = field(default_factory=dict)
    failure: Failure | None = None


def run(tasks: Sequence[Task], recipe: Recipe, jobs: int = 1, say: Say | None = None) -> Iterator[Outcome]:
    """Filter every log, in up to `jobs` processes. Yields the outcomes in the order of the tasks.

    say: is told when kernels are being compiled, which takes a while; with workers it must be picklable.
    Raises ModelError, and UsageError when a site is given and pymap3d is not there, before any log is touched.
    """
    _check(recipe)
    if jobs > 1 and len(tasks) > 1:
        from ftproc import workers

        yield from workers.run(tasks, recipe, min(jobs, len(tasks)), say)
        return
    for task in tasks:
        yield filter_one(task, recipe, say)


def filter_one(task: Task, recipe: Recipe, say: Say | None = None) -> Outcome:
    """Read, filter and write one log. Whatever goes wrong with it is in the outcome; only a closed pipe is raised."""
    from ftproc import geodesy, pipeline, summary, warm
    from ftproc.files import logs, trajectories

    try:
        log = logs.read(
            task.log, units=recipe.units, columns=recipe.columns,
            azimuth_from=recipe.azimuth_from, keep_columns=recipe.keep_columns,
        )  # fmt: skip
        settings = replace(recipe.settings, method=task.method or recipe.settings.method)
        with warm.announced(say):
            trajectory = pipeline.filter_log(log, settings, _model(recipe.model))
        if settings.site is not None:
            trajectory = geodesy.with_geodetic(trajectory, settings.site)
        trajectories.write(trajectory, task.output)
        return Outcome(task, summary.text(trajectory), summary.as_dict(trajectory))
    except BrokenPipeError:
        raise
    except Exception as error:
        return Outcome(task, failure=failure(error, task.log))


def failure(error: BaseException, source: str | None = None) -> Failure:
    """An error in a plain sentence or two, naming `source` where the error does not do so itself."""
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


def _check(recipe: Recipe) -> None:
    from ftproc import geodesy

    _model(recipe.model)
    if recipe.settings.site is not None:
        geodesy.require_pymap3d()


@cache
def _model(name: str) -> Model | None:
    if name == NO_MODEL:
        return None
    from ftproc import pipeline
    from ftproc.correction import model

    return pipeline.default_model() if name == PACKAGED else model.load(name)
