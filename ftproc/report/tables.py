"""The text and tables of the page. Everything from a file is escaped here."""

from __future__ import annotations

import html
from collections.abc import Iterable, Mapping, Sequence
from pathlib import PurePath
from typing import Any

import numpy as np

from ftproc.quality import summary as figures
from ftproc.quality import verdict
from ftproc.records import COMPONENTS, Trajectory
from ftproc.report.patches import patches as found_patches
from ftproc.report.patches import steps as found_steps
from ftproc.report.style import GREY, VERDICT
from ftproc.report.view import View
from ftproc.scoring import render

MOST_PATCHES = 200  # that are listed
AROUND_STEP = 0.02  # of the duration, on each side of a step to which figures are zoomed
_LONGEST_LIST = 6  # values; a longer list is shown by its extremes


def name(trajectory: Trajectory) -> str:
    """The title of the page: the log's file name, or the trajectory's."""
    return PurePath(str(trajectory.metadata.get("log") or trajectory.name)).name


def heading(view: View) -> str:
    """The log, and a line on how it was filtered."""
    meta, s = view.trajectory.metadata, view.summary
    parts = []
    if s:
        settings = meta["settings"]
        way = "smoothed" if settings["smooth"] else "filtered"
        parts = [f"{s['rows']:,} rows", f"{s['duration_s']:,.6g} s",
                 f"{way} by {meta['method']}, {settings['editing']} editing"]  # fmt: skip
    elif len(view.trajectory):
        parts = [f"{len(view.trajectory):,} rows"]
    if view.score is not None:
        parts.append(f"compared with {view.score.truth}")
    return f'<h1>{html.escape(name(view.trajectory))}</h1><p class="sub">{html.escape(" · ".join(parts))}</p>'


def banner(view: View) -> str:
    """The verdict with its reasons, in its colour."""
    trust = view.summary.get("trust")
    if not trust:
        return _banner(GREY, "no verdict: this file does not say how it was made", [])
    level, reasons = trust["verdict"], trust["reasons"]
    if len(reasons) < 2:
        return _banner(VERDICT[level], verdict.sentence(trust), [trust["not_shown"]] if "not_shown" in trust else [])
    return _banner(VERDICT[level], f"{level}:", reasons)


def _banner(colour: str, sentence: str, reasons: Sequence[str]) -> str:
    text = f"<strong>{html.escape(sentence)}</strong>{_list(reasons)}"
    return f'<div class="verdict" style="border-color: {colour}">{text}</div>'


def summary(view: View) -> str:
    """Counts, rates and noise per component; gaps, process noise, NIS; notes."""
    s = view.summary
    if "components" not in s:  # nor has a fused flight, whose stations have them
        return ""
    rows = [figures.component_cells(component, s["components"][component]) for component in COMPONENTS]
    notes = figures.notes(s)
    body = table(figures.HEADER, rows, "numbers") + _pairs(figures.facts(s)) + _list(notes)
    return f"<section><h2>Summary</h2>{body}</section>"


def patches(view: View) -> str:
    """The steps that stay and the outlier patches, each a button that zooms all figures over time to it."""
    found, steps = found_patches(view), found_steps(view)
    if not (found or steps):
        return ""
    around = AROUND_STEP * float(np.ptp(view.trajectory.time_s))
    rows = [
        (_zoom(s.time_s, s.time_s - around, s.time_s + around), "stays", f"{s.component}, a step", "-", s.size)
        for s in steps
    ]  # fmt: skip
    rows += [
        (_zoom(p.start_s, p.start_s, p.end_s), f"{p.end_s:,.2f}", p.component, f"{p.readings:,}",
         "-" if p.size != p.size else f"{p.size:+,.3g} {p.unit}")
        for p in sorted(found, key=lambda p: -p.readings)[:MOST_PATCHES]
    ]  # fmt: skip
    note = "Size: median of reading minus estimate." if found else ""
    if len(found) > MOST_PATCHES:
        note = f"The {MOST_PATCHES} longest of {len(found):,}. {note}"
    if steps:
        note = f"A step stays: the estimate bridges it, and follows the longer side. {note}".strip()
    click = "A click on a start zooms all figures over time to it."
    title = " and ".join(["Steps"] * bool(steps) + ["Outlier patches"] * bool(found)).replace("and O", "and o")
    body = table(("start, s", "end, s", "component", "readings", "size"), rows, "numbers patches", links=1)
    whole = '<button data-from="" data-to="">Show the whole log.</button>'
    links = f'<span class="click">{click} {whole}</span>'
    return f'<section><h2>{title}</h2>{body}<p class="note">{note} {links}</p></section>'


def _zoom(shown_s: float, start_s: float, end_s: float) -> str:
    """A time as a button that zooms to a stretch."""
    return f'<button data-from="{start_s!r}" data-to="{end_s!r}">{shown_s:,.2f}</button>'


def score(view: View) -> str:
    """The figures of `ftproc score`."""
    if view.score is None:
        return ""
    return f"<pre>{html.escape(render([view.score], 'table'))}</pre>"


def provenance(view: View) -> str:
    """Settings, specified or estimated, and the program, method, model and log."""
    meta = view.trajectory.metadata
    if not meta:
        return ""
    settings = meta.get("settings")
    about = [(key, meta[key]) for key in meta if key not in ("settings", "summary")]
    parts = [_pairs((str(key), _shown(value)) for key, value in about)]
    if isinstance(settings, Mapping):
        parts.insert(0, _pairs((str(key), _shown(value)) for key, value in settings.items()))
    title = "Settings, noise and process noise as used; provenance"
    return f'<section><h2>{title}</h2><div class="tables">{"".join(parts)}</div></section>'


def table(header: Sequence[str], rows: Iterable[Sequence[str]], kind: str = "", links: int = 0) -> str:
    """A table of texts. links: the first so many cells of each row are HTML."""
    head = "".join(f"<th>{html.escape(cell)}</th>" for cell in header)
    lines = []
    for row in rows:
        cells = (*row[:links], *map(html.escape, row[links:]))
        lines.append("".join(f"<td>{cell}</td>" for cell in cells))
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return (
        f'<div class="scroll"><table class="{kind}"><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'
    )


def _pairs(pairs: Iterable[tuple[str, str]]) -> str:
    cells = "".join(f"<tr><th>{html.escape(key)}</th><td>{html.escape(value)}</td></tr>" for key, value in pairs)
    return f"<div><table><tbody>{cells}</tbody></table></div>"


def _list(texts: Sequence[str]) -> str:
    return f"<ul>{''.join(f'<li>{html.escape(text)}</li>' for text in texts)}</ul>" if texts else ""


def _shown(value: Any) -> str:
    if value is None or value == "" or value == []:
        return "-"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_shown(part)}" for key, part in value.items() if part not in (None, []))
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list | tuple):
        if len(value) > _LONGEST_LIST and all(isinstance(v, int | float) for v in value):
            return f"{len(value)} values, from {min(value):.3g} to {max(value):.3g}"
        return ", ".join(map(_shown, value))
    return str(value)
