"""Updates by weights and by Markov chains, held against plain versions and against what the theory says."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from scipy.special import logsumexp

from ftproc.core.comparators import ensemble, particles
from ftproc.core.comparators.fuzzy import trust_in_members, trust_in_reading
from tests.core.comparators.test_ensemble import LINEAR, NOISE, SENSOR, TRACKER, cloud

READING = np.array([4200.0, -0.70, 0.365])


def near(members, sensor=TRACKER, sigmas=1.0):
    """A reading about so many sigmas off what the members expect."""
    mean = sensor.measure(members.mean(0)[None])[0]
    return mean + sigmas * np.sqrt(np.diag(sensor.noise))


def test_kernel_sum_is_the_plain_one():
    rng = np.random.default_rng(0)
    for scale in (0.1, 1.0, 30.0):
        points, centres = scale * rng.standard_normal((17, 5)), rng.standard_normal((5, 23))
        expected = [logsumexp([-0.5 * ((p - c) ** 2).sum() for c in centres.T]) for p in points]
        np.testing.assert_allclose(particles.log_kernel_sum(points, centres), expected, rtol=1e-12, atol=1e-12)


def test_width_is_silvermans():
    assert particles.silverman(100, 9) == pytest.approx((4 / 1100) ** (1 / 13))


def test_resampling_keeps_each_within_one_of_its_share():
    rng = np.random.default_rng(0)
    for _ in range(50):
        weight = rng.dirichlet(np.full(40, 0.3))
        counts = np.bincount(particles.resampled(weight, rng), minlength=40)
        assert (np.abs(counts - 40 * weight) < 1).all()
        assert counts.sum() == 40


def test_weights_are_likelihood_times_prior_over_proposal():
    """Of a mildly disagreeing reading; n > 3 d, so that both Gaussians are fitted."""
    members = cloud(1, n=80)
    z = near(members, sigmas=1.5)
    known = ensemble.forecast(members, z, TRACKER)
    found = particles.enpf(known, np.random.default_rng(2))
    moved = ensemble.corrected(known, 1.0, np.random.default_rng(2))
    log = np.array([stats.multivariate_normal(np.zeros(3), TRACKER.noise).logpdf(
        TRACKER.subtract(z, TRACKER.measure(x[None])[0])) for x in moved])  # fmt: skip
    log += stats.multivariate_normal(members.mean(0), np.cov(members.T)).logpdf(moved)
    log -= stats.multivariate_normal(moved.mean(0), np.cov(moved.T)).logpdf(moved)
    weight = np.exp(log - logsumexp(log))
    np.testing.assert_allclose(found.estimate, weight @ moved, rtol=1e-7)


def test_few_members_are_weighed_by_likelihood_only():
    members = cloud(1, n=20)
    known = ensemble.forecast(members, near(members), TRACKER)
    found = particles.enpf(known, np.random.default_rng(2))
    moved = ensemble.corrected(known, 1.0, np.random.default_rng(2))
    off = TRACKER.subtract(known.reading, TRACKER.measure(moved))
    weight = np.exp(-0.5 * (off**2 / np.diag(TRACKER.noise)).sum(1))
    np.testing.assert_allclose(found.estimate, weight @ moved / weight.sum(), rtol=1e-9)


def test_collapsed_weights_leave_the_kalman_members():
    """Close to the station, from a wide prior, the proposal misses the posterior."""
    members = np.random.default_rng(0).normal([200, 100, 80, 0, 0, 0, 0, 0, 0], 90, (100, 9))
    known = ensemble.forecast(members, np.array([230.0, 0.5, 0.3]), TRACKER)
    found = particles.enpf(known, np.random.default_rng(3))
    np.testing.assert_array_equal(found.members, ensemble.corrected(known, 1.0, np.random.default_rng(3)))


def test_gate_refuses_and_lets_pass():
    members = cloud(2)
    refused = particles.enpf_gated(ensemble.forecast(members, near(members, sigmas=30), TRACKER), None)
    assert refused.gamma == 0.0
    assert refused.members is members
    np.testing.assert_array_equal(refused.estimate, members.mean(0))
    known = ensemble.forecast(members, near(members), TRACKER)
    passed = particles.enpf_gated(known, np.random.default_rng(0))
    np.testing.assert_array_equal(passed.members, particles.enpf(known, np.random.default_rng(0)).members)


def test_renpf_is_the_one_member_by_member():
    """Every density by SciPy, one chain at a time; the draws in the same order."""
    members = cloud(3, n=40)
    z = near(members, sigmas=8.0)
    known = ensemble.forecast(members, z, TRACKER)
    found = particles.renpf(known, np.random.default_rng(9))

    rng, (n, d) = np.random.default_rng(9), members.shape
    gamma = trust_in_reading(known.rho, 3)
    assert 0 < gamma < 1
    start = ensemble.corrected(known, gamma, rng)
    inverse = np.linalg.inv(known.covariance)

    def rho(x):
        e = TRACKER.subtract(z, TRACKER.measure(x[None])[0])
        return e @ inverse @ e

    trust = trust_in_members(rho(start.mean(0)), np.array([rho(x) for x in start]), 3)
    h = particles.silverman(n, d)
    p = np.cov(members.T)
    centres = members.mean(0) + np.sqrt(1 - h**2) * (members - members.mean(0))
    kernel = stats.multivariate_normal(np.zeros(d), h**2 * p)
    noise = stats.multivariate_normal(np.zeros(3), TRACKER.noise)

    def log_target(x, i):
        return logsumexp(kernel.logpdf(x - centres)) + trust[i] * noise.logpdf(
            TRACKER.subtract(z, TRACKER.measure(x[None])[0])
        )

    steps = rng.standard_normal((particles.MOVES, n, d)) @ (2.38 / np.sqrt(d) * np.linalg.cholesky(np.cov(start.T))).T
    uniform = 1 - rng.random((particles.MOVES, n))
    last, accepted = start.copy(), 0
    for i in range(n):
        for move, u in zip(steps[:, i], uniform[:, i], strict=True):
            if np.log(u) < log_target(last[i] + move, i) - log_target(last[i], i):
                last[i] += move
                accepted += 1
    assert 0 < accepted < 0.6 * n * particles.MOVES
    np.testing.assert_allclose(found.estimate, last.mean(0), rtol=1e-9)
    np.testing.assert_allclose(
        found.members, last.mean(0) + np.sqrt(1 + particles.WIDER / n) * (last - last.mean(0)), rtol=1e-9
    )
    assert found.gamma == gamma


@pytest.mark.compiled
def test_renpf_agrees_with_the_kalman_filter_where_all_is_gaussian():
    """Averages of 60 updates of 400 members each; a reading in the bulk, so that the weights are one."""
    rng = np.random.default_rng(1)
    p = np.diag([4.0, 2.0, 1.0, 3.0])
    s = LINEAR @ p @ LINEAR.T + NOISE
    gain = p @ LINEAR.T @ np.linalg.inv(s)
    z = np.array([0.8, -0.6])
    means, spreads = [], []
    for _ in range(60):
        known = ensemble.forecast(ensemble.draw(np.zeros(4), p, 400, rng), z, SENSOR)
        found = particles.renpf(known, rng)
        assert found.gamma == 1.0
        means.append(found.estimate)
        spreads.append(np.diag(ensemble.spread(found.members)))
    posterior = np.diag(p - gain @ s @ gain.T)
    np.testing.assert_allclose(np.mean(means, 0), gain @ z, atol=0.1 * np.sqrt(posterior).max())
    np.testing.assert_allclose(np.mean(spreads, 0), posterior, rtol=0.15)


@pytest.mark.compiled
def test_chains_without_a_reading_keep_the_prior():
    """gamma = 0: the target is the prior alone, whose mean and covariance are the members'."""
    rng = np.random.default_rng(2)
    moved = []
    for _ in range(60):
        members = ensemble.draw(np.zeros(4), np.diag([4.0, 2.0, 1.0, 3.0]), 200, rng)
        found = particles.renpf(ensemble.forecast(members, np.array([500.0, 0.0]), SENSOR), rng)
        assert found.gamma == 0.0
        assert not np.array_equal(found.members, members)
        moved.append(found.members)
    every = np.concatenate(moved)
    np.testing.assert_allclose(every.mean(0), 0, atol=0.1)
    np.testing.assert_allclose(np.diag(np.cov(every.T)), [4, 2, 1, 3], rtol=0.06)


@pytest.mark.parametrize("name", list(particles.UPDATES))
def test_same_seed_same_bytes(name):
    members = cloud(4, n=100)
    known = ensemble.forecast(members, near(members), TRACKER)
    a, b, c = (particles.UPDATES[name](known, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert a.members.tobytes() == b.members.tobytes()
    assert a.members.tobytes() != c.members.tobytes()
