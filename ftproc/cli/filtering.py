"""The work of `ftproc filter`: options to a recipe, logs to tasks, outcomes to the terminal."""

from __future__ import annotations

import json
from collections.abc import Sequence

import click

from ftproc import batch, geodesy
from ftproc.batch import Outcome, Recipe
from ftproc.cli import outputs
from ftproc.cli.progress import Progress
from ftproc.cli.stations import ALL
from ftproc.files import conventions, maps
from ftproc.methods import registry


def run(
    logs: Sequence[str], output: str | None, recipe: Recipe, config: str | None, *, jobs: int, summary: str, debug: bool
) -> int:
    """Filter the logs and print what became of them; the exit code. Raises FtprocError for wrong usage.

    config: where the recipe is from, not to be written over.
    """
    methods = list(registry.METHODS) if recipe.settings.method == ALL else None
    inputs = [name for name in (recipe.model, config) if name not in (batch.PACKAGED, batch.NO_MODEL, None)]
    tasks = outputs.plan(logs, output, methods, inputs)
    for task in tasks:
        maps.check(task.output, recipe.settings.site)
    if readings := conventions.in_words(recipe.station):
        _tell(f"readings: {', '.join(readings)}")
    if recipe.settings.site is not None:
        _tell(f"positions on the earth: {geodesy.axes(conventions.FRAMES[recipe.station.azimuth_from])}, z is up")
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
        click.echo(outcome.text + place, err=on_stdout)


def _show_json(done: Sequence[Outcome]) -> None:
    """One object for one trajectory, a list for several."""
    plain = [
        {"log": o.task.log, "error": o.failure.message} if o.failure else {**o.summary, "output": o.task.output}
        for o in done
    ]
    on_stdout = any(o.task.output == "-" for o in done)
    click.echo(json.dumps(plain[0] if len(plain) == 1 else plain, indent=2), err=on_stdout)
