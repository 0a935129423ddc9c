"""The kept corpus, a few mutations, and that the judges see what is wrong."""

from __future__ import annotations

import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ftproc import pipeline
from tests.fuzz import kernel, mutation, targets
from tests.trust import cases

CORPUS = Path(__file__).parent / "corpus"
NAMES = sorted(targets.all_targets())


@pytest.mark.parametrize("name", NAMES)
def test_what_fuzzing_found_stays_right(name: str, tmp_path: Path) -> None:
    kept = sorted((CORPUS / name).iterdir())
    assert kept
    for path in kept:
        try:
            targets.judge(targets.all_targets()[name], path.read_bytes(), tmp_path)
        except Exception as error:
            raise AssertionError(f"{path.name}: {type(error).__name__}: {error}") from error


def test_the_corpus_is_of_the_targets() -> None:
    assert sorted(path.name for path in CORPUS.iterdir()) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_there_is_something_to_begin_with(name: str) -> None:
    assert len(targets.seeds(targets.all_targets()[name])) > 1


def test_a_short_fuzz() -> None:
    assert mutation.run(most=60) == (60, [])


def test_mutations_are_the_seed_s() -> None:
    one, two = (mutation.mutated(b"time_s,range_m\n0,1\n", random.Random(4)) for _ in range(2))
    assert one == two != b"time_s,range_m\n0,1\n"


def test_a_judge_that_sees(tmp_path: Path) -> None:
    """A reader that breaks on a letter is found out; so is one that refuses without a cure."""

    def breaks(path: Path) -> None:
        path.read_text().index("x")

    broken = replace(targets.all_targets()["csv"], check=breaks)
    targets.judge(broken, b"x", tmp_path)
    with pytest.raises(ValueError, match="substring not found"):
        targets.judge(broken, b"y", tmp_path)
    with pytest.raises(AssertionError, match="does not come back"):
        targets.judge(replace(broken, check=lambda path: targets.same(1j, 2j, "imag")), b"", tmp_path)


def test_bytes_become_readings() -> None:
    head, row = bytes([0, 5, 4, 0, 3, 0]), bytes([7]) + np.array([100, -32768, 32767], "<i2").tobytes()
    log = kernel.decoded(head + row + row + b"rest", "f")
    assert log is not None
    np.testing.assert_allclose(log.time_s, [7, 14])
    np.testing.assert_allclose(log.measurement, [[5100, np.nan, 1000.0]] * 2)
    assert kernel.decoded(head + row[:-1], "f") is None


@pytest.mark.parametrize("smooth", [False, True])
def test_a_variance_that_rounding_eats_stays_positive(smooth: bool) -> None:
    """Readings hours apart: of what was known before them, an update leaves less than its rounding."""
    content = (CORPUS / "kernel" / "found-384b1219").read_bytes()
    log = kernel.decoded(content, "log")
    assert log is not None
    settings = replace(kernel._settings(content), editing="none", smooth=smooth)
    cases.judge_trajectory(pipeline.filter_log(log, settings))
