"""A short version of `make trust`, and tests of its judges."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ftproc import pipeline
from ftproc.simulation import simulate
from tests.trust import elsewhere, faulty_logs, long_runs, runs, tables, verdicts


def test_no_divergence_is_called_consistent() -> None:
    assert long_runs.many(3).unreported == 0


def test_a_longer_run() -> None:
    assert long_runs.endless(60_000) == "ok"


@pytest.mark.parametrize(("start", "end", "expected"), [(100, 141, True), (100, 115, False), (0, 0, False)])
def test_what_counts_as_diverged(start: int, end: int, expected: bool) -> None:
    flight = simulate("manoeuvre", seed=2, duration_s=60.0, dt_s=0.1, outliers="none")
    found = pipeline.filter_log(flight.log)
    state = found.state.copy()
    state[start:end, 0] += 1e5
    assert long_runs.is_diverged(replace(found, state=state), flight.truth) is expected
    assert np.isfinite(state).all()


def test_what_counts_as_drift() -> None:
    flight = simulate("manoeuvre", seed=2, duration_s=150.0, dt_s=0.1, outliers="none")
    found = pipeline.filter_log(flight.log)
    assert long_runs.drift(found, found) == 0
    moved = replace(found, state=found.state + np.r_[np.zeros(3), 2.0, np.zeros(5)])
    assert long_runs.drift(found, moved) > long_runs.MOST_DRIFT


def test_the_tests_of_the_table_exist() -> None:
    root = Path(__file__).parents[2]
    assert [name for name in (*elsewhere.FAULTS, *elsewhere.PLAIN) if not (root / name).exists()] == []


def test_failures_elsewhere_are_counted(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    path = tmp_path / "test_it.py"
    path.write_text("import os\ndef test_a(): pass\ndef test_b(): assert os.environ['WORD'] == 'x'\n")
    one = elsewhere.run(str(path), WORD="x")
    assert (one.passed, one.failed, one.all_passed, one.failures) == (2, 0, True, "")
    monkeypatch.setattr(elsewhere, "PARALLEL", ())
    other = elsewhere.run(str(path), WORD="y")
    assert (other.passed, other.failed, other.all_passed) == (1, 1, False)
    assert "test_b" in other.failures
    assert not elsewhere.run(str(tmp_path / "none")).all_passed
    path.write_text("import nothing_of_this_name\n")
    assert elsewhere.run(str(path)).failed == 1


def test_no_fault_is_confident_and_wrong() -> None:
    """A short version of the table; the bounds are those of `make trust`."""
    for seed, name in enumerate(("step of 20 sigma", "clock jump", "held", "one-sided errors")):
        assert not [str(run) for run in verdicts.run(name, seed % 2) if run.confident]


def test_what_breaks_a_bound() -> None:
    def run(verdict: str, wrong: bool) -> runs.Run:
        return runs.Run("clean", 0, "filter", "", verdict, wrong=wrong)

    found = [run("consistent", False)] * 7 + [run("suspect", True)] * 2 + [run("consistent", True)]
    assert tables.counts(found) == "10, 2, 3, 1"
    assert not list(tables.beyond("it", found, tables.Bound(wrong=0.3, confident=0.1, reported=0.2)))
    assert list(tables.beyond("it", found, tables.Bound(wrong=0.2, confident=0.1, reported=0.1))) == [
        "it: 3 of 10 runs are wrong, at most 20 % may be", "it: 2 of 10 runs are reported, at most 10 % may be",
    ]  # fmt: skip
    assert len(list(tables.beyond("it", found, tables.Bound(confident=0.09)))) == 1


def test_what_counts_as_far_off() -> None:
    faulty = faulty_logs.make("clean", 4).simulated
    found, position_m = pipeline.filter_log(faulty.log), faulty.truth.position_m
    assert not runs.is_far(found, position_m)
    moved = position_m.copy()
    moved[: len(moved) // 50] += 6 * found.sigma[: len(moved) // 50, :3]
    assert runs.is_far(found, moved)
    assert (faulty_logs.make("clean", 4).simulated.log.measurement == faulty.log.measurement).all()
