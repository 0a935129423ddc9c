"""Quantities that the report derives from a trajectory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ftproc.report.view import view
from tests.report.flights import filtered, flight


def test_azimuth_is_unwrapped_and_readings_follow():
    made = filtered()
    steady = np.linspace(3.0, 7.0, len(made))
    measurement, reading = made.measurement.copy(), made.diagnostics.reading.copy()
    measurement[:, 1] = np.mod(steady + np.pi, 2 * np.pi) - np.pi
    reading[:, 1] = np.mod(steady + 0.01, 2 * np.pi)
    measurement[7, 1] = np.nan
    changed = replace(made, measurement=measurement, diagnostics=replace(made.diagnostics, reading=reading))
    found, others = view(changed).channels[1], np.arange(len(made)) != 7
    np.testing.assert_allclose(found.cleaned[others], np.rad2deg(steady)[others])
    np.testing.assert_allclose(found.reading[others] - found.cleaned[others], np.rad2deg(0.01))
    assert found.reading[7] == pytest.approx(np.rad2deg(reading[7, 1]))


def test_error_is_estimate_minus_truth():
    found = view(filtered(), flight().truth)
    np.testing.assert_allclose(found.error[:, :3], filtered().state[:, :3] - flight().truth.position_m)
    np.testing.assert_allclose(found.error[:, 3:6], filtered().state[:, 3:6] - flight().truth.velocity_mps)
    np.testing.assert_allclose(found.error[:, 6:], filtered().state[:, 6:] - flight().truth.acceleration_mps2)
    assert found.score.rmse_3d_m == pytest.approx(np.sqrt((found.error[:, :3] ** 2).sum(1).mean()))
    assert view(filtered()).error is None
