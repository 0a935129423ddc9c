"""The smoother against Rauch-Tung-Striebel with explicit inverses, and block by block against itself.

G = P+_k Phi' (P-_{k+1})^-1,  x^s_k = x+_k + G (x^s_{k+1} - x-_{k+1}),  P^s_k = P+_k + G (P^s_{k+1} - P-_{k+1}) G'
"""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering import forward, smoother
from ftproc.core.filtering.heads import smoothed_covariance
from ftproc.core.filtering.records import Model, Start
from tests import naive
from tests.core.tracks import SIGMA, covariance, matched


def smooth(a, **changes):
    a = a._replace(**changes)
    return smoother.smooth_log(a.log, a.model, a.starts)


def steps_of(a):
    return naive.run(a.time, a.z, a.weight, a.model, a.starts[0].state, a.starts[0].covariance)


@pytest.mark.parametrize(
    ("seed", "n", "irregular", "missing", "pieces"),
    [
        (1, 40, False, 0.0, 1),
        (2, 60, True, 0.0, 3),
        (3, 60, True, 0.4, 3),
        (4, 1, False, 0.0, 1),
        (5, 2, False, 0.0, 1),
    ],
)
def test_states_and_sigmas_are_those_of_rts(seed, n, irregular, missing, pieces):
    a = matched(seed, n, dt=0.5, q=5.0, irregular=irregular, missing=missing, pieces=pieces)
    found, (x, p) = smooth(a), naive.smooth(steps_of(a))
    sigma = np.sqrt(np.diagonal(p, axis1=1, axis2=2))
    np.testing.assert_allclose((found.state - x) / sigma, 0, atol=1e-8)
    np.testing.assert_allclose(found.sigma, sigma, rtol=1e-8)
    for b in (0, 3):
        axes = naive_axes(x)
        los = np.diagonal(axes @ p[:, b : b + 3, b : b + 3] @ np.swapaxes(axes, 1, 2), axis1=1, axis2=2)
        np.testing.assert_allclose(found.los_sigma[:, b : b + 3], np.sqrt(los), rtol=1e-6)


def naive_axes(x):
    """Rows: the gradients of range, azimuth, elevation, made unit vectors."""
    h = np.array([naive.jacobian(state)[:, :3] for state in x])
    return h / np.linalg.norm(h, axis=2, keepdims=True)


def test_partly_weighted_and_barred_readings():
    a = matched(6, 50, dt=0.5)
    a = a._replace(weight=np.random.default_rng(1).choice([0.0, 0.1, 0.5, 1.0], a.weight.shape))
    found, (x, p) = smooth(a), naive.smooth(steps_of(a))
    sigma = np.sqrt(np.diagonal(p, axis1=1, axis2=2))
    np.testing.assert_allclose((found.state - x) / sigma, 0, atol=1e-8)
    np.testing.assert_allclose(found.sigma, sigma, rtol=1e-8)


@pytest.mark.parametrize("n", [1, 127, 128, 129, 257])
def test_block_boundaries_leave_no_seam(n):
    a = matched(7, n, dt=0.2, missing=0.1, irregular=True)
    found, (x, p) = smooth(a), naive.smooth(steps_of(a))
    sigma = np.sqrt(np.diagonal(p, axis1=1, axis2=2))
    np.testing.assert_allclose((found.state - x) / sigma, 0, atol=1e-6)
    np.testing.assert_allclose(found.sigma, sigma, rtol=1e-6)
    run = forward.filter_log(a.log, a.model, a.starts)
    np.testing.assert_allclose(found.nis, run.nis, rtol=1e-10)
    assert found.log_likelihood == pytest.approx(run.log_likelihood, rel=1e-12)
    np.testing.assert_allclose(found.state[-1], run.state[-1], rtol=1e-12)


@pytest.mark.parametrize("n", [63, 64, 65, 200])
def test_a_log_in_several_blocks_is_that_in_one(monkeypatch, n):
    """To the last bit, whatever is wanted; only sums over blocks may be rounded otherwise."""
    a = matched(9, n, dt=0.2, missing=0.1, irregular=True, pieces=3)
    a = a._replace(weight=a.weight * np.random.default_rng(2).choice([0.0, 1.0, 1.0], a.weight.shape))
    one, scores = smooth(a), smoother.score_log(a.log, a.model, a.starts)
    monkeypatch.setattr("ftproc.core.filtering.memory.BLOCK", 64)
    found, residuals = smooth(a), smoother.smooth_log(a.log, a.model, a.starts, smoother.RESIDUALS)
    for name in ("state", "sigma", "los_sigma", "residual", "residual_variance", "nis"):
        np.testing.assert_array_equal(getattr(found, name), getattr(one, name), err_msg=name)
    np.testing.assert_array_equal(residuals.residual, one.residual)
    np.testing.assert_array_equal(residuals.residual_variance, one.residual_variance)
    np.testing.assert_array_equal(smoother.score_log(a.log, a.model, a.starts).jerk, scores.jerk)
    np.testing.assert_array_equal(smoother.score_log(a.log, a.model, a.starts).noise, scores.noise)
    assert found.log_likelihood == one.log_likelihood == smoother.likelihood_of(a.log, a.model, a.starts)


def test_block_length_does_not_matter():
    """The same record behind 50 silent samples, which shift every block."""
    a = matched(8, 300, dt=0.1)
    silent = 50
    time = np.r_[np.full(silent, a.time[0]), a.time]
    z = np.vstack([np.full((silent, 3), np.nan), a.z])
    shifted = smooth(a, time=time, z=z, weight=np.isfinite(z).astype(float))
    plain = smooth(a)
    np.testing.assert_allclose((shifted.state[silent:] - plain.state) / plain.sigma, 0, atol=1e-9)
    np.testing.assert_allclose(shifted.residual[silent:], plain.residual, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(shifted.state[:silent], np.tile(plain.state[0], (silent, 1)), rtol=1e-12)


def test_heads_are_those_of_a_run_that_keeps_all_states():
    a = matched(9, 200, dt=0.2, missing=0.1)
    starts = [Start(12, a.truth[12], a.starts[0].covariance), Start(90, a.truth[90], a.starts[0].covariance)]
    whole, heads, only = (
        smoother.smooth_log(a.log, a.model, starts, wanted)
        for wanted in (smoother.STATES, smoother.HEADS, smoother.RESIDUALS)
    )
    assert [head.sample for head in heads.heads] == [12, 90]
    for one, other in zip(whole.heads, heads.heads, strict=True):
        np.testing.assert_array_equal(one.state, other.state)
        np.testing.assert_allclose(one.covariance, other.covariance, rtol=1e-6, atol=1e-9)
    for run in (heads, only):
        assert run.state.shape == run.sigma.shape == (0, 9)
        np.testing.assert_allclose(run.residual, whole.residual, rtol=1e-9)
        np.testing.assert_allclose(run.residual_variance, whole.residual_variance, rtol=1e-9)


def test_segments_are_independent():
    a = matched(9, 200, dt=0.2, missing=0.1)
    second = Start(90, a.truth[90], np.diag(np.repeat([9.0, 4.0, 1.0], 3)) ** 2)
    both = smooth(a, starts=[a.starts[0], second])
    first = smooth(a.part(slice(90), a.starts))
    rest = smooth(a.part(slice(90, None), [second._replace(sample=0)]))
    for name in ("state", "sigma", "residual", "residual_variance", "nis"):
        np.testing.assert_allclose(getattr(both, name)[:90], getattr(first, name), rtol=1e-10, err_msg=name)
        np.testing.assert_allclose(getattr(both, name)[90:], getattr(rest, name), rtol=1e-10, err_msg=name)
    assert both.log_likelihood == pytest.approx(first.log_likelihood + rest.log_likelihood)
    np.testing.assert_array_equal([head.sample for head in both.heads], [0, 90])
    for found, alone in zip(both.heads, (first.heads[0], rest.heads[0]), strict=True):
        np.testing.assert_allclose(found.state, alone.state, rtol=1e-12)
        np.testing.assert_allclose(found.covariance, alone.covariance, rtol=1e-6)


def test_head_and_extrapolation_before_the_first_start():
    a = matched(10, 60, dt=0.2)
    found = smooth(a, starts=[Start(15, a.truth[15], a.starts[0].covariance)])
    late = smooth(a.part(slice(15, None), [Start(0, a.truth[15], a.starts[0].covariance)]))
    np.testing.assert_array_equal(found.state[15:], late.state)
    (head,) = found.heads
    assert head.sample == 15
    np.testing.assert_array_equal(head.state, found.state[15])
    np.testing.assert_allclose(np.sqrt(np.diag(head.covariance)), found.sigma[15], rtol=1e-6)
    for k in range(15):
        t = a.time[k] - a.time[15]
        phi, q = naive.transition(t), naive.process_noise(t, a.model.jerk[0])
        np.testing.assert_allclose(found.state[k], phi @ head.state, rtol=1e-10)
        p = phi @ head.covariance @ phi.T + q
        np.testing.assert_allclose(found.sigma[k], np.sqrt(np.diag(p)), rtol=1e-9)
        expected = naive.difference(a.z[k], naive.unscented(found.state[k], p)[0])
        np.testing.assert_allclose(found.residual[k], expected, rtol=1e-6, atol=1e-9)


def test_smoothed_covariance_is_positive_even_if_rounding_ate_it():
    rng = np.random.default_rng(11)
    p = covariance(rng, np.repeat([1e4, 1e3, 1e2], 3))
    n = np.linalg.inv(p) * (1 - 1e-15)  # the record says as good as everything
    found = smoothed_covariance(p, n)
    assert np.linalg.eigvalsh(found / 1e8).min() > -1e-18
    assert (np.diag(found) > 0).all()
    half = smoothed_covariance(p, np.linalg.inv(p) / 2)
    np.testing.assert_allclose(half, p / 2, rtol=1e-6)


@pytest.mark.parametrize("n", [0.0, 1e-9])
def test_smoothed_covariance_of_what_is_wholly_correlated(n):
    """Two states that are one have a covariance without an inverse."""
    p = np.full((2, 2), 9.0)
    np.testing.assert_allclose(smoothed_covariance(p, n * np.eye(2)), p, rtol=1e-6)


@pytest.mark.compiled
def test_smoother_beats_the_filter_and_its_sigmas_hold_the_truth():
    ratio, inside = [], []
    for seed in range(20, 28):
        a = matched(seed, 400, q=20.0, irregular=True, missing=0.1)
        found, run = smooth(a), forward.filter_log(a.log, a.model, a.starts)
        ratio.append(np.mean((found.state - a.truth)[:, :3] ** 2) / np.mean((run.state - a.truth)[:, :3] ** 2))
        inside.append(np.mean(((found.state - a.truth) / found.sigma) ** 2))
    assert np.mean(ratio) < 0.5
    assert np.mean(inside) == pytest.approx(1, abs=0.2)


def test_very_long_gap_keeps_sigmas_positive():
    a = matched(12, 100, q=1e-3)
    time = a.time + np.where(np.arange(100) >= 50, 3600.0, 0.0)
    weight = a.weight.copy()
    weight[50:] = 0.0
    found = smooth(a, time=time, weight=weight, model=Model(SIGMA**2, a.model.jerk))
    assert np.isfinite(found.state).all()
    assert (found.sigma > 0).all()
    assert found.sigma[60, 0] > 1e4


def test_of_two_starts_at_one_sample_the_last_one_counts():
    a = matched(3, 60, dt=0.5, q=5.0)
    other = a.starts[0]._replace(state=a.starts[0].state + 1.0)
    found, expected = smooth(a, starts=[other, *a.starts]), smooth(a)
    np.testing.assert_array_equal(found.state, expected.state)
    np.testing.assert_array_equal(found.sigma, expected.sigma)
