"""The `ftproc` command: its subcommands, loaded when used, and the one place where errors become messages."""

from __future__ import annotations

import importlib
import sys
import traceback
from pathlib import Path
from typing import Any

import click

from ftproc import __version__
from ftproc.cli import process
from ftproc.cli.command import CONTEXT, DEBUG, debug_option, write_examples
from ftproc.errors import failure, interruption, nearest, quoted
from ftproc.files.writing import streams

COMMANDS = ("simulate", "train", "filter", "score")

INTERRUPTED = 130  # what a shell reports for Ctrl-C

_ALIKE = 0.65  # of options, whose dashes alone make any two somewhat alike

_EXAMPLES = """
ftproc simulate --scenario zuo2021-outliers -o flight.csv --truth flight.truth.csv
ftproc filter flight.csv -o clean.parquet
ftproc score clean.parquet --truth flight.truth.csv
"""


class Program(click.Group):
    """The command group. Importing a subcommand is cheap; what it needs it loads when it runs."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        command = importlib.import_module(f"ftproc.cli.{cmd_name}").command
        assert isinstance(command, click.Command)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name = args[0]
        if name not in COMMANDS and not name.startswith("-") and not ctx.resilient_parsing:
            if Path(name).is_file():
                ctx.fail(f'There is no command "{name}". To filter that log: {ctx.command_path} filter {quoted(name)}.')
            ctx.fail(f'There is no command "{name}"{nearest(name, COMMANDS) or "."}')
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as error:  # of which click would print something, where that may not be read
            raise click.Abort from error

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        write_examples(formatter, _EXAMPLES)

    def main(self, args: Any = None, prog_name: str | None = None, *rest: Any, **extra: Any) -> Any:
        """Run and exit: 0 done, 1 an input could not be processed, 2 wrong usage."""
        arguments = sys.argv[1:] if args is None else list(args)
        extra["standalone_mode"] = False
        try:
            code = super().main(arguments, prog_name or "ftproc", **extra)
        except (Exception, KeyboardInterrupt) as error:
            stop = interruption(error)
            if isinstance(stop, SystemExit):
                raise stop from None
            with streams.given_up(lambda: True):  # standard error may go where standard output stalls
                code = _report(stop or error, DEBUG in arguments)  # not from the context: parsing may have failed
        sys.exit(code if isinstance(code, int) else 0)


def _report(error: BaseException, debug: bool) -> int:
    """Print the error on standard error; the exit code."""
    if debug:
        traceback.print_exception(error)
    if isinstance(error, click.Abort | KeyboardInterrupt):
        click.echo("ftproc: interrupted", err=True)
        return INTERRUPTED
    if isinstance(error, click.exceptions.NoArgsIsHelpError):
        click.echo(error.format_message(), err=True)
        return error.exit_code
    if isinstance(error, click.ClickException):
        click.echo(_usage(error), err=True)
        return error.exit_code
    if isinstance(error, BrokenPipeError):  # the reader of our output left early
        return 1
    found = failure(error)
    click.echo(f"ftproc: {found.message}", err=True)
    return found.exit_code


def _usage(error: click.ClickException) -> str:
    context = getattr(error, "ctx", None)
    path = context.command_path if context is not None else "ftproc"
    if isinstance(error, click.NoSuchOption) and context is not None:  # click itself names every similar one
        known = [name for p in context.command.get_params(context) for name in (*p.opts, *p.secondary_opts)]
        message = f"There is no option {error.option_name}{nearest(error.option_name, known, _ALIKE)}"
    else:
        message = error.format_message().strip()
    return f"{path}: {message}{'' if message.endswith(('.', '?')) else '.'} See {path} -h."


@click.group("ftproc", cls=Program, context_settings=CONTEXT)
@click.version_option(__version__, message="%(prog)s %(version)s")
def cli() -> None:
    """Clean trajectories, with honest uncertainties, from dirty theodolite and radar logs.

    A log holds the times, slant range R, azimuth A and elevation E of one target, measured by one station. `filter`
    finds the outliers, estimates position and velocity with the anti-outlier GA-BPNN-UKF (Zuo et al. 2021), and judges
    the result: consistent, suspect or unreliable. Logs of several stations on one flight become one trajectory
    (`filter --fuse`).
    """


cli.params.append(debug_option())


def main() -> None:
    """The console script."""
    process.open_streams()
    process.end_by_signals()
    try:
        cli.main()
    finally:
        process.leave_memory()
