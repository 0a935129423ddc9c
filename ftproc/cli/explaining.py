"""`ftproc filter --explain`: how logs are understood; and the commands to try first."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from ftproc.cli import targets
from ftproc.config.recipe import Recipe
from ftproc.errors import FtprocError, failure, printable, quoted
from ftproc.files.layout import CANONICAL
from ftproc.quality.summary import line
from ftproc.records import MeasurementLog

_ROWS = 3  # that are shown
_LOGS = (".csv", ".csv.gz", ".parquet", ".feather", ".txt", ".tsv", ".dat", ".xlsx", ".jsonl", ".arrow", ".h5", ".mat",
         ".ast", ".pcap", ".frd", ".npt", ".tdm", ".aer")  # fmt: skip


def explain(recipes: Mapping[str, Recipe], form: str, debug: bool) -> int:
    """Print how each log is understood, as text or JSON; the exit code."""
    from ftproc.files.reading import logs as reading

    found: list[dict[str, Any]] = []
    codes = []
    for name, recipe in recipes.items():
        several = targets.of_log(name, recipe)
        try:
            log = reading.read(name, **_of_the_first(recipe, several).reading())
        except FtprocError as error:
            codes.append(error.exit_code)
            found.append({"log": name, "error": str(error)})
            click.echo(f"ftproc: {failure(error).trace if debug else error}", err=True)
            continue
        found.append(_as_dict(name, log))
        if several.said:
            click.echo(f"ftproc: {several.said} Here is the first.", err=True)
        if form == "text":
            click.echo(text(name, log.understood))
            click.echo(_first_rows(log))
    if form == "json":
        click.echo(json.dumps(found[0] if len(found) == 1 else found, indent=2, ensure_ascii=False))
    return 0 if not codes else codes[0] if len(recipes) == 1 else 1


def _of_the_first(recipe: Recipe, several: targets.Targets) -> Recipe:
    return replace(recipe, target=several.named[0]) if several.named else recipe


def text(name: str, understood: Mapping[str, Any]) -> str:
    """The five lines on how a log was understood, under its name."""
    from ftproc.files.reading import understanding

    named = understanding.lines(understood)
    return "\n".join(map(printable, [f"{name}: understood as", *(line(what, words) for what, words in named)]))


def _as_dict(name: str, log: MeasurementLog) -> dict[str, Any]:
    columns = [log.time_s[:_ROWS].tolist(), *log.measurement[:_ROWS].T.tolist()]
    rows = [dict(zip(CANONICAL.values(), map(_known, row), strict=True)) for row in zip(*columns, strict=True)]
    return {"log": name, **log.understood, "rows": log.rows_in_file, "first_rows": rows}


def _known(value: float) -> float | None:
    return None if value != value else value


def _first_rows(log: MeasurementLog) -> str:
    header = "  ".join(f"{title:>16}" for title in CANONICAL.values())
    rows = zip(log.time_s[:_ROWS], *log.measurement[:_ROWS].T, strict=True)
    shown = ["  ".join(f"{'' if value != value else f'{value:.9g}':>16}" for value in row) for row in rows]
    return "\n".join([f"  {header}", *(f"  {row}" for row in shown)])


def first_commands() -> str:
    """The commands to try when no log is named: with a log of this directory, if there is one."""
    here = (path.name for path in sorted(Path().iterdir()) if path.name.lower().endswith(_LOGS) and path.is_file())
    logs = [name for name in here if ".truth." not in name and ".trajectory." not in name]
    name = quoted(printable(logs[0])) if logs else "flight.csv"
    page = quoted(f"{Path(printable(logs[0])).stem}.html") if logs else "flight.html"
    made = "" if logs else f"\n  ftproc simulate --scenario zuo2021-outliers -o {name}"
    tried = [f"ftproc filter {name} --explain", f"ftproc filter {name} --smooth --report {page}"]
    tried += [] if made else [f"ftproc filter {name} --write-config > station.toml"]
    return f"Name at least one log. Three commands to try:{made}" + "".join(f"\n  {command}" for command in tried)
