"""The work on one log, from file to file, and its outcome."""

from __future__ import annotations

import contextlib
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ftproc.batch import finished
from ftproc.config.recipe import Recipe
from ftproc.errors import Failure, FtprocWarning, failure, interruption, printable
from ftproc.files import decisions, layout, remote
from ftproc.long_records import joined
from ftproc.records import BESIDE, MISSING, Line, Trajectory
from ftproc.settings import PACKAGED

if TYPE_CHECKING:
    from ftproc.correction.model import Model
    from ftproc.methods.registry import Method

#: Takes a line for the user.
Notify = Callable[[str], None]


@dataclass(frozen=True)
class Task:
    """One log to filter and the file of its trajectory; either may be `-`. report: the file of the HTML page, if there
    is one. folder: of relative names, when it is not the worker's current one. redo: filter it, although
    its outputs are those that it would get. takes_decisions: whether the outcome has them."""

    log: str
    output: str
    recipe: Recipe = field(default_factory=Recipe)
    report: str | None = None
    folder: str = ""
    redo: bool = True
    takes_decisions: bool = False

    @property
    def station(self) -> str:
        """The name of the log in decisions by hand: that of its file, without folder and ending."""
        return layout.stem_and_kind(self.log)[0]

    def at(self, name: str) -> str:
        """The file of that name, as the worker finds it."""
        return str(Path(self.folder, name)) if self.folder and not remote.is_uri(name) else name

    def as_named(self, text: str) -> str:
        """A message of the worker with the names that the user has given."""
        for name in filter(None, (self.log, self.output, self.report)) if self.folder else ():
            text = text.replace(printable(self.at(name)), printable(name))
        return text


@dataclass(frozen=True)
class Outcome:
    """The outcome of a task: its summary as text and as a dictionary, or its failure; how its log was understood; its
    duration; and the decisions that were taken, if they are asked for. before: an earlier run has done it, so that
    there is no text."""

    task: Task
    text: str = ""
    summary: Mapping[str, Any] = field(default_factory=dict)
    failure: Failure | None = None
    understood: Mapping[str, Any] = field(default_factory=dict)
    elapsed_s: float = 0.0
    decisions: tuple[Line, ...] = ()
    before: bool = False


def filter_one(task: Task, notify: Notify | None = None) -> Outcome:
    """Read, filter and write one log, unless it is finished. Its errors are in the outcome; only a closed pipe and an
    interruption are raised."""
    try:
        return (None if task.redo else _kept(task)) or _filtered(task, notify)
    except BrokenPipeError:
        raise
    except Exception as error:
        if stop := interruption(error):
            raise stop from None
        found = failure(error, task.log)
        return Outcome(task, failure=replace(found, message=task.as_named(found.message)))


def _kept(task: Task) -> Outcome | None:
    """The outcome of an earlier run that has left what this one would make, or None."""
    from ftproc.quality import summary

    if task.report is not None and not Path(task.at(task.report)).is_file():
        return None
    metadata = finished.metadata(task.at(task.output), task.at(task.log), task.recipe)
    return None if metadata is None else Outcome(task, summary=summary.as_dict(metadata), before=True)


def _filtered(task: Task, notify: Notify | None) -> Outcome:
    from ftproc import pipeline, report
    from ftproc.batch import trying
    from ftproc.core import compiled
    from ftproc.correction import model_file
    from ftproc.derived.columns import with_columns
    from ftproc.files.reading import logs
    from ftproc.files.writing import atomic, geodesy, trajectories
    from ftproc.quality import next_steps, provenance, summary

    started, recipe = time.perf_counter(), task.recipe
    model = model_file.named(recipe.model)
    log = logs.read(task.at(task.log), **recipe.reading(signal=model is not None and model.hears))
    if task.folder:
        log = replace(log, name=task.log)  # as the user named it
    if recipe.decisions is not None:
        log = recipe.decisions.applied(log, task.station)
    geodesy.check_axes(log, recipe.settings)
    taken: list[Line] = []
    filtering = pipeline.Filtering(log, recipe.settings, model)
    command = partial(recipe.origin.command, task.log)

    @cache
    def metadata() -> dict[str, Any]:
        found, known = filtering.metadata, {"command": command(), "options": recipe.origin.options}
        steps = trying.steps(filtering, found["summary"], command)
        known["summary"] = next_steps.added(found["summary"], steps)
        known["recipe_sha256"] = finished.recipe_sha256(recipe)
        return provenance.completed(found, known, recipe.origin.before)

    guarded = atomic.guarding([task.at(task.log)])
    with compiled.announced(notify), _forwarded(task.log, notify), guarded:
        parts: Iterator[Trajectory] = (with_columns(part, recipe.settings, log) for part in filtering.parts())
        if task.takes_decisions:
            taken += [] if log.by_hand is None else log.by_hand.decisions.lines
            parts = _noting(parts, task.station, taken)
        if task.report is None:
            trajectories.write_parts(parts, metadata, task.at(task.output))
        else:
            trajectory = joined(list(parts))
            trajectory = replace(trajectory, metadata={**trajectory.metadata, **metadata()})
            trajectories.write(trajectory, task.at(task.output))
            report.write(trajectory, task.at(task.report))
    elapsed_s = time.perf_counter() - started
    said = summary.text(metadata()), summary.as_dict(metadata())
    return Outcome(task, *said, understood=log.understood, elapsed_s=elapsed_s, decisions=tuple(taken))


def with_method(recipe: Recipe, name: str) -> Recipe:
    """The recipe for one of all methods, with the parameters and the model that suit it. Raises ModelError."""
    from ftproc.methods import registry
    from ftproc.settings import NO_MODEL

    model = model_for(registry.named(name), recipe.model)
    return replace(recipe, settings=registry.with_own_parameters(recipe.settings, name), model=model or NO_MODEL)


def _noting(parts: Iterable[Trajectory], station: str, taken: list[Line]) -> Iterator[Trajectory]:
    """The parts of a trajectory, with the decisions on all of their readings noted behind the last."""
    found = []
    for part in parts:
        beside = {} if part.diagnostics is None else part.diagnostics.beside
        missing = np.full(len(part), MISSING, np.uint8)
        others = [beside[name].label if name in beside else missing for name in BESIDE]
        found.append((part.time_s, part.row, np.column_stack([part.outlier, *others])))
        yield part
    time_s, row, outlier = map(np.concatenate, zip(*found, strict=True))
    taken += decisions.taken(time_s, row, outlier, station)


def model_for(method: Method, name: str | Model) -> Model | None:
    """The model named if it was trained for the method, else the packaged one: no model suits all methods. Raises
    ModelError."""
    from ftproc.correction import model_file

    model = model_file.named(name)
    return model if model is None or method.suits(model.made_for) else model_file.named(PACKAGED)


@contextlib.contextmanager
def _forwarded(source: str, notify: Notify | None) -> Iterator[None]:
    """Inside the block, ftproc's warnings go to `notify`, naming their source."""
    if notify is None:
        yield
        return
    with warnings.catch_warnings():
        warnings.simplefilter("always", FtprocWarning)
        show = warnings.showwarning

        def forward(message: Warning | str, category: type[Warning], *where: Any) -> None:
            if issubclass(category, FtprocWarning):
                notify(f"{source}: {message}")
            else:
                show(message, category, *where)

        warnings.showwarning = forward  # type: ignore[assignment]
        yield
