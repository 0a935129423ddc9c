"""A short fuzz of the readers from fixed seeds: good files, mutated byte by byte and piece by piece."""

from __future__ import annotations

import contextlib
import random
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

from ftproc.correction import model_file
from ftproc.errors import FtprocError
from ftproc.files import logs, truth

from . import bad_files, bad_models, bad_truths, cases

_PIECES = (
    b",",
    b";",
    b"\n",
    b'"',
    b"\0",
    b"nan",
    b"inf",
    b"1e308",
    b"-",
    b"\xff",
    b"2024-05-31T00:00:00Z",
    b"86399",
    b"\r",
)


def mutated(content: bytes, draw: random.Random) -> bytes:
    """Some bytes flipped, pieces put in, taken out or repeated."""
    data = bytearray(content)
    for _ in range(draw.randint(1, 8)):
        place = draw.randrange(len(data) + 1)
        length = draw.choice((1, 1, 4, 50))
        match draw.randrange(4):
            case 0:
                data[place : place + 1] = bytes([draw.randrange(256)])
            case 1:
                data[place:place] = draw.choice(_PIECES)
            case 2:
                del data[place : place + length]
            case _:
                data[place:place] = data[place : place + length]
    return bytes(data)


def run(seconds: float, seed: int = 0) -> tuple[int, list[str]]:
    """How many inputs were tried, and a line for each that came out as something else than a result or a sentence."""
    draw, tried, wrong = random.Random(seed), 0, []
    seeds: list[tuple[str, bytes, Callable[[Path], object]]] = [
        ("f.csv", cases.text().encode(), logs.read),
        ("f.csv", cases.text(separator=";").replace(".", ",").encode(), logs.read),
        ("f.parquet", bad_files.packed(bad_files.columns(), write_page_checksum=True), logs.read),
        ("f.csv", bad_truths.text().encode(), truth.read),
        ("f.safetensors", bad_models.good(), model_file.load),
    ]
    until = time.monotonic() + seconds
    with tempfile.TemporaryDirectory() as directory:
        while time.monotonic() < until:
            name, content, read = draw.choice(seeds)
            path = Path(directory) / name
            path.write_bytes(mutated(content, draw))
            tried += 1
            try:
                with cases.in_time(), warnings.catch_warnings(), contextlib.suppress(FtprocError):
                    warnings.simplefilter("error")
                    read(path)
            except Exception as error:
                wrong.append(f"{name}, input {tried} of seed {seed}: {type(error).__name__}: {error}")
    return tried, wrong
