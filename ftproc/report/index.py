"""The page that lists the reports of several logs."""

from __future__ import annotations

import html
import os
from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any, NamedTuple
from urllib.parse import quote

from ftproc.errors import encodable
from ftproc.files.layout import Target
from ftproc.files.writing import atomic
from ftproc.quality import verdict
from ftproc.quality.summary import counted
from ftproc.records import COMPONENTS
from ftproc.report import tables
from ftproc.report.page import document
from ftproc.report.style import GREY, VERDICT

_HEADER = ("log", "method", "verdict", "rows", "duration", "outliers R, A, E", "why")


class Entry(NamedTuple):
    """A log, its page beside the index (None: no page), its summary (may be empty), and why it failed."""

    log: str
    page: str | None
    summary: Mapping[str, Any]
    failure: str | None = None


def write(entries: Sequence[Entry], target: Target) -> None:
    """Write the index, whole or not at all. Raises OutputError."""
    failed = sum(entry.failure is not None for entry in entries)
    count = counted(len(entries) - failed, "report") + (f", {failed} failed" if failed else "")
    body = f"<h1>{count}</h1>{tables.table(_HEADER, map(_cells, entries), 'index', links=3)}"
    with atomic.replacing(target) as stream:
        stream.write(encodable(document("Reports", body)).encode())


def _cells(entry: Entry) -> tuple[str, ...]:
    """The first three cells are HTML."""
    name = html.escape(entry.log)
    if entry.page is not None:
        name = f'<a href="./{html.escape(quote(os.fsencode(PurePath(entry.page).name)))}">{name}</a>'
    s = entry.summary
    if entry.failure is not None or "trust" not in s:
        return (name, "", _badge("failed" if entry.failure else "unknown", GREY), "", "", "", entry.failure or "")
    trust = s["trust"]
    rates = ", ".join(f"{100 * verdict.outlier_share(s['components'][name]):.1f} %" for name in COMPONENTS)
    method, badge = html.escape(str(s.get("method", ""))), _badge(trust["verdict"], VERDICT[trust["verdict"]])
    return (name, method, badge, f"{s['rows']:,}", f"{s['duration_s']:,.6g} s", rates, "; ".join(trust["reasons"]))


def _badge(text: str, colour: str) -> str:
    return f'<span class="badge" style="border-color: {colour}">{html.escape(text)}</span>'
