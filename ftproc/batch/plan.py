"""Which logs are meant, and where each trajectory and each report goes: the rules of LOG, `-o` and `--report`."""

from __future__ import annotations

import glob
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from ftproc.batch.tasks import Task
from ftproc.config.recipe import Recipe
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
#: In the name of an output or a station file: the name of each log.
ANY = "*"
_NO_LOGS = (".truth.", ".trajectory.")


class Wanted(NamedTuple):
    """A trajectory that a user wants: of which log, how. parts: what its name contains beside the log's, such as the
    target and the method."""

    log: str
    recipe: Recipe = Recipe()
    parts: tuple[str, ...] = ()


def chosen(names: Sequence[str]) -> tuple[list[str], list[str]]:
    """The logs among the names of a command line, and what a pattern has named beside them: truths and trajectories.

    A name with * or ? that no shell has replaced stands for all files that it fits. One name alone is always a log.
    """
    found = [each for name in names for each in _expanded(name)]
    if len(found) == 1:
        return found, []
    logs = [name for name in found if not _is_result(name)]
    return (logs, list(filter(_is_result, found))) if logs else (found, [])


def _is_result(name: str) -> bool:
    return any(part in Path(name).name.lower() for part in _NO_LOGS)


def _expanded(name: str) -> list[str]:
    """Sorted, as a shell does; a name that fits nothing stays."""
    if not any(sign in name for sign in "*?[") or remote.is_uri(name) or Path(name).exists():
        return [name]
    return sorted(glob.glob(name)) or [name]  # noqa: PTH207


def named_after(pattern: str, log: str) -> str:
    """The pattern with the log's name, without its endings, in place of *; a pattern without a directory is of files
    beside the logs."""
    name = pattern.replace(ANY, layout.stem_and_kind(Path(log).name)[0])
    return str(Path(log).with_name(name)) if Path(pattern).name == pattern and log != "-" else name


def tasks(wanted: Sequence[Wanted], output: str | None, redo: bool = True) -> list[Task]:
    """A task for each trajectory, with its output. redo: also of logs that an earlier run has finished. Raises
    UsageError."""
    if any(each.log == "-" for each in wanted) and len({each.log for each in wanted}) > 1:
        raise UsageError("- stands for one log on standard input; it cannot be mixed with other logs.")
    several = len(wanted) > 1 or any(each.parts for each in wanted)
    directory = "." if output is None else _directory(output, several)
    planned = [Task(each.log, _output(each, output, directory), each.recipe, redo=redo) for each in wanted]
    taken: dict[str, str] = {}
    for task in planned:
        if task.output in taken:
            raise UsageError(
                f"{taken[task.output]} and {task.log} would both be written to {task.output}; "
                "give them different names or filter them one by one."
            )
        taken[task.output] = task.log
    return planned


def in_one_table(wanted: Sequence[Wanted], output: str | None) -> bool:
    """Whether `-o` names one table for the targets of one log, which it then holds below each other."""
    targets = len(wanted) > 1 and all(len(each.parts) == 1 and each.recipe.target for each in wanted)
    one_log = len({each.log for each in wanted}) == 1
    return targets and one_log and output is not None and output != "-" and _is_table(output)


def _is_table(output: str) -> bool:
    path = Path(output)
    return layout.table_kind(path) is not None and ANY not in path.name and not path.is_dir()


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
    """The directory that `-o` names, or None when it names a file, a file for each log, or standard output."""
    path = Path(output)
    if ANY in path.name and layout.ending(path, (*layout.TABLES, *layout.MAPS)):
        return None
    endings = ", ".join((*layout.TABLES, *layout.MAPS))
    if ANY in path.name and not path.is_dir():
        raise UsageError(f"-o {output}: end the name in {endings}, or give a directory, which ends in /.")
    if output != "-" and (output.endswith("/") or path.is_dir()):
        return output
    if output == "-" or layout.table_kind(path) or layout.map_kind(path):
        if several:
            raise UsageError(f"-o {output}: there are several trajectories to write; name a directory.")
        return None
    if path.suffix and not several:
        raise UsageError(f"-o {output}: end the name in {endings}, or in / if it is a directory.")
    return output


def _output(wanted: Wanted, output: str | None, directory: str | None) -> str:
    log = wanted.log
    if log == "-" and output is None:
        return "-"  # in a pipe, out of a pipe
    stem, kind = layout.stem_and_kind("stdin.csv" if log == "-" else Path(log).name)
    name = ".".join([stem, *(re.sub(r"[^\w+-]", "_", part) for part in wanted.parts)])
    if directory is None:
        return str(output).replace(ANY, name)
    return remote.within(directory, f"{name}.trajectory{_SUFFIX.get(kind, '.csv')}")


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
