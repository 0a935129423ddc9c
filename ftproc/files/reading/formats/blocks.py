"""A text that is too large to be read at once, block by block."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from ftproc.errors import InputError
from ftproc.files.reading.formats import content

if TYPE_CHECKING:
    from ftproc.files.reading.formats.csvtext import CsvText

_BLOCK = 8 << 20  # bytes that are parsed at once


def of_file(path: Path, head: CsvText, before: os.stat_result) -> Iterator[CsvText]:
    """The rows of a file in blocks of whole lines; `head` comes from `split` of its beginning, when it was as `before`.

    Raises Changed when it is not so any more; InputError where a row may span lines, or only the whole file can tell
    what a point means.
    """
    with path.open("rb") as stream, content.unchanged(head.source, stream, before):
        stream.seek(head.body_offset)
        rest, marks = b"", set()
        while data := stream.read(_BLOCK):
            data = rest + data
            end = data.rfind(b"\n") + 1
            rest = data[end:]
            if len(rest) > _BLOCK:
                raise InputError(f"{head.source}: a line of more than {_BLOCK >> 20} MiB is no row of a log.")
            if head.delimiter != ",":  # points separate thousands if there is a comma anywhere in the file
                marks |= {mark for mark in (b",", b".") if mark in data}
                if len(marks) > 1:
                    raise InputError(f"{head.source}: decimal commas and points.")
            yield from _block(head, memoryview(data)[:end])
        yield from _block(head, memoryview(rest))


def _block(head: CsvText, body: memoryview) -> Iterator[CsvText]:
    if not re.search(rb"[^\r\n]", body):
        return
    if b'"' in bytes(body):
        raise InputError(f"{head.source}: quotation marks, in which a line may end.")
    yield head._replace(body=body, odd_quotes=False)
