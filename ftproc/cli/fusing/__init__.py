"""The work of `ftproc filter --fuse`: a range file to a fused flight and its outputs."""

from __future__ import annotations

import functools
import json
import shlex
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np

from ftproc.batch import plan
from ftproc.cli import again, process
from ftproc.cli.command import stated
from ftproc.cli.progress import Progress
from ftproc.correction import model_file
from ftproc.errors import InputError, UsageError, failure, printable
from ftproc.files import decisions, layout, remote
from ftproc.files.writing import atomic, maps, outputs, tables, trajectories
from ftproc.files.writing.decisions import write as write_decisions
from ftproc.files.writing.outputs import Output
from ftproc.fusion import flight, results, summary
from ftproc.fusion.range_file import Range, load
from ftproc.fusion.range_template import template
from ftproc.quality import next_steps, provenance
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
    "motion",
    "ecef",
    "derived",
    "decisions",
    "write_decisions",
    "again",
    "write_calibration",
    "write_config",
)

#: Those on which the trajectory depends.
OPTIONS = ("fuse", "smooth", "jerk", "gate", "motion", "ecef", "decisions")


def range_file(ctx: click.Context) -> str:
    """The text of a range file for the logs named. Raises UsageError."""
    given = stated(ctx)
    logs = [*([given["fuse"]] if given.get("fuse") else []), *given.get("logs", ())]
    return template(logs, given.get("azimuth_from"))


def fuse_logs(ctx: click.Context, debug: bool) -> int:
    """Fuse, write, and print the summary; the exit code. Raises UsageError, and errors of the outputs."""
    before, asked = ctx.meta.get(again.AGAIN), stated(ctx)
    given = asked if before is None else {**before.options, **asked}
    _refuse_idle(ctx, asked)
    range_ = load(given["fuse"])
    settings = FilterSettings(
        smooth=given.get("smooth", False),
        jerk_psd_m2ps5=given.get("jerk"),
        gate=given.get("gate", FilterSettings.gate),
        motion=given.get("motion", FilterSettings.motion),
        ecef=given.get("ecef", False),
        derived=given.get("derived", False),
    )
    usual = f"{Path(given['fuse']).stem}{'' if before is None else '.again'}.trajectory.parquet"
    by_hand = _decisions(given, {} if before is None else before.decided(asked))
    output = named = given.get("output") or usual
    if Path(output).is_dir() or output.endswith("/"):
        output = remote.within(output, usual)
    _check(range_, output, settings)
    places = results.places(range_, output, _folder(given.get("write_calibration")))
    page = _page(output, given.get("report"))
    written = [*outputs.trajectory(output, made=output != named), *results.written(places)]
    if given.get("write_decisions"):
        written.append(Output(given["write_decisions"], "--write-decisions"))
    inputs = [*range_.inputs, *([] if by_hand is None else [by_hand.name]), *again.inputs(before)]
    outputs.check([*written, *plan.pages_written([page], None)], inputs)
    began = time.monotonic()
    try:
        with Progress() as progress:
            model = model_file.named(PACKAGED) if len(range_.instruments) == 1 else None
            found = flight.fuse(range_, settings, model, functools.partial(progress, "fusing"), by_hand)
    except InputError as error:
        if debug:
            click.echo(failure(error).trace, err=True)
        click.echo(f"ftproc: {error}", err=True)
        return 1
    words = again.words(ctx, before)
    command = shlex.join(["ftproc", "filter", *(word for each in words.values() for word in each)])
    known = {"command": command, "options": {name: given[name] for name in OPTIONS if name in given}}
    if found.fused is not None:
        known["summary"] = _with_steps(found.trajectory.metadata["summary"], settings.smooth, words)
    metadata = provenance.completed(found.trajectory.metadata, known, {} if before is None else before.metadata)
    found = replace(found, trajectory=replace(found.trajectory, metadata=metadata))
    with atomic.guarding(range_.inputs):
        _write(found, output, places, range_)
        if page is not None:
            from ftproc.report.fused import write

            write(found, page)
    if given.get("write_decisions"):
        _write_decisions(found, by_hand, given["write_decisions"])
    if before is not None and output != "-":
        for difference in before.differences(output):
            click.echo(f"ftproc: {difference}", err=True)
    own = [f"{folder.rstrip('/')}/" for folder in places.folders]
    files = [name for name in (output, places.biases, *own, page) if name is not None]
    try:
        _show(found, files, given.get("summary", "text"), time.monotonic() - began, output == "-")
    except OSError as error:
        raise process.unsaid(error, [name for name in files if name != "-"]) from error
    return 0


def _with_steps(s: Mapping[str, Any], smooth: bool, words: Mapping[str, list[str]]) -> dict[str, Any]:
    """A summary with what to do next, and the commands to type."""
    steps = []
    for step in next_steps.of_fused(s, smooth):
        typed = {**words, **step.options}
        command = shlex.join(["ftproc", "filter", *(word for each in typed.values() for word in each)])
        steps.append({**step.as_dict(), "command": command})
    return next_steps.added(s, steps)


def _decisions(given: Mapping[str, Any], before: Mapping[str, decisions.Decisions]) -> decisions.Decisions | None:
    """Those of the run that is made again, or of the file named, if there are any. Raises UsageError."""
    if "decisions" in before:
        return before["decisions"]
    return decisions.read(given["decisions"]) if given.get("decisions") else None


def _write_decisions(found: flight.Flight, by_hand: decisions.Decisions | None, target: str) -> None:
    """Those by hand, and those that were taken on the readings of all stations."""
    lines = [] if by_hand is None else list(by_hand.lines)
    for name, table in found.edited.items():
        time_s = table.column("time_s").to_numpy()
        order = np.argsort(time_s, kind="stable")
        columns = np.column_stack([table.column(each).to_numpy() for each in layout.OUTLIER])
        lines += decisions.taken(time_s[order], table.column("row").to_numpy()[order], columns[order], name)
    write_decisions(lines, target)


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
    """Raise UsageError for outputs that cannot be."""
    if output != "-" and layout.table_kind(output) is None and layout.map_kind(output) is None:
        raise UsageError(f"-o {output}: end the name in {', '.join((*layout.TABLES, *layout.MAPS))}.")
    maps.check(output, range_.origin)
    if settings.ecef and range_.origin is None:
        raise UsageError("--ecef needs the origin on the earth: write lat_deg, lon_deg and height_m in [origin].")


def _folder(named: str | None) -> str | None:
    """The directory of the station files. Raises UsageError."""
    if named is not None and remote.is_uri(named):
        raise UsageError(f"--write-calibration {named}: station files are written on this machine; name a directory.")
    return named


def _page(output: str, report: str | None) -> str | None:
    """The file of the page, if there is one. Raises UsageError."""
    if report is None:
        return None
    from ftproc import report as pages

    pages.check(report)
    (page,), _ = plan.pages([output], report)
    return page


def _write(found: flight.Flight, output: str, places: results.Places, range_: Range) -> None:
    """Write the trajectory, the biases, the edited logs and the station files."""
    trajectories.write(found.trajectory, output, results.WITHOUT)
    if places.biases is not None:
        tables.write_table(found.biases, places.biases)
    for name, file in places.edited.items():
        tables.write_table(found.edited[name], file)
    if places.calibration:
        results.write_calibration(range_, found.constants, places.calibration)


def _show(found: flight.Flight, files: list[str], form: str, elapsed_s: float, on_stdout: bool) -> None:
    metadata = found.trajectory.metadata
    if form == "json":
        shown = {"log": metadata["log"], "method": metadata["method"], **metadata["summary"], "output": files[0]}
        click.echo(json.dumps(trajectories.plain(shown), indent=2), err=on_stdout)
    elif form == "text":
        text = summary.text(metadata) if found.fused is not None else single.text(metadata)
        lines = [text, line("time", f"{elapsed_s:.2f} s"), *(f"  -> {file}" for file in files if file != "-")]
        click.echo("\n".join(map(printable, "\n".join(lines).split("\n"))), err=on_stdout)
