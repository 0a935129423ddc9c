"""A short fuzz from fixed seeds in plain Python: small files, mutated byte by byte and piece by piece."""

from __future__ import annotations

import math
import random
import tempfile
import time
from pathlib import Path

from tests.fuzz.targets import all_targets, judge, seeds
from tests.trust import cases

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


def run(seconds: float = math.inf, most: float = math.inf, seed: int = 0) -> tuple[int, list[str]]:
    """How many inputs were tried, and a line for each that came out as something else than a result or a sentence."""
    draw, tried, wrong = random.Random(seed), 0, []
    found = {name: (target, seeds(target)) for name, target in all_targets().items()}
    until = time.monotonic() + seconds
    with tempfile.TemporaryDirectory() as directory:
        while tried < most and time.monotonic() < until:
            name = draw.choice(sorted(found))
            target, contents = found[name]
            content = mutated(draw.choice(contents), draw)
            tried += 1
            try:
                with cases.in_time():
                    judge(target, content, Path(directory))
            except Exception as error:
                wrong.append(f"{name}, input {tried} of seed {seed}: {type(error).__name__}: {error}")
    return tried, wrong
