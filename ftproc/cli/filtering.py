"""The work of `ftproc filter`: options to a recipe, logs to tasks, outcomes to the terminal."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import click

from ftproc import batch, geodesy
from ftproc.batch import Outcome, Recipe
from ftproc.cli import outputs
from ftproc.cli.progress import Progress
from ftproc.errors import printable
from ftproc.files import schema, units
from ftproc.methods import registry
from ftproc.settings import FilterSettings

ALL = "all"


def run(logs: Sequence[str], output: str | None, *, jobs: int, summary: str, debug: bool, **given: Any) -> int:
    """Filter the logs and print what became of them; the exit code. Raises FtprocError for wrong usage."""
    recipe = _recipe(given)
    methods = list(registry.METHODS) if given["method"] == ALL else None
    inputs = [] if recipe.model in (batch.PACKAGED, batch.NO_MODEL) else [recipe.model]
    tasks = outputs.plan(logs, output, methods, inputs)
    if recipe.settings.site is not None:
        _tell(f"positions on the earth: {geodesy.axes(_frame(recipe))}, z is up")
    done: list[Outcome] = []
    with Progress() as progress:
        for outcome in batch.run(tasks, recipe, jobs, _tell):
            done.append(outcome)
            progress.clear()
            _show(outcome, summary, debug)
            progress("filtering", len(done), len(tasks))
    if summary == "json":
        _show_json(done)
    failures = [outcome.failure.exit_code for outcome in done if outcome.failure is not None]
    return failures[0] if len(done) == 1 and failures else int(bool(failures))


def _recipe(given: dict[str, Any]) -> Recipe:
    """Raises UsageError for what is wrong whatever the log."""
    method = FilterSettings.method if given["method"] == ALL else given["method"]
    registry.named(method)
    units.parse_units(given["units"])
    schema.parse_columns(given["columns"])
    settings = FilterSettings(
        method=method,
        editing=given["editing"],
        smooth=given["smooth"],
        noise=given["noise"],
        jerk_psd_m2ps5=given["jerk"],
        gate=given["gate"],
        max_patch_s=given["max_patch"],
        gain_form=given["weight_form"] == "gain",
        site=given["site"],
    )
    reading = {name: given[name] for name in ("model", "units", "columns", "azimuth_from", "keep_columns")}
    return Recipe(settings, **reading)


def _frame(recipe: Recipe) -> str:
    return "north-east-up" if recipe.azimuth_from == "north" else "local"


def _tell(text: str) -> None:
    click.echo(f"ftproc: {text}", err=True)


def _show(outcome: Outcome, summary: str, debug: bool) -> None:
    if outcome.failure is not None:
        if debug:
            click.echo(outcome.failure.trace, err=True)
        _tell(outcome.failure.message)
    elif summary == "text":
        on_stdout = outcome.task.output == "-"
        place = "" if on_stdout else f"\n  -> {outcome.task.output}"
        lines = (outcome.text + place).split("\n")
        click.echo("\n".join(map(printable, lines)), err=on_stdout)


def _show_json(done: Sequence[Outcome]) -> None:
    """One object for one trajectory, a list for several."""
    plain = [
        {"log": o.task.log, "error": o.failure.message} if o.failure else {**o.summary, "output": o.task.output}
        for o in done
    ]
    on_stdout = any(o.task.output == "-" for o in done)
    click.echo(json.dumps(plain[0] if len(plain) == 1 else plain, indent=2), err=on_stdout)
