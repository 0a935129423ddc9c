"""The window that a live track rests on."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing import two_pass
from ftproc.core.live.window import SHORT, Sizes, Window
from tests.simulated import simulate

pytestmark = pytest.mark.compiled

KNOWN = two_pass.Known(np.full(3, np.nan), None, 4.0)


class White(Window):
    """A window that takes any noise for white and even."""

    white = True


@pytest.mark.parametrize(
    ("kind", "samples", "short"), [(Window, SHORT - 1, True), (Window, SHORT, False), (White, SHORT, True)]
)
def test_uneven_noise_is_asked_for_in_a_window_that_is_long_enough(monkeypatch, kind, samples, short):
    given = []
    whole = two_pass.edit
    monkeypatch.setattr(two_pass, "edit", lambda *each, **how: given.append(how) or whole(*each, **how))
    log = simulate("cruise", seed=1, duration_s=30.0).log
    window = kind(log.time_s[:samples], log.measurement[:samples], KNOWN, Sizes(300, 120))
    window.edit()
    assert given == [{"live": True, "short": short}]


def filled(samples, sizes, interval_s=0.05):
    """A window of a cruise with known noise and process noise."""
    log = simulate("cruise", seed=1, duration_s=samples * interval_s, dt_s=interval_s).log
    known = two_pass.Known(np.array([5.0, 3e-4, 3e-4]), 1.0, 4.0)
    window = Window(log.time_s[:samples], log.measurement[:samples], known, sizes)
    window.edit()
    return window


def test_what_waits_for_its_lag_stays_open_and_is_not_forgotten():
    """Though both sizes are smaller."""
    window = filled(300, Sizes(60, 30, lag_s=5.0))
    newest_s = window.time_s[-1]
    assert newest_s - window.time_s[window.near] >= 5.0
    assert window.trim() > 0
    assert newest_s - window.time_s[0] >= 5.0


def test_without_a_lag_the_sizes_hold():
    window = filled(300, Sizes(60, 30))
    assert len(window) - window.near == 30
    assert window.trim() == 240
    assert (len(window), window.near) == (60, 30)
    assert window.trim() == 0
