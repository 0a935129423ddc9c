"""Converted measurements: without bias, with the covariance they have, and filtered as in the textbook."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.comparators import converted
from ftproc.core.filtering import forward
from ftproc.core.model.frames import line_of_sight_axes, to_cartesian
from tests import naive
from tests.core.tracks import matched, position_error


def convert(z, noise, at):
    out, r = np.zeros(3), np.zeros((3, 3))
    converted.convert(np.asarray(z, float), np.asarray(noise, float), *at, out, r)
    return out, r


def run(a):
    extra = converted.conversion_of(a.model.noise_variance)
    return forward.run_log(converted.run_converted, a.log, a.model, a.starts, extra)


@pytest.mark.parametrize("place", [(5000.0, 2.0, 0.3), (800.0, -3.1, 1.2), (100.0, 0.0, -0.4)])
def test_conversion_is_unbiased_with_its_covariance(place):
    """With 10 degrees of noise the plain conversion is off by 1.5 % of the range."""
    rng = np.random.default_rng(0)
    sigma = np.array([0.02 * place[0], 0.17, 0.17])
    draws = np.array(place) + sigma * rng.standard_normal((200_000, 3))
    found = np.array([convert(z, sigma**2, place)[0] for z in draws[:50_000]])
    _, r = convert(place, sigma**2, place)
    truth = np.array([place[0], 0.0, 0.0])
    error = found.mean(0) - truth
    standard = np.sqrt(np.diag(r) / len(found))
    assert (np.abs(error) < 4 * standard).all()
    scale = np.sqrt(np.diag(r))
    np.testing.assert_allclose(np.cov(found.T) / np.outer(scale, scale), r / np.outer(scale, scale), atol=0.03)
    plain = to_cartesian(draws).mean(0) - to_cartesian(np.array(place))
    assert np.linalg.norm(plain) > 0.01 * place[0]


def test_covariance_of_small_noise_is_that_of_the_line_of_sight():
    _, r = convert((9e5, 1.0, 0.5), (4.0, 1e-10, 9e-10), (9e5, 1.0, 0.5))
    np.testing.assert_allclose(np.diag(r), [4.0, (9e5 * np.cos(0.5)) ** 2 * 1e-10, 9e5**2 * 9e-10], rtol=1e-3)


def test_run_is_the_linear_kalman_filter_on_positions():
    a = matched(2, 80, irregular=True)
    found = run(a)
    x, p = a.starts[0].state, a.starts[0].covariance
    h = np.eye(3, 9)
    for k in range(len(a.time)):
        if k:
            t = a.time[k] - a.time[k - 1]
            phi = naive.transition(t)
            x, p = phi @ x, phi @ p @ phi.T + naive.van_loan(t, a.model.jerk[0])
        axes = line_of_sight_axes(x[None, :3])[0]
        along, r = convert(a.z[k], a.model.noise_variance, naive.measure(x))
        s = p[:3, :3] + axes.T @ r @ axes
        gain = p @ h.T @ np.linalg.inv(s)
        x = x + gain @ (axes.T @ along - x[:3])
        p = p - gain @ s @ gain.T
        p = (p + p.T) / 2
        np.testing.assert_allclose((found.state[k] - x) / np.sqrt(np.diag(p)), 0, atol=1e-6)
        np.testing.assert_allclose(found.sigma[k], np.sqrt(np.diag(p)), rtol=1e-6)


def test_at_small_angles_of_noise_it_is_as_good_as_the_ukf_with_readings_missing():
    a = matched(3, 300, missing=0.3)
    found, ukf = run(a), forward.filter_log(a.log, a.model, a.starts)
    assert np.mean(position_error(found.state, a.truth)) < 1.02 * np.mean(position_error(ukf.state, a.truth))
    np.testing.assert_array_equal(found.weight, a.weight)
    np.testing.assert_allclose(found.innovation_sigma, ukf.innovation_sigma, rtol=0.05)
    np.testing.assert_array_equal(np.isnan(found.innovation), np.isnan(a.z))
