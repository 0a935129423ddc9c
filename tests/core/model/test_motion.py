"""Prediction and its adjoint against plain matrices; Q against numerical integration and Van Loan."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering.backward import BACKWARD
from ftproc.core.model import motion
from tests import naive
from tests.core.single import filter_at, one
from tests.core.tracks import covariance, random_jerk

INTERVALS = [0.0, 1e-6, 0.05, 1.0, 7.3, 120.0, -0.05, -2.0]


def predict(x, p, interval, jerk):
    """x and P after the interval."""
    f = filter_at(x, p)
    f["jerk"] = jerk
    motion.predict(f, interval)
    return f["x"], f["p"]


def noise_of(interval, jerk):
    """Q as `predict` adds it: what becomes of P = 0."""
    return predict(np.zeros(9), np.zeros((9, 9)), interval, jerk)[1]


def scaled(q, interval):
    """Elements in units of the powers of the interval that they have."""
    power = np.repeat([2.5, 1.5, 0.5], 3)
    return q / abs(interval) ** np.add.outer(power, power)


@pytest.mark.parametrize("interval", INTERVALS)
def test_predict_is_phi_p_phi_plus_q(interval):
    rng = np.random.default_rng(1)
    for _ in range(10):
        x, jerk = rng.normal(0, 100, 9), random_jerk(rng)[0]
        p = covariance(rng, 10 ** rng.uniform(-1, 2, 9))
        phi = naive.transition(interval)
        expected = phi @ p @ phi.T + naive.process_noise(interval, jerk)
        found_x, found = predict(x, p, interval, jerk)
        np.testing.assert_allclose(found_x, phi @ x, rtol=1e-13, atol=1e-9)
        scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
        np.testing.assert_allclose(found / scale, expected / scale, atol=1e-11)


def test_predict_over_no_time_changes_nothing():
    rng = np.random.default_rng(2)
    x, p = rng.normal(0, 1, 9), covariance(rng, np.ones(9))
    after = predict(x, p, 0.0, random_jerk(rng)[0])
    np.testing.assert_array_equal(after[0], x)
    np.testing.assert_array_equal(after[1], p)


def test_predict_there_and_back_returns_the_state():
    rng = np.random.default_rng(3)
    x = rng.normal(0, 10, 9)
    there = x
    for t in (3.7, -3.7):
        there, _ = predict(there, np.eye(9), t, np.zeros(3))
    np.testing.assert_allclose(there, x, atol=1e-12)


@pytest.mark.parametrize("interval", [0.01, 0.1, 1.0, 10.0])
def test_q_against_van_loan(interval):
    jerk = random_jerk(np.random.default_rng(4))[0]
    q = noise_of(interval, jerk)
    np.testing.assert_allclose(scaled(q, interval), scaled(naive.van_loan(interval, jerk), interval), atol=1e-10)
    assert np.linalg.eigvalsh(scaled(q, interval)).min() > 0


def test_q_composes_whatever_the_intervals():
    rng = np.random.default_rng(5)
    jerk = random_jerk(rng)[0]
    for t1, t2 in rng.uniform(0, 5, (20, 2)):
        phi = naive.transition(t2)
        composed = phi @ noise_of(t1, jerk) @ phi.T + noise_of(t2, jerk)
        np.testing.assert_allclose(composed, noise_of(t1 + t2, jerk), rtol=1e-12)


def test_q_is_positive_and_as_large_backwards_as_forwards():
    jerk = random_jerk(np.random.default_rng(6))[0]
    forwards, backwards = noise_of(2.0, jerk), noise_of(-2.0, jerk)
    np.testing.assert_allclose(np.diag(forwards), np.diag(backwards), rtol=1e-15)
    assert np.linalg.eigvalsh(scaled(backwards, 2.0)).min() > 0
    np.testing.assert_allclose(backwards[:3, 3:6], -forwards[:3, 3:6], rtol=1e-15)


@pytest.mark.parametrize("interval", [0.0, 0.05, 1.0, 12.5, -1.0])
def test_adjoint_is_the_transpose(interval):
    rng = np.random.default_rng(7)
    r, n = rng.normal(0, 1, 9), covariance(rng, np.ones(9))
    phi = naive.transition(interval)
    back = one(BACKWARD)
    back["r"], back["n"] = r, n
    motion.adjoint(back, interval)
    np.testing.assert_allclose(back["r"], phi.T @ r, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(back["n"], phi.T @ n @ phi, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize(
    ("time", "piece"),
    [(0.0, 0), (9.999, 0), (10.0, 1), (25.0, 2), (39.0, 3), (40.0, 3), (1e6, 3), (-5.0, 0)],
)
def test_knot_index_is_clamped_to_the_profile(time, piece):
    assert motion.knot_index(time + 100.0, motion.Profile(np.ones((4, 3)), 10.0, 100.0)) == piece


def test_knot_index_of_a_single_level():
    assert motion.knot_index(1e9, motion.Profile(np.ones((1, 3)), np.inf, 0.0)) == 0


def test_isotropic_is_the_same_along_every_axis():
    np.testing.assert_array_equal(motion.isotropic(3.0), [[3.0, 3.0, 3.0]])
