"""The bytes of a file or of standard input, and limits; messages for what cannot be read."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import itertools
import os
import stat
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from ftproc.errors import FtprocError, InputError, first_line, nearest
from ftproc.files import limits

#: Size from which a file is read in blocks: bytes of a CSV file, or of the columns read from a Parquet file.
LARGE = 32 << 20
GZIP_MAGIC = b"\x1f\x8b"

_OF_THE_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EMFILE, errno.ENFILE, errno.EIO)
_MOST_BESIDE = 2000  # files that are searched for a similar name
_ALIKE = 0.75
MAX_STDIN = limits.WITHOUT_END


def read(name: str, path: Path, limit: int = -1, known: os.stat_result | None = None) -> bytes:
    """The first `limit` bytes of a file, by default all. Raises InputError, also for an empty file, and Changed as
    `unchanged`."""
    try:
        if not is_ordinary(path):
            raise InputError(f"{name}: not an ordinary file (a pipe or a device); give it as - on standard input.")
        with path.open("rb") as stream, unchanged(name, stream, known):
            data = stream.read(limit)
    except FileNotFoundError as error:
        raise InputError(f"{name}: there is no such file{_near(path)}") from error
    except IsADirectoryError as error:
        raise InputError(
            f"{name}: this is a directory; name a file in it. All of a kind: {name}/*.csv -o OUT/."
        ) from error
    except PermissionError as error:
        raise InputError(f"{name}: no permission to read it.") from error
    except OSError as error:
        raise InputError(f"{name}: cannot be read ({error.strerror or error}); check the file.") from error
    if not data:
        raise InputError(f"{name}: the file is empty; expected a header line and rows.")
    return data


def _near(path: Path) -> str:
    """`; did you mean ...`, for the file beside it with the most similar name, or a full stop."""
    try:
        beside = [entry.name for entry in itertools.islice(path.parent.iterdir(), _MOST_BESIDE) if entry.is_file()]
    except OSError:
        return "."
    return nearest(path.name, beside, _ALIKE) or "."


class Changed(InputError):
    """A file was written to while it was read: what was read may be neither its old nor its new content."""


@contextlib.contextmanager
def unchanged(name: str, stream: BinaryIO, known: os.stat_result | None = None) -> Iterator[None]:
    """Raises Changed, after the block, when the file became shorter inside or was written again; a log may grow.

    known: the file as it was before the stream was opened.
    """
    before = known or os.fstat(stream.fileno())
    yield
    after = os.fstat(stream.fileno())
    replaced = (after.st_dev, after.st_ino) != (before.st_dev, before.st_ino)
    rewritten = after.st_size == before.st_size and after.st_mtime_ns != before.st_mtime_ns
    if replaced or rewritten or after.st_size < before.st_size:
        raise Changed(f"{name}: the file changed while it was read; wait until it is complete, and run again.")


def size(path: Path) -> int:
    """Of a file, in bytes; 0 if there is none, of which `read` says why."""
    try:
        return path.stat().st_size
    except OSError:
        return 0


def sha256(path: Path) -> str:
    """Of the bytes of a file; "" if it is there no more."""
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError:
        return ""


def is_ordinary(path: Path) -> bool:
    """Whether reading comes to an end without waiting. True for a directory too: `open` has the message for it."""
    mode = path.stat().st_mode
    return stat.S_ISREG(mode) or stat.S_ISDIR(mode)


def stdin() -> bytes:
    """All of standard input, which may never end. Raises InputError beyond a limit, and when it cannot be read."""
    try:
        if sys.stdin is None:
            raise OSError(errno.EBADF, os.strerror(errno.EBADF))
        data = sys.stdin.buffer.read(MAX_STDIN + 1)
    except OSError as error:
        reason = "is closed" if error.errno == errno.EBADF else f"cannot be read ({error.strerror or error})"
        raise InputError(f"<stdin>: standard input {reason}; pipe a CSV log into it, or name a file.") from error
    if len(data) > MAX_STDIN:
        raise InputError(f"<stdin>: more than {MAX_STDIN >> 20} MiB without an end; give a Parquet file, or split it.")
    return data


@contextlib.contextmanager
def undamaged(name: str, kind: str, cure: str) -> Iterator[None]:
    """What another library raises on a damaged file becomes an InputError, and its warnings are left out: `NAME: not a
    zip file, or a damaged one (why); copy it again.` An error of the disk stays what it is."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except (FtprocError, MemoryError, ImportError):
        raise
    except Exception as error:
        if isinstance(error, OSError) and error.errno in _OF_THE_DISK:
            raise
        raise InputError(f"{name}: not {kind}, or a damaged one ({first_line(error)}); {cure}.") from error
