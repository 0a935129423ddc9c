"""Noise that is correlated from sample to sample: part of the state, found, and the sigmas stay honest."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ftproc import pipeline
from ftproc.core.editing import two_pass
from ftproc.core.filtering import memory
from ftproc.core.filtering.forward import filter_log
from ftproc.core.filtering.smoother import score_log, smooth_log
from ftproc.core.identification import coloured_noise
from ftproc.settings import FilterSettings
from tests.core.tracks import matched
from tests.simulated import simulate

UNKNOWN = np.full(3, np.nan)
SHARES = np.array([0.7, 2.0, 0.4])  # variance of the offsets, in that of the white noise
TAUS = np.array([0.8, 2.5, 0.3])  # s


def coloured(a, markov=SHARES, tau=TAUS):
    """The model of a track with offsets."""
    return a.model._replace(markov_variance=markov * a.model.noise_variance, tau_s=tau)


def test_offsets_that_fade_at_once_are_white_noise():
    """Between two samples nothing of them is left: the filter is that of the sum of the two noises."""
    a = matched(1, 200, missing=0.3, irregular=True)
    model = coloured(a, tau=np.full(3, 1e-4))
    white = a.model._replace(noise_variance=a.model.noise_variance * (1 + SHARES))
    one, other = smooth_log(a.log, model, a.starts), smooth_log(a.log, white, a.starts)
    assert one.log_likelihood == pytest.approx(other.log_likelihood, rel=1e-12)
    np.testing.assert_allclose(one.state, other.state, rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(one.sigma, other.sigma, rtol=1e-7)
    np.testing.assert_allclose(one.residual, other.residual, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(one.residual_variance, other.residual_variance, rtol=1e-7)
    ahead = [filter_log(a.log, each, a.starts) for each in (model, white)]
    np.testing.assert_allclose(ahead[0].sigma, ahead[1].sigma, rtol=1e-7)


def test_leave_one_out_residuals_are_those_of_a_run_without_the_reading():
    """The smoothed prediction of a reading that is left out; its offset is predicted with it."""
    a = matched(3, 60, missing=0.2)
    model = coloured(a)
    run = smooth_log(a.log, model, a.starts)
    for k, c in ((5, 0), (30, 1), (44, 2), (59, 1)):
        if a.weight[k, c] == 0:
            continue
        weight = a.weight.copy()
        weight[k, c] = 0.0
        without = smooth_log(a.log._replace(weight=weight), model, a.starts)
        sigma = np.sqrt(without.residual_variance[k, c])
        assert run.residual[k, c] == pytest.approx(without.residual[k, c], abs=0.01 * sigma)
        assert run.residual_variance[k, c] == pytest.approx(without.residual_variance[k, c], rel=0.01)


@pytest.mark.parametrize("block", [7, 1000])
def test_scores_are_the_slopes_of_the_likelihood(monkeypatch, block):
    """Also where the way back goes over several blocks."""
    monkeypatch.setattr(memory, "BLOCK", block)
    a = matched(2, 150, missing=0.2, irregular=True)
    model = coloured(a)
    scores = score_log(a.log, model, a.starts)
    step = 1e-4
    by_name = {"noise_variance": scores.noise.score, "markov_variance": scores.markov.score, "tau_s": scores.tau}
    for name, score in by_name.items():
        for c in range(3):
            value = []
            for sign in (1, -1):
                changed = getattr(model, name).copy()
                changed[c] *= np.exp(sign * step)
                value.append(score_log(a.log, model._replace(**{name: changed}), a.starts).log_likelihood)
            assert score[c] == pytest.approx((value[0] - value[1]) / (2 * step), rel=2e-2, abs=2e-2)
    value = [
        score_log(a.log, model._replace(jerk=model.jerk * np.exp(s * step)), a.starts).log_likelihood for s in (1, -1)
    ]
    assert scores.jerk.score.sum() == pytest.approx((value[0] - value[1]) / (2 * step), rel=2e-2, abs=2e-2)


def edited(samples, seed, name="cruise", duration_s=150.0):
    """A flight at 10 Hz with noise that is correlated over so many samples."""
    spec = f"correlation={0.1 * samples}" if samples else "none"
    flight = simulate(name, seed=seed, duration_s=duration_s, dt_s=0.1, outliers=spec)
    return flight, two_pass.edit(flight.log.time_s, flight.log.measurement, two_pass.Known(UNKNOWN, None, 4.0))


def inside(flight, found):
    """Share of the samples within three published sigmas in every axis."""
    error = found.smoothed().state[:, :3] - flight.truth.position_m
    return (np.abs(error) < 3 * found.smoothed().sigma[:, :3]).all(1).mean()


@pytest.mark.compiled
@pytest.mark.parametrize("samples", [2.0, 10.0])
@pytest.mark.parametrize("seed", range(2))
def test_correlated_noise_is_found_and_sigmas_stay_honest(samples, seed):
    flight, found = edited(samples, seed)
    np.testing.assert_allclose(found.model.correlation(0.1), np.exp(-1 / samples), atol=0.08)
    np.testing.assert_allclose(np.sqrt(found.model.reading_variance), flight.sigma, rtol=0.25)
    assert (found.weight == 0).mean() < 0.01
    assert inside(flight, found) > 0.95


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("name", "interval_s", "duration_s"), [("manoeuvre", 0.05, 100.0), ("cruise", 0.1, 200.0), ("radar", 1.0, 600.0)]
)
@pytest.mark.parametrize("samples", [20, 60])
def test_sigmas_allow_for_the_slowest_noise_that_the_log_does_not_refute(name, interval_s, duration_s, samples):
    """How slow it is, and with it how large, the log says only vaguely."""
    spec, small = f"isolated=0.01:6-100,correlation={samples * interval_s}", []
    for seed in range(10, 13):
        flight = simulate(name, seed=seed, duration_s=duration_s, outliers=spec)
        found = pipeline.filter_log(flight.log, FilterSettings(smooth=True))
        error = np.abs(found.state[:, :3] - flight.truth.position_m)
        assert (error < 3 * found.sigma[:, :3]).all(1).mean() > 0.96
        small.append((error < 0.3 * found.sigma[:, :3]).all(1).mean())
    assert np.mean(small) < 0.6


@pytest.mark.compiled
@pytest.mark.parametrize("name", ["cruise", "radar", "calibration"])
def test_noise_that_cannot_be_separated_from_motion_widens_the_sigmas(name):
    """With a correlation over 2 s of 20 the estimate may follow the noise, and the sigmas allow for that."""
    _, found = edited(20.0, 3, name, 20.0)
    assert found.decision.alternative is not None or found.model.coloured


@pytest.mark.compiled
@pytest.mark.parametrize("seed", range(3))
def test_white_noise_is_not_called_correlated(seed):
    _, found = edited(0, seed)
    assert not found.model.coloured
    assert found.decision.alternative is None


@pytest.mark.compiled
def test_patches_are_no_correlated_noise():
    flight = simulate("manoeuvre", seed=4, duration_s=100.0, outliers="patch=3:10-40:8-40")
    assert not two_pass.edit(
        flight.log.time_s, flight.log.measurement, two_pass.Known(UNKNOWN, None, 4.0)
    ).model.coloured


@pytest.mark.parametrize("gap", [1, 2])
def test_only_readings_that_are_used_are_neighbours(gap):
    """Residuals of the readings used that are alike; those in between, which are not used, are of the other sign."""
    a = matched(1, 600)
    used = np.arange(600) % (gap + 1) != gap if gap == 2 else np.arange(600) % 2 == 0
    off = np.repeat(np.random.default_rng(0).standard_normal(200), 3)
    residual = np.where(used, off, -off)[:, None] * np.sqrt(2 * a.model.noise_variance)
    smoothed = SimpleNamespace(residual=residual, residual_variance=np.tile(2 * a.model.noise_variance, (600, 1)))
    log = a.log._replace(weight=np.repeat(used[:, None], 3, 1).astype(float))
    assert coloured_noise.may_be(log, smoothed, a.model) == (gap == 2)
