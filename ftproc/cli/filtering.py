"""The work of `ftproc filter`: options and station file to a recipe, logs to tasks, outcomes to the terminal."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import click

from ftproc import report
from ftproc.batch import plan, run
from ftproc.batch.tasks import Outcome, model_for
from ftproc.cli import again, explaining, process
from ftproc.cli.command import stated
from ftproc.cli.progress import Progress
from ftproc.config import reading, writing
from ftproc.config.recipe import Origin, Recipe, relevant
from ftproc.errors import InputError, UsageError, printable
from ftproc.files import conventions
from ftproc.files.options import ABSENT, parse_columns, parse_units, parse_where, parse_widths
from ftproc.files.writing import geodesy, maps, outputs
from ftproc.files.writing.decisions import write as write_decisions
from ftproc.files.writing.outputs import Output
from ftproc.files.writing.trajectories import plain
from ftproc.methods import registry
from ftproc.methods.registry import EVERY
from ftproc.quality.summary import line
from ftproc.settings import NO_MODEL, PACKAGED

_ASK_FOR_NOTHING = (("model", PACKAGED), ("model", NO_MODEL), ("target", ABSENT), ("summary", "none"))


FORMS = ("csv", "jsonl")

_WHOLE = "Leave it out, or filter the log without --follow when it is complete."
_PIPE = "Let only the rows that count through a program such as awk, and follow -."
#: Options that --follow does not honour -> what it does instead, and what to do.
_NOT_FOLLOWED = {
    "where": f"reads every row. {_PIPE}",
    "keep_columns": f"copies no other columns. {_WHOLE}",
    "derived": f"writes no derived quantities. {_WHOLE}",
    "smooth": f"knows no later rows. {_WHOLE}",
    "model": "corrects nothing with a network. Leave it out.",
    "jobs": "runs in one process. Leave it out.",
    "scheduler": "runs in one process. Leave it out.",
    "decisions": f"decides on each row as it comes. {_WHOLE}",
    "write_decisions": f"decides on each row as it comes. {_WHOLE}",
    "again": "has nothing to compare. Leave it out.",
    "summary": "has no summary but the number of rows. Leave it out, or say --summary none.",
}


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


def follow(ctx: click.Context, what: str) -> None:
    """Follow a log to its end. what: the value of --follow, a form of the rows on standard output, or the log. Raises
    FtprocError."""
    given = stated(ctx)
    logs = [*given.get("logs", ()), *([] if what in FORMS else [what])]
    if len(logs) != 1:
        raise UsageError(
            "--follow reads one log; name a file that grows, udp://HOST:PORT, tcp://HOST:PORT, or - for standard input."
        )
    found = _followed_recipe(ctx)
    from ftproc.live import publishing

    request = publishing.Request(
        logs[0], given.get("output") or outputs.STREAM, what if what in FORMS else "csv", given.get("state"),
        given.get("coast", 0.0), given.get("heartbeat", 0.0), given.get("report"),
        [given["config"]] if "config" in given else [],
    )  # fmt: skip
    said = publishing.follow_log(request, found, notify)
    if given.get("summary") != "none":
        notify(said)


def _followed_recipe(ctx: click.Context) -> Recipe:
    """How a log that grows is filtered: with live editing where nothing else is stated. Raises UsageError for options
    on the command line that --follow does not honour, too."""
    given = stated(ctx)
    for name, cure in _NOT_FOLLOWED.items():
        if given.get(name) and (name, given[name]) not in _ASK_FOR_NOTHING:
            raise UsageError(f"--{name.replace('_', '-')} is not for --follow, which {cure}")
    if given.get("editing", "live") not in ("live", "forward"):
        raise UsageError(
            f"--editing {given['editing']} is not for --follow, which decides on each row as it comes. Say --editing "
            "live or forward, or leave it out."
        )
    if str(given.get("report", "")).endswith(("/", ".pdf")):
        raise UsageError(
            f"--report {given['report']}: with --follow it is one page that opens in a browser; end its name in .html."
        )
    found = recipe(ctx, live=True)
    registry.check_parameters(found.settings)
    return found


def recipe(ctx: click.Context, live: bool = False) -> Recipe:
    """How every log is filtered; live: with live editing, unless that is recursive. Raises UsageError for what is wrong
    whatever the log, and for options on the command line that have no effect."""
    options = _options(ctx)
    before = ctx.meta.get(again.AGAIN)
    found = Recipe.of({**options, **({} if before is None else before.decided(stated(ctx)))})
    origin = Origin(again.words(ctx, before), plain(relevant(options)), {} if before is None else before.metadata)
    found = replace(found, origin=origin)
    if live and found.settings.editing == "two-pass":
        found = replace(found, settings=replace(found.settings, editing="live"))
    method = found.settings.method
    chosen = list(registry.METHODS.values()) if method == EVERY else [registry.named(method)]
    asked = [name for name, value in stated(ctx).items() if (name, value) not in _ASK_FOR_NOTHING]
    registry.refuse_idle([f"--{name.replace('_', '-')}" for name in asked], chosen, found.settings)
    return found


def station_file(ctx: click.Context) -> str:
    """The same as the text of a station file. Raises UsageError."""
    options = _options(ctx)
    if options.get("method") == EVERY:
        raise UsageError("--method all cannot be kept in a station file; name one method.")
    return writing.dump(options)


def _options(ctx: click.Context) -> dict[str, Any]:
    """The options of the station file and those of the command line, which win."""
    given = stated(ctx)
    before = ctx.meta.get(again.AGAIN)
    kept = reading.load(given["config"]) if "config" in given else {} if before is None else before.options
    options = {**kept, **given}
    for name, parse in (("units", parse_units), ("columns", parse_columns)):  # quantities not named here: the file's
        if name in options:
            options[name] = {**kept.get(name, {}), **parse(given.get(name))}
    if kept.get("set") and given.get("set"):
        options["set"] = f"{kept['set']},{given['set']}"  # the last one of a name counts
    parse_widths(options.get("widths"))
    parse_where(options.get("where"))
    if options.get("method", EVERY) != EVERY:
        registry.named(options["method"])
    return options


def filter_logs(request: Request, recipe: Recipe, debug: bool) -> int:
    """Filter the logs and print the outcomes; the exit code. Raises FtprocError for wrong usage."""
    if request.scheduler is not None and request.jobs > 1:
        raise UsageError("--jobs is for processes on this machine, --scheduler for a cluster; give one of the two.")
    if request.report is not None:
        report.check(request.report)
    registry.check_parameters(recipe.settings)
    methods = _applicable(recipe) if recipe.settings.method == EVERY else None
    inputs = _inputs(request, recipe)
    targets = _targets(request.logs, recipe)
    tasks = plan.tasks(request.logs, request.output, methods, targets)
    if recipe.decisions is not None:
        recipe.decisions.check(list(dict.fromkeys(task.station for task in tasks)))
    if request.write_decisions is not None:
        tasks = [replace(task, takes_decisions=True) for task in tasks]
    for task in tasks:
        maps.check(task.output, recipe.settings.site)
    pages, index = plan.pages([task.output for task in tasks], request.report)
    tasks = [replace(task, report=page) for task, page in zip(tasks, pages, strict=True)]
    made = [] if request.write_decisions is None else [Output(request.write_decisions, "--write-decisions")]
    outputs.check([*plan.written(tasks, request.output, index), *made], [*request.logs, *inputs])
    if readings := conventions.in_words(recipe.station):
        notify(f"readings: {', '.join(readings)}")
    if recipe.settings.site is not None:
        notify(f"positions on the earth: {geodesy.axes(conventions.FRAMES[recipe.station.azimuth_from])}, z is up")
    done: list[Outcome] = []
    unsaid: OSError | None = None
    with Progress() as progress:
        for outcome in run.run(tasks, recipe, request.jobs, notify, request.scheduler):
            done.append(outcome)
            progress.clear()
            try:
                _show(outcome, request.summary, debug)
            except OSError as error:  # a full or closed standard output: the other logs do not need it
                unsaid = error
            progress("filtering", len(done), len(tasks))
    if index is not None:
        _write_index(done, index)
    if request.write_decisions is not None:
        _write_decisions(done, request.write_decisions)
    if request.again is not None and done[0].failure is None and done[0].task.output != "-":
        for difference in request.again.differences(done[0].task.output):
            notify(difference)
    if request.summary == "json":
        try:
            _show_json(done)
        except OSError as error:
            unsaid = error
    if unsaid is not None:
        raise process.unsaid(unsaid, [o.task.output for o in done if o.failure is None and o.task.output != "-"])
    failures = [outcome.failure.exit_code for outcome in done if outcome.failure is not None]
    return failures[0] if len(done) == 1 and failures else int(bool(failures))


def _inputs(request: Request, recipe: Recipe) -> list[str]:
    """The files that are read beside the logs."""
    by_hand = None if recipe.decisions is None else recipe.decisions.name
    named = (name for name in (recipe.model, request.config, by_hand) if isinstance(name, str))
    return [*(name for name in named if name not in (PACKAGED, NO_MODEL)), *again.inputs(request.again)]


def _write_decisions(done: Sequence[Outcome], target: str) -> None:
    """The decisions that were taken on all logs; of several, each line names its log."""
    several = len(done) > 1
    lines = [line if several else line._replace(station="") for outcome in done for line in outcome.decisions]
    write_decisions(lines, target)


def _targets(logs: Sequence[str], recipe: Recipe) -> dict[str, list[str]] | None:
    """COLUMN=VALUE of each target in each log, if the option names a column; None if it does not. The value of a log
    that cannot be read is left out: reading it again gives the message."""
    from ftproc.files.reading.logs import targets

    column = recipe.target
    if column in ("", ABSENT) or "=" in column:
        return None
    if "-" in logs:
        raise UsageError("--target COLUMN reads a log twice, which standard input does not allow; name a file.")
    found = {}
    for log in logs:
        try:
            found[log] = [f"{column}={value}" for value in targets(log, column, parse_widths(recipe.widths))]
        except InputError:
            found[log] = [column]
    return found


def _applicable(recipe: Recipe) -> list[str]:
    """The methods that can be run; reports why the others are left out."""
    found = []
    for method in registry.METHODS.values():
        model = model_for(method, recipe.model)
        why = registry.obstacle(method, recipe.settings.smooth, None if model is None else model.made_for)
        if why is None:
            found.append(method.name)
        else:
            notify(f"left out: {why}")
    return found


def notify(text: str) -> None:
    """Print a sentence for the user on standard error."""
    click.echo(f"ftproc: {text}", err=True)


def _show(outcome: Outcome, summary: str, debug: bool) -> None:
    if debug and outcome.understood:
        click.echo(explaining.text(outcome.task.log, outcome.understood), err=True)
    if outcome.failure is not None:
        if debug:
            click.echo(outcome.failure.trace, err=True)
        notify(outcome.failure.message)
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
    """The target, the file of the trajectory and, if there is one, of the page."""
    report, target = outcome.task.report, outcome.task.target
    return {
        **({"target": target} if target else {}),
        "output": outcome.task.output,
        **({} if report is None else {"report": report}),
    }


def _show_json(done: Sequence[Outcome]) -> None:
    """One object for one trajectory, a list for several."""
    found = [
        {"log": o.task.log, "error": o.failure.message} if o.failure else {**o.summary, **_written(o)} for o in done
    ]
    on_stdout = any(o.task.output == "-" for o in done)
    click.echo(json.dumps(plain(found[0] if len(found) == 1 else found), indent=2), err=on_stdout)
