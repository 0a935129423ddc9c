"""Robust UKFs against iteratively reweighted least squares written out with whole matrices."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.comparators import robust
from ftproc.core.filtering import forward
from tests import naive
from tests.core.tracks import matched, position_error

KINDS = {"huber": (robust.HUBER, 1.345), "student": (robust.STUDENT, 4.0), "correntropy": (robust.CORRENTROPY, 2.5)}
WEIGHTS = {
    "huber": lambda u: min(1.0, 1.345 / max(u, 1e-300)),
    "student": lambda u: 5 / (4 + u**2),
    "correntropy": lambda u: np.exp(-(u**2) / (2 * 2.5**2)),
}


def run(a, kind, parameter):
    return forward.run_log(robust.run_robust, a.log, a.model, a.starts, robust.weighting_of(kind, parameter))


@pytest.mark.parametrize("name", KINDS)
def test_weight(name):
    for u in (0.0, 0.5, 1.345, 2.0, 4.0, 9.0):
        assert robust.weight_of(*KINDS[name], u) == pytest.approx(WEIGHTS[name](u), rel=1e-12)


@pytest.mark.parametrize("name", KINDS)
def test_run_is_that_of_the_plain_reweighted_filter(name):
    a = matched(4, 60, irregular=True, missing=0.2)
    bad = np.random.default_rng(5).random(a.z.shape) < 0.1
    a.z[bad] += (40 * np.array([3.0, 2e-4, 3e-4]) * np.ones_like(a.z))[bad]
    found = run(a, *KINDS[name])
    x, p = a.starts[0].state, a.starts[0].covariance
    noise = a.model.noise_variance
    for k in range(len(a.time)):
        if k:
            t = a.time[k] - a.time[k - 1]
            phi = naive.transition(t)
            x, p = phi @ x, phi @ p @ phi.T + naive.van_loan(t, a.model.jerk[0])
        z_hat, c, pxz = naive.unscented(x, p)
        e = naive.difference(a.z[k], z_hat)
        h = np.linalg.solve(p, pxz).T
        u = np.abs(e) / np.sqrt(np.diag(c) + noise)
        x1, p1 = x, p
        for _ in range(robust.ITERATIONS):
            weight = np.array([WEIGHTS[name](v) if np.isfinite(v) else 0.0 for v in u])
            x1, p1, _, _ = naive.update(x, p, (z_hat, c, pxz), a.z[k], noise, weight)
            u = np.abs(e - h @ (x1 - x)) / np.sqrt(noise)
        x, p = x1, (p1 + p1.T) / 2
        sigma = np.sqrt(np.diag(p))
        np.testing.assert_allclose((found.state[k] - x) / sigma, 0, atol=1e-6)
        np.testing.assert_allclose(found.sigma[k], sigma, rtol=1e-6)
        np.testing.assert_allclose(found.weight[k], weight, atol=1e-6)


@pytest.mark.parametrize(
    ("kind", "parameter"), [(robust.HUBER, 1e9), (robust.STUDENT, 1e12), (robust.CORRENTROPY, 1e7)]
)
def test_with_a_wide_parameter_it_is_the_ukf(kind, parameter):
    a = matched(6, 80, irregular=True, missing=0.3)
    found = run(a, kind, parameter)
    plain = forward.filter_log(a.log, a.model, a.starts)
    np.testing.assert_allclose((found.state - plain.state) / plain.sigma, 0, atol=1e-6)
    assert found.log_likelihood == pytest.approx(plain.log_likelihood, rel=1e-6)


@pytest.mark.parametrize("name", KINDS)
def test_isolated_outliers_do_little_harm(name):
    a = matched(7, 400)
    clean = position_error(forward.filter_log(a.log, a.model, a.starts).state, a.truth)
    bad = np.random.default_rng(8).random(a.z.shape) < 0.05
    bad[:5] = False
    a.z[bad] += (30 * np.array([3.0, 2e-4, 3e-4]) * np.ones_like(a.z))[bad]
    spoiled = position_error(forward.filter_log(a.log, a.model, a.starts).state, a.truth)
    found = position_error(run(a, *KINDS[name]).state, a.truth)
    assert np.sqrt(np.mean(found**2)) < 1.35 * np.sqrt(np.mean(clean**2))
    assert np.sqrt(np.mean(found**2)) < 0.5 * np.sqrt(np.mean(spoiled**2))
