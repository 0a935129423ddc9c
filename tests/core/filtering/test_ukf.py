"""The unscented update: 7 points against all 19, every missing pattern, the cut, wide covariances.

z^ = h(x) + sum W d,  d_i = h(X_i) - h(x) wrapped,  X = x, x +- 3 columns of chol(P),  W = 0, 1/18 ... 1/18
C = sum W (d - d^)(d - d^)',  P_xz = sum W (X - x)(d - d^)',  S = C + R,  K = P_xz S^-1
x+ = x + K (z - z^),  P+ = P - K S K'
"""

from __future__ import annotations

import numpy as np
import pytest
from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter

from ftproc.core.filtering import forward, unscented
from ftproc.core.model import jacobian
from ftproc.core.model.measurement import measure
from tests import naive
from tests.core.single import close, random_problem, transform, update
from tests.core.tracks import PATTERNS, covariance, matched


def test_weights_of_the_19_points_are_0_and_1_in_18():
    points = MerweScaledSigmaPoints(9, alpha=1.0, beta=0.0, kappa=0.0)
    np.testing.assert_allclose(points.Wm, np.r_[0.0, np.full(18, 1 / 18)], atol=1e-15)
    np.testing.assert_allclose(points.Wc, points.Wm, atol=1e-15)
    assert unscented.SPREAD == 3.0


def test_transform_of_7_points_is_that_of_19():
    rng = np.random.default_rng(1)
    for _ in range(200):
        x, p, _, _ = random_problem(rng)
        z_hat, c, pxz, _ = transform(x, p)
        expected = naive.unscented(x, p)
        scale = np.sqrt(np.diag(expected[1]))
        np.testing.assert_allclose(naive.difference(z_hat, expected[0]) / scale, 0, atol=1e-10)
        np.testing.assert_allclose(c / np.outer(scale, scale), expected[1] / np.outer(scale, scale), atol=1e-10)
        rows = np.sqrt(np.diag(p))[:, None]
        np.testing.assert_allclose(pxz / rows / scale, expected[2] / rows / scale, atol=1e-10)


def test_run_of_random_steps_is_that_of_the_plain_19_point_filter():
    """Irregular intervals, random jerk tensors, and every missing pattern many times over."""
    a = matched(2, 120, dt=0.5, irregular=True, pieces=3, missing=0.4, distance=800.0)
    assert {tuple(w) for w in a.weight.astype(int)} == set(PATTERNS)
    run = forward.filter_log(a.log, a.model, a.starts)
    steps = naive.run(a.time, a.z, a.weight, a.model, a.starts[0].state, a.starts[0].covariance)
    for k, step in enumerate(steps):
        sigma = np.sqrt(np.diag(step.p))
        np.testing.assert_allclose(
            run.state[k] / sigma, step.x / sigma, atol=1e-10 * (1 + np.abs(step.x / sigma).max())
        )
        np.testing.assert_allclose(run.sigma[k], sigma, rtol=1e-10)
    np.testing.assert_allclose(run.nis, [s.nis for s in steps], rtol=1e-8)
    assert run.log_likelihood == pytest.approx(sum(s.likelihood for s in steps), rel=1e-10)


@pytest.mark.parametrize("pattern", PATTERNS)
def test_missing_pattern_is_the_sub_vector_update(pattern):
    rng = np.random.default_rng(3)
    for _ in range(20):
        x, p, z, noise = random_problem(rng)
        z[np.array(pattern) == 0] = np.nan
        weight = np.ones(3)
        found = update(x, p, z, noise, weight)
        expected = naive.update(x, p, naive.unscented(x, p), z, noise, weight)
        close(found, expected, p, 1e-10)
        if any(pattern):
            assert found[2:] == pytest.approx(expected[2:], rel=1e-9, abs=1e-9)


def test_weight_divides_the_noise_and_touches_no_other_component():
    rng = np.random.default_rng(4)
    for _ in range(50):
        x, p, z, noise = random_problem(rng)
        weight = rng.choice([0.0, 0.05, 0.5, 1.0], 3)
        close(
            update(x, p, z, noise, weight), naive.update(x, p, naive.unscented(x, p), z, noise, weight), p, 1e-10
        )  # fmt: skip
        barred = z.copy()
        barred[weight == 0] = np.nan
        np.testing.assert_array_equal(update(x, p, barred, noise, weight)[0], update(x, p, z, noise, weight)[0])


@pytest.mark.parametrize("azimuth", [np.pi, -np.pi, np.pi / 2, -np.pi / 2])
def test_angles_are_averaged_about_the_centre_across_the_cut(azimuth):
    """The same problem turned by a quarter or a half gives the same answer, turned."""
    rng = np.random.default_rng(5)
    p = np.diag(np.r_[40.0, 40, 40, 5, 5, 5, 1, 1, 1]) ** 2
    x = np.r_[500.0, 0, 200, 3, 4, 5, 0.1, 0.2, 0.3]
    z = naive.measure(x) + rng.normal(0, 0.02, 3)
    turn = np.kron(
        np.eye(3), [[np.cos(azimuth), -np.sin(azimuth), 0], [np.sin(azimuth), np.cos(azimuth), 0], [0, 0, 1]]
    )
    noise = np.array([4.0, 1e-4, 1e-4])
    straight = update(x, p, z, noise, np.ones(3))
    z_turned = naive.difference(z, np.array([0.0, -azimuth, 0.0]))
    turned = update(turn @ x, turn @ p @ turn.T, z_turned, noise, np.ones(3))
    np.testing.assert_allclose(turned[0], turn @ straight[0], atol=1e-9)
    np.testing.assert_allclose(turned[1], turn @ straight[1] @ turn.T, atol=1e-8)


def test_ukf_is_the_kalman_filter_where_h_is_straight():
    """A far target and a narrow covariance: x+ = x + K e, K = P H' (H P H' + R)^-1 with the Jacobian H."""
    rng = np.random.default_rng(6)
    for _ in range(20):
        x = np.r_[rng.normal(0, 1e6, 3), rng.normal(0, 100, 6)]
        p = covariance(rng, np.r_[rng.uniform(1e-3, 1e-2, 3), np.full(6, 0.1)])
        noise = np.array([1e-2, 1e-8, 1e-8]) ** 2
        z = measure(*x[:3]) + rng.standard_normal(3) * np.sqrt(noise)
        h = np.zeros((3, 9))
        block = np.zeros((3, 3))
        jacobian.jacobian(x, block)
        h[:, :3] = block
        gain = p @ h.T @ np.linalg.inv(h @ p @ h.T + np.diag(noise))
        expected = x + gain @ naive.difference(z, np.array(measure(*x[:3]))), (np.eye(9) - gain @ h) @ p
        found = update(x, p, z, noise, np.ones(3))
        sigma = np.sqrt(np.diag(p))
        np.testing.assert_allclose((found[0] - expected[0]) / sigma, 0, atol=1e-6)
        np.testing.assert_allclose((found[1] - expected[1]) / np.outer(sigma, sigma), 0, atol=1e-6)


def test_one_update_is_filterpys():
    def about_the_centre(points, weights):
        return points[0] + weights @ [naive.difference(point, points[0]) for point in points]

    rng = np.random.default_rng(7)
    points = MerweScaledSigmaPoints(9, alpha=1.0, beta=0.0, kappa=0.0)
    for _ in range(10):
        x, p, z, noise = random_problem(rng)
        reference = UnscentedKalmanFilter(
            9, 3, 1.0, hx=naive.measure, fx=None, points=points, z_mean_fn=about_the_centre, residual_z=naive.difference
        )
        reference.x, reference.P, reference.R = x.copy(), p.copy(), np.diag(noise)
        reference.sigmas_f = points.sigma_points(x, p)
        reference.update(z)
        close(update(x, p, z, noise, np.ones(3)), (reference.x, reference.P), p, 1e-9)


@pytest.mark.parametrize("missing", [(), (0,), (1, 2)])
def test_wide_covariance_draws_the_points_together(missing):
    """After a long coast: still the scaled transform, of a smaller alpha, and nothing negative comes of it."""
    rng = np.random.default_rng(8)
    for _ in range(50):
        x, p, z, noise = random_problem(rng, spread=rng.choice([0.5, 5.0, 50.0]))
        slant, widest = np.linalg.norm(x[:3]), np.sqrt(np.trace(p[:3, :3]))
        spread = min(unscented.SPREAD, unscented.MAX_SPREAD_IN_RANGES * slant / widest)
        expected = naive.unscented(x, p, spread)
        z_hat, c, _, h = transform(x, p)
        scale = np.sqrt(np.diag(expected[1]))
        np.testing.assert_allclose(naive.difference(z_hat, expected[0]) / scale, 0, atol=1e-6)
        np.testing.assert_allclose(c / np.outer(scale, scale), expected[1] / np.outer(scale, scale), atol=1e-6)
        bend = (c - h @ p[:3, :3] @ h.T) / np.outer(scale, scale)
        assert np.linalg.eigvalsh(bend).min() > -1e-9
        z[list(missing)] = np.nan
        updated = update(x, p, z, noise, np.ones(3))[1]
        np.testing.assert_array_equal(updated, updated.T)
        sigma = np.sqrt(np.diag(p))
        assert np.linalg.eigvalsh(updated / np.outer(sigma, sigma)).min() > -1e-12
