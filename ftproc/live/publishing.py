"""Rows of a log that is followed, written as soon as their lag has passed."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from ftproc import __version__
from ftproc.config.recipe import Recipe
from ftproc.errors import UsageError
from ftproc.files import layout
from ftproc.files.conventions import FRAMES
from ftproc.files.writing import atomic, csvtext, geodesy, maps, outputs, streams, tables, trajectories
from ftproc.live.following import follow
from ftproc.live.growing import Say, Stop
from ftproc.live.live import Live
from ftproc.methods import registry
from ftproc.records import COMPONENTS, GOOD, ISOLATED, MISSING, PATCH, Trajectory

_LABELS = {"good": GOOD, "isolated": ISOLATED, "patch": PATCH, "missing": MISSING}


def follow_log(
    logs: Sequence[str], output: str | None, recipe: Recipe, form: str, say: Say, inputs: Sequence[str] = ()
) -> str:
    """Follow one log to its end, or until it is interrupted; what was published, in words. output: a file, or `-` or
    None for standard output in this form, csv or jsonl. say: takes a sentence for the user, at once. inputs: other
    files that are read. An error in the log is raised when what came before it has been written. Raises FtprocError."""
    if len(logs) != 1:
        raise UsageError("--follow reads one log; name a file that grows, or - for standard input.")
    settings = recipe.settings
    geodesy.check(settings)
    if recipe.keep_columns:
        say("--follow copies no other columns of the log; column `row` says which row of the log each one is.")
    written = output or outputs.STREAM
    maps.check(written, settings.site)
    if layout.map_kind(written) is None:
        tables.kind_of(written)
    outputs.check(outputs.trajectory(written), [logs[0], *inputs])
    track, counts, faults = Live(settings), _Counts(), list[Exception]()
    frame = {"frame": FRAMES[recipe.station.azimuth_from]}
    with Stop() as stop, atomic.guarding(logs), streams.given_up(lambda: stop.asked):
        rows = counts.counted(_until_fault(follow(logs[0], recipe, track, stop, say), faults))
        placed = (geodesy.located(replace(part, metadata=frame), settings) for part in rows)
        if written == outputs.STREAM:
            _print(placed, form)
        else:
            trajectories.write_parts(placed, lambda: _metadata(logs[0], recipe, track, counts), written)
        if faults:
            raise faults[0]
    return f"{logs[0]}: {counts.said(track)}"


def _until_fault(parts: Iterator[Trajectory], faults: list[Exception]) -> Iterator[Trajectory]:
    """The parts, up to an error, which is put by; before the first part it is raised."""
    published = False
    try:
        for part in parts:
            yield part
            published = True
    except Exception as error:
        if not published:
            raise
        faults.append(error)


def _print(rows: Iterable[Trajectory], form: str) -> None:
    """Write rows on standard output as they come. Raises OutputError, also when a stop is asked for while its reader
    takes nothing."""
    with_header = True
    with atomic.standard_output() as stream:
        for found in rows:
            table = trajectories.to_table(found)
            if form == "jsonl":
                lines = (json.dumps(trajectories.plain(row)).encode() + b"\n" for row in table.to_pylist())
                stream.write(b"".join(lines))
            else:
                stream.write(b"".join(csvtext.pieces(table, with_header)))
                with_header = False


class _Counts:
    """What has been published."""

    def __init__(self) -> None:
        self.rows = self.unknown = 0
        self.labels = {name: dict.fromkeys(_LABELS, 0) for name in COMPONENTS}

    def counted(self, parts: Iterable[Trajectory]) -> Iterator[Trajectory]:
        """The parts, while they are counted."""
        for part in parts:
            self.rows += len(part)
            self.unknown += int((part.state != part.state).all(1).sum())
            for c, name in enumerate(COMPONENTS):
                for label, value in _LABELS.items():
                    self.labels[name][label] += int((part.outlier[:, c] == value).sum())
            yield part

    def said(self, track: Live) -> str:
        """The counts in words."""
        found = [f"{self.rows} rows"]
        found += [f"{self.unknown} without an estimate"] if self.unknown else []
        found += [f"{track.late} came too late to be used"] if track.late else []
        return ", ".join(found)


def _metadata(log: str, recipe: Recipe, track: Live, counts: _Counts) -> Mapping[str, Any]:
    """What is known of a run that has ended."""
    settings, method = track.settings, registry.named(track.settings.method)
    return {
        "program": "ftproc",
        "version": __version__,
        "method": method.name,
        "sees": method.sees(settings),
        "log": log,
        "settings": {"editing": settings.editing, "lag_s": settings.lag_s, "smooth": False, "gate": settings.gate},
        "model_sha256": None,
        "summary": {
            "rows": counts.rows,
            "rows_without_estimate": counts.unknown,
            "rows_too_late": track.late,
            "components": counts.labels,
        },
    }
