"""Stretches of a log and of an estimate."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.components import FARTHEST
from ftproc.core.filtering.records import FilterRun, Model
from ftproc.methods.estimate import ASSUMED_READING, MOST_INTERVALS, Estimate, Recording, typical_interval

N = 40


def estimate():
    count = np.arange(float(N))
    of_three, of_six, of_nine = (count[:, None] + np.arange(width) / 10 for width in (3, 6, 9))
    run = FilterRun(
        count, of_nine, of_nine, of_nine, of_three, of_three, of_three, count, of_six, of_six, count.astype(int), -7.0
    )
    label = (of_three % 4).astype(np.uint8)
    return Estimate(run, label, Model(np.ones(3), np.ones((1, 6))), reacquired=(3, 20, 39), known=count > 5)


@pytest.mark.parametrize(("low", "high"), [(0, N), (0, 20), (3, 39), (20, N)])
def test_rows_of_an_estimate_are_those_of_all_it_holds(low, high):
    whole, found = estimate(), estimate().rows(low, high)
    for name in FilterRun._fields[:-1]:
        np.testing.assert_array_equal(getattr(found.run, name), getattr(whole.run, name)[low:high])
    assert found.run.log_likelihood == whole.run.log_likelihood
    np.testing.assert_array_equal(found.label, whole.label[low:high])
    np.testing.assert_array_equal(found.known, whole.known[low:high])
    assert [low + k for k in found.reacquired] == [k for k in whole.reacquired if low <= k < high]


def test_a_stretch_of_a_log_keeps_the_logs_time_and_stands_in_for_what_is_absent():
    z = np.full((N, 3), 5.0)
    z[10, 0], z[:, 2] = 1e300, np.nan
    found = Recording(100 + np.arange(N) / 4, z, np.full(3, np.nan), absent=(2,)).part(slice(8, 20))
    np.testing.assert_array_equal(found.time_s, np.arange(8, 20) / 4)
    assert found.measurement[2, 0] == FARTHEST
    assert (found.measurement[:, 2] == ASSUMED_READING[2]).all()
    assert np.isnan(z[:, 2]).all()


@pytest.mark.parametrize("n", [2, 4, 1000, 3 * MOST_INTERVALS])
def test_typical_interval_is_the_median_wherever_the_log_begins(n):
    time_s = 1000 + np.arange(n) / 8
    time_s[n - n // 3 :] += 500.0  # a gap
    assert typical_interval(time_s) == 1 / 8


@pytest.mark.parametrize("n", [0, 1])
def test_fewer_than_two_samples_have_no_interval(n):
    assert typical_interval(np.ones(n)) == 0.0
