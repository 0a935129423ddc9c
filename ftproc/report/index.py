"""The page that lists the trajectories of several logs, the worst first, to be sorted and searched."""

from __future__ import annotations

import html
import os
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

from ftproc.errors import encodable
from ftproc.files import remote
from ftproc.files.layout import Target
from ftproc.files.writing import atomic
from ftproc.quality import verdict
from ftproc.quality.summary import counted
from ftproc.records import BESIDE, COMPONENTS
from ftproc.report import tables
from ftproc.report.page import document
from ftproc.report.style import GREY, VERDICT

FAILED, UNKNOWN = "failed", "unknown"
#: What a log may be, the worst first.
_LEVELS = (FAILED, *reversed(verdict.LEVELS), UNKNOWN)
_ABOUT = ("log", "verdict", "why", "files", "rows", "duration, s")


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
    def shares(self) -> dict[str, float]:
        """Of the outliers among the readings of each channel; empty where they are not known."""
        parts = self.summary.get("components", {}) if self.failure is None else {}
        return {name: verdict.outlier_share(part) for name, part in parts.items()}


def write(entries: Sequence[Entry], target: Target) -> None:
    """Write the index, whole or not at all. Raises OutputError."""
    ordered = sorted(entries, key=lambda each: (_LEVELS.index(each.level), -max(each.shares.values(), default=0.0)))
    channels = shown({name for entry in entries for name in entry.shares})
    here = remote.local(target)
    rows = (_cells(entry, None if here is None else here.parent, channels) for entry in ordered)
    header = (*_ABOUT, *(f"{name.replace('_', ' ')} outliers, %" for name in channels), "method")
    heading = html.escape(counts([entry.level for entry in entries]))
    body = f"<h1>{heading}</h1>{tables.table(header, rows, 'index', links=4)}"
    with atomic.replacing(target) as stream:
        stream.write(encodable(document("Reports", body, script="index.js")).encode())


def shown(there: Collection[str]) -> list[str]:
    """The channels that a table of logs has columns for: COMPONENTS, and others that are there in some log."""
    return [*COMPONENTS, *(name for name in BESIDE if name in there)]


def counts(levels: Sequence[str]) -> str:
    """How many logs there are, and how many of each verdict."""
    found = Counter(levels)
    named = (verdict.CONSISTENT, verdict.SUSPECT, verdict.UNRELIABLE, UNKNOWN, FAILED)
    return f"{counted(len(levels), 'log')}: {', '.join(f'{found[level]} {level}' for level in named if found[level])}"


def _cells(entry: Entry, here: Path | None, channels: Sequence[str]) -> tuple[str, ...]:
    """The first four cells are HTML. here: the directory of the index, None if it is not on this machine. channels:
    that have columns."""
    s, failed = entry.summary, entry.failure is not None
    name = html.escape(entry.log)
    linked = (_link(name, None if failed else entry.page, here) or name, _badge(entry.level))
    files = _link("log", entry.log, here), _link("trajectory", None if failed else entry.output, here)
    why = entry.failure or "; ".join(s.get("trust", {}).get("reasons", ()))
    known = (f"{s['rows']:,}", f"{s['duration_s']:,.6g}") if entry.shares else ("", "")
    shares = [f"{100 * entry.shares[name]:.2f}" if name in entry.shares else "" for name in channels]
    return (*linked, html.escape(why), " ".join(filter(None, files)), *known, *shares, str(s.get("method", "")))


def _link(text: str, name: str | None, here: Path | None) -> str:
    """A link to a file of this machine; nothing to one that is not there. text: HTML."""
    path = None if name in (None, "-") else remote.local(name)
    try:
        if path is None or here is None or not path.is_file():
            return ""
        link = os.path.relpath(path.resolve(), here.resolve())
    except (OSError, ValueError):  # such as on another drive
        return ""
    return f'<a href="./{html.escape(quote(os.fsencode(link)))}">{text}</a>'


def _badge(level: str) -> str:
    colour = VERDICT.get(level, GREY)
    return f'<span class="badge" style="border-color: {colour}">{html.escape(level)}</span>'
