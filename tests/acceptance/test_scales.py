"""No length and no time is built in: a flight in other units gives the same result in these units."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ftproc.pipeline import filter_log
from ftproc.settings import FilterSettings
from tests.simulated import simulate

SETTINGS = FilterSettings(smooth=True)


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
    np.testing.assert_allclose(scaled.sigma[:, 3:] * duration / length, found.sigma[:, 3:], rtol=same)
