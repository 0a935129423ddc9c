"""All that a run will write, checked against all that it reads before anything is computed."""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from ftproc.errors import OutputError, UsageError
from ftproc.files import remote
from ftproc.files.layout import Target, sidecar
from ftproc.files.writing import atomic

STREAM = "-"
_STREAMS = {1: "standard output", 2: "standard error"}
_HEAD = 1 << 16  # bytes


class Output(NamedTuple):
    """A file that a run will write. option: by which the user names it, or what it stands beside. made: its directory
    is made when absent. ours: for a file that the program names itself, what stands at the beginning of one that ftproc
    has written: nothing else under that name is replaced."""

    target: Target
    option: str = "-o"
    made: bool = False
    ours: tuple[bytes, ...] = ()


def trajectory(target: Target, made: bool = False) -> list[Output]:
    """A trajectory, a map or a table, and its sidecar if it has one."""
    beside = sidecar(target)
    own = [] if beside is None else [Output(beside, made=made, ours=(b"{", b'"program": "ftproc"'))]
    return [Output(target, made=made), *own]


def check(outputs: Sequence[Output], inputs: Iterable[Target]) -> None:
    """Make the directories of the outputs, and raise an error if one of them cannot be written, is an input, is another
    output, or would replace a file that ftproc has not written under a name that the user has not given.

    Files are compared by identity: by any path, symbolic or hard link, also where they are standard streams. inputs:
    with the part of a file after #, or URIs in URIs after ::. Raises OutputError, UsageError.
    """
    read = {found: str(name) for name in inputs for found in _identities(name)}
    streams = {found: name for descriptor, name in _STREAMS.items() for found in _standard_stream(descriptor)}
    for found in streams.keys() & read.keys():
        raise OutputError(
            f"{streams[found]} is the input {read[found]}, which is never overwritten. Send it elsewhere."
        )
    taken: dict[str, Output] = {}
    for each in outputs:
        if str(each.target) == STREAM:
            continue
        if (path := _path(each)) is not None:
            atomic.check_name(path)
        found = atomic.identity(each.target)
        if found in read:
            raise atomic.overwriting(each.target, read[found], each.option)
        if found in streams:
            raise UsageError(f"{each.option} and {streams[found]} are both {each.target}; give one another name.")
        name = atomic.resolved_name(each.target)  # files of one content may be linked: each is replaced separately
        if name in taken:
            raise UsageError(_twice(each, taken[name]))
        taken[name] = each
    folders = {path.parent: each.option for each in outputs if each.made and (path := _path(each)) is not None}
    for folder, option in folders.items():
        make(folder, option)
    faults = dict[str, OutputError]()
    for each in outputs:
        try:
            atomic.check_target(each.target)
            if each.ours:
                _check_own(each)
        except OutputError as error:
            faults[str(each.target)] = error
    if faults:
        first, *others = faults
        also = f" The same or the like holds of {', '.join(others[:20])}." if others else ""
        raise OutputError(f"{faults[first]}{also}") from faults[first]


def make(folder: Path, option: str = "-o") -> None:
    """Make a directory for outputs unless it exists. Raises OutputError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError as error:
        raise OutputError(f"{folder}: {_no_directory(folder, option)}") from error
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise OutputError(f"{folder}: the directory cannot be made ({reason}); give another with {option}.") from error


def _no_directory(folder: Path, option: str) -> str:
    if folder.is_symlink() and not folder.exists():
        return f"this is a symbolic link to nothing; delete it, or give another name with {option}."
    if folder.is_file():
        return f"this is a file, not a directory; give another name with {option}."
    return (
        "this is a device, not a directory; end the name of a file in its kind, such as .csv; for no file, use -o - > "
        "/dev/null."
    )


def _path(each: Output) -> Path | None:
    return None if str(each.target) == STREAM else remote.local(each.target)


def _identities(name: Target) -> Iterator[object]:
    """Of the file that an input is, or is in."""
    text = str(name)
    if text == STREAM:
        yield from _standard_stream(0)
        return
    for part in (text, *text.split("::")):
        yield atomic.identity(part)
        if "#" in part:
            yield atomic.identity(part.rpartition("#")[0])


def _standard_stream(descriptor: int) -> Iterator[object]:
    with contextlib.suppress(OSError):
        found = os.fstat(descriptor)
        if stat.S_ISREG(found.st_mode):
            yield found.st_dev, found.st_ino


def _twice(one: Output, other: Output) -> str:
    if one.option == other.option:
        return f"{one.target}: this would be written twice, as {other.target} too; run them one by one."
    return f"{other.option} and {one.option} are both {one.target}; give one of the two another name."


def _check_own(each: Output) -> None:
    """Raise OutputError for what the user may not know to be replaced."""
    path = _path(each)
    if path is None or not (path.exists() or path.is_symlink()):
        return
    cure = f"Move it, or give another name with {each.option}."
    if path.is_symlink():
        raise OutputError(f"{path}: this is a symbolic link, and a file would be written through it. {cure}")
    if not path.is_file():
        raise OutputError(f"{path}: this is not an ordinary file, and would be written. {cure}")
    try:
        with path.open("rb") as stream:
            head = stream.read(_HEAD)
    except OSError:  # not to be read, so it is not known whose it is
        head = b""
    if not (head.startswith(each.ours[0]) and all(part in head for part in each.ours)):
        raise OutputError(f"{path}: this file would be replaced, and is none that an earlier run has written. {cure}")
