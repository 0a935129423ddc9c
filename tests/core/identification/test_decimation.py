"""Merged readings: against plain means, and as good as the readings one by one."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ftproc.core.filtering.records import Observations, Scalars
from ftproc.core.filtering.smoother import score_log
from ftproc.core.identification import decimation
from ftproc.core.identification.scales import Scales, scales_of
from ftproc.core.model.motion import isotropic
from tests.core.tracks import matched


def plain_means(time, z, count):
    groups = [slice(k, k + count) for k in range(0, len(time), count)]
    return np.array([time[g].mean() for g in groups]), np.array([z[g].mean(0) for g in groups])


def test_complete_groups_are_plain_means():
    a = matched(1, 120)
    (time, z, number, *_), starts = decimation.merge(a.log, a.starts, 4)
    unwrapped = np.column_stack([a.z[:, 0], np.unwrap(a.z[:, 1]), a.z[:, 2]])
    expected_time, expected = plain_means(a.time, unwrapped, 4)
    np.testing.assert_allclose(time, expected_time, rtol=1e-12)
    np.testing.assert_allclose(z[:, [0, 2]], expected[:, [0, 2]], rtol=1e-12)
    np.testing.assert_allclose(np.sin(z[:, 1] - expected[:, 1]), 0, atol=1e-12)
    np.testing.assert_array_equal(number, 4)
    assert starts[0].sample == 0


def test_mean_of_some_is_moved_to_the_time_of_all():
    """A steady motion whose last reading of a group is missing: still on the line."""
    time = 0.1 * np.arange(40)
    z = np.stack([1000 + 50 * time, 3.1 + 0.02 * time, 0.3 + 0.01 * time], 1)
    z[:, 1] = (z[:, 1] + np.pi) % (2 * np.pi) - np.pi
    weight = np.ones_like(z)
    weight[3, 0] = weight[11, 1] = weight[22, 2] = 0
    start = matched(1, 40).starts[0]
    (t, merged, number, *_), _ = decimation.merge(Observations(time, z, weight), [start], 4)
    np.testing.assert_allclose(merged[:, 0], 1000 + 50 * t, atol=0.9)
    np.testing.assert_allclose(merged[1:-1, 0], 1000 + 50 * t[1:-1], atol=1e-9)
    np.testing.assert_allclose(np.sin(merged[:, 1] - 3.1 - 0.02 * t), 0, atol=4e-4)
    assert number[0, 0] == number[2, 1] == number[5, 2] == 3


@pytest.mark.parametrize("every", [1, 2, 4])
def test_what_is_beside_is_moved_to_the_time_of_all(every):
    """Of a target that accelerates rates are right at their own times alone."""
    time = 0.1 * np.arange(40)
    a = matched(1, 40)
    weight = (np.arange(40) % every == 0).astype(float)
    rates = Scalars.rates(100 - 30 * time, 0.04, weight)
    log = Observations(time, a.z, a.weight, beside=(rates,))
    short, _ = decimation.merge(log, a.starts, 4)
    t, (merged,) = short.time_s, short.beside
    np.testing.assert_allclose(merged.value[1:-1], 100 - 30 * t[1:-1], atol=1e-9)
    np.testing.assert_array_equal(merged.weight, 4 / every)
    np.testing.assert_array_equal(merged.variance, 0.04)


def test_logs_whose_rates_are_seldom_seen_stay_as_they_are():
    a = matched(1, 40)
    rates = Scalars.rates(np.zeros(40), 1.0, (np.arange(40) % 2 == 0).astype(float))
    log = a.log._replace(beside=(rates,))
    assert decimation.merged(log, a.starts, 4)[0] is log
    often = log._replace(beside=(rates._replace(weight=np.ones(40)),))
    assert len(decimation.merged(often, a.starts, 4)[0].time_s) == 10


def test_missing_group_stays_missing_and_a_gap_ends_one():
    a = matched(2, 60)
    weight, time = a.weight.copy(), a.time.copy()
    weight[8:12, 1] = 0
    time[30:] += 100.0
    (t, z, number, *_), _ = decimation.merge(Observations(time, a.z, weight), a.starts, 4)
    assert np.isnan(z[2, 1])
    assert number[2, 1] == 0
    assert not ((t > time[29] + 1) & (t < time[30])).any()


def test_start_within_the_log_begins_a_group():
    a = matched(2, 60)
    second = a.starts[0]._replace(sample=30)
    _, starts = decimation.merge(a.log, [a.starts[0], second], 8)
    assert [s.sample for s in starts] == [0, 4]


@pytest.mark.compiled
def test_score_of_the_jerk_is_that_of_single_readings():
    """The likelihood by jerk, of merged readings and of single ones, has its summit at the same place."""
    a = matched(5, 4000)

    def slope(log, starts, factor):
        model = a.model._replace(jerk=factor * a.model.jerk)
        return score_log(log, model, starts).jerk.score.sum()

    log, starts = decimation.merge(a.log, a.starts, 2)
    for factor in (0.3, 3.0):
        assert slope(log, starts, factor) * slope(a.log, a.starts, factor) > 0
    single, merged = (slope(x, s, 1.0) for x, s in ((a.log, a.starts), (log, starts)))
    assert abs(merged - single) < 0.25 * abs(slope(a.log, a.starts, 3.0))


@pytest.mark.parametrize(("interval", "expected"), [(1.0, 1), (0.05, 1), (0.005, 13)])
def test_only_dense_logs_are_merged(interval, expected):
    a = matched(1, 100)
    model = a.model._replace(noise_variance=np.array([1.0, 1e-8, 1e-8]), jerk=isotropic(10.0))
    scales = Scales(interval, 10_000 * interval, 10_000.0, np.ones(3))
    many = decimation.how_many(scales, model, 4.0)
    assert many == pytest.approx(expected, abs=3)
    assert many >= 1


@pytest.mark.parametrize("knot_s", [0.5, 2.0, 8.0, np.inf])
def test_no_more_is_merged_than_memory_and_knots_bear(knot_s):
    """A long memory, so that it is the knots that say how many; without knots the memory says it."""
    scales = Scales(0.01, 100.0, 1000.0, np.full(3, 10.0))
    model = matched(1, 10, q=1e-3).model
    memory_s = scales.memory_s(1e-3)
    count = decimation.how_many(scales, model, knot_s)
    bound = min(decimation.SHARE * memory_s, knot_s / decimation.PER_KNOT) / scales.interval_s
    assert count == int(np.clip(bound + decimation.ROUNDING, 1, decimation.MOST))
    short = scales._replace(span_s=2.5 * decimation.FEWEST * scales.interval_s)
    assert decimation.how_many(short, model, knot_s) == min(count, 2)
    assert decimation.how_many(scales, model._replace(markov_variance=np.ones(3)), knot_s) == 1


def test_components_that_are_seen_seldom_are_not_merged_and_no_mean_stands_at_a_wrong_time():
    a = matched(3, 120)
    assert len(decimation.merged(a.log, a.starts, 4)[0].time_s) == 30
    weight = a.weight.copy()
    weight[np.arange(120) % 3 > 0, 1:] = 0.0
    seldom = a.log._replace(weight=weight)
    assert decimation.merged(seldom, a.starts, 4)[0] is seldom
    weight = a.weight.copy()
    weight[4:12, 1], weight[[0, 13], 1] = 0.0, 0.0  # neither neighbour says how far azimuth has gone
    (_, z, *_), _ = decimation.merge(a.log._replace(weight=weight), a.starts, 2)
    assert np.isnan(z[6, 1])


def test_readings_without_any_motion_or_noise_are_not_divided_by_nothing():
    a = matched(0, 60, q=1e-2)
    still = a.model._replace(jerk=np.zeros((1, 3)))
    scales = scales_of(a.log, a.model.noise_variance)
    assert decimation.how_many(scales, still, math.inf) >= 1
