"""The scales of a log."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering.records import Observations, Sites, Uneven
from ftproc.core.identification.scales import EXACT, FINEST, SHORTEST_S, scales_of

NOISE = np.array([3.0, 1e-3, 2e-3]) ** 2


def log(time_s, range_m, weight=None, **more):
    z = np.column_stack([range_m, np.zeros((len(time_s), 2))])
    return Observations(np.asarray(time_s, float), z, np.ones(z.shape) if weight is None else weight, **more)


def test_interval_range_and_noise_are_typical_of_the_readings_used():
    weight = np.ones((6, 3))
    weight[4, 0] = 0.0
    found = scales_of(log([0, 0, 2, 4, 6, 26], [1000.0, 1000, 2000, np.nan, 1e9, 3000], weight), NOISE)
    assert found.interval_s == 2.0
    assert found.span_s == 26.0
    assert found.range_m == 1500.0
    np.testing.assert_allclose(found.noise_m, [3.0, 1.5, 3.0])
    assert found.typical_noise_m == 3.0
    assert not found.exact.any()


def test_without_ranges_or_times_the_units_are_one():
    found = scales_of(log([5.0, 5.0], [np.nan, np.nan]), NOISE)
    assert (found.interval_s, found.span_s, found.range_m) == (1.0, 1.0, 1.0)
    np.testing.assert_allclose(found.noise_m, np.sqrt(NOISE))


def test_a_component_without_noise_says_nothing_of_the_noise():
    found = scales_of(log(np.arange(5), np.full(5, 1000.0)), NOISE * [0.0, 1.0, 1.0])
    assert list(found.exact) == [True, False, False]
    assert found.noise_m[0] == FINEST * 1000
    assert found.typical_noise_m == 1.5
    nearly = scales_of(log(np.arange(5), np.full(5, 1000.0)), NOISE * [EXACT**2, 1.0, 1.0])
    assert not nearly.exact.any()


def test_uneven_noise_is_that_of_the_median_reading():
    times, late = np.full((5, 3), 4.0), np.zeros((5, 3))
    times[0] = 100.0
    late[:, 0] = 8.0
    found = scales_of(log(np.arange(5), np.full(5, 1000.0), uneven=Uneven(times, late)), NOISE)
    np.testing.assert_allclose(found.noise_m, [10.0, 2.0, 4.0])


def test_stations_count_by_the_components_that_are_used():
    weight = np.ones((4, 3))
    weight[[0, 2], 0] = 0.0  # the first station has no range
    sites = Sites(np.array([0, 1, 0, 1]), np.zeros((2, 3)), np.tile(np.eye(3), (2, 1, 1)), np.array([1000.0, 3000.0]))
    found = scales_of(log(np.arange(4), np.ones(4), weight, sites=sites), np.tile(NOISE, (2, 1)))
    assert found.range_m == 2000.0
    assert (found.interval_s, found.span_s) == (1.0, 3.0)
    np.testing.assert_allclose(np.sort(found.noise_m), [1.0, 2.0, 3.0, 3.0, 6.0])


@pytest.mark.parametrize("seconds", [1.0, 60.0])
@pytest.mark.parametrize("metres", [1.0, 0.3048])
def test_memory_is_the_same_in_other_units(metres, seconds):
    plain = scales_of(log(np.arange(10), np.full(10, 1000.0)), NOISE)
    other = scales_of(
        log(np.arange(10) / seconds, np.full(10, 1000.0 / metres)), NOISE / np.array([metres**2, 1.0, 1.0])
    )
    jerk = 7.0
    assert plain.jerk_psd(plain.memory_s(jerk)) == pytest.approx(jerk)
    assert plain.memory_s(jerk) == pytest.approx((plain.typical_noise_m**2 / jerk) ** (1 / 6))
    assert other.memory_s(jerk / metres**2 * seconds**5) * seconds == pytest.approx(plain.memory_s(jerk))


def test_times_that_are_all_but_one_still_have_an_interval():
    found = scales_of(log([0.0, 3e-279, 1e-276, 1.0], np.full(4, 1000.0)), NOISE)
    assert found.interval_s == SHORTEST_S
    for memories in (0.1, 2.0, 30.0):
        jerk_psd = found.jerk_psd(memories * found.interval_s)
        assert np.isfinite(jerk_psd)
        assert found.memory_samples(jerk_psd) == pytest.approx(memories)
