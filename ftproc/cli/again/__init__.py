"""`ftproc filter --again RUN`: a run that its metadata describe, with the same settings, and what differs then."""

from __future__ import annotations

import filecmp
import json
import shlex
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import click
import numpy as np

from ftproc.cli.command import ARGUMENTS, WHERE_TO, typed
from ftproc.errors import InputError, UsageError
from ftproc.files import decisions, layout
from ftproc.files.reading import trajectories
from ftproc.files.reading.formats import content, tables
from ftproc.quality import provenance
from ftproc.records import Trajectory

AGAIN = "again"  # in the context's memory: the Before of this run
_TUPLES = ("noise", "site", "bias", "where", "widths")  # options whose values are tuples, which JSON lacks
_WORDS = {
    "version": "version of ftproc",
    "versions": "versions of Python and its libraries",
    "log_sha256": "content of the log (SHA-256)",
    "model_sha256": "correction model (SHA-256)",
}


class Before(NamedTuple):
    """An earlier run: its metadata, and its trajectory's file, or "" where that is not known. name: as the user gave
    it."""

    name: str
    metadata: Mapping[str, Any]
    trajectory: str

    @property
    def options(self) -> dict[str, Any]:
        """Those of the command line and the station file, by name, as `Recipe.of` takes them."""
        found = dict(self.metadata["options"])
        return {name: tuple(value) if name in _TUPLES else value for name, value in found.items()}

    @property
    def arguments(self) -> list[str]:
        """The words of its command line after the command."""
        return shlex.split(self.metadata["command"])[2:]

    @property
    def log(self) -> str:
        """The log's name as it was given."""
        return "-" if self.metadata["log"] == "<stdin>" else str(self.metadata["log"])

    @property
    def output(self) -> str:
        """The file of the trajectory where the user names none: never that of the run before."""
        stem = "stdin" if self.log == "-" else layout.stem_and_kind(self.log)[0]
        kind = layout.table_kind(self.trajectory) if self.trajectory else None
        return f"{stem}.again.trajectory{kind or '.csv'}"

    def decided(self, stated: Mapping[str, Any]) -> dict[str, Any]:
        """The decisions by hand of this run, by the name of their option, unless other ones are stated: their file may
        have changed since."""
        found = self.metadata.get("decisions")
        return {} if found is None or stated.get("decisions") else {"decisions": decisions.from_metadata(found)}

    def differences(self, output: str) -> Iterator[str]:
        """What differs between this run and its trajectory now, in sentences."""
        old = self.trajectory
        if old and filecmp.cmp(old, output, shallow=False):
            yield f"{output} is the same as {old}, to the last byte"
            return
        now = trajectories.read(output)
        for name in provenance.differing(now.metadata, self.metadata):
            was, is_ = (_shown(metadata.get(name)) for metadata in (self.metadata, now.metadata))
            yield f"{_WORDS.get(name, name)}: was {was}, is {is_}"
        was, is_ = (found.get("summary", {}).get("trust", {}).get("verdict") for found in (self.metadata, now.metadata))
        if was != is_:
            yield f"verdict: was {was}, is {is_}"
        if old and layout.table_kind(old) and layout.table_kind(output):
            yield from _compared(trajectories.read(old), now)


def words(ctx: click.Context, before: Before | None) -> dict[str, list[str]]:
    """The options of this run as they were typed, those of the run before among them, without what only says where
    outputs go."""
    now = typed(ctx, ctx.meta[ARGUMENTS], WHERE_TO)
    return now if before is None else {**typed(ctx, before.arguments), **now}


def inputs(before: Before | None) -> list[str]:
    """The files of the run before, which are not to be overwritten."""
    return [] if before is None else [name for name in (before.name, before.trajectory) if name]


def load(name: str) -> Before:
    """A run, from its trajectory, the JSON beside it, or what --summary json printed. Raises InputError, UsageError."""
    metadata, file = _metadata(name)
    if "options" not in metadata and isinstance(metadata.get("output"), str):
        metadata, file = _metadata(metadata["output"])
    if metadata.get("program") != "ftproc" or not metadata.get("command"):
        raise UsageError(
            f"{name}: this does not say with which options it was made: it comes from Python, from another program or "
            "from an earlier version. Name a trajectory that ftproc filter wrote, or the JSON beside it."
        )
    return Before(name, metadata, file)


def _metadata(name: str) -> tuple[dict[str, Any], str]:
    """The metadata in a file, and the trajectory that they are of."""
    if not name.lower().endswith(".json"):
        return trajectories.metadata(name, tables.read_header(name)), name
    text = content.read(name, Path(name))
    try:
        found = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{name}: this is not JSON ({error}).") from error
    beside = (f"{name[: -len('.json')]}{kind}" for kind in (*layout.TABLES, *layout.MAPS))
    file = next((each for each in beside if Path(each).exists()), "")
    return found if isinstance(found, dict) else {}, file


def _compared(old: Trajectory, now: Trajectory) -> Iterator[str]:
    """Where two trajectories differ."""
    if len(old) != len(now) or (old.row != now.row).any():
        yield f"rows: were {len(old)}, are {len(now)}"
        return
    changed = int((old.outlier != now.outlier).sum())
    apart = np.linalg.norm(old.state[:, :3] - now.state[:, :3], axis=1)
    if changed:
        yield f"outlier decisions: {changed} differ"
    if np.nanmax(apart, initial=0.0) > 0:
        k = int(np.nanargmax(apart))
        yield f"positions differ by up to {apart[k]:.3g} m, at {now.time_s[k]:.6g} s"
    elif not changed:
        yield "every number of the estimate is the same"


def _shown(value: Any) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_shown(part)}" for name, part in value.items() if name != "lines") or "none"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return ",".join(map(_shown, value))
    return "none" if value is None else str(value)
