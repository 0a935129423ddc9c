"""`ftproc filter`: dirty logs in, clean trajectories out."""

from __future__ import annotations

from typing import Any

import click

from ftproc.cli import options
from ftproc.cli.command import DEBUG, Command, start_quickly

_EXAMPLES = """
ftproc simulate --scenario zuo2021-outliers -o flight.csv
ftproc filter flight.csv --smooth --report flight.html
ftproc filter flight.csv --noise 3,0.0002,0.0002 --summary json -o clean.parquet
"""


@click.command(cls=Command, short_help="Dirty logs in, clean trajectories out.", examples=_EXAMPLES)
@click.argument("logs", nargs=-1, type=options.FILE, metavar="LOG...")
@options.output(
    "File (.parquet, .feather, .csv, .csv.gz; with a site also .kml, .geojson, .czml), - for CSV on stdout, or a "
    "directory, which is made when absent; several logs need a directory, or a * for the name of each. "
    "[default: STEM.trajectory.parquet or .csv, like the log, in the current directory]",
    "OUT",
)
@click.option(
    "--fuse",
    is_flag=False,
    flag_value="",
    type=options.RANGE,
    metavar="RANGE.toml",
    help="Several stations, one trajectory: fuse the logs of a range file, with the stations' biases and clocks found "
    "from the flight; --fuse --write-config LOG... prints such a file.",
)
@click.option(
    "--write-calibration",
    type=options.FILE,
    metavar="DIR",
    help="With --fuse: write a station file for each station, with the biases found.",
)
@options.tracker
@options.by_hand
@click.option(
    "--site",
    type=options.site,
    metavar="LAT,LON,HEIGHT",
    help="The station's position (WGS-84; degrees, degrees, m), such as 48.0812,11.2803,612: adds lat_deg, lon_deg, "
    "height_m. x is taken as east and y as north; with --azimuth-from north, x as north and y as east.",
)
@click.option(
    "--ecef", is_flag=True, help="With a site: add x_ecef_m ... vz_ecef_mps, earth-centred, earth-fixed (WGS-84)."
)
@click.option(
    "--derived",
    is_flag=True,
    help="Add ground speed, track, climb rate, flight path angle, turn rate and load factor, each with its 1-sigma.",
)
@options.azimuth_from(
    "Zero of the azimuth: x, A = atan2(y, x), or north, clockwise; then x is north. [default: north if the column is "
    "called so, such as Bearing, else x]"
)
@click.option(
    "--elevation-from",
    type=click.Choice(["horizon", "zenith"]),
    help="Zero of the elevation; zenith: the log has zenith angles. [default: zenith if the column is called so, else "
    "horizon]",
)
@options.units("Units of columns whose names state none, such as range=km,azimuth=deg. [default: s, m, rad]")
@click.option(
    "--columns",
    metavar="NAME=COLUMN,...",
    help="Names of columns that are not recognized, or their numbers from 1, such as time=T0,range=RNG or time=1.",
)
@click.option("--widths", metavar="N,N,...", help="Widths of the columns of a text without separators, in characters.")
@click.option(
    "--where",
    multiple=True,
    metavar="CONDITION",
    help="Read only rows that meet it, such as quality>=5 or mode=auto; may be given several times.",
)
@click.option(
    "--target",
    metavar="COLUMN=VALUE|COLUMN",
    help="One of several targets in a file, such as track=7; a COLUMN alone: a trajectory of each of its values, as "
    "where the file's standard tells targets apart; none: there is one target, whatever the rows suggest.",
)
@click.option("--keep-columns/--no-keep-columns", help="Copy the log's other columns to the trajectory.")
@click.option(
    "--config",
    type=options.FILE,
    metavar="FILE",
    help="A station file (TOML): site, conventions, columns, known biases, noise and options of one instrument; "
    "--write-config prints one. Options on the command line win over it. With a * for the name of each log: of "
    "those that have one, '*.toml' beside it.",
)
@click.option("--write-config", is_flag=True, help="Print a station file with these options, and filter nothing.")
@click.option(
    "--jobs", type=click.IntRange(min=1), default=1, metavar="N", help="Worker processes, each for one log at a time."
)
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Filter on a Dask cluster: the address of its scheduler, such as tcp://10.0.0.1:8786. Logs and outputs must "
    "have the same names on all workers, or be URIs such as s3://bucket/flight.csv.",
)
@click.option(
    "--redo", is_flag=True, help="Filter all logs. Else, of several, those are left that the same version has finished."
)
@click.option(
    "--summary",
    type=click.Choice(["text", "line", "json", "none"]),
    default="text",
    help="Form of the printed summary of each trajectory; on stderr when the trajectory goes to stdout. After several "
    "logs follows the number of each verdict.",
)
@click.option(
    "--table",
    type=options.FILE,
    metavar="FILE",
    help="Write a table (.csv, .json, .html) of all logs: verdict, reasons, rows, outliers, noise, outputs.",
)
@click.option(
    "--follow",
    is_flag=False,
    flag_value="csv",
    type=options.FILE,
    metavar="[csv|jsonl|LOG]",
    help="Read a log that still grows with live editing: a file, - for standard input, udp://HOST:PORT or "
    "tcp://HOST:PORT. Each row is written as soon as its lag has passed: on standard output as CSV or JSON lines, or "
    "to -o. Ctrl-C ends it, with a whole file.",
)
@click.option(
    "--state",
    type=options.FILE,
    metavar="FILE",
    help="With --follow: keep in this file what lets the same command go on after a crash, with no row lost or twice.",
)
@click.option(
    "--coast",
    type=options.seconds,
    metavar="S",
    help="With --follow: go on for S seconds when no reading comes, with rows of no reading (row -1) and their sigmas.",
)
@click.option(
    "--heartbeat",
    type=options.number,
    metavar="S",
    help="With --follow: say every S seconds that all is well, in a line among the rows on standard output, else on "
    "standard error.",
)
@options.report("a trajectory, its readings and residuals, and the verdict")
@click.option(
    "--explain", is_flag=True, help="Print how each log is understood, with its first rows, and filter nothing."
)
@click.option(
    "--list-methods",
    is_flag=False,
    flag_value="all",
    metavar="[NAME]",
    help="List the methods, or the parameters of one, and filter nothing.",
)
def command(list_methods: str | None, write_config: bool, explain: bool, follow: str | None, **options: Any) -> None:
    """Find the outliers of LOGs, and estimate the target's trajectory with its uncertainty.

    A LOG is a text file (.csv, .txt, .tsv, .dat), .parquet, .feather, .arrow, .xlsx, .jsonl, .h5 or .mat, even packed
    (.gz, .bz2, .xz, .zst, .zip), or a URI of one, with time, range, azimuth and elevation; ASTERIX, ILRS CRD, CCSDS
    TDM or NMEA; or - for text on standard input. A sheet or group in it stands behind #: flight.h5#radar. Measurement
    noise and process noise are estimated from the log. A bad log does not stop the others; the exit code is then 1.
    """
    ctx = click.get_current_context()
    if options["again"] is not None:
        options = _before(ctx, options)
    if list_methods is not None:
        from ftproc.methods import registry

        click.echo(registry.list_methods() if list_methods == "all" else registry.describe(list_methods))
    elif options.pop("fuse") is not None:
        start_quickly()
        from ftproc.cli import fusing

        if write_config:
            click.echo(fusing.range_file(ctx), nl=False)
        else:
            ctx.exit(fusing.fuse_logs(ctx, ctx.meta[DEBUG]))
    elif options.pop("write_calibration") is not None:
        raise click.UsageError("--write-calibration does nothing without --fuse. Leave it out.", ctx)
    elif write_config:
        from ftproc.cli.filtering import recipes

        click.echo(recipes.station_file(ctx), nl=False)
    elif follow is not None and not explain:
        from ftproc.cli import filtering

        filtering.follow(ctx, follow)
    elif any(options.pop(name) for name in ("state", "coast", "heartbeat")):
        raise click.UsageError("--state, --coast and --heartbeat do nothing without --follow. Leave them out.", ctx)
    elif not options["logs"]:
        from ftproc.cli import explaining

        click.echo(f"{ctx.command_path}: {explaining.first_commands()}", err=True)
        ctx.exit(2)
    elif explain:
        from ftproc.cli import explaining
        from ftproc.cli.filtering import recipes

        found = recipes.of_logs(ctx, options["logs"])
        ctx.exit(explaining.explain(found, options["summary"], ctx.meta[DEBUG]))
    else:
        start_quickly()
        from ftproc.batch import plan
        from ftproc.cli import filtering
        from ftproc.cli.filtering import recipes

        options["logs"], others = plan.chosen(options["logs"])
        if others:
            what = f"{len(others)} truths and trajectories, such as " if len(others) > 1 else "a truth or trajectory, "
            filtering.notify(f"left out: {what}{others[0]}")
        request = filtering.Request._make(options[name] for name in filtering.Request._fields)
        ctx.exit(filtering.filter_logs(request, recipes.of_logs(ctx, request.logs), ctx.meta[DEBUG]))


def _before(ctx: click.Context, options: dict[str, Any]) -> dict[str, Any]:
    """The options with what a run that is made again says in place of those that are not stated. Remembers the run."""
    from ftproc.cli import again

    if options["config"] is not None:
        raise click.UsageError("--again and --config both say how a log is filtered; give one of the two.", ctx)
    before = ctx.meta[again.AGAIN] = again.load(options["again"])
    fused = before.options.get("fuse")
    logs = options["logs"] or (() if fused else (before.log,))
    found = {"logs": logs, "fuse": options["fuse"] or fused, "output": options["output"] or before.output}
    return {**options, **found, "again": before}
