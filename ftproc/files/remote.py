"""Files that a URI names, such as s3://bucket/flight.csv: on whatever storage pyarrow or fsspec can reach.

A file is fetched into a temporary one and read there; an output is written into one and stored when it is whole.
"""

from __future__ import annotations

import contextlib
import re
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO, cast
from urllib.parse import unquote, urlsplit

from ftproc.errors import FtprocError, InputError, OutputError

_SCHEME = re.compile(r"[a-z][a-z0-9+.-]+://", re.IGNORECASE)
_AT_ONCE = 16 << 20  # bytes


def is_uri(name: object) -> bool:
    """Whether a name is a URI, and no path."""
    return isinstance(name, str) and _SCHEME.match(name) is not None


def local(name: object) -> Path | None:
    """The path that a name means on this machine (also file:///...), or None when it is on another."""
    if not is_uri(name):
        return Path(cast(str, name))
    parts = urlsplit(str(name))
    return Path(unquote(parts.path)) if parts.scheme.lower() == "file" else None


def within(directory: str, name: str) -> str:
    """The name of a file in a directory, which may be a URI."""
    return f"{directory.rstrip('/')}/{name}" if is_uri(directory) else str(Path(directory) / name)


def fetch(uri: str, directory: Path) -> Path:
    """A copy of the file in a directory of this machine. Raises InputError."""
    with _plainly(uri, InputError):
        files, path = _files(uri, InputError)
        copy = directory / (Path(path).name or "log")
        with files.open_input_stream(path, compression=None) as source, copy.open("wb") as target:
            shutil.copyfileobj(source, target, _AT_ONCE)
        return copy


@contextlib.contextmanager
def storing(uri: str) -> Iterator[BinaryIO]:
    """A binary stream whose content is stored when the block ends well, and only then. Raises OutputError."""
    with tempfile.TemporaryFile() as whole:
        yield cast(BinaryIO, whole)
        whole.seek(0)
        with _plainly(uri, OutputError):
            files, path = _files(uri, OutputError)
            target = _begun(files, path)
            try:
                shutil.copyfileobj(whole, target, _AT_ONCE)
                target.close()
            except BaseException:  # what was begun cannot be called off, only taken away
                with contextlib.suppress(Exception):
                    target.close()
                    files.delete_file(path)
                raise


def _begun(files: Any, path: str) -> Any:
    """The file, open for writing; storage with real directories may want that of the file to be made first."""
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
        raise error(f'{uri}: what "{scheme}" is, neither pyarrow nor fsspec knows here; pip install fsspec and what it '
                    f"needs for {scheme}, or copy the file to this machine.") from why  # fmt: skip
    return fs.PyFileSystem(fs.FSSpecHandler(files)), path


@contextlib.contextmanager
def _plainly(uri: str, error: type[FtprocError]) -> Iterator[None]:
    try:
        yield
    except FtprocError:
        raise
    except FileNotFoundError as why:
        raise error(f"{uri}: there is no such file or directory; check the name.") from why
    except Exception as why:  # storage has errors of its own kinds
        reason = str(why).splitlines()[0][:200] if str(why) else type(why).__name__
        what = "read" if error is InputError else "written"
        raise error(f"{uri}: cannot be {what} ({reason}); check the name, the network and your permission.") from why
