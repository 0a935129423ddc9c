"""Streams that a live system should not get, made by a generator: good rows, something bad, and good rows again.

Whatever comes, it is done in time and in little memory, no row is lost without a word, the good rows before it are
published as good as ever, and what is wrong is said in a plain sentence.
"""

from __future__ import annotations

import io
import itertools
import re
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple, cast
from unittest import mock

import numpy as np

from ftproc.config.recipe import Recipe
from ftproc.errors import FtprocError
from ftproc.files.reading import trajectories
from ftproc.live.publishing import Request, follow_log
from ftproc.records import FloatArray, IntArray, Trajectory
from ftproc.settings import FilterSettings
from ftproc.simulation import Simulation, simulate
from tests.trust import cases

GOOD, AFTER = 150, 60  # rows before what is bad, and after it
MANY = 4000  # rows of what is bad, where it is many
LIMIT_S = 120  # for one; the slowest, at 1e-14 s under a lag of an hour, takes 45 s on an idle machine
FAR_M = 500.0  # from the truth: nothing good is published so far off
SETTLED = 40  # rows after which the track has begun
WAYS = {
    "lag 0": FilterSettings(editing="live"),
    "lag 2": FilterSettings(editing="live", lag_s=2.0),
    "lag 3600": FilterSettings(editing="live", lag_s=3600.0),
    "forward": FilterSettings(editing="forward"),
}


class Attack(NamedTuple):
    """A stream. rows: how many of its lines are rows with a time, up to what ends it. says: words of the sentence that
    ends it, None where nothing does. step: bytes that come at once. begins_well: with the good rows."""

    name: str
    text: bytes
    rows: int
    way: str = "lag 0"
    says: str | None = None
    step: int = 1 << 16
    begins_well: bool = True


@cache
def flight() -> Simulation:
    """What the good rows are of."""
    return simulate("manoeuvre", seed=4, duration_s=30.0, dt_s=0.1)


def lines(time_s: FloatArray, sample: IntArray) -> list[str]:
    """Rows at these times, with the readings of these samples of the flight."""
    readings = flight().log.measurement[sample % len(flight().log)]
    return [",".join(map(repr, row)) for row in np.column_stack([time_s, readings]).tolist()]


#: What is bad: times (n,) after this one, in the order in which they come.
Times = Callable[[float], FloatArray]


def _draw() -> np.random.Generator:
    return np.random.default_rng(36)


_FEW = np.sort(_draw().integers(0, 8, MANY)).astype(float)

BAD_TIMES: dict[str, Times] = {
    "a row in an hour": lambda t: np.array([t + 3600.0]),
    "a row in a day": lambda t: np.array([t + 86400.0]),
    "a row in 4 months": lambda t: np.array([t + 1e7]),
    "a row in 30 years": lambda t: np.array([t + 1e9]),
    "a row in 2,900 years": lambda t: np.array([9.2e10]),
    "a row 30 years ago": lambda t: np.array([-1e9]),
    "a row 2,900 years ago": lambda t: np.array([-9.2e10]),
    "far and near in turn": lambda t: np.tile([t + 1e9, t], 300),
    "ever farther": lambda t: t + np.geomspace(1e-3, 1e10, 300),
    "ever nearer": lambda t: t + 1e10 - np.geomspace(1e-3, 1e10, 300)[::-1],
    "a row in 4 months, and again": lambda t: t + 1e7 * np.arange(1.0, 200.0),
    "a row every hour": lambda t: t + 3600.0 * np.arange(1.0, 200.0),
    "many rows at one time": lambda t: np.full(MANY, t + 0.1),
    "many rows at the time before": lambda t: np.full(MANY, t),
    "many rows at few times": lambda t: t + 0.1 + _FEW,
    "many rows at few times far apart": lambda t: t + 0.1 + 1e8 * _FEW,
    "pairs of rows": lambda t: t + 0.1 + 0.1 * np.repeat(np.arange(100.0), 2),
    "twenties of rows": lambda t: t + 0.1 + 0.1 * np.repeat(np.arange(20.0), 20),
    "intervals of 1e-14 s": lambda t: t + 1.5e-14 * np.arange(MANY),
    "intervals of 1e-9 s": lambda t: t + 1e-9 * np.arange(MANY),
    "intervals of 1e-5 s": lambda t: t + 1e-5 * np.arange(MANY),
    "clusters of 1e-9 s": lambda t: t + 0.1 * np.repeat(np.arange(1.0, 41.0), 20) + np.tile(1e-9 * np.arange(20), 40),
    "bursts far apart": lambda t: (t + 1e6 * np.arange(1.0, 6.0)[:, None] + 0.1 * np.arange(40)).ravel(),
    "ever earlier": lambda t: t - 0.01 * np.arange(300.0),
    "late rows within the lag": lambda t: np.tile([t, t - 0.5, t - 0.7], 200),
    "at random": lambda t: t + _draw().uniform(-3, 3, 300),
    "at random over the years": lambda t: _draw().uniform(-1e10, 1e10, 200),
    "no time for long": lambda t: np.full(MANY, np.nan),
    "no time now and then": lambda t: np.where(np.arange(300) % 3 > 0, np.nan, t + 0.1 + 0.1 * np.arange(300)),
}
#: Those of which all waits for the largest lag, too.
WAITING = ("many rows at one time", "intervals of 1e-14 s", "a row in 30 years", "late rows within the lag")


def _by_time(name: str, way: str) -> Attack:
    """Good rows, rows at these times, and good rows after the newest of them."""
    good_s = flight().log.time_s[:GOOD]
    bad_s = BAD_TIMES[name](float(good_s[-1]))
    last_s = max(float(np.nanmax(bad_s, initial=-np.inf)), float(good_s[-1]))
    after_s = last_s + 0.1 * np.arange(1, AFTER + 1)
    time_s = np.concatenate([good_s, bad_s, after_s])
    sample = np.r_[np.arange(GOOD), GOOD + np.arange(len(bad_s)), GOOD + np.arange(AFTER)]
    text = "\n".join([cases.HEADER, *lines(time_s, sample)]).replace("nan", "") + "\n"
    return Attack(f"{name}, {way}", text.encode(), int(np.isfinite(time_s).sum()), way)


def _first() -> Iterator[Attack]:
    """What is bad comes first: no track has begun."""
    log = flight().log
    for name, time_s in {
        "all rows at one time": np.full(MANY, 5.0),
        "all rows at few times": _FEW,
        "all rows 1e-300 s apart": 1e-300 * np.arange(MANY),
        "all rows at 1e10 s": 1e10 + 0.1 * np.arange(200),
        "one row per 4 months": 1e7 * np.arange(150.0),
        "30 years before the others": np.r_[-1e9, log.time_s[:AFTER]],
        "30 years after the others": np.r_[1e9, log.time_s[:AFTER]],
    }.items():
        for way in ("lag 0", "lag 2"):
            text = "\n".join([cases.HEADER, *lines(time_s, np.arange(len(time_s)))]) + "\n"
            yield Attack(f"{name}, {way}", text.encode(), len(time_s), way, begins_well=False)


def _by_text() -> Iterator[Attack]:
    """Lines that are no rows, and rows that are odd."""
    good = "\n".join([cases.HEADER, *lines(flight().log.time_s[:GOOD], np.arange(GOOD))]).encode() + b"\n"
    row = good.splitlines()[1]
    for name, text, says in (
        ("a time of 1e300", b"1e300,1,0,0\n", "the time 1e300 s is not that of a flight"),
        ("a time of -1e300", b"-1e300,1,0,0\n", "the time -1e300 s is not that of a flight"),
        ("a time that overflows", b"1e999,1,0,0\n", "the time 1e999 s is not that of a flight"),
        ("an infinite time", b"-inf,1,0,0\n", "the time -inf s is not that of a flight"),
        ("a time of 5,000 digits", b"9" * 5000 + b",1,0,0\n", "is not that of a flight"),
        ("a hexadecimal time", b"0x1p3,1,0,0\n", "is no number"),
        ("a line without an end", b"0" * 600_000, "has no end within 256 KiB"),
        ("a line of commas", b"," * 200_000 + b"\n", "has 200001 cells where the header has 4"),
        ("a line of blanks and commas", b" , " * 60_000 + b"\n", "cells where the header has 4"),
        ("a line of quotes", b'"' * 200_000 + b"\n", "where the header has 4"),
        ("a NUL in a cell", b"15.0,1\x002,0,0\n", "is no number"),
        ("lines of NUL", b"\0\0\0\0\n", "has 1 cell where the header has 4"),
        ("random bytes", _draw().bytes(5000) + b"\n", "line"),
        ("a packed log", b"\x1f\x8b\x08" + _draw().bytes(500) + b"\n", "line"),
        ("UTF-16", "15.0,1,0,0\n".encode("utf-16-le"), "is no number"),
        ("an escape", b"15.0,\x1b[2J,0,0\n", "is no number"),
        ("a row of another table", b"15.0,1000,0.1\n", "has 3 cells where the header has 4"),
    ):
        yield Attack(name, good + text + row + b"\n", GOOD, says=says)
    for name, text in (
        ("ends in CR LF", good.replace(b"\n", b"\r\n")),
        ("no end of the last line", good[:-1]),
        ("many empty lines", good + b"\n" * 5000),
        ("many comments", good + b"# note\n" * 20_000),
        ("the names again and again", good + good.splitlines()[0].join([b"", b"\n"]) * 5000),
        ("marks of UTF-8 in each line", good.replace(b"\n", b"\n\xef\xbb\xbf")),
    ):
        yield Attack(name, text, GOOD)
        yield Attack(f"{name}, in pieces", text, GOOD, step=211)
    for name, text, says in (
        ("nothing", b"", "there is no line"),
        ("only names", good.splitlines()[0] + b"\n", "no row came after the line of names"),
        ("comments without an end", b"# note\n" * 200_000, "looks like a row of a log"),
        ("empty lines without an end", b"\n" * 200_000, "looks like a row of a log"),
        ("long comments", (b"# " + b"x" * 200_000 + b"\n") * 40, "looks like a row of a log"),
        ("prose", b"all work and no play\n" * 5000, "looks like a row of a log"),
        ("names without an end", b"a," * 200_000, "has no end within 256 KiB"),
    ):
        yield Attack(name, text, 0, says=says)
    dripped = good.splitlines()[0] + b"\n" + b"1" * 50_000
    yield Attack("a long line byte by byte", dripped, 0, says="looks like a row of a log", step=1)


def attacks() -> Iterator[Attack]:
    """All, each with its own name."""
    for name, way in itertools.product(BAD_TIMES, ("lag 0", "lag 2")):
        yield _by_time(name, way)
    for name in WAITING:
        yield _by_time(name, "lag 3600")
        yield _by_time(name, "forward")
    yield from _first()
    yield from _by_text()


class _Pieces(io.RawIOBase):
    """Standard input whose bytes come a few at a time."""

    def __init__(self, text: bytes, step: int) -> None:
        self._left, self._step = io.BytesIO(text), step
        self.buffer = self

    def read(self, size: int = -1) -> bytes:
        return self._left.read(min(size, self._step))


def judge(attack: Attack, directory: Path) -> str:
    """`refused` where a sentence ends it, else `right`; AssertionError with what is wrong."""
    said, sentence, output = list[str](), "", directory / "out.csv"
    recipe = Recipe(settings=WAYS[attack.way])
    with (
        cases.in_time(LIMIT_S),
        mock.patch.object(sys, "stdin", cast(io.TextIOBase, _Pieces(attack.text, attack.step))),
    ):
        try:
            said.append(follow_log(Request("-", str(output)), recipe, said.append))
        except FtprocError as error:
            sentence = str(error)
            cases.judge_sentence("-", sentence)
    assert bool(sentence) == (attack.says is not None), f"says {sentence!r}"
    assert (attack.says or "") in sentence, f'"{attack.says}" is not in: {sentence}'
    counted = re.findall(r"(\d+) (?:came too late to be used|rows have times far ahead)", "\n".join(said))
    if attack.rows:
        _judge_rows(trajectories.read(output), attack, None if sentence else sum(map(int, counted)))
    else:
        assert not output.exists(), "something was written"
    assert [path.name for path in directory.iterdir() if path.name.startswith(".")] == [], "a hidden file is left"
    return "refused" if sentence else "right"


def _judge_rows(found: Trajectory, attack: Attack, late: int | None) -> None:
    """late: rows that were said to be, or to have a wrong time; None where nobody counted."""
    whole = f"{len(found)} rows are there, {late} late or with a wrong time, of {attack.rows}"
    assert late is None or len(found) + late == attack.rows, whole
    known = np.isfinite(found.state).all(1)
    assert (known | np.isnan(found.state).all(1)).all(), "states that are not finite"
    assert (np.isfinite(found.sigma[known]) & (found.sigma[known] > 0)).all(), "sigmas that are not positive and finite"
    assert (np.diff(found.time_s) >= 0).all(), "times that go back"
    truth = flight().truth
    left_s = float(truth.time_s[GOOD - 1]) - WAYS[attack.way].lag_s  # these rows had left before
    good = np.flatnonzero((found.row >= SETTLED) & (found.row < GOOD) & (found.time_s < left_s))
    if attack.begins_well and len(good):
        assert known[good].all(), "good rows without an estimate"
        off = np.linalg.norm(found.state[good, :3] - truth.position_m[found.row[good]], axis=1)
        assert off.max() < FAR_M, f"good rows are {off.max():.0f} m off"


def run(some: Iterable[Attack] | None = None) -> tuple[int, list[str]]:
    """How many were tried, some or all, and a line for each that went wrong."""
    tried, wrong = 0, []
    for attack in attacks() if some is None else some:
        tried += 1
        with tempfile.TemporaryDirectory() as directory:
            try:
                judge(attack, Path(directory))
            except Exception as error:
                wrong.append(f"wrong: stream {attack.name}: {type(error).__name__}: {error}")
    return tried, wrong
