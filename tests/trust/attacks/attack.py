"""An attack, and what its generators share."""

from __future__ import annotations

import bz2
import gzip
import lzma
import random
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

#: Puts files into a directory and returns what is named on the command line.
Make = Callable[[Path], str]


class Attack(NamedTuple):
    """reads: it is a good log in spite of all, or must be refused; None: whichever. says: words of the sentence."""

    name: str
    make: Make
    args: tuple[str, ...] = ()
    reads: bool | None = None
    says: str = ""


HEAD = "time_s,range_m,azimuth_rad,elevation_rad"
N = 60
T = np.arange(N) * 0.5
R = 5000.0 + 40.0 * T
A = 0.3 + 0.001 * T
E = 0.2 + 0.0005 * T
COLUMNS = dict(zip(HEAD.split(","), (T, R, A, E), strict=True))
ROWS = [[float(v) for v in row] for row in zip(T, R, A, E, strict=True)]
LINES = [",".join(map(repr, row)) for row in ROWS]
TEXT = "\n".join([HEAD, *LINES, ""])


def file(name: str, content: bytes | str | Callable[[], bytes]) -> Make:
    """A file of this content, which may be made when it is needed."""

    def make(directory: Path) -> str:
        data = content() if callable(content) else content
        (directory / name).write_bytes(data.encode("utf-8", "surrogatepass") if isinstance(data, str) else data)
        return name

    return make


def packed(kind: str, content: bytes, member: str = "log.csv") -> bytes:
    """The content in an archive."""
    import io

    import pyarrow as pa

    if kind == "zip":
        sink = io.BytesIO()
        with zipfile.ZipFile(sink, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr(member, content)
        return sink.getvalue()
    if kind == "zst":
        return bytes(pa.compress(content, codec="zstd", asbytes=True))
    return {"gz": gzip.compress, "bz2": bz2.compress, "xz": lzma.compress}[kind](content)


def damaged(whole: bytes, name: str, draw: random.Random, times: int) -> Iterator[Attack]:
    """Single bytes changed, and the end cut off."""
    for k in range(times):
        content = bytearray(whole)
        for _ in range(draw.choice((1, 1, 3))):
            content[draw.randrange(len(content))] = draw.choice((0, 255, 1, 128, draw.randrange(256)))
        yield Attack(f"{name} damaged {k}", file(name, bytes(content)))
    for k in range(3):
        yield Attack(f"{name} cut {k}", file(name, whole[: draw.randrange(1, len(whole))]))
