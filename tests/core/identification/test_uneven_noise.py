"""Noise that is not the same for all readings: late stamps, drift, rounding, tails."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from ftproc.core.editing import copies, decisions, two_pass
from ftproc.core.filtering.records import Model, Observations, Uneven
from ftproc.core.filtering.smoother import RESIDUALS, smooth_log
from ftproc.core.identification import uneven_noise
from ftproc.core.model.frames import from_cartesian, wrap
from tests import naive
from tests.core.single import random_problem, update
from tests.core.tracks import matched
from tests.simulated import simulate

KNOWN = two_pass.Known(np.full(3, np.nan), None, 4.0)


def circle(seed, n=1500, dt=0.1, late_s=0.0, sigma=(0.01, 2e-5, 2e-5), tails=None, very_late=0.0):
    """A drone on a wandering circle 80 m away that stands still now and then, and its readings with late stamps, of
    which a share is very late."""
    rng = np.random.default_rng(seed)
    fine = np.arange(-20, n * dt + 20, 0.01)
    speed = np.clip(np.convolve(rng.normal(0, 60, len(fine)), np.ones(600) / 600, "same"), 0, None)
    angle = np.cumsum(speed) * 0.01 / 40
    path = np.stack([80 + 30 * np.cos(angle), 30 * np.sin(angle), 20 + 5 * np.sin(0.7 * angle)], 1)
    time = dt * np.arange(n)
    seen = time + late_s * rng.standard_normal(n) * np.where(np.random.default_rng(seed).random(n) < very_late, 20, 1)
    position, moved = (np.stack([np.interp(t, fine, p) for p in path.T], 1) for t in (time, seen))
    noise = rng.standard_normal((n, 3)) if tails is None else rng.standard_t(tails, (n, 3))
    z = from_cartesian(moved) + np.array(sigma) * noise
    return time, np.stack([z[:, 0], wrap(z[:, 1]), z[:, 2]], 1), position


def test_rates_are_the_derivatives_of_the_readings():
    rng = np.random.default_rng(1)
    state = np.hstack([rng.normal(0, 100, (50, 3)), rng.normal(0, 5, (50, 3)), np.zeros((50, 3))])
    step = 1e-5
    ahead, behind = (from_cartesian(state[:, :3] + sign * step * state[:, 3:6]) for sign in (1, -1))
    change = ahead - behind
    change[:, 1] = wrap(change[:, 1])
    np.testing.assert_allclose(uneven_noise.rates(state), change / (2 * step), rtol=1e-5, atol=1e-9)


def test_a_late_stamp_is_noise_that_the_components_share():
    """The update with the covariance R + l l' of the readings, for every pattern of missing ones."""
    rng = np.random.default_rng(2)
    for _ in range(50):
        x, p, z, noise = random_problem(rng)
        late = rng.normal(size=3) * np.sqrt(noise) * 3
        weight = rng.choice([0.0, 1.0], 3)
        if not weight.any():
            continue
        found = update(x, p, z, noise, weight, late)
        z_hat, c, pxz = naive.unscented(x, p)
        on = weight > 0
        s = (c + np.diag(noise) + np.outer(late, late))[np.ix_(on, on)]
        gain = pxz[:, on] @ np.linalg.inv(s)
        sigma = np.sqrt(np.diag(p))
        expected = x + gain @ naive.difference(z, z_hat)[on]
        np.testing.assert_allclose(found[0] / sigma, expected / sigma, rtol=1e-7, atol=1e-7)
        np.testing.assert_allclose(
            found[1] / np.outer(sigma, sigma), (p - gain @ s @ gain.T) / np.outer(sigma, sigma), atol=1e-9
        )


def test_late_stamps_are_accepted_only_if_they_keep_the_readings_in_order():
    """The same residuals, of stamps off by 20 ms, at longer and at shorter intervals than that."""
    rng = np.random.default_rng(3)
    n, late_s, sigma = 600, 0.02, np.array([0.1, 1e-4, 1e-4])
    speed = rng.uniform(0, 60, (n, 1))
    state = np.hstack([np.tile([300.0, 200.0, 100.0], (n, 1)), speed * rng.standard_normal((n, 3)), np.zeros((n, 3))])
    residual = sigma * rng.standard_normal((n, 3)) + late_s * rng.standard_normal((n, 1)) * uneven_noise.rates(state)
    smoothed = SimpleNamespace(residual=residual, residual_variance=np.tile(1.1 * sigma**2, (n, 1)), state=state)
    model = Model(sigma**2, np.zeros((1, 6)))

    def found(interval_s):
        log = Observations(interval_s * np.arange(n), np.zeros((n, 3)), np.ones((n, 3)))
        return uneven_noise.stamp_variance(log, smoothed, model)

    noise, stamps = found(0.03)
    np.testing.assert_allclose(np.sqrt(noise) / sigma, 1, atol=0.3)
    assert np.sqrt(stamps) == pytest.approx(late_s, rel=0.2)
    assert found(0.015)[1] == 0.0


@pytest.mark.compiled
def test_late_stamps_are_found_and_are_no_outliers():
    time, z, truth = circle(7, late_s=0.01)
    found = two_pass.edit(time, z, KNOWN)
    assert found.decision.stamp_s == pytest.approx(0.01, rel=0.3)
    error = np.abs(found.smoothed().state[:, :3] - truth)
    assert (error < 3 * found.smoothed().sigma[:, :3]).mean() > 0.9


@pytest.mark.compiled
@pytest.mark.parametrize(("seed", "very_late"), [(7, 0.03), (8, 0.03), (8, 0.0)])
def test_the_track_does_not_follow_late_stamps(seed, very_late):
    """Three of a hundred stamps are off by 0.2 s, when all readings of a sample are off by as much as 1 m."""
    time, z, truth = circle(seed, n=900, late_s=0.01, very_late=very_late)
    found = two_pass.edit(time, z, KNOWN)
    assert (found.weight == 0).mean() < 0.03
    assert np.linalg.norm(found.smoothed().state[:, :3] - truth, axis=1).std() < 0.03


@pytest.mark.compiled
def test_stamps_that_are_always_late_by_chance():
    """Each reading is as old as a queue makes it, 10 ms on average; that it is so on average, no log can show. It does
    not look as if the clock jumped."""
    spread = []
    for seed in range(1, 5):
        time, z, truth = circle(seed, n=900)
        seen = time - np.random.default_rng(100 + seed).exponential(0.01, len(time))
        late = np.stack([np.interp(seen, time, np.unwrap(z[:, c])) for c in range(3)], 1)
        found = two_pass.edit(time, late, KNOWN)
        assert (found.weight == 0).mean() < 0.03
        assert found.faults.steps == ()
        spread.append(np.linalg.norm(found.smoothed().state[:, :3] - truth, axis=1).std())
    assert sorted(spread)[-2] < 0.03
    assert max(spread) < 0.1


def test_a_stamp_that_is_very_late_is_given_a_variance_of_its_own():
    time, z, truth = circle(7, n=600, late_s=0.002)
    speed = np.gradient(truth, time, axis=0)
    state = np.hstack([truth, speed, np.zeros_like(truth)])
    residual = np.random.default_rng(1).normal(size=z.shape) * [0.01, 2e-5, 2e-5] + 0.002 * uneven_noise.rates(state)
    fast = np.argsort(-np.linalg.norm(speed, axis=1))[:5]
    residual[fast] += 0.3 * uneven_noise.rates(state[fast])
    noise = np.array([0.01, 2e-5, 2e-5]) ** 2
    smoothed = SimpleNamespace(residual=residual, residual_variance=np.tile(noise, (len(z), 1)), state=state)
    log = Observations(time, z, np.ones_like(z))
    stamps = uneven_noise.each_stamp(log, smoothed, Model(noise, np.ones((1, 3))), 0.01**2)
    assert np.sqrt(stamps.variance[fast]) == pytest.approx(np.full(5, 0.3 / np.sqrt(3)), rel=0.1)
    assert np.median(np.sqrt(stamps.variance)) < 0.005


@pytest.mark.parametrize(("tails", "favoured"), [(None, False), (2.0, True)])
def test_log_probability_of_stamps(tails, favoured):
    """Student's distribution, integrated on a fine grid, of errors of the stamps that are known almost exactly."""
    rng = np.random.default_rng(3)
    late = 0.01 * (rng.standard_normal(2000) if tails is None else rng.standard_t(tails, 2000))
    state = np.tile([100.0, 0, 0, 10.0, 0, 0, 0, 0, 0], (2000, 1))
    residual = np.full((2000, 3), np.nan)
    residual[:, 0] = 10 * late
    variance = np.full((2000, 3), 1e-8)
    smoothed = SimpleNamespace(residual=residual, residual_variance=variance, state=state)
    log = Observations(np.arange(2000.0), residual, np.isfinite(residual).astype(float))
    stamps = uneven_noise.each_stamp(log, smoothed, Model(np.full(3, 1e-8), np.ones((1, 3))), 0.01**2)
    scale = 1 / np.sqrt(np.mean(1 / stamps.variance))
    students = stats.t.logpdf(late / scale, 2) - np.log(scale)
    each = stats.norm.logpdf(late, scale=np.sqrt(stamps.variance + 1e-10))
    assert stamps.log_probability == pytest.approx((students - each).sum(), rel=0.02)
    usual = stats.norm.logpdf(late, scale=late.std())
    assert (students.sum() > usual.sum()) == favoured


@pytest.mark.compiled
def test_good_clocks_have_no_late_stamps():
    assert two_pass.edit(*circle(2)[:2], KNOWN).decision.stamp_s == 0.0
    flight = simulate("manoeuvre", seed=1, duration_s=60.0)
    assert two_pass.edit(flight.log.time_s, flight.log.measurement, KNOWN).decision.stamp_s == 0.0


@pytest.mark.compiled
def test_noise_that_grows_along_the_log_is_followed():
    flight = simulate("cruise", seed=5, duration_s=300.0, outliers="none")
    rng = np.random.default_rng(0)
    growth = np.linspace(1, 5, len(flight.log.time_s))[:, None]
    z = from_cartesian(flight.truth.position_m) + flight.sigma * growth * rng.standard_normal((len(growth), 3))
    found = two_pass.edit(flight.log.time_s, z, KNOWN)
    assert found.decision.drifts
    sigma = np.sqrt(found.model.noise_variance * found.log.uneven.times)
    np.testing.assert_allclose(sigma[[200, 1500, 2800]] / (flight.sigma * growth[[200, 1500, 2800]]), 1, atol=0.35)
    assert (found.weight == 0).mean() < 0.01


@pytest.mark.compiled
def test_tails_are_no_outliers():
    flight = simulate("manoeuvre", seed=2, duration_s=60.0, outliers="tails=3")
    found = two_pass.edit(flight.log.time_s, flight.log.measurement, KNOWN)
    assert (found.weight == 0).mean() < 0.02


@pytest.mark.parametrize("step", [7.234, 1e-3, 0.1 * np.pi / 180])
def test_rounding_step_is_found(step):
    rng = np.random.default_rng(4)
    values = np.cumsum(rng.normal(0, 3 * step, 500)) + 1000 * step
    rounded = step * np.round(values / step)
    assert copies.rounding_step(rounded) == pytest.approx(step, rel=1e-6)
    rounded[::50] += rng.normal(0, 50 * step, 10)  # outliers need not lie on the grid
    assert copies.rounding_step(rounded) == pytest.approx(step, rel=1e-6)
    assert copies.rounding_step(values) < 1e-2 * step
    assert copies.rounding_step(np.full(5, 3.0)) == 0.0


@pytest.mark.compiled
def test_two_values_of_a_standing_target_are_no_outliers():
    """A transponder whose range is rounded to steps that are larger than the noise."""
    rng = np.random.default_rng(5)
    time, n = 4.0 * np.arange(300), 300
    step = 7.234
    z = np.stack([step * np.round((25_000 + rng.normal(0, 2, n)) / step), 0.5 + 1e-3 * rng.standard_normal(n),
                  0.02 + 2e-4 * rng.standard_normal(n)], 1)  # fmt: skip
    assert len(np.unique(z[:, 0])) <= 3
    found = two_pass.edit(time, z, KNOWN)
    assert (found.weight[:, 0] == 0).mean() < 0.01
    assert np.sqrt(found.model.noise_variance[0]) >= step / np.sqrt(12) * 0.999


def test_repeats_count_once_where_chance_does_not_make_them():
    step = np.array([1.0, 0.0, 0.0])
    z = np.zeros((200, 3))
    z[:, 0] = np.arange(200) // 20  # moves by a step in twenty readings, without noise
    found = uneven_noise.repeated(z, step)
    assert isinstance(found, Uneven)
    np.testing.assert_array_equal(found.times[:, 0], 20)
    np.testing.assert_array_equal(found.times[:, 1:], 1)
    z[:, 0] = np.random.default_rng(1).integers(0, 3, 200)
    assert uneven_noise.repeated(z, step) is None


def test_drift_of_even_noise_is_none():
    a = matched(4, 3000)
    smoothed = smooth_log(a.log, a.model, a.starts, RESIDUALS)
    assert uneven_noise.drift(a.log, smoothed.residual, smoothed.residual_variance) is None


@pytest.mark.parametrize("n", [600, 4000])
def test_a_drift_is_followed_however_long_the_log(n):
    """Noise that grows and fades every 600 readings, of one component."""
    a, swell = matched(4, n), np.exp(np.sin(2 * np.pi * np.arange(n) / 600))
    run = smooth_log(a.log, a.model, a.starts, RESIDUALS)
    residual = run.residual.copy()
    residual[:, 1] *= np.sqrt(swell)
    found = uneven_noise.drift(a.log, residual, run.residual_variance)
    assert (found[:, [0, 2]] == 1).all()
    off = np.log(found[:, 1] / swell)
    assert np.std(off) < 0.4 * np.std(np.log(swell))


@pytest.mark.parametrize("lasts", [60, 200])
def test_where_a_track_goes_astray_beside_a_jump_neighbours_do_not_differ_more(lasts):
    """Residuals of one sign that come slowly, up to twenty sigmas, change it, and go."""
    a = matched(4, 3000)
    run, k = smooth_log(a.log, a.model, a.starts, RESIDUALS), np.arange(3000) - 1500
    astray = 20 * np.sign(k + 0.5) * np.exp(-np.abs(k) / lasts) * np.sqrt(run.residual_variance[:, 1])
    residual = run.residual.copy()
    residual[:, 1] += astray
    assert uneven_noise.drift(a.log, residual, run.residual_variance) is not None
    assert uneven_noise.drift(a.log, residual, run.residual_variance, by_neighbours=True) is None
    residual[:, 1] = run.residual[:, 1] * (1 + np.abs(astray) / np.sqrt(run.residual_variance[:, 1]))
    assert (uneven_noise.drift(a.log, residual, run.residual_variance, by_neighbours=True)[:, 1] > 30).any()


@pytest.mark.parametrize(("n", "count"), [(120, 2), (130, 7), (7, 7), (61, 6)])
def test_windows_are_those_of_numpy(n, count):
    values = np.random.default_rng(n).normal(size=n)
    expected = [window.mean() for window in np.array_split(values, count)]
    found = uneven_noise._of_windows(values, count, lambda rows: rows.mean(1))
    np.testing.assert_allclose(found, expected, rtol=1e-14)


def hovering(seed, step):
    """A helicopter that comes, hovers and leaves, 80 s at 10 Hz, in readings rounded to steps of 20 sigma of the noise:
    times, readings, positions."""
    rng, fine = np.random.default_rng(seed), 20
    time = np.arange(800 * fine) / (10 * fine)
    speed = 40 / (1 + np.exp((time - 24) / 2)) + 40 / (1 + np.exp((60 - time) / 2))
    course = rng.uniform(0, 2 * np.pi) + 0.6 * np.sin(2 * np.pi * time / 80)
    velocity = np.stack([speed * np.cos(course), speed * np.sin(course), 0.3 * np.sin(time / 5)], 1)
    position = np.cumsum(velocity, 0)[::fine] / (10 * fine)
    away = rng.uniform(0, 2 * np.pi)
    position += np.array([1000 * np.cos(away), 1000 * np.sin(away), 150]) - position[400] * [1, 1, 0]
    z = from_cartesian(position) + step / 20 * rng.standard_normal((800, 3))
    return time[::fine].copy(), np.round(z / step) * step, position


def share_off(step, seeds):
    """The mean share of samples that are off by more than five sigmas."""
    shares = []
    for seed in seeds:
        time, z, position = hovering(seed, step)
        found = two_pass.edit(time, z, KNOWN).smoothed()
        shares.append((np.abs(found.state[:, :3] - position) > 5 * found.sigma[:, :3]).any(1).mean())
    return np.mean(shares)


@pytest.mark.compiled
@pytest.mark.parametrize("step", [(1.0, 1.7e-4, 1.7e-4), pytest.param((5.0, 9e-4, 9e-4), marks=pytest.mark.slow)])
def test_coarse_rounding_of_a_slow_target_is_neither_drift_nor_correlated_noise(step, monkeypatch):
    assert share_off(np.array(step), range(3)) < 0.005
    monkeypatch.setattr(decisions, "_repeats", lambda record, decision: False)
    assert share_off(np.array(step), [0]) > 0.01
