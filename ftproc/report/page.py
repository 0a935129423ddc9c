"""The page: verdict, tables and figures in one HTML file without references, which runs only its own scripts.

Names and values from files are escaped: as text (`html.escape`) or as JSON without any `<`. As a second barrier, the
page allows scripts by their SHA-256 only.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import html
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ftproc.records import Trajectory, Truth
from ftproc.report import deciding, tables
from ftproc.report.drawing import Drawn
from ftproc.report.maps.track import ground, track
from ftproc.report.patches import WORST_S
from ftproc.report.readings import readings, residuals, worst_seconds
from ftproc.report.timeplots import correction, errors, motion, nis, sigmas
from ftproc.report.view import View, view

if TYPE_CHECKING:
    import plotly.graph_objects as go

_BROWSER = Path(__file__).parent / "browser"

#: The nested functions around plotly's script, for module loaders; for each a browser would parse all 5 MB again.
_WRAPPER = re.compile(
    r"\(\s*function\(root, factory\) \{.*?\(\) => \{\n(.*)\nwindow\.Plotly = Plotly;\s*return Plotly;\s*\}\)\);\s*\Z",
    re.DOTALL,
)

_SCRIPTS = ("ticks.js", "page.js", "decisions.js")

#: The figures of a trajectory by name; `errors` needs a truth too.
FIGURES: dict[str, Callable[[View], Drawn]] = {
    "track": track,
    "ground": ground,
    "readings": readings,
    "worst": worst_seconds,
    "residuals": residuals,
    "nis": nis,
    "sigmas": sigmas,
    "motion": motion,
    "correction": correction,
}

#: The sections with figures: title and names of the figures, side by side.
_SECTIONS = (
    ("Track", ("ground", "track")),
    ("Readings", ("readings",)),
    (f"The {WORST_S:g} seconds with most outliers", ("worst",)),
    ("Residuals", ("residuals",)),
    ("Normalised innovation squared", ("nis",)),
    ("Uncertainty", ("sigmas",)),
    ("Motion", ("motion",)),
    ("Network correction", ("correction",)),
)


def page(trajectory: Trajectory, truth: Truth | None = None) -> str:
    """The whole page as HTML text."""
    shown = view(trajectory, truth)
    parts = [tables.heading(shown), tables.banner(shown), tables.summary(shown)]
    if truth is not None:
        parts.append(section("Against the truth", [("errors", errors(shown))], tables.score(shown)))
    parts += [tables.extremes(shown), tables.patches(shown)]
    for title, names in _SECTIONS:
        parts.append(section(title, [(name, FIGURES[name](shown)) for name in names]))
        if "worst" in names:
            parts.append(deciding.section(shown, str(trajectory.metadata.get("log", ""))))
    parts += [tables.understood(shown), tables.provenance(shown)]
    return document(tables.name(trajectory), "\n".join(parts), drawn=True)


def document(title: str, body: str, drawn: bool = False, script: str = "") -> str:
    """A page around its body (HTML). drawn: with figures, and their scripts; else with the `script` of this name."""
    named = _SCRIPTS if drawn else (script,) if script else ()
    library, text = _plotly() if drawn else None, "".join(map(_text, named))
    allowed = f"'sha256-{_sha256(text)}'" if text else "'none'"
    if library:
        allowed = f"'sha256-{library.sha256}' {allowed} 'unsafe-eval'"
    policy = f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data: blob:"
    return "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en">',
            '<head><meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{html.escape(title)}</title>",
            f"<style>\n{_text('page.css')}</style></head>",
            f"<body><main>\n{body}\n</main>",
            *([f'<script type="application/gzip" id="library">{library.packed}</script>'] if library else []),
            *([f"<script>{text}</script>"] if text else []),
            "</body></html>\n",
        ]
    )


def section(title: str, figures: list[tuple[str, Drawn]], before: str = "") -> str:
    shown = [_figure(name, drawn.figure) for name, drawn in figures if drawn.figure is not None]
    notes = dict.fromkeys(drawn.note for _, drawn in figures if drawn.note)  # without repetitions
    text = f'<p class="note">{html.escape(" ".join(notes))}</p>' if notes else ""
    side = f'<div class="figures">{"".join(shown)}</div>' if shown else ""
    return f"<section><h2>{html.escape(title)}</h2>{before}{side}{text}</section>"


def _figure(name: str, figure: go.Figure) -> str:
    """An element for the figure, and the figure as JSON, without characters that could end its script element."""
    text = figure.to_json()
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    height = int(figure.layout.height)
    return (
        f'<figure id="{name}" data-height="{height}" style="height: {height}px"></figure>'
        f'<script type="application/json" data-figure="{name}">{text}</script>'
    )


def _sha256(script: str) -> str:
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()


@cache
def _text(file: str) -> str:
    return (_BROWSER / file).read_text(encoding="utf-8")


class _Library(NamedTuple):
    """packed: the script, gzipped, in base64; 2 of 5 MB. sha256: of the script, for the page to allow it."""

    packed: str
    sha256: str


@cache
def _plotly() -> _Library:
    from plotly.offline import get_plotlyjs

    text = _WRAPPER.sub(lambda found: found[1], get_plotlyjs())
    return _Library(base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode(), _sha256(text))
