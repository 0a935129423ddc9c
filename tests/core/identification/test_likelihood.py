"""Noise and jerk found from the log: on flights drawn from the model itself and on simulated ones."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering.records import Model
from ftproc.core.filtering.smoother import smooth_log
from ftproc.core.identification import likelihood
from ftproc.core.model import motion
from ftproc.core.model.frames import from_cartesian
from tests import naive
from tests.core.tracks import SIGMA, matched, position_error

FREE = np.zeros(3, bool)


def level(a, noise=1.0, jerk=1.0, fix_noise=FREE, fix_jerk=False):
    guess = Model(SIGMA**2 * noise, motion.isotropic(jerk))
    return likelihood.fit_level(a.time, a.z, a.weight, a.starts, guess, fix_noise, fix_jerk)


def smoothed_error(a, model):
    return np.sqrt(np.mean(position_error(smooth_log(a.time, a.z, a.weight, model, a.starts).state, a.truth) ** 2))


@pytest.mark.parametrize(("noise", "jerk"), [(1.0, 1.0), (0.1, 1e-3), (9.0, 1e4)])
@pytest.mark.parametrize("seed", range(3))
def test_noise_within_a_tenth_and_jerk_within_a_factor_from_any_guess(seed, noise, jerk):
    a = matched(seed, 1000, q=30.0, missing=0.05)
    found = level(a, noise, jerk)
    found = likelihood.fit_level(a.time, a.z, a.weight, a.starts, found, FREE, False)  # goes on, as editing does
    np.testing.assert_allclose(np.sqrt(found.noise_variance), SIGMA, rtol=0.1)
    assert found.jerk.shape == (1, 6)
    assert 5 < np.mean(found.jerk[0, [0, 3, 5]]) < 150


def test_fixed_values_stay():
    a = matched(4, 400, q=30.0)
    fixed = np.array([True, False, True])
    found = level(a, noise=4.0, fix_noise=fixed)
    np.testing.assert_allclose(found.noise_variance[fixed], 4 * SIGMA[fixed] ** 2, rtol=1e-12)
    np.testing.assert_allclose(np.sqrt(found.noise_variance[1]), SIGMA[1], rtol=0.1)
    jerk_given = level(a, jerk=3.0, fix_jerk=True)
    np.testing.assert_allclose(jerk_given.jerk, motion.isotropic(3.0), rtol=1e-12)
    guess = Model(SIGMA**2, motion.isotropic(3.0))
    all_given = likelihood.fit_level(a.time, a.z, a.weight, a.starts, guess, ~FREE, True)
    assert all_given is guess


def test_rejected_readings_do_not_count():
    a = matched(5, 600, q=30.0)
    bad = np.random.default_rng(5).random(a.z.shape) < 0.2
    z = np.where(bad, a.z + 100 * SIGMA, a.z)
    spoiled = a._replace(z=z, weight=a.weight * ~bad)
    np.testing.assert_allclose(np.sqrt(level(spoiled).noise_variance), SIGMA, rtol=0.1)


def test_tuned_smoother_is_as_good_as_the_true_model():
    for seed in range(3):
        a = matched(10 + seed, 600, q=30.0)
        assert smoothed_error(a, level(a)) < 1.1 * smoothed_error(a, a.model)


def piecewise(seed):
    """Twenty seconds of calm, twenty of wild jerk, twenty of calm."""
    a = matched(seed, 600, q=1.0)
    jerk = np.array([[0.01], [400.0], [0.01]]) * motion.isotropic(1.0)
    rng, truth = np.random.default_rng(seed), a.truth.copy()
    for k in range(1, 600):
        phi, q = naive.transition(0.1), naive.van_loan(0.1, jerk[min(int(a.time[k] / 20.0), 2)])
        truth[k] = phi @ truth[k - 1] + np.linalg.cholesky(q) @ rng.standard_normal(9)
    noise = a.z - from_cartesian(a.truth[:, :3])
    return a._replace(z=from_cartesian(truth[:, :3]) + noise, truth=truth, model=Model(SIGMA**2, jerk, 20.0))


def test_profile_follows_the_flight():
    a = piecewise(0)
    single = level(a)
    profile = likelihood.fit_profile(a.time, a.z, a.weight, a.starts, single, 15)
    np.testing.assert_array_equal(profile.noise_variance, single.noise_variance)
    knots = len(profile.jerk)
    assert knots > 3
    assert profile.knot_s * knots >= a.time[-1]
    at = profile.knot_s * (np.arange(knots) + 0.5)
    height = profile.jerk[:, 0]
    assert np.median(height[(at > 22) & (at < 38)]) > 30 * np.median(height[(at < 15) | (at > 45)])
    found = [
        smooth_log(a.time, a.z, a.weight, m, a.starts).log_likelihood for m in (single, profile)
    ]  # fmt: skip
    assert found[1] > found[0] + 5
    assert smoothed_error(a, profile) < smoothed_error(a, single)


@pytest.mark.parametrize("n", [1, 2, 5])
def test_tiny_logs_have_a_model(n):
    a = matched(6, n)
    single = likelihood.fit_level(a.time, a.z, a.weight, a.starts, a.model, FREE, False)
    profile = likelihood.fit_profile(a.time, a.z, a.weight, a.starts, single, 15)
    for model in (single, profile):
        assert np.isfinite(model.noise_variance).all()
        assert (model.noise_variance >= likelihood.NOISE_FLOOR**2 * (1 - 1e-9)).all()
        assert np.isfinite(model.jerk).all()
        assert (model.jerk[:, [0, 3, 5]] > 0).all()
