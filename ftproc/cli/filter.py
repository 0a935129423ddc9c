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
@click.argument("logs", nargs=-1, type=options.FILE, metavar="LOG...")
@options.output(
    "File (.parquet, .feather, .csv, .csv.gz; with a site also .kml, .geojson, .czml), - for CSV on stdout, or a "
    "directory, which is made when absent; several logs need a directory. "
    "[default: STEM.trajectory.parquet or .csv, like the log, in the current directory]",
    "OUT",
)
@options.tracker
@click.option(
    "--site",
    type=options.site,
    metavar="LAT,LON,HEIGHT",
    help="The station on the earth (WGS-84; degrees, degrees, m), such as 48.0812,11.2803,612: adds lat_deg, lon_deg, "
    "height_m. x is taken as east and y as north; with --azimuth-from north, x as north and y as east.",
)
@click.option(
    "--ecef", is_flag=True, help="With a site: add x_ecef_m ... vz_ecef_mps, earth-centred, earth-fixed (WGS-84)."
)
@options.azimuth_from("Where the azimuth is counted from: x, A = atan2(y, x), or north, clockwise; then x is north.")
@click.option(
    "--elevation-from",
    type=click.Choice(["horizon", "zenith"]),
    default="horizon",
    help="What the elevation is counted from; zenith: the log has zenith angles.",
)
@options.units("Units of columns whose names state none, such as range=km,azimuth=deg. [default: s, m, rad]")
@click.option(
    "--columns", metavar="NAME=COLUMN,...", help="Names of columns that are not understood, such as time=T0,range=RNG."
)
@click.option("--keep-columns/--no-keep-columns", help="Carry the log's other columns through to the trajectory.")
@click.option(
    "--config",
    type=options.FILE,
    metavar="FILE",
    help="A station file (TOML): site, conventions, columns, known biases, noise and options of one instrument; "
    "--write-config prints one. Options given here win over it.",
)
@click.option("--write-config", is_flag=True, help="Print a station file with the options given, and filter nothing.")
@click.option(
    "--jobs", type=click.IntRange(min=1), default=1, metavar="N", help="Worker processes, for several logs at a time."
)
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Let the workers of a Dask cluster do it: the address of its scheduler, such as tcp://10.0.0.1:8786. Logs and "
    "outputs must lie where all workers see them under the same name, or be URIs such as s3://bucket/flight.csv.",
)
@click.option(
    "--summary",
    type=click.Choice(["text", "json", "none"]),
    default="text",
    help="What to print of each trajectory; on stderr when the trajectory itself goes to stdout.",
)
@options.report("a trajectory, the readings it was made from, and whether to trust it")
@click.option("--list-methods", is_flag=True, help="List the methods, and filter nothing.")
def command(
    logs: tuple[str, ...],
    output: str | None,
    config: str | None,
    jobs: int,
    scheduler: str | None,
    summary: str,
    report: str | None,
    list_methods: bool,
    write_config: bool,
    **_: Any,
) -> None:
    """Find the outliers of LOGs, and estimate where the target was, how fast, and how sure that is.

    A LOG is a .csv, .csv.gz, .parquet or .feather file (or a URI of one) with time, range, azimuth and elevation, or -
    for CSV on standard input. Noise and manoeuvre level are found from the log itself. A bad log does not stop the
    others; the exit code is then 1.
    """
    if list_methods:
        from ftproc.methods import registry

        click.echo(registry.list_methods())
        return
    ctx = click.get_current_context()
    if write_config:
        from ftproc.cli import stations

        click.echo(stations.as_file(ctx), nl=False)
        return
    if not logs:
        raise click.UsageError("Name at least one log.", ctx)
    from ftproc.cli.command import hasten

    hasten()
    from ftproc.cli import filtering, stations

    recipe = stations.recipe(ctx)
    workers = filtering.Workers(jobs, scheduler)
    ctx.exit(
        filtering.filter_logs(
            logs, output, recipe, config, workers, summary=summary, report=report, debug=ctx.meta[DEBUG]
        )
    )
