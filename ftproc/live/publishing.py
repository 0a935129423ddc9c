"""Rows of a log that is followed, written as soon as their lag has passed."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from ftproc import __version__
from ftproc.config.recipe import Recipe
from ftproc.errors import UsageError
from ftproc.files.conventions import FRAMES
from ftproc.files.writing import atomic, csvtext, trajectories
from ftproc.live.following import Stop, follow
from ftproc.live.live import Live
from ftproc.methods import registry
from ftproc.records import COMPONENTS, GOOD, ISOLATED, MISSING, PATCH, Trajectory

_LABELS = {"good": GOOD, "isolated": ISOLATED, "patch": PATCH, "missing": MISSING}


def follow_log(logs: Sequence[str], output: str | None, recipe: Recipe, form: str) -> str:
    """Follow one log to its end, or until it is interrupted; what was published, in words. output: a file, or `-` or
    None for standard output in this form, csv or jsonl. Raises FtprocError."""
    if len(logs) != 1:
        raise UsageError("--follow reads one log; name a file that grows, or - for standard input.")
    track, counts = Live(recipe.settings), _Counts()
    with Stop() as stop:
        rows = counts.counted(follow(logs[0], recipe, track, stop))
        if output is None or output == "-":
            _print(rows, form)
        else:
            atomic.refuse_overwriting(output, logs)
            atomic.check_target(output)
            trajectories.write_parts(rows, lambda: _metadata(logs[0], recipe, track, counts), output)
    return f"{logs[0]}: {counts.said(track)}"


def _print(rows: Iterable[Trajectory], form: str) -> None:
    """Write rows on standard output as they come."""
    with_header = True
    with atomic.standard_output() as stream:
        for found in rows:
            table = trajectories.to_table(found)
            if form == "jsonl":
                stream.writelines(json.dumps(trajectories.plain(row)).encode() + b"\n" for row in table.to_pylist())
            else:
                stream.writelines(csvtext.pieces(table, with_header))
                with_header = False
            stream.flush()


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
        "frame": FRAMES[recipe.station.azimuth_from],
        "settings": {"editing": settings.editing, "lag_s": settings.lag_s, "smooth": False, "gate": settings.gate},
        "model_sha256": None,
        "summary": {
            "rows": counts.rows,
            "rows_without_estimate": counts.unknown,
            "rows_too_late": track.late,
            "components": counts.labels,
        },
    }
