"""The window that a live track rests on."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing import two_pass
from ftproc.core.live.window import SHORT, Sizes, Window
from tests.simulated import simulate

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
