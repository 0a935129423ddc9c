"""Where each report goes, and the page that lists them: the one place that knows the rules of `--report`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ftproc.cli import outputs
from ftproc.errors import UsageError
from ftproc.files import atomic, remote, tables, trajectories
from ftproc.report import Entry, require_plotly

INDEX = "index.html"
_SUFFIXES = (".html", ".htm")
_OPTION = "--report"


def check(given: str | None) -> None:
    """Raise UsageError, before anything is done or made, when pages are wanted and plotly is missing."""
    if given is not None:
        require_plotly()


def plan(names: Sequence[str], given: str | None, inputs: Sequence[str] = ()) -> tuple[list[str | None], str | None]:
    """The page of each trajectory, and the index page if there is one; the directory is made.

    names: the trajectories' files (in `-` is nothing to name a page by, then the log's). given: the option's value.
    inputs: files that are not to be written over, beside the trajectories. Raises UsageError, OutputError.
    """
    if given is None:
        return [None] * len(names), None
    if remote.is_uri(given):
        raise UsageError(f"{_OPTION} {given}: pages are written on this machine; name a file or directory of it.")
    directory = _directory(given, several=len(names) > 1)
    pages = [given] if directory is None else [str(directory / _page(name)) for name in names]
    index = None if directory is None else str(directory / INDEX)
    twice = [page for page in pages if pages.count(page) > 1]
    if twice:
        raise UsageError(f"{_OPTION}: {twice[0]} would be the page of two trajectories; report them one by one.")
    beside = [str(found) for name in names if (found := trajectories.sidecar(name)) is not None]
    for target in [*pages, *([index] if index else [])]:
        atomic.refuse_overwriting(target, [*inputs, *names, *beside], _OPTION)
    if directory is not None:
        outputs.make(directory, _OPTION)
    for page in pages:
        atomic.check_target(page)
    return list(pages), index


def write_index(entries: Sequence[Entry], index: str | None) -> None:
    """List the pages, if there is an index. Raises OutputError."""
    if index is not None:
        from ftproc.report.index import write

        write(entries, index)


def _directory(given: str, several: bool) -> Path | None:
    path = Path(given)
    if path.is_dir() or given.endswith("/"):
        return path
    if path.suffix.lower() in _SUFFIXES:
        if several:
            raise UsageError(f"{_OPTION} {given}: there are several reports to write; name a directory.")
        return None
    if given == "-" or path.suffix:
        raise UsageError(f"{_OPTION} {given}: end the name in .html, or in / if it is a directory.")
    return path


def _page(name: str) -> str:
    file = "stdin" if name == "-" else Path(name).name
    kind = tables.kind_of(Path(file)) or ""
    return file[: len(file) - len(kind)].removesuffix(".trajectory") + ".report.html"
