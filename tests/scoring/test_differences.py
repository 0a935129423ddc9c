"""Two runs compared: rows, stretches, decisions and settings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ftproc.scoring import compare
from ftproc.scoring.differences import text
from tests.simulated import flown, trajectory_for

TRUTH = flown(outliers="none")
FIRST = trajectory_for(
    TRUTH, error_m=0.0, outlier=np.zeros((len(TRUTH), 3), np.uint8),
    metadata={"log": "a.csv", "method": "ukf", "settings": {"smooth": False, "gate": 4.0, "jerk_psd_m2ps5": [1.0]}},
    state=np.zeros((len(TRUTH), 9)), sigma=np.ones((len(TRUTH), 9)),
)  # fmt: skip


def moved(rows, by, **changes):
    state = FIRST.state.copy()
    state[rows, 0] += by
    return replace(FIRST, name="b.parquet", state=state, **changes)


def test_the_same_run_differs_nowhere():
    found = compare(FIRST, FIRST)
    assert (found.largest_m, found.largest_sigmas, found.stretches, found.changes, found.settings) == (0, 0, (), (), {})
    assert "nowhere by more than 1 sigma" in text(found)
    assert "decisions  the same" in text(found)


def test_stretches_are_where_it_differs_by_more_than_a_sigma():
    sigma = FIRST.sigma.copy()
    sigma[:, 0] = 2.0
    second = moved(slice(10, 15), 6.0, sigma=sigma)
    found = compare(FIRST, second)
    (stretch,) = found.stretches
    assert (stretch.from_s, stretch.to_s, stretch.rows) == (FIRST.time_s[10], FIRST.time_s[14], 5)
    assert (stretch.largest_m, stretch.largest_sigmas) == (6.0, 3.0)  # of the larger sigma of the two
    assert (found.largest_m, found.largest_time_s) == (6.0, FIRST.time_s[10])
    assert compare(FIRST, moved(slice(10, 15), 0.9)).stretches == ()


def test_near_stretches_are_one_and_far_ones_two():
    assert len(compare(FIRST, moved([10, 11, 14], 6.0)).stretches) == 1
    assert len(compare(FIRST, moved([10, 30], 6.0)).stretches) == 2


def test_changed_decisions_are_listed_by_runs():
    flags = FIRST.outlier.copy()
    flags[20:24, 1], flags[30, 0] = 2, 1
    found = compare(FIRST, replace(FIRST, outlier=flags)).changes
    assert [(c.component, c.readings, c.first, c.second) for c in found] == [
        ("azimuth", 4, "good", "patch"), ("range", 1, "good", "isolated"),
    ]  # fmt: skip
    back = compare(replace(FIRST, outlier=flags), FIRST).changes
    assert [(c.first, c.second) for c in back] == [("patch", "good"), ("isolated", "good")]


def test_settings_that_differ_are_named_and_lists_are_not():
    metadata = {**FIRST.metadata, "settings": {"smooth": True, "gate": 4.0, "jerk_psd_m2ps5": [2.0]}}
    assert compare(FIRST, replace(FIRST, metadata=metadata)).settings == {"smooth": (False, True)}


def test_rows_are_joined_by_number_in_one_log_and_else_by_time():
    part = moved(slice(0, 0), 0.0)
    rows = slice(5, 40)
    fields = ("row", "time_s", "measurement", "state", "sigma", "measurement_sigma", "outlier", "nis", "correction")
    part = replace(part, **{name: getattr(part, name)[rows] for name in fields})
    found = compare(FIRST, replace(part, time_s=part.time_s + 0.01))
    assert (found.rows, found.only_first, found.only_second) == (35, len(FIRST) - 35, 0)
    other = replace(part, metadata={"log": "other.csv"})
    assert compare(FIRST, other).rows == 35
    assert compare(FIRST, replace(other, time_s=part.time_s + 0.01)) is None


def test_of_many_changes_the_largest_are_listed():
    flags = FIRST.outlier.copy()
    flags[::3, 0] = 1
    said = text(compare(FIRST, replace(FIRST, outlier=flags)))
    assert said.count("decisions") == 13
    assert "smaller ones" in said


def test_rows_without_an_estimate_are_no_difference():
    state = FIRST.state.copy()
    state[:10] = np.nan
    found = compare(FIRST, replace(FIRST, state=state))
    assert found.largest_m == pytest.approx(0.0)
