"""The bytes of a file or of standard input, and limits; messages for what cannot be read."""

from __future__ import annotations

import itertools
import stat
import sys
from pathlib import Path

from ftproc.errors import InputError, nearest

#: Size from which a file is read in blocks: bytes of a CSV file, or of the columns read from a Parquet file.
LARGE = 32 << 20
#: Limit of unpacking, against files made to fill the memory: real readings shrink to a half, not to a 200th.
MAX_GROWTH = 200
GZIP_MAGIC = b"\x1f\x8b"

_MIN_UNPACKED = 64 << 20  # bytes that any packed file may unpack to
_MOST_BESIDE = 2000  # files that are looked through for a similar name
_ALIKE = 0.75
MAX_STDIN = 4 << 30  # bytes


def read(name: str, path: Path, limit: int = -1) -> bytes:
    """The first `limit` bytes of a file, by default all. Raises InputError, also for an empty file."""
    try:
        if not is_ordinary(path):
            raise InputError(f"{name}: not an ordinary file (a pipe or a device); give it as - on standard input.")
        with path.open("rb") as stream:
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


def is_ordinary(path: Path) -> bool:
    """Whether reading comes to an end without waiting. True for a directory too: `open` has the message for it."""
    mode = path.stat().st_mode
    return stat.S_ISREG(mode) or stat.S_ISDIR(mode)


def stdin() -> bytes:
    """All of standard input, which may never end. Raises InputError beyond a limit."""
    data = sys.stdin.buffer.read(MAX_STDIN + 1)
    if len(data) > MAX_STDIN:
        raise InputError(f"<stdin>: more than {MAX_STDIN >> 20} MiB without an end; give a Parquet file, or split it.")
    return data


def unpacked_limit(packed: int) -> int:
    """The most bytes that a file of `packed` bytes may unpack to."""
    return max(_MIN_UNPACKED, MAX_GROWTH * packed)
