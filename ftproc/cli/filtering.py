"""The work of `ftproc filter`: options to a recipe, logs to tasks, outcomes to the terminal."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import click

from ftproc import batch, geodesy
from ftproc.batch import Outcome, Recipe
from ftproc.cli import outputs, reports
from ftproc.cli.progress import Progress
from ftproc.cli.stations import ALL
from ftproc.errors import UsageError, printable
from ftproc.files import conventions, maps
from ftproc.methods import registry
from ftproc.report import Entry
from ftproc.summary import line


class Crew(NamedTuple):
    """Who does the work: `jobs` processes, or the cluster of a scheduler."""

    jobs: int = 1
    scheduler: str | None = None


def run(
    logs: Sequence[str], output: str | None, recipe: Recipe, config: str | None, crew: Crew, *,
    summary: str, report: str | None, debug: bool,
) -> int:  # fmt: skip
    """Filter the logs and print what became of them; the exit code. Raises FtprocError for wrong usage.

    config: where the recipe is from, not to be written over.
    """
    if crew.scheduler is not None and crew.jobs > 1:
        raise UsageError("--jobs is for processes on this machine, --scheduler for a cluster; give one of the two.")
    reports.check(report)
    methods = _applicable(recipe) if recipe.settings.method == ALL else None
    named = (name for name in (recipe.model, config) if isinstance(name, str))
    inputs = [name for name in named if name not in (batch.PACKAGED, batch.NO_MODEL)]
    tasks = outputs.plan(logs, output, methods, inputs)
    for task in tasks:
        maps.check(task.output, recipe.settings.site)
    pages, index = reports.plan([task.output for task in tasks], report, [*logs, *inputs])
    tasks = [replace(task, report=page) for task, page in zip(tasks, pages, strict=True)]
    if readings := conventions.in_words(recipe.station):
        _tell(f"readings: {', '.join(readings)}")
    if recipe.settings.site is not None:
        _tell(f"positions on the earth: {geodesy.axes(conventions.FRAMES[recipe.station.azimuth_from])}, z is up")
    done: list[Outcome] = []
    with Progress() as progress:
        for outcome in batch.run(tasks, recipe, crew.jobs, _tell, crew.scheduler):
            done.append(outcome)
            progress.clear()
            _show(outcome, summary, debug)
            progress("filtering", len(done), len(tasks))
    reports.write_index([_entry(outcome) for outcome in done], index)
    if summary == "json":
        _show_json(done)
    failures = [outcome.failure.exit_code for outcome in done if outcome.failure is not None]
    return failures[0] if len(done) == 1 and failures else int(bool(failures))


def _applicable(recipe: Recipe) -> list[str]:
    """Every method that can be run so; says why the others are left out."""
    found = []
    for method in registry.METHODS.values():
        model = batch.model_for(method, recipe.model)
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


def _entry(outcome: Outcome) -> Entry:
    if outcome.failure is not None:
        return Entry(outcome.task.log, None, {}, outcome.failure.message)
    return Entry(outcome.task.log, outcome.task.report, outcome.summary)


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
