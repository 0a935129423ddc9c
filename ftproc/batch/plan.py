"""Where each trajectory and each report goes: the rules of `-o` and `--report`, and that no input is overwritten."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from ftproc.batch.tasks import Task
from ftproc.errors import OutputError, UsageError
from ftproc.files import layout, remote
from ftproc.files.writing import atomic, trajectories

INDEX = "index.html"
_REPORT = "--report"
_PAGES = (".html", ".htm", ".pdf")
#: Ending of the trajectory's name by that of the log's, where it is not .csv.
_SUFFIX = {".parquet": ".parquet", ".feather": ".feather"}
_PACKED = (".gz", ".bz2", ".xz", ".zst", ".zip")


def tasks(
    logs: Sequence[str],
    output: str | None,
    methods: Sequence[str] | None = None,
    inputs: Sequence[str] = (),
    targets: Mapping[str, Sequence[str]] | None = None,
) -> list[Task]:
    """One task per log, or per log, target and method, with its output; makes the directory.

    methods: names of methods, which the names of the outputs then contain. inputs: other files not to be overwritten.
    targets: COLUMN=VALUE of the targets of each log, whose values the names of the outputs then contain.
    Raises UsageError, OutputError.
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
    _check(planned, [*logs, *inputs])
    if directory is not None and not remote.is_uri(directory):
        _make(Path(directory))
    for task in planned:
        trajectories.check(task.output)
    return planned


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
    stem, kind = _stem_and_kind(name)
    value = re.sub(r"[^\w+-]", "_", target.partition("=")[2])
    middle = "".join(f".{part}" for part in (value, method) if part)
    written = remote.within(directory or ".", f"{stem}{middle}.trajectory{_SUFFIX.get(kind, '.csv')}")
    return Task(log, written, method, target=target)


def _stem_and_kind(name: str) -> tuple[str, str]:
    """The name of a log without its endings, and the last of these that is not one of packing: flight.csv.gz, .csv."""
    path = Path(name.partition("#")[0])
    if path.suffix.lower() in _PACKED and path.stem:
        path = Path(path.stem)
    return path.stem, path.suffix.lower()


def _check(tasks: Sequence[Task], inputs: Sequence[str]) -> None:
    taken: dict[str, str] = {}
    for task in tasks:
        if task.output in taken:
            raise UsageError(
                f"{taken[task.output]} and {task.log} would both be written to {task.output}; "
                "give them different names or filter them one by one."
            )
        taken[task.output] = task.log
        beside = layout.sidecar(task.output)
        for target in (task.output, *(() if beside is None else (beside,))):
            atomic.refuse_overwriting(target, inputs)


def _make(directory: Path, option: str = "-o") -> None:
    """Make a directory for outputs unless it exists. Raises OutputError."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except FileExistsError as error:
        if not directory.is_file():
            cure = "end the name of a file in its kind, such as .csv; for no file, use -o - > /dev/null."
            raise OutputError(f"{directory}: this is a device, not a directory; {cure}") from error
        raise OutputError(f"{directory}: this is a file, not a directory; give another name with {option}.") from error
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise OutputError(
            f"{directory}: the directory cannot be made ({reason}); give another with {option}."
        ) from error


def pages(names: Sequence[str], report: str | None, inputs: Sequence[str] = ()) -> tuple[list[str | None], str | None]:
    """The page of each trajectory, and the index page if there is one; makes the directory.

    names: the trajectories' files, by which the pages are named. report: the option's value. inputs: files not to be
    overwritten, beside the trajectories. Raises UsageError, OutputError.
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
    beside = [str(found) for name in names if (found := layout.sidecar(name)) is not None]
    for target in [*named, *([index] if index else [])]:
        atomic.refuse_overwriting(target, [*inputs, *names, *beside], _REPORT)
    if directory is not None:
        _make(directory, _REPORT)
    for page in named:
        atomic.check_target(page)
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
