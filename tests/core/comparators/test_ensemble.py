"""The ensemble Kalman filter's step, on any system.

x <- f(x) + w        z = h(x) + v        X+ = X + K (z + v_i - h(X)),  K = Pxz (Pzz + R)^-1
"""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.comparators import ensemble
from ftproc.core.comparators.ensemble import Sensor
from ftproc.core.comparators.ensemble_run import measure, subtract
from tests.core.tracks import covariance

LINEAR = np.array([[1.0, 0.5, 0.0, -1.0], [0.0, 2.0, 1.0, 0.3]])
NOISE = np.array([[0.5, 0.1], [0.1, 0.3]])
SENSOR = Sensor(lambda x: x @ LINEAR.T, np.subtract, NOISE)
TRACKER = Sensor(measure, subtract, np.diag([9.0, 4e-8, 4e-8]))


def cloud(seed, n=60, centre=(3000.0, -2500.0, 1500.0)):
    rng = np.random.default_rng(seed)
    p = covariance(rng, np.repeat([8.0, 5.0, 2.0], 3))
    return rng.multivariate_normal(np.r_[centre, rng.normal(0, 80, 6)], p, n)


def test_step_is_the_one_member_by_member():
    """Range, azimuth, elevation; sums written out, each member with the same draw of v."""
    members, z = cloud(1), np.array([4200.0, -0.70, 0.365])
    known = ensemble.forecast(members, z, TRACKER)
    found = ensemble.corrected(known, 0.7, np.random.default_rng(5))
    n, mean = len(members), members.mean(0)
    centre = measure(mean[None])[0]
    away = np.array([subtract(measure(x[None])[0], centre) for x in members])
    pxz = sum(np.outer(x - mean, a - away.mean(0)) for x, a in zip(members, away, strict=True)) / (n - 1)
    pzz = sum(np.outer(a - away.mean(0), a - away.mean(0)) for a in away) / (n - 1)
    p_in = pzz + TRACKER.noise
    e = subtract(z, centre)
    assert known.rho == pytest.approx(e @ np.linalg.inv(p_in) @ e, rel=1e-9)
    draws = np.random.default_rng(5).standard_normal((n, 3)) * np.sqrt(np.diag(TRACKER.noise))
    for x, v, moved in zip(members, draws, found, strict=True):
        off = subtract(z + v, measure(x[None])[0])
        np.testing.assert_allclose(moved, x + 0.7 * pxz @ np.linalg.inv(p_in) @ off, rtol=1e-10)


@pytest.mark.parametrize("seen", [[0], [1], [2], [0, 1], [0, 2], [1, 2]])
def test_missing_components_are_left_out(seen):
    z = np.full(3, np.nan)
    z[seen] = np.array([4200.0, -0.70, 0.365])[seen]
    part = Sensor(lambda x: measure(x)[:, seen], lambda a, b: a - b, TRACKER.noise[np.ix_(seen, seen)])
    members = cloud(2)
    found = ensemble.enkf(ensemble.forecast(members, z, TRACKER), np.random.default_rng(1))
    expected = ensemble.enkf(ensemble.forecast(members, z[seen], part), np.random.default_rng(1))
    np.testing.assert_allclose(found.members, expected.members, rtol=1e-12)


def test_nothing_seen_is_no_forecast():
    assert ensemble.forecast(cloud(3), np.full(3, np.nan), TRACKER) is None


def test_many_members_are_a_kalman_filter():
    """20 steps of a linear system; means within 4 standard errors of KF's, covariances within 2 %."""
    rng, n = np.random.default_rng(0), 30_000
    f = np.eye(4) + 0.1 * np.eye(4, k=1)
    growth = 0.05 * np.eye(4)
    x, p = np.zeros(4), np.diag([4.0, 2.0, 1.0, 3.0])
    members, truth = ensemble.draw(x, p, n, rng), np.array([1.0, -1.0, 0.5, 2.0])
    for _ in range(20):
        truth = f @ truth
        z = LINEAR @ truth + np.linalg.cholesky(NOISE) @ rng.standard_normal(2)
        x, p = f @ x, f @ p @ f.T + growth
        s = LINEAR @ p @ LINEAR.T + NOISE
        gain = p @ LINEAR.T @ np.linalg.inv(s)
        x, p = x + gain @ (z - LINEAR @ x), p - gain @ s @ gain.T
        members = members @ f.T + rng.standard_normal((n, 4)) @ np.sqrt(growth)
        members, estimate, gamma = ensemble.enkf(ensemble.forecast(members, z, SENSOR), rng)
        assert gamma == 1.0
    scale = np.sqrt(np.diag(p))
    assert (np.abs(estimate - x) < 4 * scale / np.sqrt(n) * np.sqrt(20)).all()
    np.testing.assert_allclose(ensemble.spread(members) / np.outer(scale, scale), p / np.outer(scale, scale), atol=0.02)


def test_cut_is_nowhere_special():
    """A cloud astride the cut of the azimuth moves as the same cloud turned by a quarter does."""
    members = cloud(4, centre=(-3000.0, 4.0, 900.0))
    assert (members[:, 1] > 0).any()
    assert (members[:, 1] < 0).any()
    quarter = np.kron(np.eye(3), [[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    z = np.array([3135.0, np.pi - 1e-3, 0.29])
    turned = np.array([3135.0, -np.pi / 2 - 1e-3, 0.29])
    here = ensemble.enkf(ensemble.forecast(members, z, TRACKER), np.random.default_rng(1))
    there = ensemble.enkf(ensemble.forecast(members @ quarter.T, turned, TRACKER), np.random.default_rng(1))
    np.testing.assert_allclose(here.members @ quarter.T, there.members, atol=1e-7)


def test_no_trust_leaves_the_members():
    members = cloud(5)
    known = ensemble.forecast(members, np.array([4200.0, -0.70, 0.365]), TRACKER)
    assert ensemble.corrected(known, 0.0, np.random.default_rng(0)) is members


def test_root_of_a_covariance_and_of_one_that_rounding_broke():
    p = covariance(np.random.default_rng(0), [1e3, 1e2, 1.0, 1e-3, 1e-6, 5.0, 5.0, 5.0, 5.0])
    np.testing.assert_allclose(ensemble.root(p), np.linalg.cholesky(p), rtol=1e-9)
    few = cloud(6, n=5)
    p = ensemble.spread(few)  # of rank 4
    made = ensemble.root(p)
    scale = np.sqrt(np.diag(p))
    np.testing.assert_allclose((made @ made.T - p) / np.outer(scale, scale), 0, atol=1e-5)
    broken = np.array([[1.0, 2.0], [2.0, 1.0]])
    made = ensemble.root(broken)
    assert np.isfinite(made).all()
    np.testing.assert_allclose(made @ made.T, [[1.5, 1.5], [1.5, 1.5]], atol=1e-5)
