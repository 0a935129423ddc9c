"""What every command has in common: `-h`, `--debug`, a help that ends with examples, a quick start."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import click
from click.core import ParameterSource

from ftproc.cli import process

CONTEXT = {"help_option_names": ["-h", "--help"], "max_content_width": 100}
#: Options that say where outputs go and what does the work: a trajectory does not depend on them.
WHERE_TO = (
    *("output", "jobs", "scheduler", "summary", "report", "write_calibration", "write_decisions"),
    *("again", "table", "redo", "debug"),
)
DEBUG, ARGUMENTS = "--debug", "arguments"  # what the context remembers


def debug_option() -> click.Option:
    """`--debug`, before or after the command's name."""

    def remember(ctx: click.Context, param: click.Parameter, value: bool) -> None:
        ctx.meta[DEBUG] = value or ctx.meta.get(DEBUG, False)

    text = "Show where an error came from (Python traceback)."
    return click.Option([DEBUG], is_flag=True, expose_value=False, callback=remember, help=text)


class Command(click.Command):
    """A command whose help ends with `examples`, one shell command per line.

    more: makes a text for the help, such as a list of names, when it is shown.
    """

    def __init__(self, *args: Any, examples: str, more: Callable[[], str] | None = None, **attributes: Any) -> None:
        attributes["context_settings"] = {**CONTEXT, "show_default": True}
        super().__init__(*args, **attributes)
        self.examples, self.more = examples, more
        self.params.append(debug_option())

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        ctx.meta[ARGUMENTS] = list(args)
        return super().parse_args(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        process.check_directory()
        return super().invoke(ctx)

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        if self.more is not None:
            formatter.write("\n" + self.more().rstrip() + "\n")
        write_examples(formatter, self.examples)


def write_examples(formatter: click.HelpFormatter, examples: str) -> None:
    """The last section of a help; its lines are not wrapped, so that they can be copied."""
    lines = "".join(f"  {line.strip()}\n" for line in examples.strip().splitlines())
    formatter.write(f"\nExamples:\n{lines}")


def stated(ctx: click.Context) -> dict[str, Any]:
    """The options and arguments on the command line, by name."""
    default = (ParameterSource.DEFAULT, ParameterSource.DEFAULT_MAP)
    return {name: value for name, value in ctx.params.items() if ctx.get_parameter_source(name) not in default}


def typed(ctx: click.Context, arguments: Sequence[str], without: Iterable[str] = ()) -> dict[str, list[str]]:
    """The options among some arguments as they were typed, by name and in their order, the last of each that is given
    twice. without: names to leave out."""
    values, _, order = ctx.command.make_parser(ctx).parse_args(list(arguments))
    options = {str(p.name): p for p in order if isinstance(p, click.Option) and p.name in values}
    found = {}
    for name, option in options.items():
        value = values[name]
        if name not in without and (value is not False or option.secondary_opts):
            each = value if option.multiple else [value]
            flag = option.opts[0] if value is not False else option.secondary_opts[0]
            found[name] = [word for one in each for word in (flag, *([one] if isinstance(one, str) else []))]
    return found


def refuse_with(ctx: click.Context, option: str, useless: Iterable[str]) -> None:
    """Raise a usage error if one of the `useless` options, by name, is stated: they do nothing with `option`."""
    given = stated(ctx)
    for parameter in ctx.command.params:
        if parameter.name in useless and given.get(parameter.name):
            raise click.UsageError(f"{parameter.opts[0]} does nothing with {option}. Leave it out.", ctx)


def start_quickly() -> None:
    """Shorten the start of the process."""
    gc.set_threshold(100_000, 50, 50)  # loading modules makes many objects and little garbage
