"""The hidden file beside a target in which its content grows; what a killed program left of them is removed.

A program holds a lock on each of its own as long as it lives, which the system releases however it ends. Only a file is
removed that has a name such as only ftproc gives, was made under the same running system, and which nobody holds.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import socket
import stat
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import BinaryIO

try:
    import fcntl
except ImportError:  # Windows: what is left stays
    fcntl = None  # type: ignore[assignment]

_LONGEST = 200  # bytes of the target's name in that of its hidden file
_BOOT = Path("/proc/sys/kernel/random/boot_id")


@contextlib.contextmanager
def beside(path: Path) -> Iterator[tuple[BinaryIO, Path]]:
    """An open file beside `path`, and its name, from which the block moves it away. Raises OSError."""
    _clean(path.parent)
    descriptor, name = _made(path)
    held = None if fcntl is None else os.dup(descriptor)  # with the lock: the block closes the stream
    try:
        with os.fdopen(descriptor, "wb") as stream:
            yield stream, name
    except BaseException:  # also Ctrl-C
        with contextlib.suppress(OSError):
            name.unlink()
        raise
    finally:
        if held is not None:
            os.close(held)


def _made(path: Path) -> tuple[int, Path]:
    """A new hidden file, locked."""
    while True:
        start = os.fsdecode(os.fsencode(path.name)[:_LONGEST])
        name = path.with_name(f".{start}.ftproc-{_system()}-{os.urandom(4).hex()}.tmp")
        # O_EXCL: never through an existing link. 0o666: the user's umask decides, as for any new file.
        descriptor = os.open(name, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
        if fcntl is None:
            return descriptor, name
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            taken = os.fstat(descriptor).st_nlink == 0
        except BlockingIOError:
            taken = True
        except OSError:  # a file system without locks: nobody removes it
            taken = False
        if not taken:  # by a program that removes it, before it was locked
            return descriptor, name
        os.close(descriptor)


@cache
def _clean(directory: Path) -> None:
    """Remove what killed programs have left here; once in a process."""
    ours = re.compile(rf"\..+\.ftproc-{_system()}-[0-9a-f]{{8}}\.tmp", re.DOTALL)
    with contextlib.suppress(OSError), os.scandir(directory) as entries:
        for entry in [entry for entry in entries if ours.fullmatch(entry.name)] if fcntl is not None else []:
            with contextlib.suppress(OSError):
                _remove(entry.path)


def _remove(name: str) -> None:
    """Remove a file unless a program holds it. Raises OSError."""
    descriptor = os.open(name, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        found = os.fstat(descriptor)
        if stat.S_ISREG(found.st_mode) and found.st_nlink == 1 and found.st_uid == os.geteuid():
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            Path(name).unlink()
    finally:
        os.close(descriptor)


@cache
def _system() -> str:
    """Of the running system, in eight digits: its locks are seen by all that runs under it, and by nobody else."""
    try:
        known = _BOOT.read_bytes()
    except OSError:
        known = socket.gethostname().encode()
    return hashlib.blake2b(known, digest_size=4).hexdigest()
