"""Thinned lines: the extremes of each pixel column, found by walking along; breaks at gaps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ftproc.report.thinning import COLUMNS, Timeline


def walked(time_s, value, columns):
    """Rows at which a value is the first least or greatest of its column, one by one."""
    edges = [time_s[0] + k * (time_s[-1] - time_s[0]) / columns for k in range(columns)]
    best = {}
    for row, (t, v) in enumerate(zip(time_s, value, strict=True)):
        column = sum(t >= edge for edge in edges)
        if np.isfinite(v):
            low, high = best.get(column, (row, row))
            best[column] = (row if v < value[low] else low, row if v > value[high] else high)
    return sorted({row for pair in best.values() for row in pair})


values = st.one_of(st.floats(-5, 5).map(lambda v: round(v, 1)), st.just(np.nan))


@settings(max_examples=60)
@given(st.lists(st.tuples(st.integers(0, 40), values), min_size=9, max_size=60))
def test_extremes_are_those_found_by_walking(rows):
    time_s = np.sort(np.array([t for t, _ in rows], float))
    value = np.array([v for _, v in rows])
    timeline = Timeline.of(time_s, columns=4)
    assert timeline.thinned
    np.testing.assert_array_equal(timeline.extremes(value), walked(time_s, value, 4))


def test_a_short_log_keeps_every_value():
    time_s, value = np.arange(8.0), np.array([1, 2, np.nan, 4, 4, 4, 1, 0])
    timeline = Timeline.of(time_s, columns=4)
    assert not timeline.thinned
    np.testing.assert_array_equal(timeline.extremes(value), [0, 1, 3, 4, 5, 6, 7])


def test_no_extreme_is_lost_in_a_long_log():
    rng = np.random.default_rng(0)  # of irregular times, whose intervals are often above thrice their median
    time_s, value = np.sort(rng.uniform(0, 1e4, 100_000)), rng.standard_normal(100_000)
    value[50_000] = 99.0
    timeline = Timeline.of(time_s)
    x, y = timeline.line(value)
    assert len(x) <= 2 * COLUMNS
    assert y.max() == 99.0
    assert y.min() == value.min()
    assert x[y.argmax()] == time_s[50_000]
    assert (np.diff(x) >= 0).all()


def test_several_values_share_their_samples():
    timeline = Timeline.of(np.arange(100.0), columns=1)
    up, down = np.arange(100.0), np.where(np.arange(100) == 40, -1.0, 0.0)
    np.testing.assert_array_equal(timeline.extremes(up, down), [0, 40, 99])


@pytest.mark.parametrize("columns", [2, 100])
def test_line_breaks_at_gaps_and_missing_values(columns):
    time_s = np.r_[np.arange(10.0), 30 + np.arange(10.0)]
    value = np.r_[np.arange(10.0), 20 + np.arange(10.0)]
    timeline = Timeline.of(time_s, columns)
    x, y = timeline.line(value)
    assert np.flatnonzero(np.isnan(x)).tolist() == np.flatnonzero(np.isnan(y)).tolist()
    assert np.isnan(y).sum() == 1
    assert y[np.flatnonzero(np.isnan(y)) - 1] == 9.0
    value[4] = np.nan
    assert np.isnan(timeline.line(value)[1]).sum() == 2
    assert np.isnan(timeline.line(value, over_missing=True)[1]).sum() == 1


def test_times_of_one_instant_have_no_gaps():
    timeline = Timeline.of(np.full(5, 3.0))
    np.testing.assert_array_equal(timeline.line(np.arange(5.0))[1], np.arange(5.0))
    assert Timeline.of(np.array([3.0])).line(np.array([1.0]))[1].tolist() == [1.0]


def test_means_over_intervals():
    time_s, value = np.arange(8.0), np.array([1, 3, np.nan, 5, 7, 9, 11, 13])
    middle, total, count = Timeline.of(time_s).means(value, 2)
    np.testing.assert_allclose(middle, [1.75, 5.25])
    np.testing.assert_allclose(total, [9, 40])
    np.testing.assert_allclose(count, [3, 4])
