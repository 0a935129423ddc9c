"""What the methods know that filter each component alone."""

from __future__ import annotations

import numpy as np

from ftproc.core.model.frames import from_cartesian
from ftproc.methods import channels
from ftproc.methods.estimate import Readings
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
    found = channels.look(Readings(time_s, log.measurement, UNKNOWN), FilterSettings())
    assert found.led == channels.LONGEST_WINDOW
    np.testing.assert_allclose(np.diff(found.time_s), found.interval_s, rtol=1e-9)
    before = found.time_s[: found.led]
    off = found.reading[: found.led] - from_cartesian(path(before))
    assert np.abs(off * [1, 5000, 5000]).max() < 25
    np.testing.assert_array_equal(found.trusted[: found.led], found.reading[: found.led])
    np.testing.assert_array_equal(found.reading[found.led :], log.measurement)


def test_blindly_nothing_is_known_before_the_first_reading():
    time_s = TIME[:150]
    found = channels.look(Readings(time_s, measured(path(time_s), time_s).measurement, UNKNOWN), FilterSettings(), True)
    assert found.led == 0
    np.testing.assert_array_equal(found.time_s, time_s)
