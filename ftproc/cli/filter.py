"""`ftproc filter`: dirty logs in, clean trajectories out."""

from __future__ import annotations

from typing import Any

import click

from ftproc.cli import options
from ftproc.cli.command import DEBUG, Command

_EXAMPLES = """
ftproc simulate --scenario zuo2021-outliers -o flight.csv
ftproc filter flight.csv --smooth --report flight.html
ftproc filter flight.csv --noise 3,0.0002,0.0002 --summary json -o clean.parquet
"""


@click.command(cls=Command, short_help="Dirty logs in, clean trajectories out.", examples=_EXAMPLES)
@click.argument("logs", nargs=-1, metavar="LOG...")
@click.option(
    "-o",
    "--output",
    metavar="OUT",
    help="File (.parquet, .csv, .csv.gz), - for CSV on stdout, or a directory, which is made when absent; several "
    "logs need a directory. [default: STEM.trajectory.parquet or .csv, like the log, in the current directory]",
)
@options.tracker
@click.option(
    "--site",
    type=options.site,
    metavar="LAT,LON,HEIGHT",
    help="The station on the earth (WGS-84; degrees, degrees, m), such as 48.0812,11.2803,612: adds lat_deg, lon_deg, "
    "height_m. x is taken as east and y as north; with --azimuth-from north, x as north and y as east.",
)
@options.azimuth_from("Where the azimuth is counted from: x, A = atan2(y, x), or north, clockwise; then x is north.")
@options.units("Units of columns whose names state none, such as range=km,azimuth=deg. [default: s, m, rad]")
@click.option(
    "--columns", metavar="NAME=COLUMN,...", help="Names of columns that are not understood, such as time=T0,range=RNG."
)
@click.option("--keep-columns", is_flag=True, help="Carry the log's other columns through to the trajectory.")
@click.option(
    "--jobs", type=click.IntRange(min=1), default=1, metavar="N", help="Worker processes, for several logs at a time."
)
@click.option(
    "--summary",
    type=click.Choice(["text", "json", "none"]),
    default="text",
    help="What to print of each trajectory; on stderr when the trajectory itself goes to stdout.",
)
@options.report("a trajectory, the readings it was made from, and whether to trust it")
@click.option("--list-methods", is_flag=True, help="List the methods, and filter nothing.")
def command(logs: tuple[str, ...], output: str | None, list_methods: bool, **given: Any) -> None:
    """Find the outliers of LOGs, and estimate where the target was, how fast, and how sure that is.

    A LOG is a .csv, .csv.gz or .parquet file with time, range, azimuth and elevation, or - for CSV on standard input.
    Noise and manoeuvre level are found from the log itself. A bad log does not stop the others; the exit code is
    then 1.
    """
    if list_methods:
        from ftproc.methods import registry

        click.echo(registry.list_methods())
        return
    if not logs:
        raise click.UsageError("Name at least one log.", click.get_current_context())
    from ftproc.cli.startup import hasten

    hasten()
    from ftproc.cli import filtering

    ctx = click.get_current_context()
    ctx.exit(filtering.run(logs, output, debug=ctx.meta[DEBUG], **given))
