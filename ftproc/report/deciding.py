"""The engineer's decisions on the page: a click on a patch or a reading writes a line, and the lines are kept as the
file that `ftproc filter --decisions` reads. All of it happens in the browser, without a server."""

from __future__ import annotations

import html
import shlex
from collections.abc import Mapping
from itertools import pairwise
from pathlib import PurePath

import numpy as np

from ftproc.errors import quoted
from ftproc.files import decisions
from ftproc.files.writing.decisions import text
from ftproc.records import ENDS
from ftproc.report.patches import Patch
from ftproc.report.view import View


def buttons(view: View, patch: Patch) -> str:
    """For a patch of outliers: it is good after all, or bad whatever the editor thinks; "" without `section`."""
    if not view.summary:
        return ""
    stretch = f'data-component="{patch.component}" data-start="{patch.start_s!r}" data-end="{patch.end_s!r}"'
    return "".join(f'<button class="decide" {stretch} data-use="{use}">{use}</button> ' for use in ("good", "bad"))


def section(view: View, name: str, clocks: Mapping[str, float] | None = None) -> str:
    """The lines so far, what adds some, and the command that uses them. name: of the log, or of the range file. clocks:
    of several stations, s from the page's times to those of its log."""
    if not view.summary:
        return ""
    names = [channel.name for channel in view.channels if clocks is not None or np.isfinite(channel.drawn).any()]
    choices = {"component": dict.fromkeys((*names, "all"), ""), "use": dict.fromkeys(("bad", "good", "auto"), "")}
    if clocks is not None:
        choices = {"station": {each: f' data-clock="{clock!r}"' for each, clock in clocks.items()}, **choices}
    chosen = {what: _select(what, options) for what, options in choices.items()}
    file = f"{PurePath(name).name.split('.')[0] or 'log'}.decisions.csv"
    command, lines = _command(view, name, file), html.escape(_so_far(view, clocks is not None))
    patch = "" if clocks is not None else ", or on <em>good</em> or <em>bad</em> beside a patch,"
    return (
        '<section class="deciding"><h2>Decisions</h2><p class="note">You know the flight: a click on a reading'
        f"{patch} writes a line, and a second click takes it back. Readings named good are used whatever the editor "
        "thinks, bad ones never.</p>"
        f"<p>The stretch that the figures show: {chosen.get('station', '')} {chosen['component']} is "
        f'{chosen["use"]} <button id="stretch">Add a line.</button></p>'
        f'<textarea id="decisions" rows="6" spellcheck="false" aria-label="decisions">{lines}</textarea>'
        f'<p><button id="keep" data-file="{html.escape(file)}">Keep {html.escape(file)}</button>, then '
        f"<code>{html.escape(command)}</code></p></section>"
    )


def _select(what: str, options: Mapping[str, str]) -> str:
    """options: names with their further attributes."""
    parts = "".join(f"<option{more}>{html.escape(each)}</option>" for each, more in options.items())
    return f'<select id="{what}">{parts}</select>'


def _command(view: View, name: str, file: str) -> str:
    """The command of the run with these decisions."""
    meta = view.trajectory.metadata
    settings = meta.get("settings", {})
    known = meta.get("command") or f"ftproc filter {quoted(name)}{' --smooth' if settings.get('smooth') else ''}"
    words = shlex.split(known)
    kept = [word for before, word in pairwise(["", *words]) if "--decisions" not in (before, word.partition("=")[0])]
    return shlex.join([*kept, "--decisions", file])


def _so_far(view: View, stations: bool) -> str:
    """The decisions that the trajectory was computed with, to which lines are added."""
    found = view.trajectory.metadata.get("decisions")
    lines = decisions.from_metadata(found).lines if found else ()
    if stations:
        return text(lines, more=(*ENDS[0], "station"))
    return text([line._replace(station="") for line in lines], more=ENDS[0])
