"""Errors on one side: found in noise of every scale, its place too; and nothing in noise of any symmetric shape."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from ftproc.core.filtering.records import Observations
from ftproc.core.identification import one_sided

FINE = np.zeros(3)


def residuals(noise):
    """A log and what a smoother leaves of it, these residuals (n,) in each component."""
    n = len(noise)
    scale = np.array([5.0, 1e-3, 2e-4])
    residual = noise[:, None] * scale
    run = residual, np.tile(scale**2 * noise.var(), (n, 1))
    return Observations(np.arange(float(n)), residual, np.ones((n, 3))), run, scale


@pytest.mark.parametrize("share", [0.35, 0.55])
@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("shape", ["exponential", "half normal"])
def test_the_share_and_the_place_are_found(shape, side, share):
    draw = np.random.default_rng(1)
    n, size = 3000, 6.0
    error = draw.exponential(size, n) if shape == "exponential" else np.abs(size * draw.standard_normal(n))
    noise = draw.standard_normal(n) + side * (draw.random(n) < share) * error
    middle = noise.mean()
    log, run, scale = residuals(noise - middle)
    found = one_sided.find(log.weight, *run, FINE)
    assert [one.component for one in found] == [0, 1, 2]
    for one in found:
        assert one.share == pytest.approx(share, abs=0.15)
        assert one.error * side > 0
        assert one.shift / scale[one.component] == pytest.approx(middle, abs=0.35)
        assert 0 < one.sigma < 0.3 * abs(one.shift)
    moved = log.measurement - one_sided.without(log, found).measurement
    np.testing.assert_allclose(moved, np.tile([one.shift for one in found], (len(noise), 1)), atol=1e-12)


@pytest.mark.parametrize("shape", ["normal", "student", "spikes"])
def test_symmetric_errors_are_left_alone(shape):
    draw = np.random.default_rng(2)
    noise = draw.standard_t(4, 4000) if shape == "student" else draw.standard_normal(4000)
    noise += (draw.random(4000) < 0.1) * 8 * draw.standard_normal(4000) if shape == "spikes" else 0.0
    log, run, _ = residuals(noise)
    assert one_sided.find(log.weight, *run, FINE) == []


def test_two_equal_peaks_are_said_but_not_leant_on():
    draw = np.random.default_rng(3)
    log, run, _ = residuals(draw.standard_normal(2000) + 4.0 * draw.choice([-1, 1], 2000))
    found = one_sided.find(log.weight, *run, FINE)
    assert [one.shift for one in found] == [0.0, 0.0, 0.0]


def test_flat_errors_of_coarse_rounding_are_no_fault():
    draw = np.random.default_rng(4)
    noise = draw.uniform(-1, 1, 4000)
    log, run, scale = residuals(noise)
    assert one_sided.find(log.weight, *run, FINE) != []
    assert one_sided.find(log.weight, *run, scale / np.sqrt(3)) == []


def plainly(residual, theta, both):
    """The log-likelihood as scipy has it: normal noise, to which exponential errors add now and then."""
    place, sigma, share, error = theta[0], np.exp(theta[1]), 1 / (1 + np.exp(-theta[2])), np.exp(theta[3])
    x = residual - place
    sides = [stats.exponnorm.logpdf(sign * x, error / sigma, scale=sigma) for sign in ((1, -1) if both else (1,))]
    wrong = [np.log(share / len(sides)) + side for side in sides]
    return np.logaddexp.reduce([np.log(1 - share) + stats.norm.logpdf(x, scale=sigma), *wrong]).sum()


@pytest.mark.parametrize("both", [False, True])
@pytest.mark.parametrize("theta", [(0.1, -0.7, 0.0, -0.4), (-0.7, 0.5, 1.5, 0.7), (0.0, -2.0, -3.0, -3.0)])
def test_likelihood_and_slope_are_those_of_plain_formulas(theta, both):
    residual, theta = np.linspace(-6.0, 8.0, 57), np.array(theta)
    slope = np.empty(4)
    assert one_sided._log_likelihood(residual, theta, both, slope) == pytest.approx(
        plainly(residual, theta, both), rel=1e-9
    )
    for k, step in enumerate(1e-5 * np.eye(4)):
        numeric = (plainly(residual, theta + step, both) - plainly(residual, theta - step, both)) / 2e-5
        assert slope[k] == pytest.approx(numeric, rel=1e-5, abs=1e-4)


@pytest.mark.parametrize("z", [-300.0, -37.0, -20.001, -19.999, -5.0, 0.0, 3.0, 40.0])
def test_share_below_is_right_at_any_distance(z):
    residual, theta = np.array([z]), np.array([0.0, 0.0, 30.0, 0.0])  # all readings have errors, of one sigma
    found = one_sided._log_likelihood(residual, theta, False, np.empty(4))
    assert found == pytest.approx(0.5 - z + stats.norm.logcdf(z - 1), rel=1e-11)


def test_spans_of_a_long_log_are_asked_for_and_all_of_a_short_one():
    assert one_sided.spread(8000).all()
    asked = one_sided.spread(50_000)
    assert asked.sum() == one_sided.SPANS * one_sided.SPAN
    assert asked[:1000].all()
    assert asked[-1000:].all()
    assert asked[20_000:35_000].any()
