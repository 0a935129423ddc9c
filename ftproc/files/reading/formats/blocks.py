"""The rows of a text: block by block where it is too large to be read at once."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

from ftproc.errors import InputError
from ftproc.files.reading.formats import content
from ftproc.files.reading.formats.layout import BLANKS

_BLOCK = 8 << 20  # bytes that are parsed at once


def of_file(path: Path, source: str, offset: int, delimiter: str, before: os.stat_result) -> Iterator[memoryview]:
    """The rows of a file from an offset on, in blocks of whole lines; it is as it was `before`.

    Raises Changed when it is not so any more; InputError where a row may span lines, or only the whole file can tell
    what a point means.
    """
    with path.open("rb") as stream, content.unchanged(source, stream, before):
        stream.seek(offset)
        rest, marks = b"", set()
        while data := stream.read(_BLOCK):
            data = rest + data
            end = data.rfind(b"\n") + 1
            rest = data[end:]
            if len(rest) > _BLOCK:
                raise InputError(f"{source}: a line of more than {_BLOCK >> 20} MiB is no row of a log.")
            if delimiter != ",":  # points separate thousands if there is a comma anywhere in the file
                marks |= {mark for mark in (b",", b".") if mark in data}
                if len(marks) > 1:
                    raise InputError(f"{source}: decimal commas and points.")
            yield from _block(source, memoryview(data)[:end])
        yield from _block(source, memoryview(rest))


def delimited(body: memoryview, delimiter: str) -> tuple[bytes | memoryview, str]:
    """Rows with one character between the cells, and that."""
    if delimiter != BLANKS:
        return body, delimiter
    ends = rb"(?m)^[ \t]++|(?<![ \t])[ \t]++(?=\r?$)"
    return re.sub(rb"[ \t]+", b"\t", re.sub(ends, b"", body)), "\t"


def end(path: Path, size: int) -> bytes:
    """The last bytes of a file."""
    with path.open("rb") as stream:
        stream.seek(max(path.stat().st_size - size, 0))
        return stream.read()


def _block(source: str, body: memoryview) -> Iterator[memoryview]:
    if not re.search(rb"[^\r\n]", body):
        return
    if b'"' in bytes(body):
        raise InputError(f"{source}: quotation marks, in which a line may end.")
    yield body
