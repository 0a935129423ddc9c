"""Gradients against differences of the formulas, and sigmas against J P J' with the whole covariance."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering import forward, smoother
from ftproc.core.model import kinematics
from tests import naive
from tests.core.tracks import covariance, matched

LEVEL = np.r_[0.0, 0.0, 0.0, 180.0, -60.0, 15.0, 3.0, 20.0, -4.0]
STEEP = np.r_[0.0, 0.0, 0.0, -20.0, 5.0, 200.0, 1.0, -2.0, -30.0]
SLOW = np.r_[0.0, 0.0, 0.0, 0.4, 0.3, -0.2, 0.5, 0.1, 2.0]


def quantities(x):
    """As the textbooks write them: m/s, rad, m/s, rad, rad/s, g."""
    (vx, vy, vz), a = x[3:6], x[6:9]
    ground, v = np.hypot(vx, vy), np.linalg.norm(x[3:6])
    force = a + np.array([0, 0, 9.80665])
    if v > 1:
        along = x[3:6] / v
        force = force - (force @ along) * along
    turn = (vx * a[1] - vy * a[0]) / ground**2
    return np.array([ground, np.arctan2(vy, vx), vz, np.arctan2(vz, ground), turn, np.linalg.norm(force) / 9.80665])


def jacobian(x, step=1e-5):
    """(6, 9) by differences."""
    return np.array([(quantities(x + d) - quantities(x - d)) / (2 * step) for d in step * np.eye(9)]).T


@pytest.mark.parametrize("state", [LEVEL, STEEP, SLOW])
def test_sigmas_are_those_of_the_whole_covariance(state):
    p = covariance(np.random.default_rng(3), np.repeat([4.0, 0.5, 0.2], 3))
    expected = np.sqrt(np.diag(jacobian(state) @ p @ jacobian(state).T))
    np.testing.assert_allclose(kinematics.sigma_of(state[None], p[None])[0], expected, rtol=1e-5)


@pytest.mark.parametrize("state", [LEVEL, STEEP, SLOW])
def test_independent_errors_widen_them(state):
    p, added = np.diag(np.repeat([4.0, 0.5, 0.2], 3) ** 2), np.linspace(0.1, 0.9, 9)
    before = kinematics.sigma_of(state[None], p[None])
    wider = kinematics.widened(state[None], before, np.sqrt(np.diag(p))[None], np.sqrt(np.diag(p) + added)[None])
    np.testing.assert_allclose(wider, kinematics.sigma_of(state[None], (p + np.diag(added))[None]), rtol=1e-9)


def test_a_target_at_rest_and_free_fall_have_finite_sigmas():
    p = np.eye(9)[None]
    assert np.isfinite(kinematics.sigma_of(np.zeros((1, 9)), p)).all()
    falling = np.r_[np.zeros(3), 10.0, 0.0, 0.0, 0.0, 0.0, -kinematics.GRAVITY]
    assert np.isfinite(kinematics.sigma_of(falling[None], p)).all()


@pytest.mark.parametrize("missing", [0.0, 0.3])
def test_filter_and_smoother_have_the_sigmas_of_their_covariance(missing):
    a = matched(4, 60, dt=0.5, q=5.0, missing=missing, irregular=True)
    steps = naive.run(a.time, a.z, a.weight, a.model, a.starts[0].state, a.starts[0].covariance)
    filtered, smoothed = (
        forward.filter_log(a.log, a.model, a.starts),
        smoother.smooth_log(a.log, a.model, a.starts, smoother.PATHS),
    )
    expected = kinematics.sigma_of(filtered.state, np.array([step.p for step in steps]))
    np.testing.assert_allclose(filtered.path_sigma, expected, rtol=1e-6)
    x, p = naive.smooth(steps)
    np.testing.assert_allclose(smoothed.path_sigma, kinematics.sigma_of(x, p), rtol=1e-6)
