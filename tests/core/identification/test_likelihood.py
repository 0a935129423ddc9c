"""Noise and jerk found from the log, on flights drawn from the model itself."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering.records import Model
from ftproc.core.filtering.smoother import smooth_log
from ftproc.core.identification import likelihood
from ftproc.core.identification.likelihood import Fixed
from ftproc.core.identification.profile import fit_profile
from ftproc.core.model import motion
from tests.core.tracks import SIGMA, matched, position_error

pytestmark = pytest.mark.compiled

FREE = Fixed(np.zeros(3, bool), False)


def level(a, noise=1.0, jerk=1.0, fixed=FREE):
    guess = Model(SIGMA**2 * noise, motion.isotropic(jerk))
    return likelihood.fit_level(a.log, a.starts, guess, fixed)


def smoothed_error(a, model):
    return np.sqrt(np.mean(position_error(smooth_log(a.log, model, a.starts).state, a.truth) ** 2))


@pytest.mark.parametrize(("noise", "jerk"), [(1.0, 1.0), (0.1, 1e-3), (9.0, 1e4)])
@pytest.mark.parametrize("seed", range(3))
def test_noise_within_a_tenth_and_jerk_within_a_factor_from_any_guess(seed, noise, jerk):
    a = matched(seed, 1000, q=30.0, missing=0.05)
    found = level(a, noise, jerk)
    found = likelihood.fit_level(a.log, a.starts, found, FREE)  # goes on, as editing does
    np.testing.assert_allclose(np.sqrt(found.noise_variance), SIGMA, rtol=0.1)
    assert found.jerk.shape == (1, 3)
    assert 5 < np.mean(found.jerk) < 150


def test_fixed_values_stay():
    a = matched(4, 400, q=30.0)
    fixed = np.array([True, False, True])
    found = level(a, noise=4.0, fixed=Fixed(fixed, False))
    np.testing.assert_allclose(found.noise_variance[fixed], 4 * SIGMA[fixed] ** 2, rtol=1e-12)
    np.testing.assert_allclose(np.sqrt(found.noise_variance[1]), SIGMA[1], rtol=0.1)
    jerk_fixed = level(a, jerk=3.0, fixed=FREE._replace(jerk=True))
    np.testing.assert_allclose(jerk_fixed.jerk, motion.isotropic(3.0), rtol=1e-12)
    guess = Model(SIGMA**2, motion.isotropic(3.0))
    all_fixed = likelihood.fit_level(a.log, a.starts, guess, Fixed(np.ones(3, bool), True))
    assert all_fixed is guess


def test_a_long_log_is_represented_by_stretches_of_all_of_it():
    n = 2 * likelihood.SPANS * likelihood.SPAN
    a = matched(7, n, missing=0.05)
    blind = slice(0, 2 * likelihood.SPAN)  # where no track can begin
    weight = a.weight.copy()
    weight[blind, 0] = 0.0
    for log in (a.log, a.log._replace(weight=weight)):
        part, starts = likelihood.representative(log, a.starts, a.model.noise_variance, 1.0)
        rows = np.searchsorted(a.time, part.time_s)
        np.testing.assert_array_equal(part.measurement, a.z[rows])
        assert len(rows) <= likelihood.SPANS * likelihood.SPAN
        assert rows[-1] == n - 1
        assert np.diff(rows).max() < 1.5 * n / likelihood.SPANS
        for start in starts:  # each stretch has one, at its beginning
            assert (np.abs(start.state - a.truth[rows[start.sample]]) < 6 * np.sqrt(np.diag(start.covariance))).all()
        assert {start.sample for start in starts} >= {0, *(np.flatnonzero(np.diff(rows) > 1) + 1)}
    assert rows[0] >= blind.stop - likelihood.SPAN


def test_a_log_stands_for_itself_if_it_is_short_or_no_stretch_of_it_can_be_tracked():
    a = matched(7, 3 * likelihood.SPANS * likelihood.SPAN)
    short, blind = a.part(slice(0, 200), a.starts), a.log._replace(weight=np.zeros_like(a.weight))
    for log in (short.log, blind):
        part, starts = likelihood.representative(log, a.starts, a.model.noise_variance, 1.0)
        assert part is log
        assert starts is a.starts


@pytest.mark.parametrize("known", [(), (0, 2)])
def test_noise_is_found_where_only_the_jerk_and_other_noise_are_fixed(known):
    a = matched(4, 400, q=30.0)
    fixed = np.isin(np.arange(3), known)
    found = level(a, noise=4.0, jerk=30.0, fixed=Fixed(fixed, True))
    np.testing.assert_allclose(np.sqrt(found.noise_variance), np.where(fixed, 2.0, 1.0) * SIGMA, rtol=0.1)


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


@pytest.mark.parametrize("n", [1, 2, 5])
def test_tiny_logs_have_a_model(n):
    a = matched(6, n)
    single = likelihood.fit_level(a.log, a.starts, a.model, FREE)
    profile = fit_profile(a.log, a.starts, single, 15)
    for model in (single, profile):
        assert np.isfinite(model.noise_variance).all()
        assert (model.noise_variance > 0).all()
        assert np.isfinite(model.jerk).all()
        assert (model.jerk > 0).all()
