"""Files named by a URI, such as s3://bucket/flight.csv, on any storage that pyarrow or fsspec supports.

An input is copied into a temporary file and read there; an output is written into one and stored when it is complete.
"""

from __future__ import annotations

import contextlib
import re
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, cast
from urllib.parse import unquote, urlsplit

from ftproc.errors import FtprocError, InputError, OutputError, first_line
from ftproc.files import limits

_SCHEME = re.compile(r"[a-z][a-z0-9+.-]+://", re.IGNORECASE)
_CHUNK = 16 << 20  # bytes


def is_uri(name: object) -> bool:
    """Whether a name is a URI rather than a path."""
    return isinstance(name, str) and _SCHEME.match(name) is not None


def local(name: object) -> Path | None:
    """The path of a name on this machine (also of file:///... and local://...), or None if it is on another, or within
    a file."""
    if not is_uri(name):
        return Path(cast(str, name))
    if "::" in str(name):
        return None
    if str(name).lower().startswith("local://"):  # as fsspec reads it: the rest is a path as it stands
        return Path(str(name)[len("local://") :])
    parts = urlsplit(str(name))
    return Path(unquote(parts.path)) if parts.scheme.lower() == "file" else None


def within(directory: str, name: str) -> str:
    """The name of a file in a directory, which may be a URI."""
    return f"{directory.rstrip('/')}/{name}" if is_uri(directory) else str(Path(directory) / name)


class Copy(NamedTuple):
    """path: of a copy on this machine. packed: bytes of the file there, or of the archive that it is in."""

    path: Path
    packed: int


def fetch(uri: str, directory: Path) -> Copy:
    """Copy the file into a directory of this machine. Raises InputError, also for one without an end, and for one that
    grows beyond the limit as it comes out of an archive (zip://a.csv::s3://bucket/a.zip)."""
    with _as_error(uri, InputError):
        archive = uri.rpartition("::")[2] if "::" in uri else ""
        packed = (
            _size(uri, *_files(archive if is_uri(archive) else f"local://{archive}", InputError)) if archive else None
        )
        files, path = _files(uri, InputError)
        size = _size(uri, files, path)
        room = limits.Room(uri, packed or 0)
        copy, copied = directory / limits.short_name(Path(path).name), 0
        with files.open_input_stream(path, compression=None) as source, copy.open("wb") as target:
            while data := source.read(_CHUNK):
                copied += len(data)
                if archive:
                    room.check(copied)
                elif copied > max(size or 0, limits.WITHOUT_END):
                    raise InputError(f"{uri}: more than {limits.WITHOUT_END >> 20} MiB without an end; name a file.")
                target.write(data)
        return Copy(copy, packed or copied)


def _size(uri: str, files: Any, path: str) -> int | None:
    """Bytes of a file, None if the storage does not say. Raises InputError for what is no ordinary file."""
    from pyarrow import fs

    found = files.get_file_info(path)
    if found.type == fs.FileType.NotFound:
        raise FileNotFoundError(path)
    if found.type != fs.FileType.File:
        raise InputError(f"{uri}: not an ordinary file (a directory, a pipe or a device); name a file.")
    return cast("int | None", found.size)


@contextlib.contextmanager
def storing(uri: str) -> Iterator[BinaryIO]:
    """A binary stream whose content is stored if the block succeeds. Raises OutputError."""
    with tempfile.TemporaryFile() as whole:
        yield cast(BinaryIO, whole)
        whole.seek(0)
        with _as_error(uri, OutputError):
            files, path = _files(uri, OutputError)
            target = _open_for_writing(files, path)
            try:
                shutil.copyfileobj(whole, target, _CHUNK)
                target.close()
            except BaseException:  # a part that is stored can only be deleted
                with contextlib.suppress(Exception):
                    target.close()
                    files.delete_file(path)
                raise


def _open_for_writing(files: Any, path: str) -> Any:
    """The open file; its directory is created where the storage has directories."""
    try:
        return files.open_output_stream(path, compression=None)
    except FileNotFoundError:
        files.create_dir(path.rpartition("/")[0], recursive=True)
        return files.open_output_stream(path, compression=None)


def _files(uri: str, error: type[FtprocError]) -> tuple[Any, str]:
    """The file system of a URI and the path in it: pyarrow's own, else fsspec's."""
    import pyarrow as pa
    from pyarrow import fs

    try:
        found: tuple[Any, str] = fs.FileSystem.from_uri(uri)
        return found
    except pa.ArrowInvalid:  # a scheme that pyarrow does not know
        pass
    scheme = uri.partition(":")[0]
    try:
        import fsspec

        files, path = fsspec.core.url_to_fs(uri)
    except (ImportError, ValueError) as why:
        raise error(
            f'{uri}: neither pyarrow nor fsspec supports "{scheme}" here; pip install fsspec and its package for '
            f"{scheme}, or copy the file to this machine."
        ) from why
    return fs.PyFileSystem(fs.FSSpecHandler(files)), path


@contextlib.contextmanager
def _as_error(uri: str, error: type[FtprocError]) -> Iterator[None]:
    """Any exception of the storage becomes an `error` that names the URI."""
    try:
        yield
    except FtprocError:
        raise
    except FileNotFoundError as why:
        raise error(f"{uri}: there is no such file or directory; check the name.") from why
    except Exception as why:  # each storage raises its own errors
        what, reason = "read" if error is InputError else "written", first_line(why)
        raise error(f"{uri}: cannot be {what} ({reason}); check the name, the network and your permission.") from why
