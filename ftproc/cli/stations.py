"""The station file and the command line together: what the latter says wins."""

from __future__ import annotations

from typing import Any

import click
from click.core import ParameterSource

from ftproc.config import reading, writing
from ftproc.config.recipe import Recipe
from ftproc.errors import UsageError
from ftproc.files.options import parse_columns, parse_units
from ftproc.methods import registry

ALL = "all"  # --method all


def recipe(ctx: click.Context) -> Recipe:
    """What `filter` is to do with every log. Raises UsageError for what is wrong whatever the log."""
    return Recipe.of(_options(ctx))


def as_file(ctx: click.Context) -> str:
    """The same as the text of a station file. Raises UsageError."""
    options = _options(ctx)
    if options.get("method") == ALL:
        raise UsageError("--method all cannot be kept in a station file; name one method.")
    return writing.dump(options)


def _options(ctx: click.Context) -> dict[str, Any]:
    given = {name: value for name, value in ctx.params.items() if _said(ctx, name)}
    found = reading.load(given["config"]) if "config" in given else {}
    options = {**found, **given}
    for name, parse in (("units", parse_units), ("columns", parse_columns)):  # the file's of other quantities stay
        if name in options:
            options[name] = {**found.get(name, {}), **parse(given.get(name))}
    if options.get("method", ALL) != ALL:
        registry.named(options["method"])
    return options


def _said(ctx: click.Context, name: str) -> bool:
    return ctx.get_parameter_source(name) not in (ParameterSource.DEFAULT, ParameterSource.DEFAULT_MAP)
