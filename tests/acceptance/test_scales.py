"""No length and no time is built in: a flight in other units gives the same result in these units. What is known of
flights, the accelerations that a log cannot show, has units of its own; it is left out here."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ftproc.core.identification.motions import unseen_motion
from ftproc.pipeline import filter_log
from ftproc.settings import FilterSettings
from tests.simulated import simulate

SETTINGS = FilterSettings(motion="white-jerk", smooth=True)


@pytest.fixture(autouse=True)
def _nothing_known_of_flights(monkeypatch):
    monkeypatch.setattr(unseen_motion, "widened", lambda state, sigma, los_sigma, falls: (sigma, los_sigma))


def in_units(log, length, duration):
    """The log of the same flight, so many times as large and as slow."""
    return replace(log, time_s=log.time_s * duration, measurement=log.measurement * np.array([length, 1.0, 1.0]))


@cache
def run(scenario, outliers):
    """A log and its trajectory."""
    log = simulate(scenario, seed=3, duration_s=300.0 if scenario == "radar" else 40.0, outliers=outliers).log
    return log, filter_log(log, SETTINGS)


@pytest.mark.parametrize(
    ("scenario", "outliers"), [("manoeuvre", None), ("radar", None), ("cruise", "correlation=0.5")]
)
@pytest.mark.parametrize(("length", "duration"), [(1e-3, 1.0), (1e3, 100.0), (0.05, 0.1)])
def test_a_flight_in_other_units(scenario, outliers, length, duration):
    log, found = run(scenario, outliers)
    scaled = filter_log(in_units(log, length, duration), SETTINGS)
    np.testing.assert_array_equal(scaled.outlier, found.outlier)
    sigma = found.sigma[:, :3]
    same = 1e-6 if outliers is None else 0.1  # the search for correlated noise ends where more is hardly gained
    assert np.abs(scaled.state[:, :3] / length - found.state[:, :3]).max() < same * sigma.max()
    np.testing.assert_allclose(scaled.sigma[:, :3] / length, sigma, rtol=same)
    for k in (1, 2):
        axes = slice(3 * k, 3 * k + 3)
        again = scaled.sigma[:, axes] * duration**k / length
        np.testing.assert_allclose(again, found.sigma[:, axes], rtol=10 * same if k == 2 else same)
