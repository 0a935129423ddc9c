"""Packed files: gzip, bzip2, xz, zstd, and a zip archive with one member, unpacked within limits into a directory."""

from __future__ import annotations

import bz2
import gzip
import lzma
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

from ftproc.errors import InputError, first_line
from ftproc.files.reading.formats import content

_CHUNK = 8 << 20  # bytes

#: Ending -> how such a file begins, and its name in messages.
KINDS = {
    ".gz": (content.GZIP_MAGIC, "gzip"),
    ".bz2": (b"BZh", "bzip2"),
    ".xz": (b"\xfd7zXZ", "xz"),
    ".zst": (b"\x28\xb5\x2f\xfd", "zstd"),
    ".zip": (b"PK\x03\x04", "zip"),
}


def ending(name: str, head: bytes) -> str | None:
    """The one of KINDS that a file is packed as, by its name or else by its first bytes; an .xlsx is not packed."""
    lower = name.lower()
    by_name = next((kind for kind in KINDS if lower.endswith(kind)), None)
    return by_name or next(
        (kind for kind, (magic, _) in KINDS.items() if kind != ".zip" and head.startswith(magic)), None
    )


def unpacked(name: str, path: Path, kind: str, directory: Path) -> Path:
    """Unpack into `directory`; the file there has the name without the ending. Raises InputError, also for what grows
    beyond the limit."""
    what = KINDS[kind][1]
    try:
        if kind == ".zip":
            return _from_zip(name, path, directory)
        inner = path.name[: -len(kind)] if path.name.lower().endswith(kind) else path.name
        target = directory / (Path(inner).name or "log")
        with _OPEN[kind](path) as packed:
            _copy(name, packed, target, path.stat().st_size)
        return target
    except EOFError as error:
        raise InputError(f"{name}: the {what} file is cut short; copy it again.") from error
    except (OSError, zlib.error, lzma.LZMAError, zipfile.BadZipFile, RuntimeError, NotImplementedError) as error:
        if isinstance(error, OSError) and error.errno is not None:
            raise
        reason = first_line(error)
        raise InputError(f"{name}: not a {what} file, or a damaged one ({reason}); copy it again.") from error


def _zstd(path: Path) -> Any:
    import pyarrow as pa

    return pa.CompressedInputStream(pa.OSFile(str(path)), "zstd")


_OPEN: dict[str, Callable[[Path], Any]] = {".gz": gzip.open, ".bz2": bz2.open, ".xz": lzma.open, ".zst": _zstd}


def _copy(name: str, packed: IO[bytes], target: Path, size: int) -> None:
    room = content.unpacked_limit(size)
    with target.open("wb") as stream:
        while data := packed.read(_CHUNK):
            room -= len(data)
            if room < 0:
                raise InputError(
                    f"{name}: unpacks to more than {content.MAX_GROWTH} times its packed size, which no log does. "
                    "If it is a log, unpack it first (gunzip)."
                )
            stream.write(data)


def _from_zip(name: str, path: Path, directory: Path) -> Path:
    with zipfile.ZipFile(path) as archive:
        members = [m for m in archive.infolist() if not m.is_dir() and not m.filename.startswith(("__MACOSX/", "."))]
        if len(members) != 1:
            files = ", ".join(member.filename for member in members[:10]) or "nothing"
            raise InputError(
                f"{name}: a zip archive must hold one log, this one holds {files}. Unpack it, name a file."
            )
        if members[0].flag_bits & 1:
            raise InputError(f"{name}: the zip archive needs a password; unpack it first.")
        target = directory / (Path(members[0].filename).name or "log")
        with archive.open(members[0]) as packed:
            _copy(name, packed, target, path.stat().st_size)
        return target
