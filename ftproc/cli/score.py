"""`ftproc score`: the smoothness of trajectories, and their errors against a truth."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from ftproc.cli import options, process
from ftproc.cli.command import Command

if TYPE_CHECKING:
    from ftproc.records import Trajectory, Truth
    from ftproc.scoring import Score
    from ftproc.scoring.limits import Limits, Result

_EXAMPLES = """
ftproc simulate --scenario zuo2021-outliers -o flight.csv --truth flight.truth.csv
ftproc filter flight.csv --summary none -o clean.parquet
ftproc score clean.parquet --truth flight.truth.csv --require ed-142-terminal --report errors.html
"""


class Job(NamedTuple):
    """The options of the command."""

    trajectories: Sequence[str]
    truths: Sequence[str]
    form: str
    require: Sequence[str]
    report: str | None
    site: tuple[float, float, float] | None = None

    def files(self) -> list[str]:
        """The files of limits, which are inputs."""
        return [name for name in self.require if Path(name).is_file()]


def _standards() -> str:
    """The standards that come with the program, read without what scoring needs."""
    rooms = sorted(Path(__file__).parents[1].joinpath("scoring", "standards").glob("*.toml"))
    titles = (tomllib.loads(path.read_text(encoding="utf-8"))["title"] for path in rooms)
    lines = (f"  {path.stem:16} {title}\n" for path, title in zip(rooms, titles, strict=True))
    return "Standards for --require:\n" + "".join(lines)


@click.command(cls=Command, examples=_EXAMPLES, more=_standards)
@click.argument("trajectories", nargs=-1, required=True, type=options.FILE, metavar="TRAJECTORY...")
@options.truth("The truth: once for all trajectories, or once for each, in the same order.")
@click.option(
    "--format", "form", type=click.Choice(["table", "json", "csv"]), default="table", help="Form of the printed scores."
)
@click.option(
    "--require",
    multiple=True,
    type=options.FILE,
    metavar="LIMITS.toml|NAME",
    help="Limits on the errors: a file of [[require]], or one of the standards below; prints PASS or FAIL of each, and "
    "the exit code is 1 if one of them is not met. May be given several times.",
)
@click.option(
    "--site",
    type=options.site,
    metavar="LAT,LON,HEIGHT",
    help="The station's position, for a truth in latitude, longitude and height. [default: that of the trajectory]",
)
@options.report("a trajectory and, with a truth, its errors beside their sigmas")
def command(
    trajectories: tuple[str, ...], truths: tuple[str, ...], form: str, require: tuple[str, ...], report: str | None,
    site: tuple[float, float, float] | None,
) -> None:  # fmt: skip
    """Print the scores of trajectories, a column for each.

    A TRAJECTORY is a file that `filter` wrote, any table with time_s, x_m, y_m, z_m, or - for CSV on standard input.
    Without a truth the score is the smoothness (average gradient); with it also the errors, their consistency with the
    published sigmas, bias and spread along track, across and vertical, and precision and recall of the outlier flags.
    Two trajectories are compared with each other too: where they differ, and which decisions changed.
    """
    if len(truths) > 1 and len(truths) != len(trajectories):
        raise click.UsageError(
            f"--truth is given {len(truths)} times for {len(trajectories)} trajectories; "
            "give it once, or once for each.",
            click.get_current_context(),
        )
    if [*trajectories, *truths].count("-") > 1:
        raise click.UsageError("Standard input (-) can be read only once.", click.get_current_context())
    if require and not truths:
        raise click.UsageError(
            "--require needs the --truth that the errors are measured from.", click.get_current_context()
        )
    click.get_current_context().exit(_run(Job(trajectories, truths, form, require, report, site)))


def _run(job: Job) -> int:
    """Score the trajectories, print the scores, and write the pages; the exit code."""
    from ftproc import report as pages
    from ftproc.batch import plan
    from ftproc.errors import InputError
    from ftproc.files import layout
    from ftproc.files.reading import trajectories as trajectory_files
    from ftproc.files.writing import atomic, outputs
    from ftproc.report.index import Entry, write
    from ftproc.scoring import limits

    if job.report is not None:
        pages.check(job.report)
    asked = [limits.load(name) for name in job.require]
    page_files, index = plan.pages(job.trajectories, job.report)
    beside = [found for name in job.trajectories if (found := layout.sidecar(name)) is not None]
    outputs.check(plan.pages_written(page_files, index), [*job.trajectories, *job.truths, *beside, *job.files()])
    scored, entries, failed = list[Scored](), [], False
    known: dict[Any, Truth] = {}
    for number, (name, page_file) in enumerate(zip(job.trajectories, page_files, strict=True)):
        try:
            trajectory = trajectory_files.read(name)
            truth = _truth(job.truths[number % len(job.truths)], trajectory, known, job.site) if job.truths else None
            first = scored[0].trajectory if scored and len(job.trajectories) == 2 else None
            scored.append(_scored(trajectory, truth, asked, first))
            if page_file is not None:
                with atomic.guarding([*job.trajectories, *job.truths]):
                    pages.write(scored[-1].trajectory, page_file, truth)
                entries.append(Entry(name, page_file, _summary(scored[-1].trajectory)))
        except InputError as error:
            click.echo(f"ftproc: {error}", err=True)
            entries.append(Entry(name, None, {}, str(error)))
            failed = True
    if index is not None:
        write(entries, index)
    if scored:
        try:
            click.echo(_text(scored, job.form), nl=False)
        except OSError as error:
            written = [entry.page for entry in entries if entry.page is not None]
            raise process.unsaid(error, written, "table of scores") from error
    return int(failed or not all(limits.passed(each.results) for each in scored))


class Scored(NamedTuple):
    """A trajectory, its score, the results of the limits in one list, and these as text."""

    trajectory: Trajectory
    score: Score
    results: list[Result]
    judged: str


def _scored(trajectory: Trajectory, truth: Truth | None, asked: Sequence[Limits], first: Trajectory | None) -> Scored:
    """first: another trajectory, with which this one is compared. Raises InputError."""
    from ftproc.scoring import compare, limits, score
    from ftproc.scoring.agreement import doubt

    if truth is not None and (why := doubt(trajectory.name, trajectory.time_s, trajectory.state[:, :3], truth)):
        click.echo(f"ftproc: {why}", err=True)
    found = score(trajectory, truth)
    judged = [limits.judge(trajectory, truth, each.limits) for each in asked] if truth is not None else []
    text = "".join(limits.text(trajectory.name, each, one) for each, one in zip(asked, judged, strict=bool(judged)))
    results = [result for one in judged for result in one]
    if results:
        found = replace(found, require=limits.as_dicts(results))
    if first is not None:
        found = replace(found, difference=compare(first, trajectory))
    return Scored(trajectory, found, results, text)


def _text(scored: Sequence[Scored], form: str) -> str:
    """The scores; below a table for people also differences and limits."""
    from ftproc.errors import encodable
    from ftproc.scoring import differences, render

    parts = [render([found.score for found in scored], form)]
    if form == "table":
        parts += [differences.text(each.score.difference) for each in scored if each.score.difference is not None]
        parts += [found.judged for found in scored if found.judged]
    return encodable("\n".join(parts))


def _summary(trajectory: Trajectory) -> dict[str, Any]:
    from ftproc.report.view import summary_of

    return {"method": trajectory.metadata.get("method", ""), **summary_of(trajectory)}


def _truth(
    name: str, trajectory: Trajectory, known: dict[Any, Truth], site: tuple[float, float, float] | None
) -> Truth:
    """site: of the station, where the user states it."""
    from ftproc.derived.quantities import site_of
    from ftproc.files.reading import truth as truth_files

    where = site or site_of(trajectory.metadata)
    north = trajectory.metadata.get("frame") == "north-east-up"
    frame = None if where is None else truth_files.Frame((where[0], where[1], where[2]), north)
    if (name, frame) not in known:
        known[name, frame] = truth_files.read(name, frame)
    return known[name, frame]
