"""Noise that is correlated from sample to sample: seen, measured, and the sigmas stay honest."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing import two_pass
from ftproc.core.filtering.smoother import smooth_log
from ftproc.core.identification import coloured_noise
from ftproc.core.model.frames import from_cartesian
from tests.core.tracks import SIGMA, matched
from tests.simulated import simulate

pytestmark = pytest.mark.compiled

UNKNOWN = np.full(3, np.nan)


def edited(correlation_s, seed):
    spec = f"correlation={correlation_s}" if correlation_s else "none"
    flight = simulate("cruise", seed=seed, duration_s=150.0, outliers=spec)
    return flight, two_pass.edit(flight.log.time_s, flight.log.measurement, two_pass.Known(UNKNOWN, None, 4.0))


@pytest.mark.parametrize("correlation_s", [0.3, 0.5])
@pytest.mark.parametrize("seed", range(2))
def test_correlated_noise_is_found_and_sigmas_stay_honest(correlation_s, seed):
    flight, found = edited(correlation_s, seed)
    np.testing.assert_allclose(found.model.correlation, np.exp(-0.1 / correlation_s), atol=0.06)
    np.testing.assert_allclose(np.sqrt(found.model.reading_variance), flight.sigma, rtol=0.15)
    assert (found.weight == 0).mean() < 0.01
    error = found.smoothed.state[:, :3] - flight.truth.position_m
    assert (np.abs(error) < 3 * found.smoothed.sigma[:, :3]).all(1).mean() > 0.95
    assert 0.3 < np.mean((error / found.smoothed.sigma[:, :3]) ** 2) < 1.5


def test_noise_of_a_second_has_honest_sigmas():
    """A correlation of 0.9 between neighbours."""
    flight, found = edited(1.0, 0)
    error = found.smoothed.state[:, :3] - flight.truth.position_m
    assert (np.abs(error) < 3 * found.smoothed.sigma[:, :3]).all(1).mean() > 0.9
    assert not found.slow_noise


def test_noise_that_passes_for_motion_is_reported():
    """A correlation of 0.95: what remains of the log are too few independent readings to tell it from motion."""
    assert edited(2.0, 0)[1].slow_noise


@pytest.mark.parametrize("seed", range(3))
def test_white_noise_is_not_called_correlated(seed):
    assert not edited(0.0, seed)[1].model.correlation.any()


def test_moments_of_white_and_of_correlated_noise():
    """The true model and a slow target: variance and correlation come out as they went in."""
    a = matched(1, 3000, q=1e-3)
    rng = np.random.default_rng(1)
    noise = rng.standard_normal((3000, 3))
    for rho in (0.0, 0.6):
        coloured = noise.copy()
        for k in range(1, 3000):
            coloured[k] = rho * coloured[k - 1] + np.sqrt(1 - rho**2) * noise[k]
        a = a._replace(z=from_cartesian(a.truth[:, :3]) + SIGMA * coloured)
        variance = SIGMA**2 * (1 + rho) / (1 - rho)
        model = a.model._replace(noise_variance=variance)
        run = smooth_log(a.log, model, a.starts)
        found, correlation = coloured_noise.moments(run, a.weight, variance)
        np.testing.assert_allclose(found / SIGMA**2, 1, atol=0.15)
        np.testing.assert_allclose(correlation, rho, atol=0.06)


def test_short_record_is_not_judged():
    a = matched(2, 40)
    run = smooth_log(a.log, a.model, a.starts)
    variance, correlation = coloured_noise.moments(run, a.weight, a.model.noise_variance)
    np.testing.assert_array_equal(variance, a.model.noise_variance)
    np.testing.assert_array_equal(correlation, 0)


def markov(correlation, n):
    """(n, 3) noise of unit variance, each component with a correlation of its own."""
    noise = np.random.default_rng(4).standard_normal((n, 3))
    for k in range(1, n):
        noise[k] = correlation * noise[k - 1] + np.sqrt(1 - correlation**2) * noise[k]
    return noise


def smoothed(noise):
    """The run of a smoother that takes such noise for white, its weights and the noise variances it was given."""
    a = matched(1, len(noise), q=1e-3)
    a = a._replace(z=from_cartesian(a.truth[:, :3]) + SIGMA * noise)
    return smooth_log(a.log, a.model, a.starts), a.weight, a.model.noise_variance


@pytest.mark.parametrize(
    ("correlation", "n", "verdict"),
    [((0.0, 0.0, 0.0), 1000, False), ((0.1, 0.1, 0.1), 20_000, False), ((0.0, 0.4, 0.0), 1000, True),
     ((0.4, 0.4, 0.4), 150, False), ((-0.7, -0.7, -0.7), 1000, False)],
)  # fmt: skip
def test_correlation_must_be_large_and_beyond_doubt(correlation, n, verdict):
    assert coloured_noise.is_correlated(*smoothed(markov(np.array(correlation), n))) == verdict


def test_patches_are_no_correlated_noise():
    """Three of them, that nobody has found, make the correlation of the whole log large, but not that of most of it."""
    noise = markov(0.0, 2000)
    for begin in (300, 900, 1500):
        noise[begin : begin + 40] += 4.0
    run = smoothed(noise)
    assert coloured_noise.moments(*run)[1].min() > 1.5 * coloured_noise.LEAST
    assert not coloured_noise.is_correlated(*run)
