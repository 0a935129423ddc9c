"""One log from file to file, and what became of it: the work that every worker does."""

from __future__ import annotations

import contextlib
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ftproc.config.recipe import Recipe
from ftproc.errors import Failure, FtprocWarning, failure, interruption
from ftproc.files import remote
from ftproc.records import joined
from ftproc.settings import PACKAGED

if TYPE_CHECKING:
    from ftproc.correction.model import Model
    from ftproc.methods.registry import Method

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
class Outcome:
    """What became of a task: its summary as text and as a dictionary, or its failure; and the time it took."""

    task: Task
    text: str = ""
    summary: Mapping[str, Any] = field(default_factory=dict)
    failure: Failure | None = None
    elapsed_s: float = 0.0


#: Takes a task and returns what waits for its outcome.
Begin = Callable[[Task], Callable[[], Outcome]]


def filter_one(task: Task, recipe: Recipe, say: Say | None = None) -> Outcome:
    """Read, filter and write one log. Whatever goes wrong with it is in the outcome; only a closed pipe and
    an interruption are raised."""
    from ftproc import pipeline, report
    from ftproc.core import compiled
    from ftproc.correction import model_file
    from ftproc.files.reading import logs
    from ftproc.files.writing import geodesy, trajectories
    from ftproc.methods import registry
    from ftproc.quality import summary

    began = time.perf_counter()
    try:
        log = logs.read(task.at(task.log), **recipe.reading())
        if task.place:
            log = replace(log, name=task.log)  # the trajectory says where it comes from in the user's words
        settings = replace(recipe.settings, method=task.method or recipe.settings.method)
        named = None if task.method is None else registry.named(task.method)
        model = model_file.named(recipe.model) if named is None else model_for(named, recipe.model)
        filtering = pipeline.Filtering(log, settings, model)
        with compiled.announced(say), _passed_on(task.log, say):
            parts = (geodesy.located(part, settings) for part in filtering.parts())
            if task.report is None:
                trajectories.write_parts(parts, lambda: filtering.metadata, task.at(task.output))
            else:
                trajectory = joined(list(parts))
                trajectory = replace(trajectory, metadata={**trajectory.metadata, **filtering.metadata})
                trajectories.write(trajectory, task.at(task.output))
                report.write(trajectory, task.at(task.report))
        metadata = filtering.metadata
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
    from ftproc.correction import model_file

    model = model_file.named(name)
    return model if model is None or method.suits(model.made_for) else model_file.named(PACKAGED)


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
