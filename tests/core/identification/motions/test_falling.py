"""What nobody steers: the wind that its fall tells, and what of the track that is worth."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc import pipeline
from ftproc.core.identification.motions import falling
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate
from ftproc.simulation.flights import unsteered

pytestmark = pytest.mark.compiled

WIND = np.array([9.0, -6.0, 0.0])
FALLS = 200, 204, 206, 207, 217, 220, 225  # seeds: bombs and shells


def of(seed):
    """The smoothed RMSE m and m/s; and of position, velocity and acceleration the shares inside 3 sigma, and the
    typical error in sigmas."""
    flight = simulate("ballistic", seed=seed)
    found = pipeline.filter_log(flight.log, FilterSettings(smooth=True, motion="ballistic"))
    truth = np.hstack([flight.truth.position_m, flight.truth.velocity_mps, flight.truth.acceleration_mps2])
    wrong = (found.state - truth[np.isin(flight.truth.time_s, found.time_s)]).reshape(-1, 3, 3)
    in_sigmas = np.abs(wrong) / found.sigma.reshape(-1, 3, 3)
    return np.sqrt((wrong[:, :2] ** 2).sum(2).mean(0)), (in_sigmas < 3).mean((0, 2)), np.median(in_sigmas, (0, 2))


def test_the_wind_is_found(monkeypatch):
    found, fit = [], falling.fit

    def noted(*given):
        model, likelihood = fit(*given)
        found.append(model.motion.wind)
        return model, likelihood

    monkeypatch.setattr(falling, "fit", noted)
    monkeypatch.setattr(unsteered.Air, "wind", lambda air, height_m: WIND)
    for seed in FALLS[1:]:
        of(seed)
    wrong = np.array(found) - WIND
    assert (wrong[:, 2] == 0).all()
    assert np.sqrt((wrong**2).sum(1).mean()) < 4.0  # 10.8 if none were


def test_the_track_is_better_for_it(monkeypatch):
    """And its sigmas are honest, and not far too wide."""
    found, inside, in_sigmas = map(np.array, zip(*map(of, FALLS), strict=True))
    assert (inside > 0.95).all()
    assert (np.median(in_sigmas, 0) > [0.3, 0.2, 0.05]).all()  # with gusts as on wings .37, .14, .03
    monkeypatch.setattr(falling, "_blown", lambda short, model: (model, 0.0))
    still, *_ = map(np.array, zip(*map(of, FALLS), strict=True))
    position, velocity = np.exp(np.log(found / still).mean(0))
    assert position < 0.94
    assert velocity < 0.88
    assert (found / still).max() < 1.1
