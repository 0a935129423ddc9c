"""Verdicts on a run."""

import numpy as np
import pytest
from scipy import stats

from ftproc import pipeline
from ftproc.quality import consistency, summary
from ftproc.settings import FilterSettings
from tests.simulated import simulate


def scatter(scaled):
    return consistency.scatter(float(scaled @ scaled), len(scaled))


@pytest.mark.parametrize(("size", "verdict"), [(0.5, "cautious"), (1.0, "consistent"), (1.5, "overconfident")])
def test_verdict_of_many_innovations(size, verdict):
    found = scatter(size * np.random.default_rng(0).standard_normal(5000))
    assert found["verdict"] == verdict
    assert found["innovation_ratio"] == pytest.approx(size, rel=0.05)
    assert found["innovation_bounds"] == [pytest.approx(0.8), pytest.approx(1.2)]


def test_few_innovations_have_wide_bounds():
    """99 % of honest filters with 20 readings lie within."""
    rng = np.random.default_rng(1)
    said = [scatter(rng.standard_normal(20))["verdict"] for _ in range(2000)]
    assert 0.97 < said.count("consistent") / 2000 < 1


def test_no_innovation_says_nothing():
    assert consistency.scatter(0.0, 0)["verdict"] == "not observable"
    assert consistency.scatter(2.0, 2)["innovation_ratio"] == 1.0


def test_blind_stretches_are_named_with_their_worst_sigma():
    sigma = np.ones((100, 3))
    sigma[40:50, 2], sigma[45, 0], sigma[99] = 50.0, 300.0, 60.0
    first, last = consistency.blind_stretches(10.0 + np.arange(100), sigma)
    assert (first["from_s"], first["to_s"]) == (50.0, 59.0)
    assert first["sigma_m"] == pytest.approx(np.sqrt(300**2 + 1 + 50**2))
    assert (last["from_s"], last["to_s"]) == (109.0, 109.0)


def test_at_most_twenty_stretches_the_longest():
    sigma = np.ones((300, 3))
    for k in range(30):
        sigma[10 * k : 10 * k + 1 + k // 10] = 99.0
    found = consistency.blind_stretches(np.arange(300.0), sigma)
    assert len(found) == consistency.MOST_BLIND
    assert found == sorted(found, key=lambda s: s["from_s"])
    assert all(s["to_s"] > s["from_s"] for s in found)


def test_log_without_range_for_half_a_minute_is_called_hardly_observable():
    flight = simulate("manoeuvre-clean", seed=4, duration_s=60.0, dt_s=0.1)
    flight.log.measurement[200:500] = np.nan
    trajectory = pipeline.filter_log(flight.log)
    (stretch,) = trajectory.metadata["summary"]["hardly_observable"]
    assert 20 < stretch["from_s"] < stretch["to_s"] < 53
    assert "the position is hardly observable: 1 sigma up to" in summary.text(trajectory.metadata)


def test_gate_that_cannot_fire_is_reported():
    """One reading in a minute of a turning target: whatever comes fits the prediction."""
    flight = simulate("manoeuvre-clean", seed=2, duration_s=120.0, dt_s=0.5)
    settings = FilterSettings(noise=(0.01, 1e-6, 1e-6), jerk_psd_m2ps5=1e4)
    text = summary.text(pipeline.filter_log(flight.log, settings).metadata)
    assert "gate can hardly fire: predictions are" in text


def test_usual_flight_has_no_such_remarks():
    text = summary.text(pipeline.filter_log(simulate("manoeuvre-clean", seed=3, duration_s=60.0).log).metadata)
    assert "hardly" not in text


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
