"""`ftproc score`: the smoothness of trajectories, and their errors against a truth."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from ftproc.cli import options, process
from ftproc.cli.command import Command

if TYPE_CHECKING:
    from ftproc.records import Trajectory, Truth

_EXAMPLES = """
ftproc simulate --scenario zuo2021-outliers -o flight.csv --truth flight.truth.csv
ftproc filter flight.csv --summary none -o clean.parquet
ftproc score clean.parquet --truth flight.truth.csv --report errors.html
"""


@click.command(cls=Command, examples=_EXAMPLES)
@click.argument("trajectories", nargs=-1, required=True, type=options.FILE, metavar="TRAJECTORY...")
@click.option(
    "--truth",
    "truths",
    multiple=True,
    type=options.FILE,
    metavar="TRUTH",
    help="The truth: once for all trajectories, or once for each, in the same order.",
)
@click.option(
    "--format", "form", type=click.Choice(["table", "json", "csv"]), default="table", help="Form of the printed scores."
)
@options.report("a trajectory and, with a truth, its errors beside their sigmas")
def command(trajectories: tuple[str, ...], truths: tuple[str, ...], form: str, report: str | None) -> None:
    """Print the scores of trajectories, a column for each.

    A TRAJECTORY is a file that `filter` wrote, any table with time_s, x_m, y_m, z_m, or - for CSV on standard input.
    Without a truth the score is the smoothness (average gradient); with it also the errors, their consistency with the
    published sigmas, and precision and recall of the outlier flags.
    """
    if len(truths) > 1 and len(truths) != len(trajectories):
        raise click.UsageError(
            f"--truth is given {len(truths)} times for {len(trajectories)} trajectories; "
            "give it once, or once for each.",
            click.get_current_context(),
        )
    if [*trajectories, *truths].count("-") > 1:
        raise click.UsageError("Standard input (-) can be read only once.", click.get_current_context())
    click.get_current_context().exit(_run(trajectories, truths, form, report))


def _run(trajectories: Sequence[str], truths: Sequence[str], form: str, report: str | None) -> int:
    """Score the trajectories, print the scores, and write the pages; the exit code."""
    from ftproc import report as pages
    from ftproc.batch import plan
    from ftproc.errors import InputError
    from ftproc.files import layout
    from ftproc.files.reading import trajectories as trajectory_files
    from ftproc.files.writing import atomic, outputs
    from ftproc.report.index import Entry, write
    from ftproc.scoring import render, score
    from ftproc.scoring.matching import exchanged_axes

    if report is not None:
        pages.check(report)
    places, index = plan.pages(trajectories, report)
    beside = [found for name in trajectories if (found := layout.sidecar(name)) is not None]
    outputs.check(plan.pages_written(places, index), [*trajectories, *truths, *beside])
    scores, entries, failed = [], [], False
    known: dict[str, Truth] = {}
    for number, (name, place) in enumerate(zip(trajectories, places, strict=True)):
        try:
            truth = _truth(truths[number % len(truths)], known) if truths else None
            trajectory = trajectory_files.read(name)
            scores.append(score(trajectory, truth))
            if truth is not None and (doubt := exchanged_axes(trajectory, truth)):
                click.echo(f"ftproc: {doubt}", err=True)
            if place is not None:
                with atomic.guarding([*trajectories, *truths]):
                    pages.write(trajectory, place, truth)
                entries.append(Entry(name, place, _summary(trajectory)))
        except InputError as error:
            click.echo(f"ftproc: {error}", err=True)
            entries.append(Entry(name, None, {}, str(error)))
            failed = True
    if index is not None:
        write(entries, index)
    if scores:
        try:
            click.echo(render(scores, form), nl=False)
        except OSError as error:
            written = [entry.page for entry in entries if entry.page is not None]
            raise process.unsaid(error, written, "table of scores") from error
    return int(failed)


def _summary(trajectory: Trajectory) -> dict[str, Any]:
    from ftproc.report.view import summary_of

    return {"method": trajectory.metadata.get("method", ""), **summary_of(trajectory)}


def _truth(name: str, known: dict[str, Truth]) -> Truth:
    from ftproc.files.reading import truth as truth_files

    if name not in known:
        known[name] = truth_files.read(name)
    return known[name]
