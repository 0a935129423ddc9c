"""The recursive filter over a log whose weights are decided."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering import forward
from ftproc.core.filtering.records import Model, Start
from ftproc.core.model.frames import line_of_sight_axes
from tests import naive
from tests.core.tracks import SIGMA, matched


def run(a, **changes):
    a = a._replace(**changes)
    return forward.filter_log(a.log, a.model, a.starts)


def same(one, other):
    for name, value in one._asdict().items():
        np.testing.assert_array_equal(value, getattr(other, name), err_msg=name)


def test_step_without_readings_is_a_pure_prediction():
    a = matched(1, 30)
    z = a.z.copy()
    z[10:20] = np.nan
    found = run(a, z=z)
    for k in range(10, 20):
        np.testing.assert_array_equal(found.state[k], found.predicted[k])
        np.testing.assert_allclose(found.state[k], naive.transition(0.1) @ found.state[k - 1], rtol=1e-13)
    assert np.isnan(found.nis[10:20]).all()
    assert np.isnan(found.innovation[10:20]).all()
    assert (found.sigma[20] < found.sigma[19]).all()
    assert (np.diff(found.sigma[9:20, :6], axis=0) > 0).all()
    assert np.isfinite(found.innovation_sigma).all()


def test_value_of_a_barred_reading_does_not_matter():
    """Weight zero, NaN or both: the same states and sigmas to the last bit."""
    a = matched(2, 50)
    weight = a.weight.copy()
    weight[np.random.default_rng(0).random(weight.shape) < 0.4] = 0.0
    absurd, missing = a.z.copy(), a.z.copy()
    absurd[weight == 0] = 12345.0
    missing[weight == 0] = np.nan
    barred = run(a, weight=weight)
    for other in (run(a, weight=weight, z=absurd), run(a, weight=weight, z=missing), run(a, z=missing)):
        np.testing.assert_array_equal(other.state, barred.state)
        np.testing.assert_array_equal(other.sigma, barred.sigma)
        np.testing.assert_array_equal(other.weight, barred.weight)
        assert other.log_likelihood == barred.log_likelihood


def test_two_readings_at_one_instant_are_two_updates():
    a = matched(3, 20)
    twice = np.repeat(np.arange(20), 2)
    half = a.model._replace(noise_variance=2 * a.model.noise_variance)
    double = run(a.part(twice, a.starts), model=half)
    np.testing.assert_allclose(double.sigma[1::2], run(a).sigma, rtol=1e-3)
    np.testing.assert_allclose((double.state[1::2] - run(a).state) / run(a).sigma, 0, atol=0.05)
    np.testing.assert_array_equal(double.predicted[1::2], double.state[0::2])


def test_run_is_re_initialized_at_each_start():
    a = matched(4, 60)
    later = Start(25, a.truth[25] + 3.0, np.diag(np.repeat([9.0, 4.0, 1.0], 3)) ** 2)
    both = run(a, starts=[a.starts[0], later])
    first = run(a.part(slice(25), a.starts))
    second = run(a.part(slice(25, None), [later._replace(sample=0)]))
    np.testing.assert_array_equal(both.state[:25], first.state)
    np.testing.assert_array_equal(both.state[:25], run(a).state[:25])
    np.testing.assert_array_equal(both.state[25:], second.state)
    np.testing.assert_array_equal(both.sigma[25:], second.sigma)
    np.testing.assert_array_equal(both.since_start, np.r_[np.arange(25), np.arange(35)])
    assert both.log_likelihood == pytest.approx(second.log_likelihood + first.log_likelihood)


def test_samples_before_the_first_start_are_extrapolated_backwards():
    a = matched(5, 40)
    start = Start(12, a.truth[12], a.starts[0].covariance)
    found = run(a, starts=[start])
    for k in range(12):
        phi = naive.transition(a.time[k] - a.time[12])
        q = naive.process_noise(a.time[k] - a.time[12], a.model.jerk[0])
        np.testing.assert_allclose(found.state[k], phi @ start.state, rtol=1e-11)
        sigma = np.sqrt(np.diag(phi @ start.covariance @ phi.T + q))
        np.testing.assert_allclose(found.sigma[k], sigma, rtol=1e-10)
        c = naive.unscented(found.state[k], phi @ start.covariance @ phi.T + q)[1]
        np.testing.assert_allclose(found.innovation_sigma[k], np.sqrt(np.diag(c) + SIGMA**2), rtol=1e-6)
    assert not found.weight[:12].any()
    assert np.isnan(found.nis[:12]).all()
    np.testing.assert_array_equal(found.since_start[:12], 0)


def test_innovations_are_taken_before_the_update_and_wrapped():
    a = matched(6, 40)
    z = a.z.copy()
    z[20, 1] += 2 * np.pi
    plain, turned = run(a), run(a, z=z)
    assert np.abs(turned.innovation[:, 1]).max() < 1
    np.testing.assert_allclose(turned.state, plain.state, atol=1e-6)
    expected = naive.difference(a.z[30], naive.measure(plain.predicted[30]))
    np.testing.assert_allclose(plain.innovation[30] / SIGMA, expected / SIGMA, atol=0.05)


def test_line_of_sight_sigmas_are_the_rotated_covariance():
    a = matched(7, 25, missing=0.2)
    found = run(a)
    steps = naive.run(a.time, a.z, a.weight, a.model, a.starts[0].state, a.starts[0].covariance)
    for k, step in enumerate(steps):
        axes = line_of_sight_axes(step.x[None, :3])[0]
        expected = [np.diag(axes @ step.p[b : b + 3, b : b + 3] @ axes.T) for b in (0, 3)]
        np.testing.assert_allclose(found.los_sigma[k], np.sqrt(np.concatenate(expected)), rtol=1e-9)


def test_matched_filter_is_consistent():
    """Mean NIS is the number of components, 0.27 % lie beyond 3 sigma, neighbours are uncorrelated, NEES is 9."""
    nis, beyond, lagged, nees = [], [], [], []
    for seed in range(12):
        a = matched(100 + seed, 500, dt=0.2, q=30.0, missing=0.1)
        found = run(a)
        u = np.where(a.weight > 0, found.innovation / found.innovation_sigma, np.nan)
        nis.append(np.nansum(found.nis) / a.weight.sum())
        beyond.append(np.nanmean(np.where(np.isnan(u), np.nan, np.abs(u) > 3)))
        lagged.append(np.nanmean(u[1:] * u[:-1]))
        last = naive.run(a.time[:40], a.z, a.weight, a.model, a.starts[0].state, a.starts[0].covariance)[-1]
        nees.append((a.truth[39] - last.x) @ np.linalg.solve(last.p, a.truth[39] - last.x))
    assert np.mean(nis) == pytest.approx(1, abs=0.03)
    assert 0.0015 < np.mean(beyond) < 0.004
    assert abs(np.mean(lagged)) < 0.02
    assert 4 < np.mean(nees) < 15


def test_single_sample_and_reading_variance():
    a = matched(8, 1)
    found = run(a)
    assert found.state.shape == (1, 9)
    assert np.isfinite(found.state).all()
    coloured = Model(SIGMA**2, a.model.jerk, markov_variance=SIGMA**2 * [0.5, 0.0, 2.0], tau_s=np.full(3, 2.0))
    np.testing.assert_allclose(coloured.reading_variance, SIGMA**2 * [1.5, 1, 3])
    np.testing.assert_allclose(coloured.correlation(2.0), np.array([1 / 3, 0, 2 / 3]) / np.e)
    np.testing.assert_array_equal(a.model.reading_variance, SIGMA**2)
    assert not a.model.correlation(0.0).any()
