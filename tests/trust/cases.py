"""A case of the corpus, and its judge: refused in a plain sentence, or read correctly."""

from __future__ import annotations

import contextlib
import signal
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from ftproc import pipeline
from ftproc.config import reading
from ftproc.config.recipe import Recipe
from ftproc.correction import model, model_file
from ftproc.errors import FtprocError
from ftproc.files.reading import logs, truth
from ftproc.records import MeasurementLog, Trajectory, Truth
from ftproc.simulation import Simulation, simulate

LIMIT_S = 30  # for one case; a hundred times what the slowest takes
LONGEST_SENTENCE = 1200
HEADER = "time_s,range_m,azimuth_rad,elevation_rad"

#: Puts the case's file into a directory and returns its path.
Make = Callable[[Path], Path]

#: What the record read must be like, beside what every result must be like.
Check = Callable[[Any], bool]


@dataclass(frozen=True)
class Case:
    """One bad (or merely odd) file.

    kind: log, model, truth or station. says: words of the sentence that refuses it; None: it is to be read, and `check`
    holds for the record; `either`: refused in whatever sentence, or read so that `check` holds (a flipped bit may hit
    anything). known: what is still wrong with it, and where.
    """

    kind: str
    name: str
    make: Make
    says: tuple[str, ...] | None = None
    check: Check = lambda record: True
    either: bool = False
    known: str = ""
    options: dict[str, Any] = field(default_factory=dict)


def written(content: bytes | str, name: str = "log.csv") -> Make:
    """A file of this content."""

    def make(directory: Path) -> Path:
        path = directory / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return make


@cache
def flight() -> Simulation:
    """What the good parts of the corpus are made of: 40 samples, no outliers."""
    return simulate("zuo2021", seed=1, duration_s=39.0)


@cache
def rows() -> list[list[str]]:
    """The flight's cells, which read back bit for bit."""
    log = flight().log
    return [[repr(float(v)) for v in (t, *z)] for t, z in zip(log.time_s, log.measurement, strict=True)]


def text(cells: list[list[str]] | None = None, header: str = HEADER, separator: str = ",", end: str = "\n") -> str:
    """CSV text of the rows given, or of the flight."""
    lines = [header.replace(",", separator), *(separator.join(row) for row in (rows() if cells is None else cells))]
    return end.join(lines) + end


def with_cell(row: int, column: int, cell: str) -> list[list[str]]:
    """The flight's rows with one cell replaced."""
    changed = [list(cells) for cells in rows()]
    changed[row][column] = cell
    return changed


def with_column(column: int, change: Callable[[float], float]) -> list[list[str]]:
    """The flight's rows with every number of a column changed."""
    return [
        [repr(change(float(cell))) if index == column else cell for index, cell in enumerate(cells)] for cells in rows()
    ]


def same(log: MeasurementLog) -> bool:
    """The flight, bit for bit."""
    base = flight().log
    return np.array_equal(log.time_s, base.time_s) and np.array_equal(log.measurement, base.measurement)


def same_but(row: int, column: int, value: float) -> Check:
    """The flight, but for one reading."""

    def check(log: MeasurementLog) -> bool:
        expected = flight().log.measurement.copy()
        expected[row, column - 1] = value
        return np.array_equal(log.measurement, expected, equal_nan=True)

    return check


def judge(case: Case, directory: Path) -> str:
    """`refused` or `right`; AssertionError with what is wrong otherwise.

    Anything that is not an FtprocError comes out as it is: that is a traceback. A warning counts as one.
    """
    path = case.make(directory)
    try:
        with in_time(), warnings.catch_warnings():
            warnings.simplefilter("error")
            found = _READ[case.kind](path, case.options)
    except FtprocError as error:
        sentence = str(error)
        assert case.either or case.says is not None, f"was to be read, but: {sentence}"
        for words in case.says or ():
            assert words in sentence, f'"{words}" is not in: {sentence}'
        judge_sentence(path.name, sentence)
        return "refused"
    assert case.says is None or case.either, f"was to be refused with {case.says}"
    assert case.check(found), "was not read correctly"
    return "right"


def judge_sentence(name: str, sentence: str) -> None:
    """AssertionError unless it names the file of this name, is plain and has a cure."""
    assert name in sentence, f"does not name the file: {sentence}"
    assert "internal error" not in sentence, sentence
    assert sentence.isprintable(), f"holds control characters: {sentence!r}"
    assert len(sentence) < LONGEST_SENTENCE, f"is too long: {sentence}"
    assert _has_a_cure(sentence), f"has no cure: {sentence}"


_CURES = (
    *("correct", "copy", "save", "say", "use", "give", "name", "write", "complete", "delete", "rename", "separate"),
    *("put", "fill", "unpack", "train", "convert", "check", "expected", "supported", "choose", "leave", "split"),
    *("count", "add", "sort", "there is no such file", "did you mean", "needs all", "must end in"),
    *("its keys are", "the sections: ", ": ftproc "),
)


def _has_a_cure(sentence: str) -> bool:
    return any(word in sentence.lower() for word in _CURES)


def _log(path: Path, options: dict[str, Any]) -> MeasurementLog:
    """Read it; and unless it is the flight itself, filter it: an accepted log must not fail later."""
    log = logs.read(path, **options)
    if not same(log):
        judge_trajectory(pipeline.filter_log(log, None, model_file.named("packaged")))
    return log


def _truth(path: Path, options: dict[str, Any]) -> Truth:
    from ftproc.scoring.matching import match

    found = truth.read(path)
    match(flight().log.time_s, found)
    return found


def _model(path: Path, options: dict[str, Any]) -> model.Model:
    found = model_file.load(path)
    judge_trajectory(pipeline.filter_log(flight().log, None, found))
    model.card(found)
    return found


def _station(path: Path, options: dict[str, Any]) -> Recipe:
    """Read it; and filter the flight by it, which may be refused but must not fail."""
    found = Recipe.of(reading.load(path))
    log = path.with_name("flight.csv")
    log.write_text(text())
    with contextlib.suppress(FtprocError):
        given = {**found.reading(), "columns": None, "units": None}
        named = None if found.model == "none" else model_file.named("packaged")
        judge_trajectory(pipeline.filter_log(logs.read(log, **given), found.settings, named))
    return found


_READ: dict[str, Callable[[Path, dict[str, Any]], Any]] = {
    "log": _log,
    "truth": _truth,
    "model": _model,
    "station": _station,
}


def judge_trajectory(trajectory: Trajectory) -> None:
    """Finite states and positive, finite sigmas throughout; of a log without a component for which nothing stands, of
    the cleaned others."""
    cleaned, sigma = np.isfinite(trajectory.measurement), trajectory.measurement_sigma
    assert (np.isfinite(sigma) == cleaned).all(), "cleaned readings without sigmas, or sigmas without these"
    assert (sigma[cleaned] > 0).all(), "sigmas of cleaned readings that are not positive"
    summary = trajectory.metadata["summary"]
    if summary["not_observable"] and summary.get("height_m") is None:
        assert np.isnan(trajectory.state).all(), "states without all three components"
        return
    assert np.isfinite(trajectory.state).all(), "states that are not finite"
    assert np.isfinite(trajectory.sigma).all(), "sigmas that are not finite"
    assert (trajectory.sigma > 0).all(), "sigmas that are not positive"


@contextlib.contextmanager
def in_time(limit_s: int = LIMIT_S) -> Iterator[None]:
    """TimeoutError when the block takes longer."""

    def late(signum: int, frame: object) -> None:
        raise TimeoutError(f"took more than {limit_s} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(limit_s)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
