"""The truth at the times of a trajectory."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ftproc.errors import InputError
from ftproc.records import Truth
from ftproc.scoring import score
from ftproc.scoring.matching import match
from tests.simulated import trajectory_for


def line(time_s: list[float], velocity: bool = True, flags: list[int] | None = None) -> Truth:
    """A cubic flight: x = t^3, y = t, z = 5 (linear between knots without velocity)."""
    t = np.array(time_s)
    position = np.stack([t**3, t, np.full(len(t), 5.0)], axis=1)
    speed = np.stack([3 * t**2, np.ones(len(t)), np.zeros(len(t))], axis=1)
    outlier = None if flags is None else np.array([[f] * 3 for f in flags], np.uint8)
    return Truth("line", t, position, speed if velocity else None, outlier=outlier)


def test_interpolation_with_velocity_is_exact_for_a_cubic() -> None:
    time = np.array([-0.1, 0.0, 0.3, 1.0, 1.7, 4.9, 5.0, 5.1])
    found = match(time, line([0.0, 1.0, 2.0, 5.0]))
    inside = (time >= 0) & (time <= 5)
    np.testing.assert_allclose(found.position_m[inside, 0], time[inside] ** 3, atol=1e-12)
    assert found.velocity_mps is not None
    np.testing.assert_allclose(found.velocity_mps[inside, 0], 3 * time[inside] ** 2, atol=1e-12)
    assert np.isnan(found.position_m[~inside]).all()
    np.testing.assert_array_equal(found.exact, [False, True, False, True, False, False, True, False])
    np.testing.assert_array_equal(found.interpolated, [False, False, True, False, True, True, False, False])


def test_interpolation_without_velocity_is_linear() -> None:
    found = match(np.array([0.5, 1.25]), line([0.0, 1.0, 2.0], velocity=False))
    np.testing.assert_allclose(found.position_m[:, 0], [0.5, 1.0 + 0.25 * 7])
    assert found.velocity_mps is None


def test_counts_of_matched_interpolated_and_unmatched() -> None:
    truth = line([0.0, 1.0, 2.0, 3.0])
    t = trajectory_for(line([-1.0, 0.0, 0.5, 1.0, 2.5, 3.0, 4.0]), measurement=np.zeros((7, 3)))
    found = score(t, truth)
    assert (found.samples, found.matched, found.interpolated, found.unmatched) == (7, 3, 2, 2)


def test_kth_of_equal_times_matches_the_kth() -> None:
    truth = line([0.0, 1.0, 1.0, 1.0, 2.0], flags=[0, 1, 2, 3, 0])
    truth.position_m[:, 2] = [0.0, 10.0, 20.0, 30.0, 40.0]
    found = match(np.array([1.0, 1.0, 2.0, 2.0]), truth)
    np.testing.assert_array_equal(found.position_m[:, 2], [10.0, 20.0, 40.0, 40.0])
    np.testing.assert_array_equal(found.exact, [True, True, True, False])  # the truth has one row at 2 s
    np.testing.assert_array_equal(found.interpolated, [False, False, False, True])
    assert found.outlier is not None
    np.testing.assert_array_equal(found.outlier[:, 0], [1, 2, 0, 0])


def naive_gap(t: float, theirs: list[int]) -> bool:
    """Whether a time lies in a gap that is far longer than the intervals around it."""
    knots = sorted(set(theirs))
    steps = [b - a for a, b in itertools.pairwise(knots)]
    for k, (low, high) in enumerate(itertools.pairwise(knots)):
        if low < t < high:
            around = [steps[min(max(j, 0), len(steps) - 1)] for j in range(k - 5, k + 6)]
            return steps[k] > 5 * sorted(around)[5]
    return False


@given(
    st.lists(st.integers(0, 12), max_size=25).map(sorted),
    st.lists(st.integers(0, 12), max_size=25).map(sorted),
)
def test_matching_equals_the_naive_one(ours: list[int], theirs: list[int]) -> None:
    truth = line([float(t) for t in theirs], flags=[k % 7 for k in range(len(theirs))])
    truth = replace(truth, outlier=np.array([[k % 7] * 3 for k in range(len(theirs))], np.uint8).reshape(-1, 3))
    found = match(np.array(ours, float), truth)
    assert found.outlier is not None
    for i, t in enumerate(ours):
        before = ours[:i].count(t)
        rows = [k for k, u in enumerate(theirs) if u == t]
        if before < len(rows):
            assert found.exact[i]
            assert found.outlier[i, 0] == rows[before] % 7
        else:
            assert not found.exact[i]
            covered = bool(theirs) and theirs[0] <= t <= theirs[-1] and not naive_gap(t, theirs)
            assert found.interpolated[i] == covered
        if theirs and theirs[0] <= t <= theirs[-1] and not naive_gap(t, theirs):
            assert found.position_m[i, 1] == pytest.approx(t)
        else:
            assert np.isnan(found.position_m[i]).all()


def test_times_printed_with_fewer_digits_are_the_same_times() -> None:
    truth = line([0.1, 0.2, 0.30000000000000004, 1.7e9 + 0.1], flags=[1, 2, 3, 4])
    found = match(np.array([0.1, 0.2, 0.3, float(f"{1.7e9 + 0.1:.7f}")]), truth)
    assert found.exact.all()
    assert not match(np.array([0.1001]), truth).exact.any()


def test_flags_count_only_where_the_truth_has_that_sample() -> None:
    truth = line([0.0, 1.0, 2.0, 3.0], flags=[1, 0, 1, 0])
    t = trajectory_for(
        line([0.0, 0.5, 1.0, 2.5]), measurement=np.zeros((4, 3)), outlier=np.ones((4, 3), np.uint8)
    )  # fmt: skip
    found = score(t, truth).outliers
    assert found is not None
    assert (found["range"].true_positives, found["range"].false_positives) == (1, 1)
    assert found["range"].false_negatives == found["range"].true_negatives == 0


def test_truth_with_holes_is_bridged_or_unmatched() -> None:
    truth = line([0.0, 1.0, 2.0, 3.0])
    truth.position_m[1] = np.nan
    found = match(np.array([0.5, 1.0, 2.0]), truth)
    assert np.isfinite(found.position_m[0]).all()  # between 0 s and 2 s
    assert np.isnan(found.position_m[1]).all()
    t = trajectory_for(line([0.0, 1.0, 2.0]), measurement=np.zeros((3, 3)), state=np.zeros((3, 9)))
    scored = score(t, truth)
    assert (scored.matched, scored.unmatched) == (2, 1)
    truth.position_m[:] = np.nan
    assert score(t, truth).unmatched == 3


def test_truths_own_gradient_is_taken_at_the_matched_samples() -> None:
    truth = line([0.0, 1.0, 2.0, 3.0])
    t = trajectory_for(line([0.0, 2.0, 9.0]), measurement=np.zeros((3, 3)))
    found = score(t, truth).truth_average_gradient
    assert found is not None
    r = [math.hypot(x**3, x, 5.0) for x in (0.0, 2.0)]
    assert found.range_m == pytest.approx(r[1] - r[0])


@pytest.mark.parametrize("velocity", [False, True])
def test_a_gap_in_the_truth_is_not_bridged(velocity: bool) -> None:
    times = [k / 10 for k in range(101) if not 40 < k < 60]
    found = match(np.linspace(0, 10, 101), line(times, velocity))
    without = np.isnan(found.position_m).any(axis=1)
    assert np.flatnonzero(without).tolist() == list(range(41, 60))
    assert not found.interpolated[without].any()
    assert found.exact[[40, 60]].all()


def test_a_truth_of_two_rates_and_a_lost_row_or_two_are_bridged() -> None:
    times = [k / 10 for k in range(50) if k not in (20, 21)] + [5.0 + k for k in range(20)]
    assert np.isfinite(match(np.linspace(0, 24, 500), line(times)).position_m).all()


def test_a_truth_of_another_time_is_refused() -> None:
    trajectory = trajectory_for(line([0.0, 1.0, 2.0]), measurement=np.zeros((3, 3)))
    with pytest.raises(InputError, match=r"line: its times, 2000 s to 2001 s, do not overlap .*, 0 s to 2 s\."):
        score(trajectory, line([2000.0, 2001.0]))
