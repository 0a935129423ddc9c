"""The text and tables of the page. Everything from a file is escaped here."""

from __future__ import annotations

import html
from collections.abc import Iterable, Mapping, Sequence
from pathlib import PurePath
from typing import Any

import numpy as np

from ftproc.derived.extremes import Extreme
from ftproc.derived.extremes import extremes as found_extremes
from ftproc.derived.quantities import site_of
from ftproc.quality import summary as figures
from ftproc.quality import verdict
from ftproc.records import Trajectory
from ftproc.report import deciding
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
    found = PurePath(str(trajectory.metadata.get("log") or trajectory.name)).name
    return "standard input" if found == "-" else found


def heading(view: View) -> str:
    """The log, a line on where and when it was taken, and one on how it was filtered."""
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
    lines = [line for line in (" · ".join(taken(view)), " · ".join(parts)) if line]
    below = "".join(f'<p class="sub">{html.escape(line)}</p>' for line in lines)
    return f"<h1>{html.escape(name(view.trajectory))}</h1>{below}{_clock(view)}"


def taken(view: View) -> list[str]:
    """Date and clock time of the first row, the station, the target and the instrument, as far as they are known."""
    meta, moments = view.trajectory.metadata, view.moments
    site = site_of(meta)
    what = "origin" if meta.get("stations") else "station"
    where = "" if site is None else f"{what} {abs(site[0]):.5f}° {'SN'[site[0] >= 0]}, {abs(site[1]):.5f}° " \
        f"{'WE'[site[1] >= 0]}, {site[2]:.6g} m"  # fmt: skip
    understood, station = meta.get("understood"), meta.get("station")
    target = understood.get("target") if isinstance(understood, Mapping) else None
    known = station.get("in_words") if isinstance(station, Mapping) else None
    instrument = f"instrument: {', '.join(map(str, known))}" if isinstance(known, list | tuple) and known else ""
    begins = f"T+0 is {moments.begins}{'' if moments.zone else ', time zone not stated'}" if moments.begins else ""
    if not begins and moments.counts_from_elsewhere:
        begins = f"T+0 is {moments.start_s:,.2f} s of the log's clock, whose date is not known"
    return [each for each in (begins, where, f"target {target}" if target else "", instrument) if each]


def _clock(view: View) -> str:
    """What the scripts need of the log's clock: ms since 1970 (UTC) at time zero, and the first time, s."""
    zero = view.moments.zero_ms
    data = f'data-zero="{"" if zero is None else repr(zero)}" data-start="{view.moments.start_s!r}" '
    return f'<div id="log" hidden {data}data-zone="{view.moments.zone.strip()}"></div>'


def banner(view: View) -> str:
    """The verdict with its reasons, in its colour."""
    trust = view.summary.get("trust")
    if not trust:
        streamed = (view.trajectory.metadata.get("settings") or {}).get("editing") == "live"
        why = "a stream is judged by ftproc filter of its log" if streamed else "this file does not say how it was made"
        return _banner(GREY, f"no verdict: {why}", [])
    level, reasons = verdict.level_of(trust), trust["reasons"]
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
    rows = [figures.component_cells(name, part) for name, part in s["components"].items()]
    turned = list(zip(figures.HEADER, *rows, strict=True))  # a line for each figure: a telephone shows it whole
    notes = figures.notes(s)
    body = table(turned[0], turned[1:], "numbers whole")
    body = f'<div class="tables">{body}{_pairs([*figures.facts(s), *figures.innovations(s)])}</div>{_list(notes)}'
    return f"<section><h2>Summary</h2>{body}{_rivals(s)}</section>"


def _rivals(s: Mapping[str, Any]) -> str:
    """The other understandings that are nearly as likely, if the summary has some: a line of figures each."""
    found = [each for each in s.get("rivals", ()) if isinstance(each, Mapping)]
    if not found:
        return ""
    header = list(dict.fromkeys(key for each in found for key in each))
    rows = [[_shown(each.get(key)) for key in header] for each in found]
    return f"<h3>Other understandings that are nearly as likely</h3>{table(header, rows)}"


def extremes(view: View) -> str:
    """The extremes of the flight, each a button that zooms to it."""
    found, moments = found_extremes(view.trajectory), view.moments
    if not found:
        return ""
    around = AROUND_STEP * float(np.ptp(view.trajectory.time_s))
    rows = [
        (_zoom(each.what, each.time_s - around, each.time_s + around), *_measured(each), moments.clock(each.time_s),
         *_since(view, each.time_s))
        for each in found
    ]  # fmt: skip
    header = ("", "value", "1 sigma", when(view), *(["T+ s"] if moments.counts_from_elsewhere else []))
    note = (
        'Farthest out by the value less 1 sigma. <span class="click">A click zooms all figures over time to it.</span>'
    )
    body = table(header, rows, "numbers extremes", links=1)
    return f'<section><h2>Extremes of the flight</h2>{body}<p class="note">{note}</p></section>'


def _measured(each: Extreme) -> tuple[str, str]:
    """Value and sigma, with as many decimals as the sigma's two digits have."""
    if not each.sigma > 0:
        return f"{each.value:,.5g} {each.unit}", "-"
    decimals = int(np.clip(1 - np.floor(np.log10(each.sigma)), 0, 9))
    return f"{each.value:,.{decimals}f} {each.unit}", f"± {each.sigma:,.{decimals}f}"


def understood(view: View) -> str:
    """How the log was understood, folded."""
    known = view.trajectory.metadata.get("understood")
    columns = known.get("columns") if isinstance(known, Mapping) else None
    if not isinstance(known, Mapping) or not isinstance(columns, Mapping) or not columns:
        return ""
    header = ("quantity", "column", "unit", "unit from", "why")
    rows = [(str(q), *(_shown(c.get(key)) for key in ("column", "unit", "unit_from", "why")))
            for q, c in columns.items() if isinstance(c, Mapping)]  # fmt: skip
    rest = [("file", known.get("file")), ("not used", known.get("not_used")), ("clock", known.get("clock")),
            ("readings", known.get("conventions")), ("doubtful", known.get("doubts"))]  # fmt: skip
    body = table(header, rows) + _pairs((key, _shown(value)) for key, value in rest)
    return _folded("Understood as", body)


def _folded(title: str, body: str) -> str:
    return f"<section><details><summary><h2>{html.escape(title)}</h2></summary>{body}</details></section>"


def patches(view: View) -> str:
    """The steps that stay and the outlier patches, each a button that zooms all figures over time to it."""
    found, steps = found_patches(view), found_steps(view)
    if not (found or steps):
        return ""
    around = AROUND_STEP * float(np.ptp(view.trajectory.time_s))
    rows = [
        (_zoom(view.moments.clock(s.time_s), s.time_s - around, s.time_s + around), "", *_since(view, s.time_s),
         "stays", f"{s.component}, a step", "-", s.size)
        for s in steps
    ]  # fmt: skip
    longest = sorted(found, key=lambda p: -p.readings)[:MOST_PATCHES]
    rows += [
        (_zoom(view.moments.clock(p.start_s), p.start_s, p.end_s), deciding.buttons(view, p), *_since(view, p.start_s),
         f"{p.end_s - p.start_s:,.2f}", p.component, f"{p.readings:,}",
         "-" if p.size != p.size else f"{p.size:+,.3g} {p.unit}")
        for p in sorted(longest, key=lambda p: p.start_s)
    ]  # fmt: skip
    note = "Size: median of reading minus estimate." if found else ""
    if len(found) > MOST_PATCHES:
        note = f"The {MOST_PATCHES} longest of {len(found):,}. {note}"
    if steps:
        note = f"A step stays: the estimate bridges it, and follows the longer side. {note}".strip()
    click = "A click on a start zooms all figures over time to it."
    title = " and ".join(["Steps"] * bool(steps) + ["Outlier patches"] * bool(found)).replace("and O", "and o")
    since = ["T+ s"] if view.moments.counts_from_elsewhere else []
    header = (when(view), "it is" if view.summary else "", *since, "lasts, s", "component", "readings", "size")
    body = table(header, rows, "numbers patches", links=2)
    whole = '<button data-from="" data-to="">Show the whole log.</button>'
    links = f'<span class="click">{click} {whole}</span>'
    return f'<section><h2>{title}</h2>{body}<p class="note">{note} {links}</p></section>'


def _zoom(shown: str, start_s: float, end_s: float) -> str:
    """A text as a button that zooms to a stretch."""
    return f'<button data-from="{start_s!r}" data-to="{end_s!r}">{html.escape(shown)}</button>'


def when(view: View) -> str:
    """The title of a column of times."""
    if view.moments.zero_ms is None:
        return "time, s"
    return view.moments.zone.strip() or "clock"


def _since(view: View, time_s: float) -> list[str]:
    """The cell of seconds since the first row, where they say more than the time."""
    return [view.moments.since(time_s).removeprefix("T")] if view.moments.counts_from_elsewhere else []


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
    about = [(key, meta[key]) for key in meta if key not in ("settings", "summary", "understood")]
    parts = [_pairs((str(key), _shown(value)) for key, value in about)]
    if isinstance(settings, Mapping):
        parts.insert(0, _pairs((str(key), _shown(value)) for key, value in settings.items()))
    title = "Settings, noise and process noise as used; provenance"
    return _folded(title, f'<div class="tables">{"".join(parts)}</div>')


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
