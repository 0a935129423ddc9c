"""Streams of the table (`make trust` tries all): in time, in little memory, no row lost, the good rows as good as
ever."""

from __future__ import annotations

import itertools
import re
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pytest

from tests.trust import streams

MANY, PARTS = 75, 40  # streams, and parts of them, of which one is tried here
MOST_MEMORY_KB = 3 << 19  # 1.5 GB


def tried_alone(part: int) -> tuple[int, list[str], int]:
    """In a process of its own: what `streams.run` gives of a part, and the most memory that it took, kB. (The system's
    ru_maxrss would count what the process held that started it.)"""
    tried, wrong = streams.run(itertools.islice(streams.attacks(), part, None, PARTS))
    status = Path("/proc/self/status")
    found = re.search(r"VmHWM:\s+(\d+) kB", status.read_text()) if status.exists() else None
    return tried, wrong, int(found[1]) if found else 0


@pytest.mark.parametrize("part", [0, pytest.param(PARTS // 2, marks=pytest.mark.slow)])
def test_each_is_survived(part: int) -> None:
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        tried, wrong, memory_kb = pool.submit(tried_alone, part).result()
    assert tried > 0
    assert not wrong, "\n".join(wrong)
    assert memory_kb < MOST_MEMORY_KB


def test_there_are_many_and_each_has_its_name() -> None:
    names = [attack.name for attack in streams.attacks()]
    assert len(names) >= MANY
    assert len(set(names)) == len(names)
    assert list(streams.attacks()) == list(streams.attacks())


def test_a_judge_that_sees(tmp_path: Path) -> None:
    """Attacks that are wrong in themselves: each must be found out."""
    (good,) = (attack for attack in streams.attacks() if attack.name == "ends in CR LF")
    cells = good.text.split(b"\r\n")
    off = b"\r\n".join([cells[0], *(line.replace(b",", b",1", 1) for line in cells[1:-1]), b""])
    for wrong in (
        good._replace(rows=good.rows + 1),
        good._replace(says="is no number"),
        good._replace(text=b"", rows=0),
        good._replace(text=b"", rows=0, says="is no number"),
        good._replace(text=off),
    ):
        with pytest.raises(AssertionError):
            streams.judge(wrong, tmp_path)
