"""Packed files: gzip, bzip2, xz, zstd, and a zip archive with one member, unpacked within limits into a directory."""

from __future__ import annotations

import bz2
import gzip
import lzma
import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

from ftproc.errors import InputError
from ftproc.files.limits import Room, short_name
from ftproc.files.reading.formats import content

_CHUNK = 8 << 20  # bytes
#: Members of an archive that are written for people.
_DOCUMENT = re.compile(
    r"(?:^|/)(?:read_?me|licen[cs]e|copying|changelog|about|notes)\b|\.(?:md|pdf|html?|docx?|rtf|png|jpe?g)$",
    re.IGNORECASE,
)

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


def unpacked(name: str, path: Path, kind: str, directory: Path, room: Room, part: str = "") -> Path:
    """Unpack into `directory`; the file there ends as the name does without the ending. part: the wanted member of an
    archive. Raises InputError, also for what grows beyond the limit."""
    what = KINDS[kind][1]
    with content.undamaged(name, f"a {what} file", "copy it again"):
        try:
            if kind == ".zip":
                return _from_zip(name, path, directory, room, part)
            inner = path.name[: -len(kind)] if path.name.lower().endswith(kind) else path.name
            target = directory / short_name(inner)
            with _OPEN[kind](path) as packed:
                _copy(packed, target, room)
            return target
        except EOFError as error:
            raise InputError(f"{name}: the {what} file is cut short; copy it again.") from error


def is_member(path: Path, part: str) -> bool:
    """Whether an archive holds a file of this name."""
    with zipfile.ZipFile(path) as archive:
        return part in archive.namelist()


def _zstd(path: Path) -> Any:
    import pyarrow as pa

    return pa.CompressedInputStream(pa.OSFile(str(path)), "zstd")


_OPEN: dict[str, Callable[[Path], Any]] = {".gz": gzip.open, ".bz2": bz2.open, ".xz": lzma.open, ".zst": _zstd}


def _copy(packed: IO[bytes], target: Path, room: Room) -> None:
    size = lines = 0
    with target.open("wb") as stream:
        while data := packed.read(_CHUNK):
            size, lines = size + len(data), lines + data.count(b"\n")
            room.check(size, lines)
            stream.write(data)


def _from_zip(name: str, path: Path, directory: Path, room: Room, part: str) -> Path:
    with zipfile.ZipFile(path) as archive:
        files = [m for m in archive.infolist() if not m.is_dir() and not m.filename.startswith(("__MACOSX/", "."))]
        members = [m for m in files if m.filename == part] or files
        if len(members) > 1:
            members = [m for m in members if not _DOCUMENT.search(m.filename)] or members
        if len(members) != 1:
            held = ", ".join(member.filename for member in files[:10]) or "nothing"
            whole = name.removesuffix(f"#{part}")
            raise InputError(
                f"{whole}: which file of this zip archive? "
                f"It holds {held}. Name one behind #, such as {whole}#{files[0].filename if files else 'log.csv'}."
            )
        if members[0].flag_bits & 1:
            raise InputError(f"{name}: the zip archive needs a password; unpack it first.")
        target = directory / short_name(Path(members[0].filename).name)
        with archive.open(members[0]) as packed:
            _copy(packed, target, room)
        return target
