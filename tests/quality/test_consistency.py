"""Consistency of the innovations, and where the position is poorly observable."""

import numpy as np
import pytest
from scipy import stats

from ftproc import pipeline
from ftproc.quality import consistency, summary
from ftproc.settings import FilterSettings
from tests.simulated import simulate


def judged(scaled):
    return consistency.innovation_test(float(scaled @ scaled), len(scaled))


@pytest.mark.parametrize(("size", "verdict"), [(0.5, "cautious"), (1.0, "consistent"), (1.5, "overconfident")])
def test_verdict_of_many_innovations(size, verdict):
    found = judged(size * np.random.default_rng(0).standard_normal(5000))
    assert found["verdict"] == verdict
    assert found["innovation_ratio"] == pytest.approx(size, rel=0.05)
    assert found["innovation_bounds"] == [pytest.approx(0.8), pytest.approx(1.2)]


def test_few_innovations_have_wide_bounds():
    """99 % of consistent filters with 20 readings lie within."""
    rng = np.random.default_rng(1)
    verdicts = [judged(rng.standard_normal(20))["verdict"] for _ in range(2000)]
    assert 0.97 < verdicts.count("consistent") / 2000 < 1


def test_no_innovation_decides_nothing():
    assert consistency.innovation_test(0.0, 0)["verdict"] == "not observable"
    assert consistency.innovation_test(2.0, 2)["innovation_ratio"] == 1.0


def test_poorly_observable_intervals_have_their_largest_sigma():
    sigma = np.ones((100, 3))
    sigma[40:50, 2], sigma[45, 0], sigma[99] = 50.0, 300.0, 60.0
    first, last = consistency.poorly_observable(10.0 + np.arange(100), sigma)
    assert (first["from_s"], first["to_s"]) == (50.0, 59.0)
    assert first["sigma_m"] == pytest.approx(np.sqrt(300**2 + 1 + 50**2))
    assert (last["from_s"], last["to_s"]) == (109.0, 109.0)


def test_at_most_twenty_intervals_the_longest():
    sigma = np.ones((300, 3))
    for k in range(30):
        sigma[10 * k : 10 * k + 1 + k // 10] = 99.0
    found = consistency.poorly_observable(np.arange(300.0), sigma)
    assert len(found) == consistency.MOST_INTERVALS
    assert found == sorted(found, key=lambda s: s["from_s"])
    assert all(s["to_s"] > s["from_s"] for s in found)


def test_half_a_minute_without_readings_is_poorly_observable():
    flight = simulate("manoeuvre-clean", seed=4, duration_s=60.0, dt_s=0.1)
    flight.log.measurement[200:500] = np.nan
    trajectory = pipeline.filter_log(flight.log)
    (interval,) = trajectory.metadata["summary"]["poorly_observable"]
    assert 20 < interval["from_s"] < interval["to_s"] < 53
    assert "the position is poorly observable from" in summary.text(trajectory.metadata)


def test_a_gate_that_detects_little_is_reported():
    """With so large a process noise every reading fits the prediction."""
    flight = simulate("manoeuvre-clean", seed=2, duration_s=120.0, dt_s=0.5)
    settings = FilterSettings(noise=(0.01, 1e-6, 1e-6), jerk_psd_m2ps5=1e4)
    text = summary.text(pipeline.filter_log(flight.log, settings).metadata)
    assert "is poorly observable: its predicted sigma is" in text


def test_an_ordinary_flight_has_no_such_remark():
    text = summary.text(pipeline.filter_log(simulate("manoeuvre-clean", seed=3, duration_s=60.0).log).metadata)
    assert "observable" not in text


def test_bounds_of_nis_are_those_of_chi_square_until_they_are_narrow():
    freedom = np.array([0.0, 12.0, 30.0, 90.0, 3e5])
    low, high = consistency.nis_bounds(freedom)
    assert np.isnan(low[0])
    assert np.isnan(high[0])
    # what 99 % of chi-square variables lie between, from SciPy; at 90 the wider of the two
    np.testing.assert_allclose(low[1:3], stats.chi2.ppf(0.005, freedom[1:3]), rtol=0.02)
    np.testing.assert_allclose(high[1:4], stats.chi2.ppf(0.995, freedom[1:4]), rtol=0.02)
    assert low[4] == pytest.approx(0.64 * freedom[4])
    assert high[4] == pytest.approx(1.44 * freedom[4])


def test_stretches_that_the_estimate_leaves():
    rng, time = np.random.default_rng(4), np.arange(400) * 0.5
    squares = rng.standard_normal(400) ** 2
    assert consistency.left_behind(time, squares) == []
    lone = squares.copy()
    lone[::3] = 1e4  # a third of the readings is not the bulk
    assert consistency.left_behind(time, lone) == []
    squares[100:160] = (12 + rng.standard_normal(60)) ** 2
    (found,) = consistency.left_behind(time, squares)
    assert 42 < found["from_s"] < 50
    assert 79 < found["to_s"] < 88
    assert found["sigmas"] == pytest.approx(12, abs=1)
    assert consistency.left_behind(time[:20], np.full(20, 1e4)) == []
