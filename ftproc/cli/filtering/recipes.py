"""The options of the command line and of station files, to the recipe of each log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from ftproc.batch import plan
from ftproc.cli import again
from ftproc.cli.command import stated
from ftproc.config import reading, writing
from ftproc.config.recipe import Origin, Recipe, relevant
from ftproc.errors import UsageError
from ftproc.files.options import ABSENT, parse_columns, parse_units, parse_where, parse_widths
from ftproc.files.writing.trajectories import plain
from ftproc.methods import registry
from ftproc.methods.registry import EVERY
from ftproc.settings import NO_MODEL, PACKAGED

_ASK_FOR_NOTHING = (("model", PACKAGED), ("model", NO_MODEL), ("target", ABSENT), ("summary", "none"))

_WHOLE = "Leave it out, or filter the log without --follow when it is complete."
_PIPE = "Let only the rows that count through a program such as awk, and follow -."
#: Options that --follow does not honour -> what it does instead, and what to do.
_NOT_FOLLOWED = {
    "where": f"reads every row. {_PIPE}",
    "keep_columns": f"copies no other columns. {_WHOLE}",
    "derived": f"writes no derived quantities. {_WHOLE}",
    "smooth": f"knows no later rows. {_WHOLE}",
    "model": "corrects with the packaged network. Leave it out, or say --model none.",
    "jobs": "runs in one process. Leave it out.",
    "scheduler": "runs in one process. Leave it out.",
    "decisions": f"decides on each row as it comes. {_WHOLE}",
    "write_decisions": f"decides on each row as it comes. {_WHOLE}",
    "again": "has nothing to compare. Leave it out.",
    "summary": "has no summary but the number of rows. Leave it out, or say --summary none.",
    "table": "follows one log. Leave it out.",
    "redo": "keeps nothing of an earlier run. Leave it out.",
}


def followed(ctx: click.Context, log: str) -> Recipe:
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
    found = recipe(ctx, live=True, log=log)
    registry.check_parameters(found.settings)
    return found


def recipe(ctx: click.Context, live: bool = False, log: str = "") -> Recipe:
    """How a log is filtered; live: with live editing, unless that is recursive. log: for its own station file, where
    the name of that has a *. Raises UsageError for what is wrong whatever the log, and for options on the command line
    that have no effect."""
    options = _options(ctx, log)
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


def of_logs(ctx: click.Context, logs: Sequence[str]) -> dict[str, Recipe]:
    """How each log is filtered: all in the same way, unless they have station files of their own."""
    if not _is_pattern(ctx.params["config"]):
        return dict.fromkeys(logs, recipe(ctx))
    return {log: recipe(ctx, log=log) for log in logs}


def _is_pattern(config: str | None) -> bool:
    return config is not None and plan.ANY in config and not Path(config).exists()


def station_files(config: str | None, logs: Sequence[str]) -> list[str]:
    """The files that --config names: one for all logs, or of each log that has one."""
    if config is None or not _is_pattern(config):
        return [] if config is None else [config]
    return [name for name in (plan.named_after(config, log) for log in logs) if Path(name).exists()]


def _options(ctx: click.Context, log: str = "") -> dict[str, Any]:
    """The options of the station file and those of the command line, which win."""
    given = stated(ctx)
    config: str | None = given.get("config")
    if log and _is_pattern(config):
        config = next(iter(station_files(config, [log])), None)
    before = ctx.meta.get(again.AGAIN)
    kept = reading.load(config) if config is not None else {} if before is None else before.options
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
