"""A stream from its source to its outputs: rows, metadata, a page, what is kept for a crash, and what is said."""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from ftproc import __version__
from ftproc.config.recipe import Recipe
from ftproc.core import compiled
from ftproc.correction import model_file
from ftproc.correction.live import live_model
from ftproc.files.conventions import frame
from ftproc.files.writing import atomic, geodesy, maps, outputs, streams
from ftproc.live.following import Following
from ftproc.live.lines.growing import Say
from ftproc.live.outputs.page import Page
from ftproc.live.outputs.rows import Output, written
from ftproc.live.state import StateFile
from ftproc.live.stop import Stop
from ftproc.live.stream import Stream
from ftproc.methods import registry
from ftproc.records import COMPONENTS, GOOD, ISOLATED, MISSING, PATCH, Trajectory

KEEP_S = 1.0  # between two states
_LABELS = {"good": GOOD, "isolated": ISOLATED, "patch": PATCH, "missing": MISSING}


class Request(NamedTuple):
    """How a log is followed. source: a file, `-`, udp://HOST:PORT or tcp://HOST:PORT. output: a file, or `-` for
    standard output in a form, csv or jsonl. state: the file that lets a later run go on. coast_s: how long tracks go
    on in a pause. heartbeat_s: between lines that say that all is well; zero for none. page: that follows. inputs:
    other files that are read."""

    source: str
    output: str = outputs.STREAM
    form: str = "csv"
    state: str | None = None
    coast_s: float = 0.0
    heartbeat_s: float = 0.0
    page: str | None = None
    inputs: Sequence[str] = ()


def follow_log(request: Request, recipe: Recipe, say: Say) -> str:
    """Follow one log to its end, or until it is interrupted; what was published, in words. say: takes a sentence for
    the user, at once. An error in the log is raised when what came before it has been written. Raises FtprocError."""
    settings = recipe.settings
    geodesy.check(settings)
    if recipe.keep_columns:
        say("--follow copies no other columns of the log; column `row` says which row of the log each one is.")
    maps.check(request.output, settings.site)
    files = [*written(request.output)] if request.output != outputs.STREAM else []
    more = ((request.state, "--state"), (request.page, "--report"))
    files += [outputs.Output(name, option) for name, option in more if name is not None]
    outputs.check(files, [request.source, *request.inputs])
    stream = Stream(request.source, recipe, say, request.coast_s)
    state = None if request.state is None else StateFile(Path(request.state), _purpose(request, recipe))
    with Stop() as stop, atomic.guarding([request.source]), streams.given_up(lambda: stop.asked):
        return _Run(request, Following(stream, stop, say, state), state, say).to_its_end()


def _purpose(request: Request, recipe: Recipe) -> str:
    """What must be the same for a state to be gone on with."""
    return repr((__version__, compiled.DIGEST, request.source, request.output, request.coast_s, recipe))


class _Run:
    def __init__(self, request: Request, following: Following, state: StateFile | None, say: Say) -> None:
        self._request, self._following, self._state, self._say = request, following, state, say
        self._stream = following.stream
        self._counts = _Counts()
        known = None if state is None else state.known
        if known is not None:
            self._counts.__dict__.update(known["counts"])
        self._output = Output(request.output, request.form, self._metadata, None if known is None else known["output"])
        self._page = None if request.page is None else Page(request.page, self._metadata)
        self._kept_s = self._beat_s = time.monotonic()

    def to_its_end(self) -> str:
        """What was published, in words."""
        faults = list[Exception]()
        closing = contextlib.nullcontext() if self._state is None else contextlib.closing(self._state)
        with closing, self._output as output:
            for part in self._until_fault(faults):
                if part is not None:
                    self._publish(part)
                else:
                    self._moment(output)
            if self._page is not None:
                self._page.finish()
            if self._state is not None and self._counts.rows:
                self._keep(output)
        if faults:
            raise faults[0]
        return f"{self._request.source}: {self._counts.said(self._stream)}"

    def _until_fault(self, faults: list[Exception]) -> Iterator[Trajectory | None]:
        """The parts, up to an error, which is put by; before the first row it is raised."""
        try:
            yield from self._following.rows()
        except Exception as error:
            if not self._counts.rows:
                raise
            faults.append(error)

    def _publish(self, part: Trajectory) -> None:
        known = {"frame": frame(self._stream.station)}
        part = geodesy.located(replace(part, metadata=known), self._stream.recipe.settings)
        self._counts.add(part)
        self._output.add(part)
        if self._page is not None:
            self._page.add(part)

    def _moment(self, output: Output) -> None:
        output.pause()
        now_s = time.monotonic()
        if self._state is not None and (now_s - self._kept_s >= KEEP_S or self._state.is_new):
            self._keep(output)
        if self._page is not None:
            self._page.pause()
        if self._request.heartbeat_s and now_s - self._beat_s >= self._request.heartbeat_s:
            self._beat_s = now_s
            self._beat()

    def _keep(self, output: Output) -> None:
        assert self._state is not None
        self._kept_s = time.monotonic()
        known = self._following.kept(output.known())
        self._state.replace({**known, "counts": self._counts.__dict__})

    def _beat(self) -> None:
        """A line that says that all is well: among the rows where they go to standard output, else for the user."""
        newest_s = max((track.newest_s for track in self._stream.tracks.values()), default=None)
        now = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
        waiting = sum(track.waiting for track in self._stream.tracks.values())
        found = {"utc": now, "rows": self._counts.rows, "waiting": waiting, "late": self._stream.late}
        found |= {} if newest_s is None else {"newest_s": newest_s}
        as_text = ", ".join(f"{name} {value}" for name, value in found.items())
        as_json = json.dumps({"heartbeat": found})
        if not self._output.line(as_json if self._request.form == "jsonl" else f"# heartbeat: {as_text}"):
            self._say(f"{self._request.source}: heartbeat: {as_text}")

    def _metadata(self) -> Mapping[str, Any]:
        """What is known of the run so far."""
        settings = self._stream.recipe.settings
        model = live_model(self._stream.recipe.model, settings.editing, settings.lag_s)
        method = registry.named(settings.method)
        return {
            "program": "ftproc",
            "version": __version__,
            "method": method.name,
            "sees": method.sees(settings),
            "log": self._request.source,
            "settings": {"editing": settings.editing, "lag_s": settings.lag_s, "smooth": False, "gate": settings.gate},
            "model_sha256": None if model is None else model_file.sha256(model),
            "summary": {
                "rows": self._counts.rows,
                "rows_without_estimate": self._counts.unknown,
                "rows_too_late": self._stream.late,
                "rows_coasted": self._counts.coasted,
                "components": self._counts.labels,
            },
        }


class _Counts:
    """What has been published: rows, those without an estimate, and those of no reading."""

    def __init__(self) -> None:
        self.rows = self.unknown = self.coasted = 0
        self.labels = {name: dict.fromkeys(_LABELS, 0) for name in COMPONENTS}

    def add(self, part: Trajectory) -> None:
        """Count rows."""
        self.rows += len(part)
        self.unknown += int((part.state != part.state).all(1).sum())
        self.coasted += int((part.row < 0).sum())
        for c, name in enumerate(COMPONENTS):
            for label, value in _LABELS.items():
                self.labels[name][label] += int((part.outlier[:, c] == value).sum())

    def said(self, stream: Stream) -> str:
        """The counts in words."""
        found = [f"{self.rows} row{'s' * (self.rows != 1)}"]
        found += [f"{self.unknown} without an estimate"] if self.unknown else []
        found += [f"{self.coasted} coasted"] if self.coasted else []
        found += [f"{stream.late} came too late to be used"] if stream.late else []
        return ", ".join(found)
