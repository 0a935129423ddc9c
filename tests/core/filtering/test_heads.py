"""The smoothed covariance of vague states, against one least-squares problem over all states of a record, solved by QR:
no covariance stands in it, so vagueness costs it nothing.

    minimise |P0^-1/2 (x_0 - m)|^2 + sum |Q^-1/2 (x_{k+1} - Phi x_k)|^2 + sum |R^-1/2 (z_k - H x_k)|^2
"""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering import heads, smoother
from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.model.motion import isotropic
from ftproc.simulation import simulate
from tests import naive
from tests.core.tracks import covariance

SIGMA = np.array([1.0, 1e-8, 1e-8])  # at 100,000 km: 1 m along and across
VAGUE = np.diag(np.repeat([50.0, 1e3, 1e3], 3) ** 2)
VAGUER = np.diag(np.repeat([50.0, 1e4, 1e6], 3) ** 2)


def record(times, q=1.0, markov=0.0, tau_s=3.0, covariance=VAGUE):
    """A straight flight far away, on which h is as good as linear."""
    truth = np.array([[6e7 + 100 * t, -7e7, 3e7, 100.0, 0.0, 0.0, 0.0, 0.0, 0.0] for t in times])
    z = np.array([naive.measure(x) for x in truth])
    model = Model(SIGMA**2, isotropic(q), markov_variance=markov * SIGMA**2, tau_s=np.full(3, tau_s))
    log = Observations(np.asarray(times, float), z, np.ones_like(z))
    return log, model, [Start(0, truth[0], covariance)], truth


def batch(log, model, starts, truth):
    """(n, 9) sigmas of all states by QR."""
    n, size = len(log.time_s), 12 if model.coloured else 9
    rows = []

    def add(root, *blocks):
        row = np.zeros((len(root), n * size))
        for k, block in blocks:
            row[:, k * size : (k + 1) * size] = np.linalg.solve(root, block)
        rows.append(row)

    first = np.zeros((size, size))
    first[:9, :9] = starts[0].covariance
    first[9:, 9:] = np.diag(model.markov_variance[: size - 9])
    add(np.linalg.cholesky(first), (0, np.eye(size)))
    for k in range(n):
        if k:
            t = log.time_s[k] - log.time_s[k - 1]
            phi, q = np.zeros((size, size)), np.zeros((size, size))
            phi[:9, :9], q[:9, :9] = naive.transition(t), naive.van_loan(t, model.jerk[0])
            kept = np.exp(-t / model.tau_s[: size - 9])
            phi[9:, 9:], q[9:, 9:] = np.diag(kept), np.diag((1 - kept**2) * model.markov_variance[: size - 9])
            add(np.linalg.cholesky(q), (k - 1, -phi), (k, np.eye(size)))
        seen = np.flatnonzero(log.weight[k] > 0)
        h = np.hstack([naive.jacobian(truth[k]), np.eye(3)])[seen][:, :size]
        add(np.diag(np.sqrt(model.noise_variance[seen])), (k, h))
    a = np.vstack(rows)
    scale = np.linalg.norm(a, axis=0)
    inverse = np.linalg.inv(np.linalg.qr(a / scale, mode="r"))
    return (np.linalg.norm(inverse, axis=1) / scale).reshape(n, size)[:, :9]


@pytest.mark.parametrize("markov", [0.0, 2.0])
@pytest.mark.parametrize(("dt", "covariance"), [(0.5, VAGUE), (0.02, VAGUE), (0.02, VAGUER)])
def test_first_sigmas_are_those_of_the_whole_record(dt, covariance, markov):
    case = record(dt * np.arange(30), markov=markov, covariance=covariance)
    found = smoother.smooth_log(*case[:3])
    np.testing.assert_allclose(found.sigma, batch(*case), rtol=2e-3)
    np.testing.assert_allclose(np.sqrt(np.diag(found.heads[0].covariance)), found.sigma[0], rtol=1e-9)


def test_the_plain_difference_would_not_hold():
    """What the module is for: without it the same sigmas are rounding."""
    case = record(0.02 * np.arange(30), covariance=VAGUER)
    run = smoother.smooth_log(*case[:3], wanted=smoother.HEADS)
    wrong = np.sqrt(np.diag(run.heads[0].covariance)) / batch(*case)[0]
    assert wrong.max() > 10


@pytest.mark.parametrize("gap_s", [3.0, 30.0])
@pytest.mark.parametrize("markov", [0.0, 2.0])
def test_sigmas_around_a_gap(gap_s, markov):
    times = np.r_[0.1 * np.arange(15), gap_s + 0.1 * np.arange(15)]
    case = record(times, q=1e-3, markov=markov, covariance=np.diag(np.repeat([5.0, 3.0, 2.0], 3) ** 2))
    np.testing.assert_allclose(smoother.smooth_log(*case[:3]).sigma, batch(*case), rtol=5e-3)


def test_sigmas_where_components_come_late():
    """No elevation in the first half: the state stays vague for long."""
    log, *rest, truth = record(0.05 * np.arange(40))
    log.weight[:20, 2] = 0.0
    np.testing.assert_allclose(smoother.smooth_log(log, *rest).sigma, batch(log, *rest, truth), rtol=2e-3)


def test_several_rows_at_one_time():
    case = record(np.repeat(0.1 * np.arange(8), 3))
    log, *rest, truth = case
    found = smoother.smooth_log(log, *rest).sigma
    np.testing.assert_allclose(found[::3], found[1::3], rtol=1e-6)
    once = log.part(slice(None, None, 3)), rest[0]._replace(noise_variance=SIGMA**2 / 3), rest[1], truth[::3]
    np.testing.assert_allclose(found[::3], batch(*once), rtol=2e-3)


def test_sigmas_across_a_block(monkeypatch):
    """A vague state at the first sample of a block, whose predecessor lies in another."""
    from ftproc.core.filtering import memory

    case = record(0.02 * np.arange(30))
    whole = smoother.smooth_log(*case[:3])
    for block in (1, 3, 7):
        monkeypatch.setattr(memory, "BLOCK", block)
        np.testing.assert_allclose(smoother.smooth_log(*case[:3]).sigma, whole.sigma, rtol=1e-9)


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("scenario", "seed", "dt_s"),
    [("overhead", 5, 0.02), ("radar", 6, 0.05), ("calibration", 7, 0.01), ("family", 8, 0.02), ("zuo2021", 9, 0.02)],
)
def test_no_sigma_leaps_between_neighbours(scenario, seed, dt_s):
    """Over a few milliseconds the process noise changes a variance by Q and what motion carries over, no more; and no
    error is far out of its sigma."""
    from ftproc.methods import anti_outlier
    from ftproc.methods.estimate import Readings
    from ftproc.settings import FilterSettings

    flight = simulate(scenario, seed=seed, dt_s=dt_s, duration_s=4000 * dt_s, outliers="none")
    readings = Readings(flight.log.time_s, flight.log.measurement, np.full(3, np.nan))
    found = anti_outlier.estimate(readings, FilterSettings(smooth=True)).smoothed
    ratio = found.sigma[1:51] / found.sigma[:50]
    assert ratio.min() > 0.5
    assert ratio.max() < 2.0


def test_invert():
    p = covariance(np.random.default_rng(3), np.logspace(-3, 6, 9))
    inverse, spread = np.zeros((9, 9)), np.sqrt(np.diag(p))
    assert heads.invert(p, inverse, np.zeros((9, 9)), np.zeros(9))
    np.testing.assert_allclose(inverse @ p * np.outer(spread, 1 / spread), np.eye(9), atol=1e-8)
    singular = np.ones((9, 9))
    assert not heads.invert(singular, np.zeros((9, 9)), np.zeros((9, 9)), np.zeros(9))
    broken = np.eye(9)
    broken[4, 4] = np.nan
    assert not heads.invert(broken, np.zeros((9, 9)), np.zeros((9, 9)), np.zeros(9))
