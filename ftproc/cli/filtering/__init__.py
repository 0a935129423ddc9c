"""The work of `ftproc filter`: logs to tasks, outcomes to the terminal, and `recipes`."""

from __future__ import annotations

import contextlib
import json
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import click

from ftproc import __version__, report
from ftproc.batch import plan, run, table
from ftproc.batch.tasks import Outcome, Task, model_for, with_method
from ftproc.cli import again, explaining, process, targets
from ftproc.cli.command import stated
from ftproc.cli.filtering.recipes import followed, station_files
from ftproc.cli.progress import Progress
from ftproc.config.recipe import Recipe
from ftproc.errors import UsageError, printable
from ftproc.files import conventions
from ftproc.files.writing import geodesy, maps, outputs
from ftproc.files.writing.decisions import write as write_decisions
from ftproc.files.writing.outputs import Output
from ftproc.files.writing.trajectories import plain
from ftproc.methods import registry
from ftproc.methods.registry import EVERY
from ftproc.quality.summary import line
from ftproc.report.index import write as write_index
from ftproc.settings import NO_MODEL, PACKAGED

FORMS = ("csv", "jsonl")


class Request(NamedTuple):
    """The options of `filter` that are not part of the recipe, by their names on the command line."""

    logs: Sequence[str]
    output: str | None
    config: str | None
    jobs: int
    scheduler: str | None
    summary: str
    report: str | None
    write_decisions: str | None
    again: again.Before | None
    table: str | None
    redo: bool


def follow(ctx: click.Context, what: str) -> None:
    """Follow a log to its end. what: the value of --follow, a form of the rows on standard output, or the log. Raises
    FtprocError."""
    given = stated(ctx)
    logs = [*given.get("logs", ()), *([] if what in FORMS else [what])]
    if len(logs) != 1:
        raise UsageError(
            "--follow reads one log; name a file that grows, udp://HOST:PORT, tcp://HOST:PORT, or - for standard input."
        )
    found = followed(ctx, logs[0])
    from ftproc.live import publishing

    request = publishing.Request(
        logs[0], given.get("output") or outputs.STREAM, what if what in FORMS else "csv", given.get("state"),
        given.get("coast", 0.0), given.get("heartbeat", 0.0), given.get("report"),
        station_files(given.get("config"), logs),
    )  # fmt: skip
    said = publishing.follow_log(request, found, notify)
    if given.get("summary") != "none":
        notify(said)


def filter_logs(request: Request, recipes: Mapping[str, Recipe], debug: bool) -> int:
    """Filter the logs and print the outcomes; the exit code. Raises FtprocError for wrong usage."""
    if request.scheduler is not None and request.jobs > 1:
        raise UsageError("--jobs is for processes on this machine, --scheduler for a cluster; give one of the two.")
    if request.report is not None:
        report.check(request.report)
    with contextlib.ExitStack() as until_written:
        return _filtered(request, _planned(request, recipes, until_written), recipes, debug)


def _filtered(request: Request, planned: Planned, recipes: Mapping[str, Recipe], debug: bool) -> int:
    tasks, index, together = planned
    for text in _readings(recipes.values()):
        notify(text)
    done: list[Outcome] = []
    unsaid: OSError | None = None
    with Progress("filtering", len(tasks)) as progress:
        outcomes = run.run(tasks, request.jobs, notify, request.scheduler, progress.step)
        for outcome in outcomes:
            outcome = replace(outcome, task=replace(outcome.task, output=together)) if together else outcome
            done.append(outcome)
            progress.clear()
            try:
                _show(outcome, request.summary, debug)
            except OSError as error:  # a full or closed standard output: the other logs do not need it
                unsaid = error
    if together is not None and any(outcome.failure is None for outcome in done):
        _write_together([task for task, outcome in zip(tasks, done, strict=True) if outcome.failure is None], together)
    if index is not None:
        write_index(table.entries(done), index)
    if request.table is not None:
        table.write(done, request.table)
    if request.write_decisions is not None:
        _write_decisions(done, request.write_decisions)
    if request.again is not None and together is None and done[0].failure is None and done[0].task.output != "-":
        for difference in request.again.differences(done[0].task.output):
            notify(difference)
    try:
        _show_all(done, request.summary)
    except OSError as error:
        unsaid = error
    if unsaid is not None:
        raise process.unsaid(unsaid, [o.task.output for o in done if o.failure is None and o.task.output != "-"])
    failures = [outcome.failure.exit_code for outcome in done if outcome.failure is not None]
    return failures[0] if len(done) == 1 and failures else int(bool(failures))


class Planned(NamedTuple):
    """The tasks, the index page if there is one, and the table in which their trajectories end, if it is one for all:
    then they are written elsewhere first."""

    tasks: list[Task]
    index_page: str | None
    together: str | None


def _planned(request: Request, recipes: Mapping[str, Recipe], until_written: contextlib.ExitStack) -> Planned:
    """What is to be done, with all outputs checked against all inputs. until_written: gets the directory of parts."""
    if request.table is not None:
        table.check(request.table)
    left_out = dict[str, None]()
    wanted = [each for log in request.logs for each in _wanted(log, recipes[log], left_out)]
    for why in left_out:
        notify(f"left out: {why}")
    if request.output is None and any(each.recipe.settings.method in each.parts for each in wanted):
        raise UsageError("--method all writes several trajectories: name a directory with -o.")
    redo = request.redo or len(wanted) == 1 or request.write_decisions is not None
    together = request.output if request.scheduler is None and plan.in_one_table(wanted, request.output) else None
    folder = until_written.enter_context(tempfile.TemporaryDirectory(prefix="ftproc-")) if together else ""
    tasks = plan.tasks(wanted, str(Path(folder, "*.parquet")) if together else request.output, redo or bool(together))
    by_hand = next((each.decisions for each in recipes.values() if each.decisions is not None), None)
    if by_hand is not None:
        by_hand.check(list(dict.fromkeys(task.station for task in tasks)))
    for task in tasks:
        maps.check(task.output, task.recipe.settings.site)
    pages, index = plan.pages([task.output for task in tasks], request.report)
    taken = request.write_decisions is not None
    tasks = [replace(task, report=page, takes_decisions=taken) for task, page in zip(tasks, pages, strict=True)]
    named = {"--table": request.table, "--write-decisions": request.write_decisions}
    more = [Output(name, option) for option, name in named.items() if name is not None]
    if together is None:
        written = plan.written(tasks, request.output, index)
    else:
        written = [*outputs.trajectory(together), *plan.pages_written(pages, index)]
    outputs.check([*written, *more], _inputs(request, recipes.values()))
    return Planned(tasks, index, together)


def _write_together(tasks: Sequence[Task], target: str) -> None:
    """The trajectories of all targets of a log in one table."""
    from ftproc.batch import together

    together.write({task.recipe.target.partition("=")[2]: task.output for task in tasks}, __version__, target)


def _inputs(request: Request, recipes: Iterable[Recipe]) -> list[str]:
    """The files that are read."""
    models = {each.model for each in recipes if isinstance(each.model, str)} - {PACKAGED, NO_MODEL}
    by_hand = {each.decisions.name for each in recipes if each.decisions is not None}
    configs = station_files(request.config, request.logs)
    return [*request.logs, *sorted(models), *sorted(by_hand), *configs, *again.inputs(request.again)]


def _write_decisions(done: Sequence[Outcome], target: str) -> None:
    """The decisions that were taken on all logs; of several, each line names its log."""
    several = len(done) > 1
    lines = [line if several else line._replace(station="") for outcome in done for line in outcome.decisions]
    write_decisions(lines, target)


def _wanted(log: str, recipe: Recipe, left_out: dict[str, None]) -> Iterator[plan.Wanted]:
    """The trajectories of a log: one, or one of each target and of each method. left_out gets why others are not."""
    registry.check_parameters(recipe.settings)
    several = targets.of_log(log, recipe)
    if several.said:
        notify(several.said)
    methods = _applicable(recipe, left_out) if recipe.settings.method == EVERY else [""]
    for target in several.named or [recipe.target]:
        for method in methods:
            own = {"method": method, **({"target": target} if several.named else {})}
            origin = recipe.origin.stating({name: value for name, value in own.items() if value})
            found = replace(with_method(recipe, method) if method else recipe, target=target, origin=origin)
            value = target.partition("=")[2] if several.named else ""
            yield plan.Wanted(log, found, tuple(filter(None, (value, method))))


def _readings(recipes: Iterable[Recipe]) -> list[str]:
    """The sentences to the user on the conventions, each sentence once."""
    found = []
    for recipe in recipes:
        if readings := conventions.in_words(recipe.station):
            found.append(f"readings: {', '.join(readings)}")
        if recipe.settings.site is not None:
            axes = geodesy.axes(conventions.frame(recipe.station))
            named = "" if recipe.station.azimuth_from else " (unless the azimuth's name says north)"
            found.append(f"positions on the earth: {axes}{named}, z is up")
    return list(dict.fromkeys(found))


def _applicable(recipe: Recipe, left_out: dict[str, None]) -> list[str]:
    """The methods that can be run; left_out gets why the others cannot, once each and in their order."""
    found = []
    for method in registry.METHODS.values():
        model = model_for(method, recipe.model)
        why = registry.obstacle(method, recipe.settings.smooth, None if model is None else model.made_for)
        if why is None:
            found.append(method.name)
        else:
            left_out[why] = None
    return found


def notify(text: str) -> None:
    """Print a sentence for the user on standard error."""
    click.echo(f"ftproc: {text}", err=True)


def _show(outcome: Outcome, summary: str, debug: bool) -> None:
    if debug and outcome.understood:
        click.echo(explaining.text(outcome.task.log, outcome.understood), err=True)
    on_stdout = outcome.task.output == "-"
    if outcome.failure is not None:
        if debug:
            click.echo(outcome.failure.trace, err=True)
        notify(outcome.failure.message)
    elif summary == "line" or (summary == "text" and outcome.before):
        click.echo(table.line(outcome), err=on_stdout)
    elif summary == "text":
        files = [file for file in (outcome.task.output, outcome.task.report) if file not in (None, "-")]
        lines = [outcome.text, line("time", f"{outcome.elapsed_s:.2f} s"), *(f"  -> {file}" for file in files)]
        text = "\n".join(lines)
        click.echo("\n".join(map(printable, text.split("\n"))), err=on_stdout)


def _show_all(done: Sequence[Outcome], summary: str) -> None:
    """What is printed at the end: the summaries as JSON, and for several logs the number of each verdict."""
    if summary == "json":
        _show_json(done)
    if len(done) > 1 and summary != "none":
        click.echo(table.counts(done), err=summary == "json")


def _show_json(done: Sequence[Outcome]) -> None:
    """One object for one trajectory, a list for several."""
    found = [
        {"log": o.task.log, "error": o.failure.message} if o.failure else {**o.summary, **_written(o)} for o in done
    ]
    on_stdout = any(o.task.output == "-" for o in done)
    click.echo(json.dumps(plain(found[0] if len(found) == 1 else found), indent=2), err=on_stdout)


def _written(outcome: Outcome) -> dict[str, str]:
    """The target, the file of the trajectory and, if there is one, of the page."""
    named = {"target": outcome.task.recipe.target, "output": outcome.task.output, "report": outcome.task.report or ""}
    return {name: value for name, value in named.items() if value}
