"""Outputs appear complete or not at all, and never replace an input."""

from __future__ import annotations

import contextlib
import errno
import os
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import BinaryIO

from ftproc.errors import OutputError, stdout_fault
from ftproc.files import remote
from ftproc.files.layout import Target

_LONGEST_NAME = 200  # bytes of the target's name in that of its temporary file


def refuse_overwriting(target: Target, inputs: Iterable[Target], option: str = "-o") -> None:
    """Raise OutputError if `target` is one of `inputs`, by any path, symbolic or hard link.

    `-` (a standard stream) is never a file. option: the one that names the target.
    """
    for given in inputs:
        if "-" not in (str(target), str(given)) and _same(target, given):
            raise OutputError(
                f"{target}: this is the input {given}, which is never overwritten. Give another name with {option}."
            )


def check_target(target: Target) -> None:
    """Raise OutputError, before any work is done, if `target` is a directory or its directory does not exist. A URI on
    another machine is not checked."""
    path = remote.local(target)
    if path is None or str(target) == "-":
        return
    try:
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, "")
        directory = _resolved(path).parent
        if not directory.is_dir():
            raise OSError(errno.ENOTDIR if directory.exists() else errno.ENOENT, "")
    except OSError as error:
        raise _output_error(path, error) from error


@contextlib.contextmanager
def replacing(target: Target) -> Iterator[BinaryIO]:
    """A binary stream whose content becomes the file `target` if the block succeeds.

    The bytes go to a hidden file beside the target, are flushed to the disk and renamed into place. If anything fails,
    the hidden file is removed and an earlier target stays unchanged. Of a symbolic link, the file behind it is
    replaced. A device or named pipe is written to directly. A URI on another machine is stored when it is complete.
    Raises OutputError for every OSError.
    """
    near = remote.local(target)
    if near is None:
        with remote.storing(str(target)) as stream:
            yield stream
        return
    try:
        check_target(near)
        path = _resolved(near)
        if path.exists() and not path.is_file():
            with path.open("wb") as stream:
                yield stream
        else:
            yield from _beside(path)
    except OSError as error:
        raise _output_error(near, error) from error


@contextlib.contextmanager
def standard_output() -> Iterator[BinaryIO]:
    """Standard output for a result. Raises OutputError when it is full or closed, BrokenPipeError when its reader has
    left, which the caller handles."""
    try:
        if sys.stdout is None:
            raise OSError(errno.EBADF, os.strerror(errno.EBADF))
        yield sys.stdout.buffer
        sys.stdout.buffer.flush()
    except BrokenPipeError:
        raise
    except OSError as error:
        raise OutputError(stdout_fault(error)) from error


def sync(stream: BinaryIO) -> None:
    """Flush `stream` to the disk (a full disk shows here at the latest)."""
    stream.flush()
    os.fsync(stream.fileno())


def _beside(path: Path) -> Iterator[BinaryIO]:
    name = os.fsdecode(os.fsencode(path.name)[:_LONGEST_NAME])
    temporary = path.with_name(f".{name}.{os.urandom(4).hex()}.tmp")
    # O_EXCL: never through an existing link. 0o666: the user's umask decides, as for any new file.
    descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
    try:
        with os.fdopen(descriptor, "wb") as stream:
            yield stream
            sync(stream)
        temporary.replace(path)
    except BaseException:  # also Ctrl-C
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise
    _sync_directory(path.parent)


def _sync_directory(directory: Path) -> None:
    """Make the new name survive a power cut, where the system can open directories."""
    with contextlib.suppress(OSError):
        descriptor = os.open(directory, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _resolved(path: Path) -> Path:
    """The file behind all links. OSError for a link to itself, also where Python raises another error or none."""
    try:
        found = path.resolve()
    except RuntimeError as error:
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP)) from error
    if found.is_symlink():
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
    return found


def _same(target: Target, given: Target) -> bool:
    one, other = remote.local(target), remote.local(given)
    if one is None or other is None:
        return str(target) == str(given)
    return _same_file(one, other)


def _same_file(one: Path, other: Path) -> bool:
    try:
        return one.samefile(other)
    except OSError:  # at least one does not exist yet: compare the resolved names
        with contextlib.suppress(OSError):
            return _resolved(one) == _resolved(other)
        return False


def _output_error(path: Path, error: OSError) -> OutputError:
    directory = path.parent
    with contextlib.suppress(OSError):
        if path.is_symlink():
            directory = _resolved(path).parent
    reasons = {
        errno.ENOENT: f"there is no directory {directory}; create it first (mkdir -p {directory}).",
        errno.ENOTDIR: f"{directory} is not a directory; choose another place.",
        errno.EISDIR: "this is a directory; give the name of a file in it.",
        errno.EACCES: f"no permission to write in {directory}; choose another place.",
        errno.EPERM: f"no permission to write in {directory}; choose another place.",
        errno.EROFS: f"{directory} cannot be written to (read-only); choose another place.",
        errno.ENOSPC: "the disk is full; nothing was written. Make room or choose another place.",
        errno.EDQUOT: "the disk quota is used up; nothing was written. Make room or choose another place.",
        errno.ELOOP: "this is a symbolic link to itself; delete it, or give another name.",
        errno.ENAMETOOLONG: "the name is too long for the file system; give a shorter one.",
        errno.EFBIG: "the file is larger than the system allows; nothing was written. Choose another place.",
    }
    if error.errno == errno.ENOENT and directory.is_dir():  # such as /proc
        reasons[errno.ENOENT] = f"no file can be made in {directory}; choose another place."
    reason = reasons.get(error.errno or 0, f"cannot be written ({error.strerror or error}).")
    return OutputError(f"{path}: {reason}")
