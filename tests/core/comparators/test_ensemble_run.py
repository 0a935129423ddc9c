"""The ensemble and particle filters along a track."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.comparators import ensemble, particles
from ftproc.core.comparators.ensemble_run import Motion, Settings, filter_log, measure, subtract
from ftproc.core.filtering import forward
from ftproc.core.filtering.records import Model, Start
from tests import naive
from tests.core.tracks import matched, position_error, random_jerk

pytestmark = pytest.mark.compiled

NAMES = list(particles.UPDATES)


def run(name, a, members=100, patch_s=1.5, seed=0):
    settings = Settings(name, members, patch_s, np.random.default_rng(seed))
    return filter_log(a.log, a.model, a.starts, settings)


def rms(found, a):
    return np.sqrt(np.mean(position_error(found.state, a.truth) ** 2))


def test_sensor_is_the_plain_one():
    rng = np.random.default_rng(0)
    x = rng.normal(0, 3000, (50, 9))
    np.testing.assert_allclose(measure(x), [naive.measure(row) for row in x], rtol=1e-12)
    a, b = rng.uniform(-np.pi, np.pi, (2, 50, 3))
    np.testing.assert_allclose(subtract(a, b), [naive.difference(*rows) for rows in zip(a, b, strict=True)], atol=1e-12)
    assert np.isnan(subtract(np.full(3, np.nan), b)).all()


@pytest.mark.parametrize("interval", [0.0, 0.05, 1.0, 2.7])
def test_motion_is_constant_acceleration_with_white_jerk(interval):
    """Each piece of the jerk profile in its own time; the noise's covariance from its factor, exactly."""
    jerk = random_jerk(np.random.default_rng(1), pieces=2)
    motion = Motion.of(Model(np.ones(3), jerk, 10.0))
    still = motion._replace(factor=np.zeros((2, 9, 9)))
    x = np.random.default_rng(2).normal(size=(4, 9))
    moved = still.move(x, 3.0, interval, np.random.default_rng(0))
    np.testing.assert_allclose(moved, x @ naive.transition(interval).T, rtol=1e-12)
    for since, piece in ((3.0, 0), (12.0, 1), (99.0, 1)):
        drawn = motion.move(np.zeros((40, 9)), since, interval, np.random.default_rng(5))
        white = np.random.default_rng(5).standard_normal((40, 9))
        factor = np.linalg.lstsq(white, drawn, rcond=None)[0].T
        np.testing.assert_allclose(factor @ factor.T, naive.process_noise(interval, jerk[piece]), rtol=1e-7, atol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_nearly_as_good_as_the_ukf_and_honest(name):
    """On flights of the filter's own model, with missing readings at odd times; the weighted filters, whose members
    are jittered, know least."""
    worst = {"enkf": 1.25, "enpf": 1.6, "enpf-chi2": 1.6, "renpf": 1.5}[name]
    found, plain, nees = [], [], []
    for seed in range(3):
        a = matched(seed, 250, irregular=True, missing=0.15)
        filtered, made = run(name, a)
        assert len(made) == 1
        found.append(rms(filtered, a))
        plain.append(rms(forward.filter_log(a.log, a.model, a.starts), a))
        nees.append(np.mean(((filtered.state - a.truth)[:, :3] / filtered.sigma[:, :3]) ** 2))
        assert np.isnan(filtered.nis[np.isnan(a.z).all(1)]).all()
        assert (filtered.weight[np.isnan(a.z)] == 0).all()
    assert np.mean(found) < worst * np.mean(plain)
    assert 0.5 < np.mean(nees) < 1.8


def test_innovations_and_sigmas_are_the_ukfs():
    a = matched(4, 120)
    many, _ = run("enkf", a, members=3000)
    plain = forward.filter_log(a.log, a.model, a.starts)
    np.testing.assert_allclose(many.sigma, plain.sigma, rtol=0.12)
    np.testing.assert_allclose(many.los_sigma, plain.los_sigma, rtol=0.12)
    np.testing.assert_allclose(many.innovation_sigma, plain.innovation_sigma, rtol=0.12)
    np.testing.assert_allclose((many.innovation - plain.innovation) / plain.innovation_sigma, 0, atol=0.3)
    assert many.log_likelihood == pytest.approx(plain.log_likelihood, rel=0.02)


def spoiled(seed, share=0.05):
    """A track with so many of its samples 8 to 60 sigmas off, and their indices."""
    a = matched(seed, 200)
    rng = np.random.default_rng(seed)
    hit = np.flatnonzero(rng.random(len(a.time)) < share)
    hit = hit[hit > 20]
    size = np.sqrt(a.model.noise_variance) * rng.uniform(8, 60, (len(hit), 3)) * rng.choice([-1, 1], (len(hit), 3))
    z = a.z.copy()
    z[hit] += size
    return a._replace(z=z), hit


def test_isolated_outliers_are_refused():
    """renpf's error below a third of enkf's (which is that of a filter that edits nothing)."""
    errors = []
    for seed in range(3):
        a, hit = spoiled(seed)
        fuzzy, made = run("renpf", a)
        assert len(made) == 1
        assert fuzzy.weight[hit].max() < 0.2
        assert (fuzzy.weight > 0).all(1).mean() > 0.9
        errors.append([rms(fuzzy, a), rms(run("enpf-chi2", a)[0], a), rms(run("enkf", a)[0], a)])
    fuzzy_m, gated_m, plain_m = np.mean(errors, 0)
    assert fuzzy_m < plain_m / 3
    assert gated_m < plain_m / 3


@pytest.mark.parametrize("name", ["enpf-chi2", "renpf"])
def test_a_wrong_track_is_re_acquired(name):
    """The target is suddenly 2 km further on: the gate refuses all, until the readings before agree on a new start."""
    a = matched(5, 200)
    a.truth[90:, :3] += np.array([1200.0, 1600.0, 0.0])
    z = measure(a.truth) + (a.z - measure(matched(5, 200).truth))
    found, made = run(name, a._replace(z=z))
    assert len(made) == 2
    assert 90 + 15 <= made[1].sample <= 90 + 25
    assert (found.weight[90 : made[1].sample] == 0).all()
    assert (found.weight[made[1].sample :] > 0).mean() > 0.9
    assert position_error(found.state, a.truth)[-50:].max() < 12
    assert found.since_start[-1] == 199 - made[1].sample


def test_a_log_with_several_starts_is_re_initialized_at_each():
    a = matched(6, 120)
    second = Start(60, a.truth[60], a.starts[0].covariance)
    found, made = run("enkf", a._replace(starts=[*a.starts, second]))
    assert made == [*a.starts, second]
    assert list(found.since_start[[59, 60, 119]]) == [59, 0, 59]


def test_samples_before_the_first_start_are_extrapolated():
    a = matched(7, 60)
    late = Start(5, a.truth[5], a.starts[0].covariance)
    found, _ = run("enkf", a._replace(starts=[late]))
    assert np.isfinite(found.state).all()
    assert np.isfinite(found.los_sigma).all()
    assert (found.weight[:5] == 0).all()


def test_same_seed_same_bytes():
    a = matched(8, 40)
    once, again, other = (run("renpf", a, seed=s)[0] for s in (1, 1, 2))
    assert once.state.tobytes() == again.state.tobytes()
    assert once.state.tobytes() != other.state.tobytes()


def test_spread_of_the_first_members():
    a = matched(9, 3)
    drawn = ensemble.draw(a.starts[0].state, a.starts[0].covariance, 20_000, np.random.default_rng(0))
    sigma = np.sqrt(np.diag(a.starts[0].covariance))
    scaled = (ensemble.spread(drawn) - a.starts[0].covariance) / np.outer(sigma, sigma)
    np.testing.assert_allclose(scaled, 0, atol=0.04)


def test_a_missing_component_is_no_lost_track():
    """Range and azimuth in turn: no sample is whole, but each is used."""
    a = matched(6, 120)
    z = a.z.copy()
    z[20::2, 0] = z[21::2, 1] = np.nan
    found, made = run("renpf", a._replace(z=z, weight=np.isfinite(z).astype(float)))
    assert len(made) == 1
    assert (found.weight[20:].max(1) > 0).mean() > 0.95
