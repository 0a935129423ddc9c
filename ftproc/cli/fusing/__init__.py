"""The work of `ftproc filter --fuse`: a range file to a fused flight and its outputs."""

from __future__ import annotations

import functools
import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from ftproc.batch import plan
from ftproc.cli.command import stated
from ftproc.cli.progress import Progress
from ftproc.correction import model_file
from ftproc.errors import InputError, OutputError, UsageError, failure, printable
from ftproc.files import layout
from ftproc.files.writing import atomic, maps, tables, trajectories
from ftproc.fusion import flight, results, summary
from ftproc.fusion.range_file import Range, load, template
from ftproc.quality import summary as single
from ftproc.quality.summary import line
from ftproc.settings import PACKAGED, FilterSettings

#: Options of `filter` that mean something for several stations; of a single log, the others are its station's.
MEANT = (
    "fuse",
    "logs",
    "output",
    "smooth",
    "summary",
    "report",
    "jerk",
    "gate",
    "ecef",
    "write_calibration",
    "write_config",
)


def range_file(ctx: click.Context) -> str:
    """The text of a range file for the logs named. Raises UsageError."""
    given = stated(ctx)
    logs = [*([given["fuse"]] if given.get("fuse") else []), *given.get("logs", ())]
    return template(logs, given.get("azimuth_from"))


def fuse_logs(ctx: click.Context, debug: bool) -> int:
    """Fuse, write, and print the summary; the exit code. Raises UsageError, and errors of the outputs."""
    given = stated(ctx)
    _refuse_idle(ctx, given)
    range_ = load(given["fuse"])
    settings = FilterSettings(
        smooth=given.get("smooth", False),
        jerk_psd_m2ps5=given.get("jerk"),
        gate=given.get("gate", FilterSettings.gate),
        ecef=given.get("ecef", False),
    )
    output = given.get("output") or f"{Path(given['fuse']).stem}.trajectory.parquet"
    if Path(output).is_dir() or output.endswith("/"):
        output = str(Path(output) / f"{Path(given['fuse']).stem}.trajectory.parquet")
    _check(range_, output, settings)
    given["report"] = _page(range_, output, given.get("report"))
    began = time.monotonic()
    try:
        with Progress() as progress:
            model = model_file.named(PACKAGED) if len(range_.instruments) == 1 else None
            found = flight.fuse(range_, settings, model, functools.partial(progress, "fusing"))
    except InputError as error:
        if debug:
            click.echo(failure(error).trace, err=True)
        click.echo(f"ftproc: {error}", err=True)
        return 1
    places = _write(found, output, given, range_)
    _show(found, places, given.get("summary", "text"), time.monotonic() - began, output == "-")
    return 0


def _refuse_idle(ctx: click.Context, given: Mapping[str, Any]) -> None:
    """Raise UsageError for options that do nothing with --fuse."""
    if given.get("logs"):
        raise UsageError(
            f"--fuse takes its logs from the range file, so {given['logs'][0]} has no place on the command line; "
            "write it there as log = ..., or print a range file with --fuse --write-config LOG..."
        )
    for parameter in ctx.command.params:
        if parameter.name in given and parameter.name not in MEANT:
            raise UsageError(
                f"{parameter.opts[0]} does nothing with --fuse: each station has its own; write it in the range file, "
                "below [station.NAME]."
            )


def _check(range_: Range, output: str, settings: FilterSettings) -> None:
    """Raise UsageError or OutputError for outputs that cannot be."""
    inputs = [range_.path, *(each.log for each in range_.instruments)]
    if output != "-":
        if layout.table_kind(output) is None and layout.map_kind(output) is None:
            raise UsageError(f"-o {output}: end the name in {', '.join((*layout.TABLES, *layout.MAPS))}.")
        atomic.refuse_overwriting(output, inputs)
        trajectories.check(output)
    maps.check(output, range_.origin)
    if settings.ecef and range_.origin is None:
        raise UsageError("--ecef needs the origin on the earth: write lat_deg, lon_deg and height_m in [origin].")


def _page(range_: Range, output: str, report: str | None) -> str | None:
    """The file of the page, if there is one; makes the directory. Raises UsageError or OutputError."""
    if report is None:
        return None
    from ftproc import report as pages

    pages.check(report)
    (page,), _ = plan.pages([output], report, [range_.path, *(each.log for each in range_.instruments)])
    return page


def _write(found: flight.Flight, output: str, given: Mapping[str, Any], range_: Range) -> list[str]:
    """Write all outputs; their names."""
    trajectories.write(found.trajectory, output, results.WITHOUT)
    places = [output]
    if output != "-":
        kind = layout.table_kind(output) or layout.map_kind(output) or ""
        stem = Path(output).with_name(Path(output).name[: len(Path(output).name) - len(kind)])
        tables.write_table(found.biases, str(stem) + ".biases.csv")
        folder = Path(str(stem) + ".edited")
        _make(folder)
        for name, table in found.edited.items():
            tables.write_table(table, str(folder / f"{name}.parquet"))
        places += [f"{stem}.biases.csv", f"{folder}/"]
    if given.get("write_calibration") is not None:
        folder = Path(given["write_calibration"])
        _make(folder)
        results.write_calibration(range_, found.constants, folder)
        places.append(f"{folder}/")
    if given["report"] is not None:
        from ftproc.report.fused import write

        write(found, given["report"])
        places.append(given["report"])
    return places


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise OutputError(f"{folder}: the directory cannot be made ({reason}); give another name with -o.") from error


def _show(found: flight.Flight, places: list[str], form: str, elapsed_s: float, on_stdout: bool) -> None:
    metadata = found.trajectory.metadata
    if form == "json":
        shown = {"log": metadata["log"], "method": metadata["method"], **metadata["summary"], "output": places[0]}
        click.echo(json.dumps(trajectories.plain(shown), indent=2), err=on_stdout)
    elif form == "text":
        text = summary.text(metadata) if found.fused is not None else single.text(metadata)
        lines = [text, line("time", f"{elapsed_s:.2f} s"), *(f"  -> {place}" for place in places if place != "-")]
        click.echo("\n".join(map(printable, "\n".join(lines).split("\n"))), err=on_stdout)
