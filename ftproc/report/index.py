"""The page that lists the trajectories of several logs, the worst first, to be sorted and searched."""

from __future__ import annotations

import html
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

from ftproc.errors import encodable
from ftproc.files import remote
from ftproc.files.layout import Target
from ftproc.files.writing import atomic
from ftproc.quality import verdict
from ftproc.quality.summary import counted
from ftproc.records import COMPONENTS
from ftproc.report import tables
from ftproc.report.page import document
from ftproc.report.style import GREY, VERDICT

FAILED, UNKNOWN = "failed", "unknown"
#: What a log may be, the worst first.
_LEVELS = (FAILED, *reversed(verdict.LEVELS), UNKNOWN)
_HEADER = ("log", "verdict", "files", "rows", "duration, s", *(f"{c} outliers, %" for c in COMPONENTS), "method", "why")


class Entry(NamedTuple):
    """A log, its page (None: no page), its summary (may be empty), why it failed, and its trajectory."""

    log: str
    page: str | None
    summary: Mapping[str, Any]
    failure: str | None = None
    output: str | None = None

    @property
    def level(self) -> str:
        """The verdict, or what there is instead."""
        trust = self.summary.get("trust", {})
        return FAILED if self.failure is not None else verdict.level_of(trust) or UNKNOWN

    @property
    def shares(self) -> list[float]:
        """Of the outliers among the readings of each component; empty where they are not known."""
        parts = self.summary.get("components", {})
        return [verdict.outlier_share(parts[name]) for name in COMPONENTS] if self.failure is None and parts else []


def write(entries: Sequence[Entry], target: Target) -> None:
    """Write the index, whole or not at all. Raises OutputError."""
    ordered = sorted(entries, key=lambda each: (_LEVELS.index(each.level), -max(each.shares, default=0.0)))
    here = remote.local(target)
    rows = (_cells(entry, None if here is None else here.parent) for entry in ordered)
    heading = html.escape(counts([entry.level for entry in entries]))
    body = f"<h1>{heading}</h1>{tables.table(_HEADER, rows, 'index', links=3)}"
    with atomic.replacing(target) as stream:
        stream.write(encodable(document("Reports", body, script="index.js")).encode())


def counts(levels: Sequence[str]) -> str:
    """How many logs there are, and how many of each verdict."""
    found = Counter(levels)
    named = (verdict.CONSISTENT, verdict.SUSPECT, verdict.UNRELIABLE, UNKNOWN, FAILED)
    return f"{counted(len(levels), 'log')}: {', '.join(f'{found[level]} {level}' for level in named if found[level])}"


def _cells(entry: Entry, here: Path | None) -> tuple[str, ...]:
    """The first three cells are HTML. here: the directory of the index, None if it is not on this machine."""
    s, failed = entry.summary, entry.failure is not None
    name = html.escape(entry.log)
    linked = (_link(name, None if failed else entry.page, here) or name, _badge(entry.level))
    files = _link("log", entry.log, here), _link("trajectory", None if failed else entry.output, here)
    why = entry.failure or "; ".join(s.get("trust", {}).get("reasons", ()))
    known = (f"{s['rows']:,}", f"{s['duration_s']:,.6g}") if entry.shares else ("", "")
    shares = [f"{100 * share:.2f}" for share in entry.shares] or [""] * len(COMPONENTS)
    return (*linked, " ".join(filter(None, files)), *known, *shares, str(s.get("method", "")), why)


def _link(text: str, name: str | None, here: Path | None) -> str:
    """A link to a file of this machine; nothing to one that is not there. text: HTML."""
    path = None if name in (None, "-") else remote.local(name)
    try:
        if path is None or here is None or not path.is_file():
            return ""
        place = os.path.relpath(path.resolve(), here.resolve())
    except (OSError, ValueError):  # such as on another drive
        return ""
    return f'<a href="./{html.escape(quote(os.fsencode(place)))}">{text}</a>'


def _badge(level: str) -> str:
    colour = VERDICT.get(level, GREY)
    return f'<span class="badge" style="border-color: {colour}">{html.escape(level)}</span>'
