"""Where each trajectory and each report goes: the rules of `-o` and `--report`."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from ftproc.batch.tasks import Task
from ftproc.errors import UsageError
from ftproc.files import layout, remote
from ftproc.files.writing import outputs
from ftproc.files.writing.outputs import Output

INDEX = "index.html"
#: What stands at the beginning of an index page.
INDEX_BEGINS = (b"<!DOCTYPE html>", b"<title>Reports</title>")
_REPORT = "--report"
_PAGES = (".html", ".htm", ".pdf")
#: Ending of the trajectory's name by that of the log's, where it is not .csv.
_SUFFIX = {".parquet": ".parquet", ".feather": ".feather"}


def tasks(
    logs: Sequence[str],
    output: str | None,
    methods: Sequence[str] | None = None,
    targets: Mapping[str, Sequence[str]] | None = None,
) -> list[Task]:
    """One task per log, or per log, target and method, with its output.

    methods: names of methods, which the names of the outputs then contain. targets: COLUMN=VALUE of the targets of each
    log, whose values the names of the outputs then contain. Raises UsageError.
    """
    if "-" in logs and len(logs) > 1:
        raise UsageError("- stands for one log on standard input; it cannot be mixed with other logs.")
    if output is None:
        directory: str | None = "."
        if methods:
            raise UsageError("--method all writes several trajectories: name a directory with -o.")
    else:
        directory = _directory(output, several=len(logs) > 1 or bool(methods) or bool(targets))
    planned = [
        _task(log, output, directory, method, target)
        for log in logs
        for target in (targets or {}).get(log, ("",))
        for method in (methods or (None,))
    ]
    taken: dict[str, str] = {}
    for task in planned:
        if task.output in taken:
            raise UsageError(
                f"{taken[task.output]} and {task.log} would both be written to {task.output}; "
                "give them different names or filter them one by one."
            )
        taken[task.output] = task.log
    return planned


def written(tasks: Sequence[Task], output: str | None, index: str | None) -> list[Output]:
    """All files of these tasks, and the index page if there is one. output: the value of `-o`."""
    made = [output is not None and task.output != output for task in tasks]
    found = [each for task, new in zip(tasks, made, strict=True) for each in outputs.trajectory(task.output, new)]
    return [*found, *pages_written([task.report for task in tasks], index)]


def pages_written(pages: Sequence[str | None], index: str | None) -> list[Output]:
    """The pages, and the index page if there is one, in whose directory they are."""
    named = [page for page in pages if page is not None]
    if index is None:
        return [Output(page, _REPORT) for page in named]
    own = [Output(page, _REPORT, made=True, ours=INDEX_BEGINS[:1]) for page in named]
    return [*own, Output(index, _REPORT, made=True, ours=INDEX_BEGINS)]


def _directory(output: str, several: bool) -> str | None:
    """The directory that `-o` names, or None when it names a file or standard output."""
    path = Path(output)
    if output != "-" and (output.endswith("/") or path.is_dir()):
        return output
    if output == "-" or layout.table_kind(path) or layout.map_kind(path):
        if several:
            raise UsageError(f"-o {output}: there are several trajectories to write; name a directory.")
        return None
    if path.suffix and not several:
        raise UsageError(
            f"-o {output}: end the name in {', '.join((*layout.TABLES, *layout.MAPS))}, or in / if it is a directory."
        )
    return output


def _task(log: str, output: str | None, directory: str | None, method: str | None, target: str) -> Task:
    if output is not None and directory is None:
        return Task(log, output, method, target=target)
    if log == "-" and output is None:
        return Task(log, "-", method, target=target)  # in a pipe, out of a pipe
    name = "stdin.csv" if log == "-" else Path(log).name
    stem, kind = layout.stem_and_kind(name)
    value = re.sub(r"[^\w+-]", "_", target.partition("=")[2])
    middle = "".join(f".{part}" for part in (value, method) if part)
    written = remote.within(directory or ".", f"{stem}{middle}.trajectory{_SUFFIX.get(kind, '.csv')}")
    return Task(log, written, method, target=target)


def pages(names: Sequence[str], report: str | None) -> tuple[list[str | None], str | None]:
    """The page of each trajectory, and the index page if there is one.

    names: the trajectories' files, by which the pages are named. report: the option's value. Raises UsageError.
    """
    if report is None:
        return [None] * len(names), None
    if remote.is_uri(report):
        raise UsageError(f"{_REPORT} {report}: pages are written on this machine; name a file or directory of it.")
    directory = _page_directory(report, several=len(names) > 1)
    named = [report] if directory is None else [str(directory / _page(name)) for name in names]
    index = None if directory is None else str(directory / INDEX)
    twice = [page for page in named if named.count(page) > 1]
    if twice:
        raise UsageError(f"{_REPORT}: {twice[0]} would be the page of two trajectories; report them one by one.")
    return list(named), index


def _page_directory(report: str, several: bool) -> Path | None:
    path = Path(report)
    if path.is_dir() or report.endswith("/"):
        return path
    if path.suffix.lower() in _PAGES:
        if several:
            raise UsageError(f"{_REPORT} {report}: there are several reports to write; name a directory.")
        return None
    if report == "-" or path.suffix:
        raise UsageError(f"{_REPORT} {report}: end the name in .html or .pdf, or in / if it is a directory.")
    return path


def _page(name: str) -> str:
    file = "stdin" if name == "-" else Path(name).name
    kind = layout.table_kind(file) or ""
    return file[: len(file) - len(kind)].removesuffix(".trajectory") + ".report.html"
