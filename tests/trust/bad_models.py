"""Models that lie about themselves. What is let in is also applied to a flight."""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from safetensors.numpy import load as parse
from safetensors.numpy import save as serialise

from ftproc.correction import model_file
from tests.trust.cases import Case, written

KEY = "ftproc-correction"
NAME = "m.safetensors"
_FLIPS = 60


@cache
def good() -> bytes:
    """The packaged model's file."""
    return (Path(model_file.__file__).parent / "default.safetensors").read_bytes()


def parts() -> tuple[dict[str, Any], dict[str, Any]]:
    """Its tensors and its header."""
    length = int.from_bytes(good()[:8], "little")
    return parse(good()), json.loads(json.loads(good()[8 : 8 + length])["__metadata__"][KEY])


def rewritten(change: Callable[[dict[str, Any], dict[str, Any]], None]) -> bytes:
    """The file with tensors and header changed."""
    tensors, header = parts()
    change(tensors, header)
    return bytes(serialise(tensors, metadata={KEY: json.dumps(header)}))


def framed(header: bytes, length: int | None = None, data: bytes = b"") -> bytes:
    """A safetensors file whose header has this text and this length field."""
    return struct.pack("<Q", len(header) if length is None else length) + header + data


def containers() -> Iterator[Case]:
    """Files that are no safetensors, or lie about their sizes."""
    body = b'{"w1":{"dtype":"F64","shape":[%s],"data_offsets":[%s]}}'
    for label, content in (
        ("empty", b""),
        ("one byte", b"x"),
        ("text", b"no model"),
        ("NULs", bytes(1000)),
        ("pickle", b"\x80\x04cos\nsystem\n."),
        ("header of 2^64 bytes", framed(b"{}", 2**64 - 1)),
        ("header of 2^62 bytes", framed(b"{}", 2**62)),
        ("header of 100 MB and one", framed(b"{}", 100_000_001)),
        ("header longer than the file", framed(b"{}", 3)),
        ("header shorter", framed(b'{"a":1}', 2)),
        ("header of no JSON", framed(b"{not json}")),
        ("header a list", framed(b"[]")),
        ("header null", framed(b"null")),
        ("header not UTF-8", framed(b'{"\xff":1}')),
        ("deep header", framed(b"[" * 200_000 + b"]" * 200_000)),
        ("metadata a list", framed(b'{"__metadata__":[1]}')),
        ("metadata of numbers", framed(b'{"__metadata__":{"a":1}}')),
        ("empty header", framed(b"{}")),
        ("data beyond the end", framed(body % (b"1000000", b"0,8000000"))),
        ("negative offset", framed(body % (b"1", b"-8,0"), data=bytes(8))),
        ("offsets backwards", framed(body % (b"1", b"8,0"), data=bytes(8))),
        ("huge shape", framed(body % (b"99999999999,99999999999", b"0,8"), data=bytes(8))),
        ("shape that does not fit", framed(body % (b"3", b"0,8"), data=bytes(8))),
        ("shape of 2^61", framed(body % (b"2305843009213693952", b"0,0"))),
        ("unknown type", framed((body % (b"1", b"0,8")).replace(b"F64", b"F99"), data=bytes(8))),
        ("bfloat16", framed((body % (b"4", b"0,8")).replace(b"F64", b"BF16"), data=bytes(8))),
        ("float8", framed((body % (b"8", b"0,8")).replace(b"F64", b"F8_E4M3"), data=bytes(8))),
        ("rubbish behind", good() + b"x"),
        ("another safetensors", bytes(serialise({"a": np.ones(3)}))),
    ):
        yield Case("model", label, written(content, NAME), ("`ftproc train` writes",))
    for length in (1, 7, 8, 100, len(good()) // 2, len(good()) - 1):
        yield Case("model", f"cut at {length}", written(good()[:length], NAME), ("`ftproc train` writes",))
    for place in np.linspace(0, len(good()) - 1, _FLIPS).astype(int):
        flipped = bytearray(good())
        flipped[place] ^= 1 << int(place % 8)
        yield Case("model", f"flipped at {place}", written(bytes(flipped), NAME), either=True)


def _at(header: dict[str, Any], inside: tuple[str, ...]) -> dict[str, Any]:
    for key in inside:
        header = header[key]
    return header


def headers() -> Iterator[Case]:
    """Headers with an entry left out, or of another kind, size or value."""
    for path in [(key,) for key in parts()[1]] + [("stages", "filter", key) for key in parts()[1]["stages"]["filter"]]:
        key, inside = path[-1], path[:-1]
        gone = rewritten(lambda t, h, key=key, inside=inside: _at(h, inside).pop(key))
        yield Case("model", f"without {key}", written(gone, NAME), ("train it again",))
        for value in (None, "x", [], {}, [["a"]], -1, 1e400, 10**400, True, [[1], [1, 2]], {"a": {"b": []}}, "NaN"):
            changed = rewritten(lambda t, h, key=key, inside=inside, value=value: _at(h, inside).update({key: value}))
            yield Case("model", f"{key} {str(value)[:12]}", written(changed, NAME), either=True)
    for tensor in parts()[0]:
        for label, change in (
            ("gone", lambda t, h, k=tensor: t.pop(k)),
            ("empty", lambda t, h, k=tensor: t.update({k: np.empty(0)})),
            ("NaN", lambda t, h, k=tensor: t.update({k: t[k] * np.nan})),
            ("infinite", lambda t, h, k=tensor: t.update({k: t[k] + np.inf})),
            ("flat", lambda t, h, k=tensor: t.update({k: np.append(t[k].ravel(), 1.0)})),
            ("larger", lambda t, h, k=tensor: t.update({k: np.zeros((40, 41))})),
        ):
            if label in ("NaN", "infinite") and not parts()[0][tensor].size:
                continue  # nothing there to spoil
            yield Case("model", f"{tensor} {label}", written(rewritten(change), NAME), ("train it again",))
        huge = rewritten(lambda t, h, k=tensor: t.update({k: np.sign(t[k]) * 1e300}))
        yield Case("model", f"{tensor} huge", written(huge, NAME), either=True)
    for features in ("other", "", "window2", 7):
        changed = rewritten(lambda t, h, f=features: h["stages"]["filter"].update(features=f))
        yield Case(
            "model", f"for features {features!r}", written(changed, NAME), ("made for the feature set", "known are")
        )
    deep = serialise({"a": np.ones(1)}, metadata={KEY: "[" * 100_000 + "]" * 100_000})
    yield Case("model", "deep entry", written(bytes(deep), NAME), ("damaged", "train it again"))
    coloured = rewritten(lambda t, h: h["stages"]["filter"].update(features="\x1b[31m\x07"))
    yield Case("model", "control characters", written(coloured, NAME), ("made for the feature set",))


def put(how: Callable[[Path], object], name: str = NAME) -> Callable[[Path], Path]:
    """A file of this name, made so."""

    def make(d: Path) -> Path:
        how(d / name)
        return d / name

    return make


def places() -> Iterator[Case]:
    """A name behind which there is no ordinary file."""
    for label, how in NO_FILES:
        yield Case("model", label, put(how), ("`ftproc train`",))


def _sparse(path: Path, size: int) -> None:
    with path.open("wb") as stream:
        stream.truncate(size)


#: What may be found under a name instead of an ordinary file.
NO_FILES: tuple[tuple[str, Callable[[Path], object]], ...] = (
    ("no file", lambda p: None),
    ("a directory", Path.mkdir),
    ("a named pipe", os.mkfifo),
    ("a link to itself", lambda p: p.symlink_to(p.name)),
    ("an endless device", lambda p: p.symlink_to(os.devnull.replace("null", "zero"))),
    ("a file of 2 GB", lambda p: _sparse(p, 2 << 30)),
)


def all_cases() -> Iterator[Case]:
    """Every model."""
    for table in (containers, headers, places):
        yield from table()
