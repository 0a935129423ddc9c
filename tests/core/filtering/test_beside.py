"""Range rates in the filter and the smoother, against the textbook written out on whole matrices."""

import numpy as np
import pytest

from ftproc.core.filtering.beside import RESIDUAL, SPREAD, WIDTH
from ftproc.core.filtering.forward import filter_log, filter_with_beside
from ftproc.core.filtering.records import Model, Observations, Scalars, Start
from ftproc.core.filtering.smoother import likelihood_of, residuals_beside, score_log, smooth_log
from ftproc.core.model.frames import from_cartesian
from ftproc.core.model.motion import Profile, isotropic

JERK, NOISE, RATE_VARIANCE = 0.2, np.array([9.0, 4e-8, 4e-8]), 0.25


def phi(interval):
    return np.kron(np.array([[1, interval, interval**2 / 2], [0, 1, interval], [0, 0, 1]]), np.eye(3))


def process_noise(t):
    one = [[t**5 / 20, t**4 / 8, t**3 / 6], [t**4 / 8, t**3 / 3, t**2 / 2], [t**3 / 6, t**2 / 2, t]]
    return JERK * np.kron(np.array(one), np.eye(3))


def reading(x):
    return from_cartesian(x[:3])


def rate(x):
    return x[:3] @ x[3:6] / np.linalg.norm(x[:3])


def slope(function, x):
    step = 1e-3 * np.eye(9)
    return np.stack([(function(x + each) - function(x - each)) / 2e-3 for each in step], -1)


def textbook(log, start, weight):
    """Extended Kalman filter, a rate before the readings of its row, and Rauch-Tung-Striebel smoother."""
    x, p = start.state, start.covariance
    ahead, after = [], []
    for k, now in enumerate(log.time_s):
        if k:
            interval = now - log.time_s[k - 1]
            x, p = phi(interval) @ x, phi(interval) @ p @ phi(interval).T + process_noise(interval)
        ahead.append((x, p))
        if weight[k] > 0:
            h = slope(rate, x)
            s = h @ p @ h + RATE_VARIANCE
            x, p = x + p @ h * (log.beside[0].value[k] - rate(x)) / s, p - np.outer(p @ h, p @ h) / s
        on = np.flatnonzero(log.weight[k] > 0)
        h = slope(reading, x)[on]
        s = h @ p @ h.T + np.diag(NOISE[on])
        gain = p @ h.T @ np.linalg.inv(s)
        x, p = x + gain @ (log.measurement[k] - reading(x))[on], p - gain @ s @ gain.T
        after.append((x, p))
    back = [after[-1]]
    for k in range(len(after) - 2, -1, -1):
        f = phi(log.time_s[k + 1] - log.time_s[k])
        gain = after[k][1] @ f.T @ np.linalg.inv(ahead[k + 1][1])
        x = after[k][0] + gain @ (back[-1][0] - ahead[k + 1][0])
        back.append((x, after[k][1] + gain @ (back[-1][1] - ahead[k + 1][1]) @ gain.T))
    return after, back[::-1]


@pytest.fixture(scope="module")
def scene():
    rng = np.random.default_rng(0)
    t = np.sort(rng.uniform(0, 20, 40))
    states = [np.array([3000, 2000, 1500, -60, 40, 5, 0.5, -0.3, 0.1])]
    for interval in np.diff(t):
        states.append(phi(interval) @ states[-1])
    true = np.array(states)
    z = from_cartesian(true[:, :3]) + rng.standard_normal((40, 3)) * np.sqrt(NOISE)
    rates = np.array([rate(x) for x in true]) + 0.5 * rng.standard_normal(40)
    rates[5] = np.nan
    rates[7] += 40
    used, weight = np.ones((40, 3)), np.ones(40)
    used[9, 0], weight[[5, 7]] = 0, 0
    log = Observations(t, z, used, beside=(Scalars.rates(rates, RATE_VARIANCE, weight),))
    spread = np.repeat([5.0, 2.0, 0.3], 3)
    start = Start(0, true[0] + rng.standard_normal(9) * spread, np.diag(spread**2))
    return log, start, Model(NOISE, isotropic(JERK))


def test_filter_and_smoother_are_the_textbook_s(scene):
    log, start, model = scene
    after, back = textbook(log, start, log.beside[0].weight)
    run, smoothed = filter_log(log, model, [start]), smooth_log(log, model, [start])
    for k, ((x, _), (s, p)) in enumerate(zip(after, back, strict=True)):
        assert np.abs((run.state[k] - x) / run.sigma[k]).max() < 0.01
        assert np.abs((smoothed.state[k] - s) / smoothed.sigma[k]).max() < 0.01
        np.testing.assert_allclose(smoothed.sigma[k], np.sqrt(np.diag(p)), rtol=1e-3)


@pytest.mark.parametrize("k", [0, 3, 7, 20, 39])
def test_a_residual_is_that_of_all_the_rest(scene, k):
    log, start, model = scene
    residual, variance = residuals_beside(log, model, [start])[0].T
    weight = log.beside[0].weight.copy()
    weight[k] = 0
    x, p = textbook(log, start, weight)[1][k]
    h = slope(rate, x)
    assert residual[k] == pytest.approx(log.beside[0].value[k] - rate(x), abs=0.01)
    assert variance[k] == pytest.approx(h @ p @ h + RATE_VARIANCE, rel=1e-3)
    assert np.isnan(residual[5])


@pytest.mark.parametrize("component", range(3))
def test_scores_are_the_slopes_of_the_likelihood(scene, component):
    log, start, model = scene
    step = 1e-4 * np.eye(3)[component]

    def slope_by(change):
        high, low = (likelihood_of(log, change(sign * step), [start]) for sign in (1, -1))
        return (high - low) / 2e-4

    found = score_log(log, model, [start])
    by_noise = slope_by(lambda d: model._replace(noise_variance=NOISE * np.exp(d)))
    by_jerk = slope_by(lambda d: model._replace(jerk=model.jerk * np.exp(d)))
    assert found.noise.score[component] == pytest.approx(by_noise, abs=0.02)
    assert found.jerk.score[0, component] == pytest.approx(by_jerk, abs=0.02)


def test_innovations_of_the_filter(scene):
    log, start, model = scene
    _, left = filter_with_beside(log, model, [start])
    assert left.shape == (1, len(log.time_s), WIDTH)
    left = left[0]
    ratio = left[:, RESIDUAL] / np.sqrt(left[:, SPREAD])
    assert np.isnan(ratio[5])
    assert ratio[7] > 20
    used = log.beside[0].weight > 0
    assert 0.5 < np.sqrt(np.mean(ratio[used] ** 2)) < 1.5


def test_without_rates_nothing_is_different(scene):
    log, start, model = scene
    silent = log.beside[0]._replace(weight=np.zeros(len(log.time_s)))
    alone, unused = log._replace(beside=()), log._replace(beside=(silent,))
    one, other = smooth_log(alone, model, [start]), smooth_log(unused, model, [start])
    for name in ("state", "sigma", "residual", "residual_variance"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    assert Profile(model.jerk, 1.0, 0.0).beside.shape == (0, 0, WIDTH)
    assert len(filter_with_beside(alone, model, [start])[1]) == 0


def test_parts_and_spread_rates(scene):
    log, _, _ = scene
    assert len(log.part(slice(3, 9)).beside[0].value) == 6
    spread = log.beside[0].part(slice(0, 2)).spread(np.array([1, 4]), 6)
    np.testing.assert_array_equal(np.isfinite(spread.value), [False, True, False, False, True, False])
    np.testing.assert_array_equal(spread.weight, [0, 1, 0, 0, 1, 0])
