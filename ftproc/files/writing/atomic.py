"""Outputs appear complete or not at all, and never replace an input."""

from __future__ import annotations

import contextlib
import errno
import os
import stat
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import BinaryIO

from ftproc.errors import OutputError, stdout_fault
from ftproc.files import remote
from ftproc.files.layout import Target
from ftproc.files.writing import hidden, streams

_LONGEST = 255  # bytes of a name, on any usual file system

_guarded: dict[object, str] = {}


@contextlib.contextmanager
def guarding(inputs: Iterable[Target]) -> Iterator[None]:
    """Inside, no output replaces one of these files, whatever has come to be called by its name meanwhile."""
    global _guarded
    before = _guarded
    _guarded = {**before, **{identity(name): str(name) for name in inputs}}
    try:
        yield
    finally:
        _guarded = before


def identity(name: Target) -> object:
    """By which a file is the same under any name: its device and inode where it exists, else its resolved name; on
    another machine its URI. Devices and pipes are never the same: they are not replaced."""
    path = remote.local(name)
    if path is None:
        return str(name)
    try:
        found = path.stat()
        return (found.st_dev, found.st_ino) if stat.S_ISREG(found.st_mode) else object()
    except (OSError, ValueError):
        return resolved_name(name)


def resolved_name(name: Target) -> str:
    """A name without links, where they can be followed; a URI on another machine as it is."""
    path = remote.local(name)
    with contextlib.suppress(OSError, ValueError):
        return str(name if path is None else _resolved(path))
    return str(name)


def overwriting(target: Target, given: str, option: str = "-o") -> OutputError:
    """The error for an output that is an input. option: the one that names the output."""
    return OutputError(
        f"{target}: this is the input {given}, which is never overwritten. Give another name with {option}."
    )


def check_name(path: Path) -> None:
    """Raise OutputError for a name that no usual file system holds, also where its directory is not there yet."""
    if len(os.fsencode(path.name)) > _LONGEST:
        raise output_error(path, OSError(errno.ENAMETOOLONG, ""))


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
        raise output_error(path, error) from error


@contextlib.contextmanager
def replacing(target: Target, synced: bool = True) -> Iterator[BinaryIO]:
    """A binary stream whose content becomes the file `target` if the block succeeds.

    The bytes go to a hidden file beside the target, are flushed to the disk and renamed into place. If anything fails,
    the hidden file is removed and an earlier target stays unchanged. Of a symbolic link, the file behind it is
    replaced. A device or named pipe is written to directly. A URI on another machine is stored when it is complete.
    synced: False for what is replaced so often that a power cut may cost the newest. Raises OutputError for every
    OSError.
    """
    near = remote.local(target)
    if near is None:
        with remote.storing(str(target)) as stream:
            yield stream
        return
    try:
        check_target(near)
        path = _place(near)
        _refuse_guarded(path, near)
        if path.exists() and not path.is_file():
            with streams.opened(path) as stream:
                yield stream
        else:
            with hidden.beside(path) as (stream, temporary):
                yield stream
                if synced:
                    sync(stream)
                stream.close()
                _refuse_guarded(path, near)
                temporary.replace(path)
            if synced:
                _sync_directory(path.parent)
    except OSError as error:
        raise output_error(near, error) from error


@contextlib.contextmanager
def growing(target: Target, kept: bool = False) -> Iterator[BinaryIO]:
    """A binary stream at the end of a file that is seen to grow. An earlier file of that name is replaced at once by an
    empty one, never written into; kept: it goes on instead. A device or named pipe is written to directly. Raises
    OutputError for every OSError."""
    near = remote.local(target)
    if near is None:
        raise OutputError(f"{target}: a file that grows must be on this machine; name one, or - for standard output.")
    path = near
    try:
        check_target(near)
        path = _place(near)
        _refuse_guarded(path, near)
        if path.exists() and not path.is_file():
            with streams.opened(path) as stream:
                yield stream
            return
        if not (kept and path.exists()):
            with replacing(near):
                pass
        with path.open("r+b", buffering=0) as file:
            file.seek(0, os.SEEK_END)
            yield streams.whole(file)
            os.fsync(file.fileno())
            kept = path.exists() and os.path.samestat(os.fstat(file.fileno()), path.stat())
    except OSError as error:
        raise output_error(near, error) from error
    if not kept:
        raise OutputError(f"{target}: removed or replaced while it was written, so its rows are lost; filter again.")


@contextlib.contextmanager
def standard_output() -> Iterator[BinaryIO]:
    """Standard output for a result. Raises OutputError when it is full or closed, BrokenPipeError when its reader has
    left, which the caller handles."""
    try:
        if sys.stdout is None:
            raise OSError(errno.EBADF, os.strerror(errno.EBADF))
        sys.stdout.flush()
        yield streams.whole(sys.stdout.buffer)
    except BrokenPipeError:
        raise
    except OSError as error:
        raise OutputError(stdout_fault(error)) from error


def sync(stream: BinaryIO) -> None:
    """Flush `stream` to the disk (a full disk shows here at the latest)."""
    stream.flush()
    os.fsync(stream.fileno())


def _guarded_as(path: Path) -> str | None:
    """The input that this entry of a directory is (a link is none), or None."""
    try:
        found = path.lstat()
    except OSError:
        return None
    return _guarded.get((found.st_dev, found.st_ino))


def _place(near: Path) -> Path:
    """The file that is replaced: behind a link, but the link itself where it has come to lead to an input."""
    path = _resolved(near)
    return near if near.is_symlink() and _guarded_as(path) is not None else path


def _refuse_guarded(path: Path, target: Path) -> None:
    if (given := _guarded_as(path)) is not None:
        raise overwriting(target, given)


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


def output_error(path: Path, error: OSError, written: str = "nothing was written") -> OutputError:
    """The error of the system in a sentence. written: what holds all the same when there is no more room."""
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
        errno.ENOSPC: f"the disk is full; {written}. Make room or choose another place.",
        errno.EDQUOT: f"the disk quota is used up; {written}. Make room or choose another place.",
        errno.ELOOP: "this is a symbolic link to itself; delete it, or give another name.",
        errno.ENAMETOOLONG: "the name is too long for the file system; give a shorter one.",
        errno.EFBIG: f"the file is larger than the system allows; {written}. Choose another place.",
    }
    if error.errno == errno.ENOENT and directory.is_dir():  # such as /proc
        reasons[errno.ENOENT] = f"no file can be made in {directory}; choose another place."
    reason = reasons.get(error.errno or 0, f"cannot be written ({error.strerror or error}).")
    return OutputError(f"{path}: {reason}")
