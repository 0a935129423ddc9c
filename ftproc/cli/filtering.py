"""The work of `ftproc filter`: options to a recipe, logs to tasks, outcomes to the terminal."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import click

from ftproc.batch import plan, run
from ftproc.batch.tasks import Outcome, model_for
from ftproc.cli.progress import Progress
from ftproc.cli.stations import ALL
from ftproc.config.recipe import Recipe
from ftproc.errors import UsageError, printable
from ftproc.files import conventions
from ftproc.files.writing import geodesy, maps
from ftproc.methods import registry
from ftproc.quality.summary import line
from ftproc.report.style import require_plotly
from ftproc.settings import NO_MODEL, PACKAGED


class Workers(NamedTuple):
    """Who does the work: `jobs` processes, or the cluster of a scheduler."""

    jobs: int = 1
    scheduler: str | None = None


def filter_logs(
    logs: Sequence[str], output: str | None, recipe: Recipe, config: str | None, workers: Workers, *,
    summary: str, report: str | None, debug: bool,
) -> int:  # fmt: skip
    """Filter the logs and print what became of them; the exit code. Raises FtprocError for wrong usage.

    config: where the recipe is from, not to be written over.
    """
    if workers.scheduler is not None and workers.jobs > 1:
        raise UsageError("--jobs is for processes on this machine, --scheduler for a cluster; give one of the two.")
    if report is not None:
        require_plotly()
    methods = _applicable(recipe) if recipe.settings.method == ALL else None
    named = (name for name in (recipe.model, config) if isinstance(name, str))
    inputs = [name for name in named if name not in (PACKAGED, NO_MODEL)]
    tasks = plan.tasks(logs, output, methods, inputs)
    for task in tasks:
        maps.check(task.output, recipe.settings.site)
    pages, index = plan.pages([task.output for task in tasks], report, [*logs, *inputs])
    tasks = [replace(task, report=page) for task, page in zip(tasks, pages, strict=True)]
    if readings := conventions.in_words(recipe.station):
        _tell(f"readings: {', '.join(readings)}")
    if recipe.settings.site is not None:
        _tell(f"positions on the earth: {geodesy.axes(conventions.FRAMES[recipe.station.azimuth_from])}, z is up")
    done: list[Outcome] = []
    with Progress() as progress:
        for outcome in run.run(tasks, recipe, workers.jobs, _tell, workers.scheduler):
            done.append(outcome)
            progress.clear()
            _show(outcome, summary, debug)
            progress("filtering", len(done), len(tasks))
    if index is not None:
        _write_index(done, index)
    if summary == "json":
        _show_json(done)
    failures = [outcome.failure.exit_code for outcome in done if outcome.failure is not None]
    return failures[0] if len(done) == 1 and failures else int(bool(failures))


def _applicable(recipe: Recipe) -> list[str]:
    """Every method that can be run so; says why the others are left out."""
    found = []
    for method in registry.METHODS.values():
        model = model_for(method, recipe.model)
        why = registry.obstacle(method, recipe.settings.smooth, None if model is None else model.made_for)
        if why is None:
            found.append(method.name)
        else:
            _tell(f"left out: {why}")
    return found


def _tell(text: str) -> None:
    click.echo(f"ftproc: {text}", err=True)


def _show(outcome: Outcome, summary: str, debug: bool) -> None:
    if outcome.failure is not None:
        if debug:
            click.echo(outcome.failure.trace, err=True)
        _tell(outcome.failure.message)
    elif summary == "text":
        on_stdout = outcome.task.output == "-"
        places = [place for place in (outcome.task.output, outcome.task.report) if place not in (None, "-")]
        lines = [outcome.text, line("time", f"{outcome.elapsed_s:.2f} s"), *(f"  -> {place}" for place in places)]
        text = "\n".join(lines)
        click.echo("\n".join(map(printable, text.split("\n"))), err=on_stdout)


def _write_index(done: Sequence[Outcome], index: str) -> None:
    """The page that lists what became of every log."""
    from ftproc.report.index import Entry, write

    why = [None if o.failure is None else o.failure.message for o in done]
    write([Entry(o.task.log, o.task.report, o.summary, text) for o, text in zip(done, why, strict=True)], index)


def _written(outcome: Outcome) -> dict[str, str]:
    """Where the trajectory is and, if one was made, the page."""
    report = outcome.task.report
    return {"output": outcome.task.output, **({} if report is None else {"report": report})}


def _show_json(done: Sequence[Outcome]) -> None:
    """One object for one trajectory, a list for several."""
    plain = [
        {"log": o.task.log, "error": o.failure.message} if o.failure else {**o.summary, **_written(o)} for o in done
    ]
    on_stdout = any(o.task.output == "-" for o in done)
    click.echo(json.dumps(plain[0] if len(plain) == 1 else plain, indent=2), err=on_stdout)
