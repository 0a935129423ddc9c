"""What the methods know that filter each component alone."""

from __future__ import annotations

import numpy as np

from ftproc import pipeline
from ftproc.core.model.frames import from_cartesian
from ftproc.methods import channels
from ftproc.methods.estimate import Readings
from ftproc.records import MeasurementLog
from ftproc.settings import FilterSettings
from tests.methods.flights import TIME, measured

UNKNOWN = np.full(3, np.nan)


def path(t):
    """A turn and climb of constant acceleration."""
    t = np.asarray(t)[:, None]
    return (
        np.array([4000.0, 3000.0, 800.0]) + np.array([-60.0, 80.0, 5.0]) * t + 0.5 * np.array([9.0, -12.0, 4.0]) * t**2
    )


def test_a_log_begins_with_the_first_state_carried_back():
    time_s = TIME[:150]
    log = measured(path(time_s), time_s)
    found = channels.prepare(Readings(time_s, log.measurement, UNKNOWN), FilterSettings())
    assert found.led == channels.LONGEST_WINDOW
    np.testing.assert_allclose(np.diff(found.time_s), found.interval_s, rtol=1e-9)
    before = found.time_s[: found.led]
    off = found.reading[: found.led] - from_cartesian(path(before))
    assert np.abs(off * [1, 5000, 5000]).max() < 25
    np.testing.assert_array_equal(found.trusted[: found.led], found.reading[: found.led])
    np.testing.assert_array_equal(found.reading[found.led :], log.measurement)


def test_blindly_nothing_is_known_before_the_first_reading():
    time_s = TIME[:150]
    found = channels.prepare(
        Readings(time_s, measured(path(time_s), time_s).measurement, UNKNOWN), FilterSettings(), True
    )
    assert found.led == 0
    np.testing.assert_array_equal(found.time_s, time_s)


def test_positions_and_velocities_are_those_of_the_readings_and_their_rates():
    time_s, step_s = TIME[:150], 1e-4
    readings = Readings(time_s, measured(path(time_s), time_s).measurement, UNKNOWN)
    value, before, after = (from_cartesian(path(time_s + late)) for late in (0.0, -step_s, step_s))
    cleaned = channels.Cleaned(value, np.ones_like(value), rate=(after - before) / (2 * step_s))
    state = channels.estimate(readings, channels.prepare(readings, FilterSettings(), True), cleaned).run.state
    np.testing.assert_allclose(state[:, :3], path(time_s), rtol=1e-9)
    velocity = (path(time_s + step_s) - path(time_s - step_s)) / (2 * step_s)
    np.testing.assert_allclose(state[:, 3:6], velocity, atol=1e-4)
    assert np.isnan(state[:, 6:]).all()


def test_sigmas_are_positive_where_a_component_is_cleaned_beyond_its_bounds():
    """A method that knows no geometry may clean an elevation to more than a right angle, and a range to below zero."""
    time = np.arange(40.0)
    beyond = np.column_stack([500 - 15 * time, 0.1 * time, 1.4 + 0.01 * time])
    log = MeasurementLog("log", time, beyond + 1e-3 * np.random.default_rng(0).normal(size=(40, 3)), np.arange(40))
    found = pipeline.filter_log(log, FilterSettings(method="outlier-kf"))
    assert (found.measurement[:, 2] > np.pi / 2).any()
    assert (found.measurement[:, 0] < 0).any()
    for sigma in (found.sigma[:, :3], found.measurement_sigma):
        assert (sigma > 0).all()
