"""`ftproc score`: how good trajectories are, by themselves and against a truth."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from ftproc.cli import options
from ftproc.cli.command import Command

if TYPE_CHECKING:
    from ftproc.records import Truth

_EXAMPLES = """
ftproc simulate --scenario zuo2021-outliers -o flight.csv --truth flight.truth.csv
ftproc filter flight.csv --summary none -o clean.parquet
ftproc score clean.parquet --truth flight.truth.csv --format json
"""


@click.command(cls=Command, examples=_EXAMPLES)
@click.argument("trajectories", nargs=-1, required=True, type=options.FILE, metavar="TRAJECTORY...")
@click.option(
    "--truth",
    "truths",
    multiple=True,
    type=options.FILE,
    metavar="TRUTH",
    help="What really happened: once for all trajectories, or once for each, in the same order.",
)
@click.option("--format", "form", type=click.Choice(["table", "json", "csv"]), default="table", help="How to print it.")
def command(trajectories: tuple[str, ...], truths: tuple[str, ...], form: str) -> None:
    """Print how good trajectories are, side by side.

    A TRAJECTORY is a file that `filter` wrote, any table with time_s, x_m, y_m, z_m, or - for CSV on standard input.
    Without a truth only the smoothness (average gradient) can be told; with it also the errors, whether the
    uncertainties are honest, and how well the outliers were found.
    """
    from ftproc.errors import InputError
    from ftproc.files import trajectories as trajectory_files
    from ftproc.scoring import render, score

    if len(truths) > 1 and len(truths) != len(trajectories):
        raise click.UsageError(
            f"--truth is given {len(truths)} times for {len(trajectories)} trajectories; "
            "give it once, or once for each.",
            click.get_current_context(),
        )
    if [*trajectories, *truths].count("-") > 1:
        raise click.UsageError("Standard input (-) can be read only once.", click.get_current_context())
    scores, failed = [], False
    known: dict[str, Truth] = {}
    for index, name in enumerate(trajectories):
        try:
            truth = _truth(truths[index % len(truths)], known) if truths else None
            scores.append(score(trajectory_files.read(name), truth))
        except InputError as error:
            click.echo(f"ftproc: {error}", err=True)
            failed = True
    if scores:
        click.echo(render(scores, form), nl=False)
    if failed:
        click.get_current_context().exit(1)


def _truth(name: str, known: dict[str, Truth]) -> Truth:
    from ftproc.files import truth as truth_files

    if name not in known:
        known[name] = truth_files.read(name)
    return known[name]
