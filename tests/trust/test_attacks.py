"""An attack of each generator; `make trust` makes them all."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pytest

from tests.trust.attacks import attack, binaries, hdf5, running, standards, texts
from tests.trust.attacks.attack import Attack

GENERATORS = (*texts.ALL, *binaries.ALL, *hdf5.ALL, *standards.ALL)
LEAST = 600
pytestmark = pytest.mark.filterwarnings("ignore")  # of the libraries that make odd files


@cache
def few(generator: Callable[[random.Random], Iterator[Attack]]) -> tuple[Attack, list[tuple[str, tuple[str, ...]]]]:
    """One of the attacks of a generator, and the names and arguments of all."""
    made = list(generator(random.Random("a few")))
    return random.Random(f"one of the {generator.__name__}").choice(made), [(each.name, each.args) for each in made]


@pytest.mark.parametrize("generator", GENERATORS, ids=lambda generator: generator.__name__)
def test_none_is_lost(generator: Callable[[random.Random], Iterator[Attack]]) -> None:
    each, _ = few(generator)
    assert running.lost(each) == "", each.name


def test_there_are_many_and_each_has_its_name() -> None:
    made = [name for generator in GENERATORS for name in few(generator)[1]]
    assert len(made) >= LEAST
    assert [name for name in set(made) if made.count(name) > 1] == []


def test_the_same_seed_makes_the_same_files(tmp_path: Path) -> None:
    one, two, other = (list(hdf5.broken(random.Random(seed))) for seed in (1, 1, 2))
    for k, made in enumerate((one, two, other)):
        (tmp_path / str(k)).mkdir()
        made[-1].make(tmp_path / str(k))
    contents = [(tmp_path / str(k) / "a.h5").read_bytes() for k in range(3)]
    assert contents[0] == contents[1] != contents[2]


def test_a_judge_that_sees(monkeypatch: pytest.MonkeyPatch) -> None:
    good = Attack("good", attack.file("a.csv", attack.TEXT))
    assert running.lost(good) == ""
    assert "was read" in running.lost(good._replace(reads=False))
    bad = Attack("bad", attack.file("a.csv", "nothing"))
    assert "was refused" in running.lost(bad._replace(reads=True))
    assert 'does not say "word"' in running.lost(bad._replace(says="word"))
    monkeypatch.setattr(running, "MOST_MB", 10)
    assert running.lost(good) == ""  # for all of it may be this process's own
    monkeypatch.setattr(running, "own_mb", lambda: 0)
    assert "took" in running.lost(good)
    monkeypatch.setattr(running, "_ADDRESSES", 120 << 20)
    assert running.lost(good) != ""
