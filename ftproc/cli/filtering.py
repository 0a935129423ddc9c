"""The work of `ftproc filter`: options and station file to a recipe, logs to tasks, outcomes to the terminal."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import click
from click.core import ParameterSource

from ftproc.batch import plan, run
from ftproc.batch.tasks import Outcome, model_for
from ftproc.cli.progress import Progress
from ftproc.config import reading, writing
from ftproc.config.recipe import Recipe
from ftproc.errors import UsageError, printable
from ftproc.files import conventions
from ftproc.files.options import parse_columns, parse_units
from ftproc.files.writing import geodesy, maps
from ftproc.methods import registry
from ftproc.methods.registry import EVERY
from ftproc.quality.summary import line
from ftproc.report.style import require_plotly
from ftproc.settings import NO_MODEL, PACKAGED


class Request(NamedTuple):
    """The options of `filter` that are not part of the recipe, by their names on the command line."""

    logs: Sequence[str]
    output: str | None
    config: str | None
    jobs: int
    scheduler: str | None
    summary: str
    report: str | None


def recipe(ctx: click.Context) -> Recipe:
    """How every log is filtered. Raises UsageError for what is wrong whatever the log."""
    return Recipe.of(_options(ctx))


def station_file(ctx: click.Context) -> str:
    """The same as the text of a station file. Raises UsageError."""
    options = _options(ctx)
    if options.get("method") == EVERY:
        raise UsageError("--method all cannot be kept in a station file; name one method.")
    return writing.dump(options)


def _options(ctx: click.Context) -> dict[str, Any]:
    """The options of the station file and those of the command line, which win."""
    default = (ParameterSource.DEFAULT, ParameterSource.DEFAULT_MAP)
    stated = {name: value for name, value in ctx.params.items() if ctx.get_parameter_source(name) not in default}
    kept = reading.load(stated["config"]) if "config" in stated else {}
    options = {**kept, **stated}
    for name, parse in (("units", parse_units), ("columns", parse_columns)):  # quantities not named here: the file's
        if name in options:
            options[name] = {**kept.get(name, {}), **parse(stated.get(name))}
    if kept.get("set") and stated.get("set"):
        options["set"] = f"{kept['set']},{stated['set']}"  # the last one of a name counts
    if options.get("method", EVERY) != EVERY:
        registry.named(options["method"])
    return options


def filter_logs(request: Request, recipe: Recipe, debug: bool) -> int:
    """Filter the logs and print the outcomes; the exit code. Raises FtprocError for wrong usage."""
    if request.scheduler is not None and request.jobs > 1:
        raise UsageError("--jobs is for processes on this machine, --scheduler for a cluster; give one of the two.")
    if request.report is not None:
        require_plotly()
    registry.check_parameters(recipe.settings)
    methods = _applicable(recipe) if recipe.settings.method == EVERY else None
    named = (name for name in (recipe.model, request.config) if isinstance(name, str))
    inputs = [name for name in named if name not in (PACKAGED, NO_MODEL)]
    tasks = plan.tasks(request.logs, request.output, methods, inputs)
    for task in tasks:
        maps.check(task.output, recipe.settings.site)
    pages, index = plan.pages([task.output for task in tasks], request.report, [*request.logs, *inputs])
    tasks = [replace(task, report=page) for task, page in zip(tasks, pages, strict=True)]
    if readings := conventions.in_words(recipe.station):
        _notify(f"readings: {', '.join(readings)}")
    if recipe.settings.site is not None:
        _notify(f"positions on the earth: {geodesy.axes(conventions.FRAMES[recipe.station.azimuth_from])}, z is up")
    done: list[Outcome] = []
    with Progress() as progress:
        for outcome in run.run(tasks, recipe, request.jobs, _notify, request.scheduler):
            done.append(outcome)
            progress.clear()
            _show(outcome, request.summary, debug)
            progress("filtering", len(done), len(tasks))
    if index is not None:
        _write_index(done, index)
    if request.summary == "json":
        _show_json(done)
    failures = [outcome.failure.exit_code for outcome in done if outcome.failure is not None]
    return failures[0] if len(done) == 1 and failures else int(bool(failures))


def _applicable(recipe: Recipe) -> list[str]:
    """The methods that can be run; reports why the others are left out."""
    found = []
    for method in registry.METHODS.values():
        model = model_for(method, recipe.model)
        why = registry.obstacle(method, recipe.settings.smooth, None if model is None else model.made_for)
        if why is None:
            found.append(method.name)
        else:
            _notify(f"left out: {why}")
    return found


def _notify(text: str) -> None:
    click.echo(f"ftproc: {text}", err=True)


def _show(outcome: Outcome, summary: str, debug: bool) -> None:
    if outcome.failure is not None:
        if debug:
            click.echo(outcome.failure.trace, err=True)
        _notify(outcome.failure.message)
    elif summary == "text":
        on_stdout = outcome.task.output == "-"
        places = [place for place in (outcome.task.output, outcome.task.report) if place not in (None, "-")]
        lines = [outcome.text, line("time", f"{outcome.elapsed_s:.2f} s"), *(f"  -> {place}" for place in places)]
        text = "\n".join(lines)
        click.echo("\n".join(map(printable, text.split("\n"))), err=on_stdout)


def _write_index(done: Sequence[Outcome], index: str) -> None:
    """The page that lists the outcomes of all logs."""
    from ftproc.report.index import Entry, write

    why = [None if o.failure is None else o.failure.message for o in done]
    write([Entry(o.task.log, o.task.report, o.summary, text) for o, text in zip(done, why, strict=True)], index)


def _written(outcome: Outcome) -> dict[str, str]:
    """The file of the trajectory and, if there is one, of the page."""
    report = outcome.task.report
    return {"output": outcome.task.output, **({} if report is None else {"report": report})}


def _show_json(done: Sequence[Outcome]) -> None:
    """One object for one trajectory, a list for several."""
    plain = [
        {"log": o.task.log, "error": o.failure.message} if o.failure else {**o.summary, **_written(o)} for o in done
    ]
    on_stdout = any(o.task.output == "-" for o in done)
    click.echo(json.dumps(plain[0] if len(plain) == 1 else plain, indent=2), err=on_stdout)
