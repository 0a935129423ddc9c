"""Where each trajectory goes: the one place that knows the rules of `-o`, and that no input is written over."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ftproc.batch import Task
from ftproc.errors import OutputError, UsageError
from ftproc.files import atomic, remote, tables, trajectories

#: What a trajectory's name ends in, by what the log's name ends in.
_SUFFIX = {".csv": ".csv", ".csv.gz": ".csv", ".parquet": ".parquet", ".feather": ".feather"}


def plan(
    logs: Sequence[str], output: str | None, methods: Sequence[str] | None = None, inputs: Sequence[str] = ()
) -> list[Task]:
    """One task per log, or per log and method, its output decided and its directory made.

    methods: names to run each log through, told apart in the output's name. inputs: other files not to be
    written over. Raises UsageError, OutputError.
    """
    if "-" in logs and len(logs) > 1:
        raise UsageError("- stands for one log on standard input; it cannot be mixed with other logs.")
    if output is None:
        directory: str | None = "."
        if methods:
            raise UsageError("--method all writes several trajectories: name a directory with -o.")
    else:
        directory = _directory(output, several=len(logs) > 1 or bool(methods))
    tasks = [_task(log, output, directory, method) for log in logs for method in (methods or (None,))]
    _check(tasks, [*logs, *inputs])
    if directory is not None and not remote.is_uri(directory):
        make(Path(directory))
    for task in tasks:
        atomic.check_target(task.output)
    return tasks


def _directory(output: str, several: bool) -> str | None:
    """The directory that `-o` names, or None when it names a file or standard output."""
    path = Path(output)
    if output != "-" and (output.endswith("/") or path.is_dir()):
        return output
    if output == "-" or trajectories.kind_of(path) is not None:
        if several:
            raise UsageError(f"-o {output}: there are several trajectories to write; name a directory.")
        return None
    if path.suffix and not several:
        raise UsageError(
            f"-o {output}: end the name in {', '.join(trajectories.SUFFIXES)}, or in / if it is a directory."
        )
    return output


def _task(log: str, output: str | None, directory: str | None, method: str | None) -> Task:
    if output is not None and directory is None:
        return Task(log, output, method)
    if log == "-" and output is None:
        return Task(log, "-", method)  # in a pipe, out of a pipe
    name = "stdin.csv" if log == "-" else Path(log).name
    kind = tables.kind_of(Path(name)) or ".csv"
    stem = name[: -len(kind)] if tables.kind_of(Path(name)) else Path(name).stem
    middle = f".{method}" if method else ""
    return Task(log, remote.within(directory or ".", f"{stem}{middle}.trajectory{_SUFFIX[kind]}"), method)


def _check(tasks: Sequence[Task], inputs: Sequence[str]) -> None:
    taken: dict[str, str] = {}
    for task in tasks:
        if task.output in taken:
            raise UsageError(
                f"{taken[task.output]} and {task.log} would both be written to {task.output}; "
                "give them different names or filter them one by one."
            )
        taken[task.output] = task.log
        beside = trajectories.sidecar(task.output)
        for target in (task.output, *(() if beside is None else (beside,))):
            atomic.refuse_overwriting(target, inputs)


def make(directory: Path, option: str = "-o") -> None:
    """Make a directory for outputs if it is not there. Raises OutputError."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except FileExistsError as error:
        raise OutputError(f"{directory}: this is a file, not a directory; give another name with {option}.") from error
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise OutputError(
            f"{directory}: the directory cannot be made ({reason}); give another with {option}."
        ) from error
