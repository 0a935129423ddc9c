"""The adaptive Kalman filter of one component."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.comparators import adaptive
from tests import naive

RNG = np.random.default_rng(1)
TIME = np.cumsum(RNG.choice([0.05, 0.1, 0.3], 300))


def run(z, noise=0.01, jerk=0.5, x0=(0.0, 1.0, 0.0), p0=1.0, adapt=True, angular=False):
    model = adaptive.Channel(0, np.array(x0, float), p0 * np.eye(3), noise, jerk, angular)
    return adaptive.adaptive_kalman(TIME, z, model, adapt)


def test_without_adaptation_it_is_the_textbook_kalman_filter():
    z = np.sin(TIME) + 0.1 * RNG.standard_normal(300)
    z[RNG.random(300) < 0.2] = np.nan
    state, variance, innovation, sigma, weight, likelihood = run(z, adapt=False)
    x, p, h, expected = np.array([0.0, 1.0, 0.0]), np.eye(3), np.array([[1.0, 0, 0]]), 0.0
    for k in range(300):
        if k:
            t = TIME[k] - TIME[k - 1]
            phi = naive.transition(t)[::3, ::3]
            x, p = phi @ x, phi @ p @ phi.T + naive.van_loan(t, np.full(3, 0.5))[::3, ::3]
        s = (h @ p @ h.T).item() + 0.01
        assert sigma[k] == pytest.approx(np.sqrt(s), rel=1e-9)
        if np.isfinite(z[k]):
            e = z[k] - x[0]
            assert innovation[k] == pytest.approx(e, abs=1e-9)
            gain = p @ h.T / s
            x, p = x + gain[:, 0] * e, (np.eye(3) - gain @ h) @ p
            expected -= 0.5 * (np.log(s) + e * e / s)
        np.testing.assert_allclose(state[k], x, atol=1e-9)
        np.testing.assert_allclose(variance[k], np.diag(p), rtol=1e-8)
    assert likelihood == pytest.approx(expected)
    np.testing.assert_array_equal(weight, np.isfinite(z))


@pytest.mark.parametrize(("u", "factor"), [(0, 1), (3, 1), (6, 0.5), (8, 0.375), (8.01, 0)])
def test_gain_factor(u, factor):
    assert adaptive.gain_factor(float(u)) == factor


def test_outliers_are_kept_out():
    truth = np.sin(TIME)
    z = truth + 0.1 * RNG.standard_normal(300)
    bad = np.flatnonzero(RNG.random(300) < 0.1)[1:]
    z[bad] += 20
    state, _, _, _, weight, _ = run(z)
    assert (weight[bad] == 0).all()
    assert np.sqrt(np.mean((state[20:, 0] - truth[20:]) ** 2)) < 0.1


def test_noise_is_learnt():
    z = TIME + 0.3 * RNG.standard_normal(300)
    _, _, innovation, sigma, _, _ = run(z, noise=0.02, jerk=1e-4)
    assert np.mean((innovation[100:] / sigma[100:]) ** 2) == pytest.approx(1, abs=0.35)
    plain = run(z, noise=0.02, jerk=1e-4, adapt=False)
    assert np.mean((plain[2][100:] / plain[3][100:]) ** 2) > 3


def test_after_a_lasting_jump_it_is_re_initialized():
    z = 0.01 * RNG.standard_normal(300)
    z[100:] += 50
    state, _, _, _, weight, _ = run(z, noise=1e-4, jerk=1e-4, x0=(0, 0, 0))
    assert not weight[100 : 100 + adaptive.MOST_REJECTED].any()
    assert np.abs(state[160:, 0] - 50).max() < 0.5
    assert weight[160:].mean() > 0.9
