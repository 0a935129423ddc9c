"""The EKF's linearisation against a plain EKF with numerical derivatives: x+ = x + K e, K = P H' S^-1."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering import forward
from ftproc.core.model import jacobian
from tests import naive
from tests.core.single import filter_at, random_problem
from tests.core.tracks import PATTERNS, matched


def test_linearisation_is_h_p_h():
    rng = np.random.default_rng(1)
    for _ in range(50):
        x, p, _, _ = random_problem(rng)
        f = filter_at(x, p)
        jacobian.linearise(f)
        expected = naive.extended(x, p)
        np.testing.assert_allclose(naive.difference(f["z_hat"], expected[0]), 0, atol=1e-10)
        scale = np.sqrt(np.diag(expected[1]))
        np.testing.assert_allclose(f["c"] / np.outer(scale, scale), expected[1] / np.outer(scale, scale), atol=1e-7)


def test_run_with_missing_readings_is_that_of_the_plain_ekf():
    a = matched(2, 80, irregular=True, missing=0.4, pieces=2)
    assert {tuple(w) for w in a.weight.astype(int)} == set(PATTERNS)
    run = forward.filter_log(a.log, a.model, a.starts, extended=True)
    steps = naive.run(
        a.time, a.z, a.weight, a.model, a.starts[0].state, a.starts[0].covariance, transform=naive.extended
    )  # fmt: skip
    sigma = np.array([np.sqrt(np.diag(s.p)) for s in steps])
    np.testing.assert_allclose((run.state - [s.x for s in steps]) / sigma, 0, atol=1e-6)
    np.testing.assert_allclose(run.sigma, sigma, rtol=1e-6)
    assert run.log_likelihood == pytest.approx(sum(s.likelihood for s in steps), rel=1e-7)


def test_far_target_ekf_and_ukf_agree():
    a = matched(3, 60, distance=1e6, missing=0.2)
    extended = forward.filter_log(a.log, a.model, a.starts, extended=True)
    plain = forward.filter_log(a.log, a.model, a.starts)
    np.testing.assert_allclose((extended.state - plain.state) / plain.sigma, 0, atol=1e-3)
    assert not np.array_equal(extended.state, plain.state)


def test_about_its_own_predictions_a_filter_is_the_extended_one():
    a = matched(4, 80, irregular=True, missing=0.3)
    extended = forward.filter_log(a.log, a.model, a.starts, extended=True)
    given = a.log._replace(about=np.array(extended.predicted[:, :3]))
    about = forward.filter_log(given, a.model, a.starts)
    np.testing.assert_allclose((about.state - extended.state) / extended.sigma, 0, atol=1e-6)
    np.testing.assert_allclose(about.sigma, extended.sigma, rtol=1e-9)
    assert about.log_likelihood == pytest.approx(extended.log_likelihood, rel=1e-9)
