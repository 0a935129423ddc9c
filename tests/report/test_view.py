"""Quantities that the report derives from a trajectory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ftproc.report.view import STANDARD_GRAVITY, load_factor, speed, view
from tests.report.flights import filtered, flight
from tests.simulated import load_factor as load_factor_of


def turn(n_g, v=200.0):
    """A level turn in which wings carry n_g."""
    across = STANDARD_GRAVITY * np.sqrt(n_g**2 - 1)
    return np.array([[0, 0, 1e3, v, 0, 0, 0, across, 0]], float)


@pytest.mark.parametrize("n_g", [1.0, 2.0, 5.0])
def test_load_factor_of_a_level_turn(n_g):
    assert load_factor(turn(n_g)) == pytest.approx(n_g)
    assert speed(turn(n_g)) == pytest.approx(200.0)


def test_load_factor_of_accelerating_resting_and_falling():
    state = np.zeros((3, 9))
    state[0, [3, 6]] = 100.0, 30.0  # thrust along the path carries nothing
    state[2, 8] = -STANDARD_GRAVITY
    np.testing.assert_allclose(load_factor(state), [1.0, 1.0, 0.0], atol=1e-12)


def test_load_factor_of_a_simulated_flight():
    truth = flight().truth
    state = np.hstack([truth.position_m, truth.velocity_mps, truth.acceleration_mps2])
    np.testing.assert_allclose(load_factor(state), load_factor_of(flight()), rtol=1e-9)


def test_azimuth_is_unwrapped_and_readings_follow():
    made = filtered()
    steady = np.linspace(3.0, 7.0, len(made))
    measurement, reading = made.measurement.copy(), made.diagnostics.reading.copy()
    measurement[:, 1] = np.mod(steady + np.pi, 2 * np.pi) - np.pi
    reading[:, 1] = np.mod(steady + 0.01, 2 * np.pi)
    measurement[7, 1] = np.nan
    found = view(replace(made, measurement=measurement, diagnostics=replace(made.diagnostics, reading=reading)))
    others = np.arange(len(made)) != 7
    np.testing.assert_allclose(found.cleaned[others, 1], np.rad2deg(steady)[others])
    np.testing.assert_allclose(found.reading[others, 1] - found.cleaned[others, 1], np.rad2deg(0.01))
    assert found.reading[7, 1] == pytest.approx(np.rad2deg(reading[7, 1]))


def test_error_is_estimate_minus_truth():
    found = view(filtered(), flight().truth)
    np.testing.assert_allclose(found.error[:, :3], filtered().state[:, :3] - flight().truth.position_m)
    np.testing.assert_allclose(found.error[:, 3:6], filtered().state[:, 3:6] - flight().truth.velocity_mps)
    np.testing.assert_allclose(found.error[:, 6:], filtered().state[:, 6:] - flight().truth.acceleration_mps2)
    assert found.score.rmse_3d_m == pytest.approx(np.sqrt((found.error[:, :3] ** 2).sum(1).mean()))
    assert view(filtered()).error is None
