"""Precise and slow instruments on agile targets: what a total station sees of a drone. Between two readings the target
goes farther than anybody can foretell, and what looks like noise is motion."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc import pipeline
from ftproc.core import odds
from ftproc.core.filtering.initialization import find_starts
from ftproc.core.filtering.records import Model, Observations
from ftproc.core.filtering.smoother import likelihood_of
from ftproc.core.identification import likelihood
from ftproc.core.model.motion import isotropic
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate
from tests.drone import CRUISER, FAR, apart, holding, read, seen, soaring


def outcome(seed, dt_s, sigma):
    """RMS error in m, the share of rows more than 5 sigma off, and the verdict."""
    log, position = seen(seed, dt_s, sigma)
    found = pipeline.filter_log(log, FilterSettings(smooth=True))
    error = found.state[:, :3] - position
    far = (np.abs(error) > 5 * found.sigma[:, :3]).any(1).mean()
    return np.sqrt((error**2).sum(1).mean()), far, found.metadata["summary"]["trust"]["verdict"]


@pytest.mark.parametrize(("dt_s", "sigma"), [(1.0, (0.02, 3e-5, 3e-5)), (0.5, (0.005, 1e-5, 1e-5))])
@pytest.mark.parametrize("seed", range(5))
def test_never_wrong_and_consistent(seed, dt_s, sigma):
    _, far, verdict = outcome(seed, dt_s, sigma)
    assert far < 0.01 or verdict != "consistent"


def test_circles_are_no_patches():
    """Screening had taken some for a patch, and with these rejected the decisions stood still."""
    log, position = soaring(78)
    found = pipeline.filter_log(log, FilterSettings(smooth=True))
    assert np.sqrt(((found.state[:, :3] - position) ** 2).sum(1).mean()) < 3.4
    assert found.metadata["summary"]["trust"]["verdict"] == "consistent"


def test_motion_is_not_taken_for_noise():
    """At 5 Hz the smoother is about as good as the readings; it was three times worse, with 15 times their noise."""
    error = [outcome(seed, 0.2, (0.002, 1e-5, 1e-5))[0] for seed in (1, 2, 3)]
    assert np.median(error) < 0.006


@pytest.mark.parametrize(
    ("scenario", "dt_s", "seed", "most_m"), [("cruise", 5.0, 10, 4.0), ("aerodynamic", 1.0, 12, 4.0)]
)
def test_less_noise_may_be_likelier(scenario, dt_s, seed, most_m):
    """Aircraft each five seconds, or one: 10.7 and 10.5 m, with two and three times the noise."""
    flight = simulate(scenario, seed=seed, dt_s=dt_s)
    found = pipeline.filter_log(flight.log, FilterSettings(smooth=True))
    kept = np.isin(flight.truth.time_s, found.time_s)
    off = found.state[:, :3] - flight.truth.position_m[kept]
    assert np.sqrt((off**2).sum(1).mean()) < most_m
    assert (np.abs(off) < 3 * found.sigma[:, :3]).mean() > 0.98


def test_most_noise_is_within_the_doubt():
    log, _ = seen(3, 1.0, (0.02, 3e-5, 3e-5))
    observations = Observations(log.time_s, log.measurement, np.ones_like(log.measurement))
    model = Model(np.array([0.02, 3e-5, 3e-5]) ** 2, isotropic(10.0))
    starts = find_starts(observations, model.noise_variance, 10.0)
    assert likelihood.most_noise(observations, model, starts, np.full((len(log), 3), 1e-6)) is None
    found = likelihood.most_noise(observations, model, starts, np.full((len(log), 3), 1e3))
    assert found is not None
    lost = likelihood_of(observations, model, starts) - likelihood_of(observations, found, starts)
    assert lost <= odds.POSSIBLE
    for c in range(3):
        more = found.noise_variance.copy()
        more[c] *= likelihood.NOISE_STEP**2
        worse = likelihood_of(observations, found._replace(noise_variance=more), starts)
        limit = likelihood.NOISE_STEP ** (2 * likelihood.NOISE_STEPS) * model.noise_variance[c]
        assert worse < likelihood_of(observations, model, starts) - odds.POSSIBLE or found.noise_variance[c] >= limit


@pytest.mark.parametrize(
    ("dt_s", "late_s", "most_m", "seed"),
    [
        (5.0, 0.006, 15.0, 1),
        (5.0, 0.006, 15.0, 2),
        (0.5, 0.001, 1.0, 2),
        pytest.param(0.5, 0.001, 1.0, 1, marks=pytest.mark.slow),
    ],
)
def test_angles_with_stamps_of_their_own(dt_s, late_s, most_m, seed):
    """Milliseconds after the ranges: half of the intervals are a thousandth of the others. Positions were 1e8 m off."""
    log, position = apart(seed, dt_s, late_s)
    found = pipeline.filter_log(log, FilterSettings(smooth=True))
    error = found.state[:, :3] - position
    assert np.sqrt((error**2).sum(1).mean()) < most_m
    assert (np.abs(error) < 5 * found.sigma[:, :3]).all(1).mean() > 0.98
    assert found.metadata["summary"]["trust"]["verdict"] != "unreliable"


@pytest.mark.parametrize("seed", [3, 7])
def test_turns_are_followed_live(seed):
    """At 2 Hz; the turns were taken for outliers in two components, and the track was 30 to 60 m off."""
    log, position = read(CRUISER, FAR, np.arange(0.0, 240.0, 0.5), (1.0, 1e-4, 1e-4), seed)
    found = pipeline.filter_log(log, FilterSettings(editing="live"))
    assert np.sqrt(np.nanmean(((found.state[:, :3] - position) ** 2).sum(1))) < 2.5


@pytest.mark.parametrize(
    ("seed", "dt_s", "lasts_s"),
    [
        (1, 0.1, 1200.0),
        (2, 0.1, 1200.0),
        (3, 0.1, 1200.0),
        pytest.param(4, 0.1, 6500.0, marks=pytest.mark.slow),
        (404, 0.1, 1200.0),  # whose noise was said to be three times what it is
    ],
)
def test_turns_between_the_spans_that_stand_for_a_long_log_are_flown(seed, dt_s, lasts_s):
    """They were taken for outliers, and the track was lost, by up to 200 km; the last is edited in segments."""
    log, position = holding(seed, dt_s, lasts_s)
    found = pipeline.filter_log(log, FilterSettings(smooth=True))
    assert np.sqrt(((found.state[:, :3] - position) ** 2).sum(1).mean()) < 10
    assert found.metadata["summary"]["trust"]["verdict"] == "consistent"


def test_a_turn_is_no_wave():
    """The process noise was found of a patch that goes to and fro, and not of the turn: the track was 936 m off."""
    log, position = holding(300, 0.1, 1200.0)
    found = pipeline.filter_log(log, FilterSettings(smooth=True))
    assert np.sqrt(((found.state[:, :3] - position) ** 2).sum(1).mean()) < 10
